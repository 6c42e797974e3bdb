/** The window moved over the whole drive: how the drift depends on where it lies, and its distribution. */

import { h } from '../dom';
import { t } from '../messages';
import { navigation as say } from '../messages/navigation';
import { LEFT, rangeOf, RIGHT, TIME_STEPS, VALUE_STEPS, valueLabels } from '../plot/axes';
import { axis, shareOf, timeAt } from '../plot/axis';
import { Canvas } from '../plot/strip';
import { palette } from '../plot/palette';
import type { Session } from '../session';
import type { Span, Store } from '../state';
import { convertDifference, formatFixed, formatSignificant, formatTime, unitLabel } from '../units';
import { Cancelled, type Pending } from '../worker/rpc';
import { BASE, COMPASS } from './curves';
import type { Blind, Drift, Sensor, Swept } from './door';
import { SENSORS } from './windows';

const TOP = 6;
const BOTTOM = 18;

/** What is left at the end of a window; null where there is nothing. */
export type EndOf = (drift: Drift) => number | null;

/** What is left at the end of each window over where it began. */
class SweepPlot extends Canvas {
  drifts: readonly Drift[] = [];
  endOf: EndOf = distanceOf;
  view: Span = { t0: 0, t1: 1 };
  start = 0;

  x(time: number): number {
    return LEFT + shareOf(time, this.view) * (this.width - LEFT - RIGHT);
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const values = this.drifts.map(this.endOf);
    const high = rangeOf([[0, ...values]], 1, false)[1];
    const floor = this.height - BOTTOM;
    const y = (value: number): number => floor - (value / high) * (floor - TOP);
    const step = VALUE_STEPS.find((s) => high / s <= 4) ?? high;
    const ticks = Array.from({ length: Math.floor(high / step) + 1 }, (_, i) => i * step);
    const labels = valueLabels(ticks, step);
    context.textBaseline = 'middle';
    context.textAlign = 'right';
    ticks.forEach((tick, i) => {
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, Math.round(y(tick)), this.width - LEFT - RIGHT, 1);
      context.fillStyle = palette.value.muted;
      context.fillText(labels[i] ?? '', LEFT - 5, y(tick));
    });
    context.textAlign = 'center';
    context.textBaseline = 'top';
    for (const time of this.#instants()) {
      context.fillStyle = palette.value.muted;
      context.fillText(formatTime(time - this.start, 0), this.x(time), floor + 5);
    }
    context.save();
    context.beginPath();
    context.rect(LEFT, 0, this.width - LEFT - RIGHT, this.height);
    context.clip();
    this.drifts.forEach((drift, i) => {
      const value = values[i];
      if (value === null || value === undefined) return;
      const [x, top] = [this.x(drift.window[0]), y(value)];
      context.fillStyle = palette.value.blind;
      context.fillRect(x - 0.75, top, 1.5, floor - top);
      context.beginPath();
      context.arc(x, top, 3, 0, 2 * Math.PI);
      context.fill();
    });
    context.restore();
  }

  /** Round instants to be written below the plot; over distance those at even places. */
  #instants(): number[] {
    const { t0, t1 } = this.view;
    const most = Math.max(2, Math.floor((this.width - LEFT - RIGHT) / 84));
    if (axis.value.kind === 'distance') return Array.from({ length: most }, (_, i) => timeAt((i + 0.5) / most, this.view));
    const step = TIME_STEPS.find((s) => (t1 - t0) / s <= most) ?? t1 - t0;
    const first = Math.ceil((t0 - this.start) / step - 1e-9);
    const last = Math.floor((t1 - this.start) / step + 1e-9);
    return Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => this.start + (first + i) * step);
  }
}

const finite = (value: number | null | undefined): number | null => (typeof value === 'number' && Number.isFinite(value) ? value : null);

/** Distance at the end of a window, m. */
export const distanceOf: EndOf = (drift) => finite(drift.at[drift.at.length - 1]?.distance);

/** How far the yaw went off until the end of a window, rad. */
export const yawOf: EndOf = (drift) => {
  const yaw = finite(drift.at[drift.at.length - 1]?.yaw);
  return yaw === null ? null : Math.abs(yaw);
};

/** The window that is worst at its end. */
export function worstOf(drifts: readonly Drift[], endOf: EndOf): Drift | null {
  return drifts.reduce<Drift | null>((worst, d) => ((endOf(d) ?? -1) > (worst ? (endOf(worst) ?? -1) : -1) ? d : worst), null);
}

export class SweepPanel {
  readonly element: HTMLElement;
  readonly #store: Store;
  readonly #session: Session;
  readonly #isThere: (sensor: Sensor) => boolean;
  readonly #blind: (window: Blind) => void;
  readonly #sensor = h('select', { 'aria-label': say.sweep.sensor });
  readonly #length = number('60', 5, 600, say.sweep.length);
  readonly #step = number('20', 1, 600, say.sweep.step);
  readonly #button = h('button', { type: 'button' }, say.sweep.go);
  readonly #bar = h('progress', { max: 1, 'aria-label': t.work.progress, hidden: true });
  readonly #result = h('div.sweep-result');
  readonly #host = h('div.sweep-plot', { role: 'img', hidden: true });
  readonly #plot: SweepPlot;
  #pending: Pending<Swept> | null = null;
  /** The sensor of the sweep that is shown or under way. */
  #swept: Sensor | null = null;

  constructor(store: Store, session: Session, isThere: (sensor: Sensor) => boolean, blind: (window: Blind) => void) {
    this.#store = store;
    this.#session = session;
    this.#isThere = isThere;
    this.#blind = blind;
    const texts = say.sweep;
    const unit = (): HTMLElement => h('span', {}, t.units.seconds);
    const form = h('div.sweep-form', {}, h('h3', {}, texts.title), this.#sensor, h('label', {}, texts.lengthShort, this.#length), unit(), h('label', {}, texts.stepShort, this.#step), unit(), this.#button, this.#bar);
    this.#sensor.addEventListener('change', () => this.refresh());
    store.tuning.on((now, before) => {
      if (now.params[COMPASS] !== before.params[COMPASS] && this.#swept === 'mag') this.forget();
    });
    this.#button.addEventListener('click', () => (this.#pending ? this.#pending.cancel() : void this.#go()));
    this.#plot = new SweepPlot(this.#host);
    store.window.watch((view) => {
      this.#plot.view = view;
      this.#plot.redraw();
    });
    this.element = h('section.sweep', { 'aria-label': texts.title }, form, this.#result, this.#host);
  }

  /** What can be blinded may have changed. */
  refresh(): void {
    const sensors = SENSORS.filter((s) => this.#isThere(s));
    const chosen = this.#sensor.value;
    this.#sensor.replaceChildren(...sensors.map((s) => h('option', { value: s, selected: s === chosen }, say.rows[s])));
    this.#button.disabled = sensors.length === 0 || (this.#sensor.value !== 'mag' && this.#store.run(BASE).value.reply === null);
  }

  /** What was swept belongs to a run that is no longer there. */
  forget(): void {
    this.#pending?.cancel();
    this.#result.replaceChildren();
    this.#host.hidden = true;
    this.refresh();
  }

  async #go(): Promise<void> {
    const store = this.#store;
    const { params, vehicle } = store.tuning.value;
    const sensor = this.#sensor.value as Sensor;
    const [length, step] = [this.#length.valueAsNumber, this.#step.valueAsNumber];
    if (!this.#length.reportValidity() || !this.#step.reportValidity()) return;
    // Forward only: looking back takes as long again, and fills the windows in from behind.
    const own = sensor === 'mag' ? { estimator: COMPASS, params: { ...params[COMPASS] } } : { estimator: BASE, params: { ...params[BASE], smoother: 'off' } };
    const pending = this.#session.rpc.start('sweep', { ...own, vehicle, plan: { sensor, length, step, recovery: length } }, ({ fraction }) => {
      this.#bar.value = fraction ?? 0;
    });
    this.#pending = pending;
    this.#swept = sensor;
    this.#result.replaceChildren();
    this.#host.hidden = true;
    this.#bar.value = 0;
    this.#working(true);
    try {
      this.#show(sensor, length, await pending.answer);
    } catch (reason) {
      const text = reason instanceof Cancelled ? say.sweep.stopped : reason instanceof Error ? reason.message : String(reason);
      this.#result.replaceChildren(h('p.note', { role: 'status' }, text));
    } finally {
      this.#pending = null;
      this.#working(false);
    }
  }

  #working(isWorking: boolean): void {
    this.#bar.hidden = !isWorking;
    this.#button.textContent = isWorking ? say.sweep.stop : say.sweep.go;
  }

  #show(sensor: Sensor, length: number, { drifts, distribution }: Swept): void {
    const texts = say.sweep;
    if (drifts.length === 0) {
      this.#result.replaceChildren(h('p.note', { role: 'status' }, texts.none));
      return;
    }
    const isCompass = sensor === 'mag';
    const display = this.#store.display.value;
    const unit = isCompass ? unitLabel('angle', 'rad', display) : 'm';
    const angle = (value: number): number => convertDifference('angle', value, display);
    const place = (m: number, share: number | undefined): HTMLElement => h('td', {}, `${formatFixed(m, 2)} m`, Number.isFinite(share) ? h('small', {}, ` ${formatSignificant(100 * (share as number), 2)} %`) : null);
    const rows = distribution.map((d) => {
      const cells = isCompass ? d.yaw.map((yaw) => h('td', {}, `${formatFixed(angle(yaw), 2)} ${unit}`)) : d.distance.map((m, i) => place(m, d.share[i]));
      return h('tr', {}, h('th', { scope: 'row' }, say.table.after(formatFixed(d.after, 0))), ...cells);
    });
    const head = ['', texts.median, texts.p95, texts.largest].map((text) => (text === '' ? h('td') : h('th', { scope: 'col' }, text)));
    const caption = (isCompass ? texts.captionYaw : texts.caption)(say.rows[sensor], drifts.length, length);
    const table = h('table.numbers', {}, h('caption', {}, caption), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows));
    const worst = worstOf(drifts, isCompass ? yawOf : distanceOf);
    const show = worst && h('button.quiet', { type: 'button', onclick: () => this.#blind({ sensor, t0: worst.window[0], t1: worst.window[1] }) }, texts.worst(formatTime(this.#store.sinceStart(worst.window[0]), 0)));
    const title = (isCompass ? texts.plotYaw : texts.plot)(formatFixed(length, 0), unit);
    this.#result.replaceChildren(table, ...(show ? [show] : []), h('p.plot-title', {}, title));
    this.#host.setAttribute('aria-label', title);
    this.#host.hidden = false;
    const endOf: EndOf = isCompass ? (drift) => { const yaw = yawOf(drift); return yaw === null ? null : angle(yaw); } : distanceOf;
    Object.assign(this.#plot, { drifts, endOf, start: this.#store.span.value.t0 });
    this.#plot.redraw();
  }

  canvases(): HTMLCanvasElement[] {
    return this.#host.hidden ? [] : [this.#plot.canvas];
  }
}

function number(value: string, min: number, max: number, label: string): HTMLInputElement {
  return h('input.number', { type: 'number', value, min, max, step: 'any', required: true, 'aria-label': label });
}
