/** Plots of a closed loop over time, under one window, with a line at the instant that is looked at. */

import { h, onResize } from '../dom';
import { t } from '../messages';
import { loops as say } from '../messages/loops';
import { LEFT, RIGHT } from '../plot/axes';
import { withGaps } from '../plot/gaps';
import { type CurveData, type CurveStyle, TimePlot } from '../plot/time-plot';
import { convert, type Display, formatSignificant, type Quantity, unitLabel } from '../units';
import type { Driven } from './door';
import { rowAt } from './stage';

/** Points of a curve; more could not be told apart. */
const POINTS = 1500;

interface Curve {
  label: string;
  source: 'car' | 'guidance';
  column: string;
  style: CurveStyle;
  /** Of the loop that is compared with. */
  isCompared?: boolean;
}

export interface TraceSpec {
  key: string;
  title: string;
  quantity: Quantity;
  unit: string;
  least: number;
  curves: Curve[];
}

const LINE: CurveStyle = { colour: 'estimate', width: 1.5 };
const GHOST: CurveStyle = { colour: 'ghost', width: 1.2, dash: [4, 5] };
const TARGET: CurveStyle = { colour: 'threshold', width: 1.2, dash: [8, 3] };

function car(label: string, column: string, style: CurveStyle = LINE, isCompared = false): Curve {
  return { label, source: 'car', column, style, isCompared };
}

/** The plots, from top to bottom. */
export function traceSpecs(): TraceSpec[] {
  const { plots, curves } = say;
  return [
    {
      key: 'yaw_rate', title: plots.yawRate, quantity: 'angle', unit: 'rad/s', least: 0.02,
      curves: [car(curves.compared, 'yaw_rate', GHOST, true), car(curves.reference, 'yaw_rate_reference', TARGET), car(curves.car, 'yaw_rate')],
    },
    {
      key: 'lateral', title: plots.lateral, quantity: 'plain', unit: 'm/s^2', least: 0.2,
      curves: [car(curves.compared, 'lateral_acceleration', GHOST, true), car(curves.car, 'lateral_acceleration')],
    },
    {
      key: 'moment', title: plots.moment, quantity: 'plain', unit: 'N m', least: 20,
      curves: [car(curves.compared, 'moment', GHOST, true), car(curves.command, 'moment_command', TARGET), car(curves.given, 'moment')],
    },
    {
      key: 'brakes', title: plots.brakes, quantity: 'plain', unit: 'N', least: 50,
      curves: [
        car(curves.fl, 'brake_fl', { colour: 'estimate', width: 1.5 }), car(curves.fr, 'brake_fr', { colour: 'second', width: 1.5 }),
        car(curves.rl, 'brake_rl', { colour: 'mode-1', width: 1.5, dash: [6, 3] }), car(curves.rr, 'brake_rr', { colour: 'threshold', width: 1.5, dash: [6, 3] }),
      ],
    },
    {
      key: 'cross_track', title: plots.crossTrack, quantity: 'plain', unit: 'm', least: 0.2,
      curves: [
        { label: curves.compared, source: 'guidance', column: 'cross_track', style: GHOST, isCompared: true },
        { label: curves.car, source: 'guidance', column: 'cross_track', style: LINE },
      ],
    },
  ];
}

/** A column on common instants: the last value at or before each. */
function held(driven: Driven, { source, column }: Curve, times: number[]): Float64Array {
  const { time, columns } = driven[source];
  const values = columns[column];
  return Float64Array.from(times, (at) => (values && time.length > 0 && at >= (time[0] as number) ? (values[rowAt(time, at)] ?? Number.NaN) : Number.NaN));
}

export class Trace {
  readonly element: HTMLElement;
  #spec: TraceSpec;
  #plot: TimePlot;
  #cursor = h('div.cursor-line');
  #values: { curve: Curve; text: HTMLElement; entry: HTMLElement }[];
  #unit = h('span.lane-unit');
  #driven: Driven | null = null;
  #compared: Driven | null = null;
  #end = 1;

  constructor(spec: TraceSpec, seek: (time: number) => void) {
    this.#spec = spec;
    const host = h('div.plot', { role: 'img' });
    this.#plot = new TimePlot(host, { styles: spec.curves.map((c) => c.style), isLog: false, hasTimeAxis: true });
    this.#values = spec.curves.map((curve) => {
      const text = h('span.value');
      const swatch = h('span.swatch', { 'data-colour': curve.style.colour, 'data-dashed': curve.style.dash ? true : undefined });
      return { curve, text, entry: h('span.legend-entry.fixed', {}, swatch, curve.label, text) };
    });
    const area = h('div.time-area');
    area.style.left = `${LEFT}px`;
    area.style.right = `${RIGHT}px`;
    area.append(this.#cursor);
    const at = (event: PointerEvent): void => {
      const box = area.getBoundingClientRect();
      seek(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * this.#end);
    };
    area.addEventListener('pointerdown', (event) => {
      area.setPointerCapture(event.pointerId);
      at(event);
    });
    area.addEventListener('pointermove', (event) => event.buttons > 0 && at(event));
    host.append(area);
    this.element = h('div.lane.with-time-axis', { 'data-trace': spec.key }, h('div.legend', {}, h('h3.lane-title', {}, spec.title), this.#unit, ...this.#values.map((v) => v.entry)), host);
    onResize(host, (width, height) => width > 0 && this.#plot.setSize(width, height));
  }

  show(driven: Driven, compared: Driven | null, display: Display): void {
    this.#driven = driven;
    this.#compared = compared;
    const { quantity, unit, curves, least } = this.#spec;
    const last = driven.car.time[driven.car.time.length - 1] ?? 1;
    this.#end = Math.max(last, 0.1);
    const times = Array.from({ length: POINTS }, (_, i) => (i * this.#end) / (POINTS - 1));
    const data = curves.map((curve): CurveData => {
      const of = curve.isCompared ? compared : driven;
      if (!of) return { line: [], isShown: false, isBandShown: false };
      return { line: withGaps(held(of, curve, times), (v) => convert(quantity, v, display)), isShown: true, isBandShown: false };
    });
    this.#plot.setWindow(0, this.#end);
    this.#plot.setData(times, data, convert(quantity, least, display));
    const label = unitLabel(quantity, unit, display);
    this.#unit.textContent = quantity === 'angle' ? `${label}/s` : label;
    this.element.querySelector('.plot')?.setAttribute('aria-label', t.views.plotLabel(this.#spec.title, this.#unit.textContent));
    this.element.hidden = !data.some((c) => c.line.some((v) => v !== null && v !== 0));
    for (const { curve, entry } of this.#values) entry.hidden = Boolean(curve.isCompared) && !compared;
  }

  setTime(time: number, display: Display): void {
    this.#cursor.style.left = `${(100 * time) / this.#end}%`;
    for (const { curve, text } of this.#values) {
      const of = curve.isCompared ? this.#compared : this.#driven;
      const value = of ? (held(of, curve, [time])[0] ?? Number.NaN) : Number.NaN;
      text.textContent = formatSignificant(convert(this.#spec.quantity, value, display));
    }
  }
}
