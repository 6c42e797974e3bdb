/** Lamps: which quantities the measurements can tell, along the drive and at the cursor, and why not. */

import { h } from '../dom';
import { road as say } from '../messages/road';
import { LEFT, RIGHT } from '../plot/axes';
import { shareOf } from '../plot/axis';
import { Canvas, type Stretch, stretches } from '../plot/strip';
import { palette } from '../plot/palette';
import { TimeArea } from '../plot/time-area';
import type { Session } from '../session';
import type { Span, Store } from '../state';
import type { TableColumn } from '../views/table';
import { type GridItem, latest } from '../worker/rpc';

const SOURCE = 'road:lamps';
/** The columns that have a lamp. */
const LAMPS = ['slope', 'grade', 'body_pitch', 'accel_bias', 'altitude', 'lateral_speed', 'force_yf'] as const;
/** Height of a row, px. */
const ROW = 13;

/** Quantities that are out for the same reason, told together: `[quantities, reason]`. */
export function outages(names: readonly string[], states: ArrayLike<number>, reasons: readonly string[]): [string[], string][] {
  const out = new Map<number, string[]>();
  names.forEach((name, i) => {
    const state = states[i] ?? Number.NaN;
    if (state > 0) out.set(state, [...(out.get(state) ?? []), name]);
  });
  return [...out].map(([state, quantities]) => [quantities, reasons[state - 1] ?? '']);
}

class LampStrip extends Canvas {
  rows: Stretch[][] = [];
  window: Span = { t0: 0, t1: 1 };

  protected override draw(context: CanvasRenderingContext2D): void {
    const right = this.width - RIGHT;
    const x = (time: number): number => Math.min(right, Math.max(LEFT, LEFT + shareOf(time, this.window) * (right - LEFT)));
    this.rows.forEach((row, index) => {
      const top = index * ROW + 3;
      context.fillStyle = palette.value.muted;
      context.textAlign = 'right';
      context.textBaseline = 'middle';
      context.fillText(say.lamps.short[LAMPS[index] ?? 'slope'], LEFT - 5, top + 4, LEFT - 7);
      for (const stretch of row) {
        const [from, to] = [x(stretch.t0), x(stretch.t1)];
        if (to <= from) continue;
        const isSeen = stretch.mode === 0;
        context.fillStyle = isSeen ? palette.value['mode-1'] : palette.value.hairline;
        context.fillRect(from, isSeen ? top : top + 3, Math.max(to - from, 0.7), isSeen ? 8 : 2);
      }
    });
  }
}

export class LampLane {
  readonly element: HTMLElement;
  #store: Store;
  #session: Session;
  #host = h('div.strip', { role: 'img', 'aria-label': say.lamps.label });
  #strip: LampStrip;
  #bulbs = LAMPS.map((name) => h('li.known', {}, h('span.bulb', { 'aria-hidden': 'true' }), say.lamps.names[name], h('span.visually-hidden')));
  #why = h('p.lamp-why');
  #reasons: string[] = [];
  readonly #read = latest(() => this.#load());
  readonly #askLight = latest(() => this.#light());
  /** There is a result whose lamps have not been found out. */
  #isDue = true;
  /** The lamps are there to be drawn. */
  onLit: () => void = () => {};

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const legend = h('div.legend', {}, h('h3.lane-title', {}, say.lamps.title), h('ul.knowns', {}, ...this.#bulbs));
    this.element = h('div.strip-lane.lamp-lane', { hidden: true }, legend, this.#host, this.#why);
    this.#host.style.height = `${LAMPS.length * ROW + 3}px`;
    this.#strip = new LampStrip(this.#host);
    this.#host.append(new TimeArea(store).element);
    store.window.watch((window) => {
      this.#strip.window = window;
      this.#strip.redraw();
    });
    store.cursor.on(this.#read);
    store.run('slope').on((now, before) => {
      if (now.reply === before.reply) return;
      this.#isDue = true;
      this.#askLight();
    });
  }

  /** Have the core find out what can be known, when it can be seen. */
  async #light(): Promise<void> {
    if (!this.#isDue || !this.element.parentElement?.checkVisibility()) return;
    this.#isDue = false;
    const isThere = this.#store.run('slope').value.reply !== null;
    this.element.hidden = !isThere;
    if (!isThere) return;
    this.#reasons = await this.#session.rpc.call('lamps', { vehicle: this.#store.tuning.value.vehicle });
    this.onLit();
    this.#read();
  }

  items(): GridItem[] {
    this.#askLight();
    return this.element.hidden ? [] : LAMPS.map((column) => ({ source: SOURCE, column, step: true }));
  }

  take(times: Float64Array, columns: Float64Array[]): void {
    this.#strip.rows = columns.map((column) => stretches(times, column));
    this.#strip.redraw();
  }

  tableColumns(): TableColumn[] {
    const { names, column } = say.lamps;
    return this.element.hidden ? [] : LAMPS.map((name) => ({ source: SOURCE, column: name, label: column(names[name]), quantity: 'plain', unit: '1' }));
  }

  async #load(): Promise<void> {
    if (this.element.hidden || !this.#store.report.value) return;
    const items = LAMPS.map((column) => ({ source: SOURCE, column }));
    const states = await this.#session.rpc.call('values', { items, times: [this.#store.cursor.value] });
    this.#bulbs.forEach((bulb, i) => {
      const state = states[i] ?? Number.NaN;
      bulb.dataset['state'] = state === 0 ? 'lit' : state > 0 ? 'out' : 'unknown';
      bulb.title = this.#reasons[state - 1] ?? '';
      const said = bulb.lastElementChild;
      if (said) said.textContent = state > 0 ? say.lamps.isOut : '';
    });
    const names = LAMPS.map((name) => say.lamps.names[name]);
    this.#why.textContent = outages(names, states, this.#reasons).map(([quantities, reason]) => say.lamps.why(quantities.join(', '), reason)).join(' ');
  }
}
