/** The car as a mapping reads it, at one instant or over a short piece: pictures, and numbers beside what others say. */

import '../style/preview.css';
import { h } from '../dom';
import { wizard } from '../messages/wizard';
import { perFrame, type Signal } from '../signal';
import type { Store } from '../state';
import { formatFixed } from '../units';
import type { Trial } from './door';
import { Above, Behind, Side } from './figures';
import { Motion, PIECE } from './motion';

const say = wizard.preview;
const DEGREES = 180 / Math.PI;
const GRAVITY = 9.80665;
/** Seconds of the log per second of playing. */
const PACE = 2;

type Key = keyof typeof say.rows;

/** One quantity: what a sensor measures, what the others say, and from which difference they contradict. */
interface Row {
  key: Key;
  unit: string;
  /** Values at the ends of the bars. */
  full: number;
  /** A smaller difference is nothing. */
  apart: number;
  values(motion: Motion, time: number): [measured: number, expected: number];
}

const ROWS: Row[] = [
  { key: 'forward', unit: 'm/s²', full: 5, apart: 1, values: (m, t) => [m.mean('accel_x', t), m.expectedForward(t)] },
  { key: 'sideways', unit: 'm/s²', full: 5, apart: 1.2, values: (m, t) => [m.mean('accel_y', t), m.mean('expected_y', t)] },
  { key: 'down', unit: 'm/s²', full: 12, apart: 2, values: (m, t) => [m.mean('accel_z', t), -GRAVITY] },
  { key: 'turn', unit: '°/s', full: 30, apart: 3, values: (m, t) => [m.mean('gyro_z', t) * DEGREES, m.mean('expected_turn', t) * DEGREES] },
  { key: 'speed', unit: 'km/h', full: 150, apart: 8, values: (m, t) => [m.mean('speed', t), m.mean('ground_speed', t)].map((v) => 3.6 * v) as [number, number] },
  { key: 'heading', unit: '°', full: 360, apart: 45, values: (m, t) => [m.at('compass', t), m.at('course', t)].map((v) => (v * DEGREES + 360) % 360) as [number, number] },
];

interface Shown {
  row: Row;
  measured: HTMLElement;
  expected: HTMLElement;
  bars: [HTMLElement, HTMLElement];
  element: HTMLElement;
}

/** The difference of two values of a row; headings are apart at most half a circle. */
function difference(row: Row, measured: number, expected: number): number {
  const plain = measured - expected;
  return row.key === 'heading' ? Math.abs(((plain + 540) % 360) - 180) : Math.abs(plain);
}

export class Preview {
  readonly element: HTMLElement;
  #motion: Motion | null = null;
  #time = NaN;
  #playing: { from: number; since: number } | null = null;
  #store: Store;
  #above = new Above();
  #side = new Side();
  #behind = new Behind();
  #slider = h('input', { type: 'range', step: '0.1', 'aria-label': say.time });
  #clock = h('output');
  #play = h('button', { type: 'button', onclick: () => this.#toggle() }, say.play);
  #rows: Shown[] = ROWS.map((row) => {
    const [measured, expected] = [h('td'), h('td')];
    const bars: [HTMLElement, HTMLElement] = [h('i.sensed'), h('i.other')];
    const element = h('tr', { 'data-row': row.key }, h('th', { scope: 'row' }, say.rows[row.key]), measured, expected, h('td.bars', { 'aria-hidden': 'true' }, ...bars));
    return { row, measured, expected, bars, element };
  });
  #show = perFrame(() => this.#draw());

  constructor(store: Store, trial: Signal<Trial | null>) {
    this.#store = store;
    this.#slider.addEventListener('input', () => {
      this.stop();
      this.#time = this.#slider.valueAsNumber;
      this.#show();
    });
    const moments = Object.entries(say.moments).map(([key, text]) => h('button', { type: 'button', onclick: () => this.#seek(key as keyof typeof say.moments) }, text));
    this.element = h(
      'section.preview',
      { hidden: true, 'aria-label': say.title },
      h('div.preview-head', {}, h('h3', {}, say.title), h('p.note', {}, say.note)),
      h('div.preview-body', {}, this.#above.element, this.#side.element, this.#behind.element, this.#numbers()),
      h('div.preview-time', {}, this.#play, this.#slider, this.#clock, ...moments),
    );
    trial.watch((now) => this.#set(now));
  }

  /** Play no further. */
  stop(): void {
    this.#playing = null;
    this.#play.textContent = say.play;
  }

  #numbers(): HTMLElement {
    const head = [say.what, say.measured, say.expected].map((text) => h('th', { scope: 'col' }, text));
    return h('table.preview-numbers', { 'aria-label': say.numbers }, h('thead', {}, h('tr', {}, ...head, h('td', { 'aria-hidden': 'true' }))), h('tbody', {}, ...this.#rows.map((r) => r.element)));
  }

  /** Another mapping moves the same instant. */
  #set(trial: Trial | null): void {
    if (!trial) {
      // While a change is tried, what was shown stays.
      return;
    }
    const before = this.#motion;
    this.#motion = new Motion(trial);
    const isSame = before && before.t0 === this.#motion.t0 && before.t1 === this.#motion.t1;
    this.element.hidden = this.#motion.t1 <= this.#motion.t0;
    if (!isSame) {
      [this.#slider.min, this.#slider.max] = [String(this.#motion.t0), String(this.#motion.t1)];
      const cursor = this.#store.cursor.value;
      if (cursor > this.#motion.t0 + 1 && cursor < this.#motion.t1) this.#time = cursor;
      else this.#seek('turn');
    } else if (before) this.#motion.piece(before.piece(this.#time)[0]);
    this.#show();
  }

  #seek(moment: keyof typeof say.moments): void {
    const motion = this.#motion;
    if (!motion) return;
    this.stop();
    const size = {
      turn: (t: number) => Math.abs(motion.at('expected_y', t)),
      brake: (t: number) => -motion.at('expected_x', t),
      climb: (t: number) => Math.abs(motion.at('grade', t)),
    };
    this.#time = motion.most(size[moment]);
    this.#show();
  }

  #toggle(): void {
    const motion = this.#motion;
    if (!motion || this.#playing) {
      this.stop();
      return;
    }
    const [from] = motion.piece(this.#time);
    this.#playing = { from, since: performance.now() };
    this.#play.textContent = say.pause;
    this.#show();
  }

  #draw(): void {
    const motion = this.#motion;
    if (!motion) return;
    if (this.#playing) {
      const { from, since } = this.#playing;
      const gone = ((performance.now() - since) / 1000) * PACE;
      this.#time = Math.min(from + Math.min(gone, PIECE), motion.t1);
      if (gone >= PIECE || !this.element.isConnected) this.stop();
      else this.#show();
    }
    const time = this.#time;
    this.#slider.value = String(time);
    this.#clock.textContent = say.seconds(formatFixed(time - motion.t0, 1));
    this.#slider.setAttribute('aria-valuetext', this.#clock.textContent);
    for (const figure of [this.#above, this.#side, this.#behind]) figure.draw(motion, time);
    for (const shown of this.#rows) this.#drawRow(shown, motion, time);
  }

  #drawRow({ row, measured, expected, bars, element }: Shown, motion: Motion, time: number): void {
    const values = row.values(motion, time);
    const digits = row.key === 'heading' || row.key === 'speed' ? 0 : 1;
    const text = (value: number, by: string): (HTMLElement | string)[] => (Number.isFinite(value) ? [`${formatFixed(value, digits)}${row.unit === '°' ? '' : ' '}${row.unit}`, h('span.note', {}, by)] : [say.unknown]);
    measured.replaceChildren(...text(values[0], say.sensor[row.key]));
    expected.replaceChildren(...text(values[1], say.against[row.key]));
    bars.forEach((bar, i) => {
      const share = Math.max(-1, Math.min(1, (values[i] ?? 0) / row.full)) || 0;
      bar.style.left = `${50 + Math.min(share, 0) * 50}%`;
      bar.style.width = `${Math.abs(share) * 50}%`;
    });
    const apart = difference(row, ...values);
    element.toggleAttribute('data-differs', apart > Math.max(row.apart, 0.25 * Math.abs(values[1])));
  }
}
