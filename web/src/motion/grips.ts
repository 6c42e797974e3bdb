/** Threshold lines that can be dragged: on the plot itself, by a handle at its right edge, and with the arrow keys there. */

import { h } from '../dom';
import type { EstimatorInfo, NumberParam } from '../door';
import { t } from '../messages';
import { LEFT, RIGHT } from '../plot/axes';
import type { Session } from '../session';
import { fromTravel, toTravel } from '../slider';
import type { Store } from '../state';
import { type History, type Tuning, withParam } from '../tuning';
import { convert, formatSignificant, unitLabel } from '../units';
import type { Lane } from '../views/lane';
import { type Line, paramOf, tuned, valueFor } from './threshold';

const ESTIMATOR = 'motion_mode';
/** Distance from a line, px, within which it is taken. */
const NEAR = 6;
/** How often a factor is corrected, after a pointer has moved, until the line lies under it. */
const CORRECTIONS = 4;
/** Share by which a line may miss the pointer. */
const CLOSE = 0.01;

export class Grip {
  readonly element = h('div.grip', { role: 'slider', tabindex: '0', 'aria-orientation': 'vertical', hidden: true });
  readonly line: Line;
  #lane: Lane;
  #store: Store;
  #session: Session;
  #history: History<Tuning>;
  /** Where the line lies over time, SI, and the parameter's value that put it there. */
  #drawn: { times: Float64Array; values: Float64Array; param: number } | null = null;
  /** The threshold wanted while a line is dragged, SI, and how often its factor may still be corrected. */
  #wanted: { value: number; at: number; corrections: number } | null = null;

  constructor(store: Store, session: Session, history: History<Tuning>, lane: Lane, line: Line) {
    this.#store = store;
    this.#session = session;
    this.#history = history;
    this.#lane = lane;
    this.line = line;
    this.element.dataset['line'] = line;
    this.element.style.width = `${RIGHT}px`;
    lane.plotHost.append(this.element);
    this.element.addEventListener('keydown', (event) => this.#key(event));
    lane.plotHost.addEventListener('pointerdown', (event) => this.#down(event), { capture: true });
    lane.plotHost.addEventListener('pointermove', (event) => this.#hover(event), { capture: true });
    store.tuning.on(() => this.#describe());
    store.display.on(() => requestAnimationFrame(() => this.#place()));
  }

  #info(): EstimatorInfo | null {
    return this.#store.catalogue.value?.estimators.find((e) => e.name === ESTIMATOR) ?? null;
  }

  /** The parameter that moves the line. */
  #spec(): NumberParam | null {
    const info = this.#info();
    if (!info) return null;
    const isAdaptive = tuned(info, this.#store.tuning.value.params[ESTIMATOR], 'adaptive') === true;
    const spec = info.params.find((p) => p.name === paramOf(this.line, isAdaptive));
    return spec?.kind === 'number' ? spec : null;
  }

  #value(spec: NumberParam): number {
    const info = this.#info();
    const value = info ? tuned(info, this.#store.tuning.value.params[ESTIMATOR], spec.name) : null;
    return typeof value === 'number' ? value : spec.default;
  }

  /** Take where the line lies now; `null` for none. */
  take(times: Float64Array, values: Float64Array | null): void {
    const spec = this.#spec();
    const ran = spec ? this.#store.run(ESTIMATOR).value.reply?.current.params[spec.name] : undefined;
    const isThere = values !== null && values.length > 0 && spec !== null && typeof ran === 'number';
    this.#drawn = isThere ? { times, values, param: ran } : null;
    requestAnimationFrame(() => {
      this.#place();
      this.#correct();
    });
  }

  #at(time: number): number {
    const { times, values } = this.#drawn ?? {};
    if (!times || !values) return Number.NaN;
    const { t0, t1 } = this.#store.window.value;
    const index = Math.round(((time - t0) / (t1 - t0)) * times.length - 0.5);
    for (let reach = 0; reach < times.length; reach++) {
      for (const i of [index - reach, index + reach]) {
        const value = values[i];
        if (value !== undefined && Number.isFinite(value)) return value;
      }
    }
    return Number.NaN;
  }

  #toDisplayed(value: number): number {
    return convert(this.#lane.spec.quantity, value, this.#store.display.value);
  }

  #height(value: number): number {
    return this.#lane.plot.heightOf(this.#toDisplayed(value));
  }

  #place(): void {
    const value = this.#at(this.#store.window.value.t1);
    this.element.hidden = !Number.isFinite(value);
    if (this.element.hidden) return;
    this.element.style.top = `${this.#height(value)}px`;
    this.#describe();
  }

  #describe(): void {
    const spec = this.#spec();
    if (!spec) return;
    const value = this.#value(spec);
    const display = this.#store.display.value;
    const threshold = `${formatSignificant(this.#toDisplayed(this.#at(this.#store.window.value.t1)))} ${unitLabel(this.#lane.spec.quantity, this.#lane.spec.unit, display)}`;
    const { element } = this;
    element.title = t.motion.threshold.hint;
    element.setAttribute('aria-label', t.motion.threshold.grip(this.line.replace('_', ' ').toUpperCase()));
    element.setAttribute('aria-valuemin', String(spec.min));
    element.setAttribute('aria-valuemax', String(spec.max));
    element.setAttribute('aria-valuenow', String(value));
    element.setAttribute('aria-valuetext', `${threshold}, ${spec.name.replaceAll('_', ' ')} ${formatSignificant(value)}`);
  }

  #push(spec: NumberParam, value: number, isGesture: boolean): void {
    if (value === this.#value(spec)) return;
    const next = withParam(this.#store.tuning.value, ESTIMATOR, spec, value);
    this.#history.push(next, isGesture ? `${ESTIMATOR}.${spec.name}` : null);
    this.#store.tuning.value = next;
  }

  #key(event: KeyboardEvent): void {
    const steps: Record<string, number> = { ArrowUp: 5, ArrowRight: 5, ArrowDown: -5, ArrowLeft: -5, PageUp: 50, PageDown: -50 };
    const step = steps[event.key];
    const spec = this.#spec();
    if (step === undefined || !spec) return;
    event.preventDefault();
    event.stopPropagation();
    this.#store.estimator.value = ESTIMATOR;
    this.#push(spec, fromTravel(spec, toTravel(spec, this.#value(spec)) + step), false);
  }

  /** Where a pointer is: time, and height below the plot's top. */
  #pointer(event: PointerEvent): { time: number; height: number; isOnGrip: boolean } {
    const box = this.#lane.plotHost.getBoundingClientRect();
    const { t0, t1 } = this.#store.window.value;
    const share = (event.clientX - box.left - LEFT) / Math.max(1, box.width - LEFT - RIGHT);
    const isOnGrip = event.target instanceof Node && this.element.contains(event.target);
    return { time: t0 + Math.min(1, Math.max(0, share)) * (t1 - t0), height: event.clientY - box.top, isOnGrip };
  }

  #isNear(event: PointerEvent): boolean {
    const { time, height, isOnGrip } = this.#pointer(event);
    if (isOnGrip) return true;
    // A finger on the plot moves the cursor: it takes the handle.
    return event.pointerType !== 'touch' && Math.abs(this.#height(this.#at(time)) - height) <= NEAR;
  }

  #hover(event: PointerEvent): void {
    const { classList } = this.#lane.plotHost;
    const mark = `near-${this.line}`;
    classList.toggle(mark, this.#wanted !== null || (event.buttons === 0 && this.#isNear(event)));
    classList.toggle('near-threshold', [...classList].some((name) => name !== 'near-threshold' && name.startsWith('near-')));
  }

  #down(event: PointerEvent): void {
    if (event.button !== 0 || event.shiftKey || !this.#isNear(event) || !this.#spec()) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const host = this.#lane.plotHost;
    host.setPointerCapture(event.pointerId);
    this.element.focus({ preventScroll: true });
    this.#store.estimator.value = ESTIMATOR;
    this.#session.beginGesture(ESTIMATOR);
    const move = (moved: PointerEvent): void => {
      if (moved.pointerId !== event.pointerId) return;
      moved.stopImmediatePropagation();
      this.#dragTo(moved);
    };
    const end = (ended: PointerEvent): void => {
      if (ended.pointerId !== event.pointerId) return;
      for (const name of ['pointermove', 'pointerup', 'pointercancel'] as const) host.removeEventListener(name, name === 'pointermove' ? move : end, { capture: true });
      this.#wanted = null;
      this.#history.endGesture();
      this.#session.endGesture(ESTIMATOR);
    };
    host.addEventListener('pointermove', move, { capture: true });
    host.addEventListener('pointerup', end, { capture: true });
    host.addEventListener('pointercancel', end, { capture: true });
  }

  #dragTo(event: PointerEvent): void {
    const { time, height, isOnGrip } = this.#pointer(event);
    const displayed = this.#lane.plot.valueAt(height);
    const value = displayed / this.#toDisplayed(1);
    if (!(value > 0)) return;
    this.#wanted = { value, at: isOnGrip ? this.#store.window.value.t1 : time, corrections: CORRECTIONS };
    this.#apply();
  }

  #apply(): void {
    const spec = this.#spec();
    if (!spec || !this.#drawn || !this.#wanted) return;
    const isFactor = spec.name.endsWith('_factor');
    this.#push(spec, valueFor(spec, isFactor, this.#drawn.param, this.#at(this.#wanted.at), this.#wanted.value), true);
  }

  /** A factor moves its line only as far as the noise floor lets it: look where the line came to lie, and go on. */
  #correct(): void {
    const wanted = this.#wanted;
    if (!wanted || wanted.corrections === 0) return;
    wanted.corrections -= 1;
    if (Math.abs(this.#at(wanted.at) / wanted.value - 1) > CLOSE) this.#apply();
  }
}
