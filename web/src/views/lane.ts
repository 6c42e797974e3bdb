/** One plot with its legend, whose entries show the values at the cursor and toggle the curves. */

import { h, onResize } from '../dom';
import { t } from '../messages';
import { LEFT, RIGHT, TURN_STEPS } from '../plot/axes';
import { band, breakTurns, held, withGaps } from '../plot/gaps';
import { TimeArea } from '../plot/time-area';
import { type CurveData, TimePlot } from '../plot/time-plot';
import type { Store } from '../state';
import { axisSign, convert, convertDifference, digitsOf, digitsWithin, formatFixed, formatSignificant, unitLabel } from '../units';
import type { GridItem, GridReply } from '../worker/rpc';
import { type CurveSpec, type LaneSpec, sourceOf } from './curves';

interface Entry {
  curve: CurveSpec;
  button: HTMLButtonElement;
  name: HTMLElement;
  value: HTMLElement;
  /** Whether the view lets this curve be chosen at all. */
  isOffered: boolean;
}

/** Numbers of one curve on the grid. */
interface Fetched {
  curve: CurveSpec;
  values: Float64Array;
  sigmas: Float64Array | null;
}

export class Lane {
  readonly element: HTMLElement;
  readonly spec: LaneSpec;
  readonly plot: TimePlot;
  readonly plotHost = h('div.plot');
  #store: Store;
  #entries: Entry[];
  #unit = h('span.lane-unit');
  #bandButton: HTMLButtonElement | null;
  #isBandOn = true;
  #fetched: { times: Float64Array; curves: Fetched[] } | null = null;
  /** Pixels the curves have. */
  pixels = 600;
  onToggle: () => void = () => {};
  onSize: () => void = () => {};

  constructor(store: Store, spec: LaneSpec, hasTimeAxis: boolean) {
    this.#store = store;
    this.spec = spec;
    this.#entries = spec.curves.map((curve) => this.#entry(curve));
    this.#bandButton = spec.curves.some((c) => c.sigma) ? this.#band() : null;
    const legend = h('div.legend', {}, h('h3.lane-title', {}, spec.title), this.#unit, ...this.#legendOrder());
    this.element = h('div.lane', {}, legend, this.plotHost);
    this.element.style.flexGrow = String(spec.weight);
    if (hasTimeAxis) this.element.classList.add('with-time-axis');
    const styles = spec.curves.map((c) => c.style);
    this.plot = new TimePlot(this.plotHost, { styles, isLog: spec.isLog ?? false, hasTimeAxis, ...(spec.isCircular ? { steps: TURN_STEPS } : {}), ...(spec.settling === undefined ? {} : { settling: spec.settling }) });
    this.plotHost.append(new TimeArea(store).element);
    this.plotHost.setAttribute('role', 'img');
    onResize(this.plotHost, (width, height) => {
      if (width === 0) return;
      this.pixels = Math.max(50, width - LEFT - RIGHT);
      this.plot.setSize(width, height);
      this.onSize();
    });
    store.display.watch(() => this.#relabel());
    store.window.watch(({ t0, t1 }) => {
      const start = store.span.value.t0;
      this.plot.setWindow(t0 - start, t1 - start);
    });
  }

  /** What is drawn last comes first: the estimate, its band, then the rest. */
  #legendOrder(): HTMLElement[] {
    const order = ['estimate', 'second', 'third', 'blind', 'truth', 'threshold', 'ghost', 'raw'];
    // Variants of the estimate come right after it.
    const rank = ({ curve: { style } }: Entry): number => (style.colour.startsWith('v-') ? 0.5 : order.indexOf(style.colour));
    const buttons: HTMLElement[] = [...this.#entries].sort((a, b) => rank(a) - rank(b)).map((e) => e.button);
    if (this.#bandButton) buttons.splice(1, 0, this.#bandButton);
    return buttons;
  }

  #entry(curve: CurveSpec): Entry {
    const name = h('span', {}, curve.label);
    const value = h('span.value');
    const swatch = h('span.swatch', { 'data-colour': curve.style.colour, 'data-dashed': curve.style.dash?.length ? true : undefined });
    const button = h('button.legend-entry', { type: 'button', 'aria-pressed': String(curve.isOn) }, swatch, name, value);
    button.title = t.curves.show(curve.label);
    button.addEventListener('click', () => {
      curve.isOn = !curve.isOn;
      button.setAttribute('aria-pressed', String(curve.isOn));
      this.onToggle();
    });
    return { curve, button, name, value, isOffered: true };
  }

  #band(): HTMLButtonElement {
    const swatch = h('span.swatch.band', { 'data-colour': 'estimate' });
    const button = h('button.legend-entry', { type: 'button', 'aria-pressed': 'true', title: t.curves.show(t.curves.sigma) });
    button.append(swatch, t.curves.sigma);
    button.addEventListener('click', () => {
      this.#isBandOn = !this.#isBandOn;
      button.setAttribute('aria-pressed', String(this.#isBandOn));
      this.#draw();
    });
    return button;
  }

  #relabel(): void {
    const unit = unitLabel(this.spec.quantity, this.spec.unit, this.#store.display.value);
    this.#unit.textContent = unit;
    this.plotHost.setAttribute('aria-label', t.views.plotLabel(this.spec.title, unit));
    this.#draw();
  }

  /** Offer only some of the curves. */
  offer(isOffered: (curve: CurveSpec) => boolean): void {
    for (const entry of this.#entries) entry.isOffered = isOffered(entry.curve);
    this.updateLegend();
  }

  /** Hide legend entries of curves that do not exist. */
  updateLegend(): void {
    for (const entry of this.#entries) {
      entry.button.hidden = !entry.isOffered || (entry.curve.level === undefined && sourceOf(this.#store, entry.curve) === null);
      if (entry.curve.name) entry.name.textContent = entry.curve.name(this.#store);
    }
    const hasBand = this.#entries.some((e) => e.curve.sigma && !e.button.hidden);
    if (this.#bandButton) this.#bandButton.hidden = !hasBand;
  }

  /** The curves to draw, with where their numbers are. */
  shown(): { curve: CurveSpec; source: string }[] {
    return this.#entries.flatMap(({ curve, isOffered }) => {
      const source = isOffered && curve.isOn ? sourceOf(this.#store, curve) : null;
      return source === null ? [] : [{ curve, source }];
    });
  }

  /** The columns to fetch for what is shown. */
  items(): GridItem[] {
    const step = (c: CurveSpec): boolean => c.style.isStep ?? false;
    return this.shown().flatMap(({ curve, source }) => [
      { source, column: curve.column, step: step(curve) },
      ...(curve.sigma ? [{ source, column: curve.sigma, step: step(curve) }] : []),
    ]);
  }

  /** Take the columns that `items` asked for, in that order, from the start of `columns`; returns how many. */
  take(reply: GridReply, columns: Float64Array[], items: GridItem[]): void {
    let next = 0;
    const curves: Fetched[] = [];
    while (next < items.length) {
      const item = items[next] as GridItem;
      // Two curves may be of one column: they come in the order in which they were asked for.
      const isOne = ({ curve: c, isOffered }: Entry): boolean => isOffered && c.column === item.column && sameSource(c, item.source) && !curves.some((f) => f.curve === c);
      const curve = this.#entries.find(isOne)?.curve;
      const values = columns[next] as Float64Array;
      const sigmas = curve?.sigma ? (columns[next + 1] ?? null) : null;
      if (curve) curves.push({ curve, values, sigmas });
      next += curve?.sigma ? 2 : 1;
    }
    // Labels count from the start of the drive, whatever its clock shows.
    const start = this.#store.span.value.t0;
    this.#fetched = { times: reply.times.map((time) => time - start), curves };
    this.#draw();
  }

  #draw(): void {
    const fetched = this.#fetched;
    if (!fetched) return;
    const display = this.#store.display.value;
    const { quantity } = this.spec;
    const curves = this.spec.curves.map((curve): CurveData => {
      if (curve.level !== undefined) {
        const isShown = curve.isOn && fetched.curves.length > 0 && this.#entries.some((e) => e.curve === curve && e.isOffered);
        return { line: isShown ? new Array(fetched.times.length).fill(curve.level) : [], isShown, isBandShown: false };
      }
      const data = fetched.curves.find((f) => f.curve === curve);
      if (!data || data.values.length === 0) return { line: [], isShown: false, isBandShown: false };
      const sign = axisSign(curve.column, display);
      const shown = (value: number): number => convert(quantity, sign * drawn(curve, value), display);
      const values = curve.hold === undefined ? data.values : held(data.values, fetched.times, curve.hold);
      const { isLog, floor = 0 } = this.spec;
      let line = withGaps(values, isLog ? (v) => (shown(v) > 0 ? Math.max(shown(v), floor) : Number.NaN) : shown);
      if (this.spec.isCircular) line = breakTurns(line, convert(quantity, Math.PI, display));
      const isShown = curve.isOn;
      if (!data.sigmas || data.sigmas.length === 0) return { line, isShown, isBandShown: false };
      const edges = band(curve.isError ? new Float64Array(data.values.length) : data.values, data.sigmas);
      return { line, low: withGaps(edges.low, shown), high: withGaps(edges.high, shown), isShown, isBandShown: this.#isBandOn };
    });
    this.plot.setData(fetched.times, curves, convertDifference(quantity, this.spec.least, display));
  }

  /** Show the values at the cursor; `values` holds value and sigma for each of `shown()`. */
  showValues(values: { curve: CurveSpec; value: number; sigma: number }[]): void {
    const display = this.#store.display.value;
    const { quantity, isLog, least } = this.spec;
    const reachOf = (sigma: number): number => convertDifference(quantity, 3 * sigma, display);
    const digits = digitsWithin(values.map((v) => reachOf(v.sigma)), digitsOf(quantity, display, least));
    for (const entry of this.#entries) {
      const found = values.find((v) => v.curve === entry.curve);
      if (!found) {
        entry.value.textContent = '';
        continue;
      }
      const sign = entry.curve.isMagnitude ? 1 : axisSign(entry.curve.column, display);
      const value = convert(quantity, sign * drawn(entry.curve, found.value), display);
      let text = isLog ? formatSignificant(value) : formatFixed(value, digits);
      const reach = reachOf(found.sigma);
      if (Number.isFinite(reach)) text += ` ±${formatFixed(reach, digits)}`;
      entry.value.textContent = text;
    }
  }
}

/** What of a value is drawn. */
function drawn(curve: CurveSpec, value: number): number {
  if (curve.of) return curve.of(value);
  return curve.isMagnitude ? Math.abs(value) : value;
}

function sameSource(curve: CurveSpec, source: string): boolean {
  if (typeof curve.source === 'string') return curve.source === source;
  const [estimator, which] = source.split(':');
  // What is being computed stands for the current result.
  return curve.source.estimator === estimator && curve.source.which === (which === 'running' ? 'current' : which);
}
