/** Three small pictures of the car: from above, from the side, from behind. Filled as sensors say, outlined as the rest does. */

import { h } from '../dom';
import { wizard } from '../messages/wizard';
import { formatFixed } from '../units';
import type { Motion } from './motion';

const say = wizard.preview;
const SPACE = 'http://www.w3.org/2000/svg';
const DEGREES = 180 / Math.PI;
/** Slopes are drawn so much steeper than they are. */
const STEEPER = 3;

/** The car from above, its front up; from the side, its front to the right; from behind. Around the origin. */
const SHAPES = {
  above: 'M-5 9 V-6 Q-5 -10 0 -10 Q5 -10 5 -6 V9 Q5 10 4 10 H-4 Q-5 10 -5 9ZM-3.6 -3 H3.6 L3 1 H-3Z',
  side: 'M-44 6 V-6 Q-43 -10 -38 -11 L-24 -23 H6 L22 -11 L40 -8 Q45 -6 45 -1 V6ZM-20 -20 L-29 -11.5 H-5 V-20ZM0 -20 V-11.5 H16 L4.500 -20Z',
  behind: 'M-26 6 V-8 L-18 -26 H18 L26 -8 V6ZM-15 -22 L-20 -10 H20 L15 -22ZM-24 -4 H-16 V0 H-24ZM16 -4 H24 V0 H16Z',
};
const WHEELS = { side: [[-27, 8, 8], [27, 8, 8]], behind: [[-20, 8, 6], [20, 8, 6]] } as const;

function svg<K extends keyof SVGElementTagNameMap>(tag: K, props: Record<string, string | number>, ...children: Element[]): SVGElementTagNameMap[K] {
  const element = document.createElementNS(SPACE, tag);
  for (const [name, value] of Object.entries(props)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

function car(shape: keyof typeof SHAPES, kind: 'sensed' | 'other'): SVGGElement {
  const wheels = shape === 'above' ? [] : WHEELS[shape].map(([cx, cy, r]) => svg('circle', { cx, cy, r }));
  return svg('g', { class: kind }, svg('path', { d: SHAPES[shape], 'fill-rule': 'evenodd' }), ...wheels);
}

function figure(title: string, drawing: SVGSVGElement, caption: HTMLElement): HTMLElement {
  drawing.setAttribute('role', 'img');
  return h('figure', {}, h('span.title', {}, title), drawing, h('figcaption', {}, caption));
}

/** An angle as said: `2.1°`. */
export function angle(radians: number): string {
  return Number.isFinite(radians) ? `${formatFixed(radians * DEGREES, 1)}°` : say.unknown;
}

/** Seen from above: the way by places, and the way by speed and gyro from where the piece begins. */
export class Above {
  readonly element: HTMLElement;
  #ground = svg('polyline', { class: 'other-way' });
  #own = svg('polyline', { class: 'sensed-way' });
  #other = car('above', 'other');
  #sensed = car('above', 'sensed');
  #caption = h('span');
  #drawing = svg('svg', { viewBox: '0 0 200 120', class: 'car-figure' }, this.#ground, this.#own, this.#other, this.#sensed);

  constructor() {
    this.element = figure(say.above, this.#drawing, this.#caption);
  }

  draw(motion: Motion, time: number): void {
    const { ground, own } = motion.ways(time);
    const all = [...ground, ...own].filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
    const [xs, ys] = [all.map((p) => p[0]), all.map((p) => p[1])];
    const [x0, x1, y0, y1] = all.length > 0 ? [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)] : [0, 0, 0, 0];
    const metres = Math.max((x1 - x0) / 170, (y1 - y0) / 90, 0.25);
    const place = ([x, y]: readonly [number, number]): [number, number] => [100 + (x - (x0 + x1) / 2) / metres, 60 - (y - (y0 + y1) / 2) / metres];
    const line = (way: [number, number][]): string => way.filter(([x]) => Number.isFinite(x)).map((p) => place(p).map((v) => v.toFixed(1)).join(',')).join(' ');
    this.#ground.setAttribute('points', line(ground));
    this.#own.setAttribute('points', line(own));
    const put = (icon: Element, at: { place: [number, number]; heading: number } | null): void => {
      icon.setAttribute('visibility', at ? 'visible' : 'hidden');
      if (at) icon.setAttribute('transform', `translate(${place(at.place).map((v) => v.toFixed(1)).join(' ')}) rotate(${(at.heading * DEGREES).toFixed(1)})`);
    };
    put(this.#other, motion.overGround(time));
    put(this.#sensed, motion.sensed(time));
    const rate = motion.at('gyro_z', time) * DEGREES;
    const turning = Math.abs(rate) < 0.5 ? say.straight : `${formatFixed(Math.abs(rate), 1)}°/s ${rate > 0 ? say.right : say.left}`;
    this.#drawing.setAttribute('aria-label', say.aboveLabel(turning));
    this.#caption.textContent = `${turning}; ${say.scale(formatFixed(200 * metres, 0))}`;
  }
}

/** Seen from the side: the car on its road. */
export class Side {
  readonly element: HTMLElement;
  #road = svg('g', { class: 'other' }, svg('path', { d: 'M-110 17 H110' }), car('side', 'other'));
  #sensed = car('side', 'sensed');
  #caption = h('span');
  #drawing = svg('svg', { viewBox: '-100 -60 200 120', class: 'car-figure' }, this.#road, this.#sensed);

  constructor() {
    this.element = figure(say.side, this.#drawing, this.#caption);
  }

  draw(motion: Motion, time: number): void {
    const [pitch, grade] = [motion.at('pitch', time), motion.at('grade', time)];
    const turn = (radians: number): string => `rotate(${(-STEEPER * (Number.isFinite(radians) ? radians : 0) * DEGREES).toFixed(1)})`;
    this.#road.setAttribute('transform', turn(grade));
    this.#sensed.setAttribute('transform', turn(pitch));
    this.#drawing.setAttribute('aria-label', say.sideLabel(angle(pitch), angle(grade)));
    this.#caption.textContent = `${say.pitch(angle(pitch))}, ${say.grade(angle(grade))}; ${say.steeper(STEEPER)}`;
  }
}

/** Seen from behind: the car on a level road. */
export class Behind {
  readonly element: HTMLElement;
  #sensed = car('behind', 'sensed');
  #caption = h('span');
  #drawing = svg('svg', { viewBox: '-100 -60 200 120', class: 'car-figure' }, svg('g', { class: 'other' }, svg('path', { d: 'M-110 15 H110' }), car('behind', 'other')), this.#sensed);

  constructor() {
    this.element = figure(say.behind, this.#drawing, this.#caption);
  }

  draw(motion: Motion, time: number): void {
    const roll = motion.at('roll', time);
    this.#sensed.setAttribute('transform', `rotate(${(STEEPER * (Number.isFinite(roll) ? roll : 0) * DEGREES).toFixed(1)})`);
    this.#drawing.setAttribute('aria-label', say.behindLabel(angle(roll)));
    this.#caption.textContent = `${say.roll(angle(roll))}; ${say.steeper(STEEPER)}`;
  }
}
