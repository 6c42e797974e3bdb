/** Threshold lines that can be dragged: on the plot itself, by a handle at its right edge, and with the arrow keys there. */

import { h } from '../dom';
import type { EstimatorInfo, NumberParam } from '../door';
import { motion as say } from '../messages/motion';
import { LEFT, RIGHT } from '../plot/axes';
import { axis, timeAt } from '../plot/axis';
import type { Session } from '../session';
import { fromTravel, toTravel } from '../slider';
import type { Store } from '../state';
import type { History, Tuning } from '../tuning';
import { convert, formatSignificant, unitLabel } from '../units';
import type { Lane } from '../views/lane';
import { FOLLOWING, type Line, moved, paramOf } from './threshold';

const ESTIMATOR = 'motion_mode';
/** Distance from a line, px, within which it is taken. */
const NEAR = 6;

export class Grip {
  readonly element = h('div.grip', { role: 'slider', tabindex: '0', 'aria-orientation': 'vertical', hidden: true });
  readonly line: Line;
  #lane: Lane;
  #store: Store;
  #session: Session;
  #history: History<Tuning>;
  #others: () => readonly Grip[];
  /** Where the line lies over time, SI. */
  #drawn: { times: Float64Array; values: Float64Array } | null = null;
  #isDragged = false;

  constructor(store: Store, session: Session, history: History<Tuning>, lane: Lane, line: Line, others: () => readonly Grip[]) {
    this.#store = store;
    this.#session = session;
    this.#history = history;
    this.#lane = lane;
    this.line = line;
    this.#others = others;
    this.element.dataset['line'] = line;
    this.element.style.width = `${RIGHT}px`;
    // Beside the plot, which is a picture to a reader of the screen.
    lane.element.append(this.element);
    this.element.addEventListener('keydown', (event) => this.#key(event));
    this.element.addEventListener('pointerdown', (event) => this.#down(event));
    lane.plotHost.addEventListener('pointerdown', (event) => this.#down(event), { capture: true });
    lane.plotHost.addEventListener('pointermove', (event) => this.#hover(event), { capture: true });
    store.display.on(() => requestAnimationFrame(() => this.#place()));
  }

  #info(): EstimatorInfo | null {
    return this.#store.catalogue.value?.estimators.find((e) => e.name === ESTIMATOR) ?? null;
  }

  #spec(): NumberParam | null {
    const spec = this.#info()?.params.find((p) => p.name === paramOf(this.line));
    return spec?.kind === 'number' ? spec : null;
  }

  /** Take where the line lies now; `null` for none. */
  take(times: Float64Array, values: Float64Array | null): void {
    this.#drawn = values !== null && values.length > 0 ? { times, values } : null;
    requestAnimationFrame(() => this.#place());
  }

  /** Where the line lies at an instant of what is shown, SI. */
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

  /** Where the line lies at the end of what is shown, SI: where its handle is. */
  get threshold(): number {
    return this.#at(this.#store.window.value.t1);
  }

  #toDisplayed(value: number): number {
    return convert(this.#lane.spec.quantity, value, this.#store.display.value);
  }

  #height(value: number): number {
    return this.#lane.plot.heightOf(this.#toDisplayed(value));
  }

  #place(): void {
    const value = this.threshold;
    this.element.hidden = !Number.isFinite(value);
    if (this.element.hidden) return;
    // A line that has left the plot is taken at its edge.
    const height = Math.min(Math.max(this.#height(value), 4), this.#lane.plotHost.clientHeight - 4);
    this.element.style.top = `${this.#lane.plotHost.offsetTop + height}px`;
    this.#describe(value);
  }

  #describe(value: number): void {
    const spec = this.#spec();
    if (!spec) return;
    const { quantity, unit } = this.#lane.spec;
    const { element } = this;
    element.title = say.threshold.hint;
    element.setAttribute('aria-label', say.threshold.grip(this.line.replace('_', ' ').toUpperCase()));
    element.setAttribute('aria-valuemin', String(spec.min));
    element.setAttribute('aria-valuemax', String(spec.max));
    element.setAttribute('aria-valuenow', String(value));
    element.setAttribute('aria-valuetext', `${formatSignificant(this.#toDisplayed(value))} ${unitLabel(quantity, unit, this.#store.display.value)}`);
  }

  #move(threshold: number, isGesture: boolean): void {
    const info = this.#info();
    if (!info || !(threshold > 0)) return;
    const [jd, td, fd] = FOLLOWING.map((line) => this.#others().find((g) => g.line === line)?.threshold ?? Number.NaN) as [number, number, number];
    const next = moved(this.#store.tuning.value, info, this.line, threshold, { jd, td, fd });
    this.#history.push(next, isGesture ? `${ESTIMATOR}.${this.line}` : null);
    this.#store.estimator.value = ESTIMATOR;
    this.#store.tuning.value = next;
  }

  #key(event: KeyboardEvent): void {
    const steps: Record<string, number> = { ArrowUp: 5, ArrowRight: 5, ArrowDown: -5, ArrowLeft: -5, PageUp: 50, PageDown: -50 };
    const step = steps[event.key];
    const spec = this.#spec();
    if (step === undefined || !spec) return;
    event.preventDefault();
    event.stopPropagation();
    this.#move(fromTravel(spec, toTravel(spec, this.threshold) + step), false);
  }

  /** Where a pointer is: time, and height below the plot's top. */
  #pointer(event: PointerEvent): { time: number; height: number; isOnGrip: boolean } {
    const box = this.#lane.plotHost.getBoundingClientRect();
    const share = (event.clientX - box.left - LEFT) / Math.max(1, box.width - LEFT - RIGHT);
    const isOnGrip = event.target instanceof Node && this.element.contains(event.target);
    return { time: timeAt(Math.min(1, Math.max(0, share)), this.#store.window.value, axis.value), height: event.clientY - box.top, isOnGrip };
  }

  #isNear(event: PointerEvent): boolean {
    const { time, height, isOnGrip } = this.#pointer(event);
    if (isOnGrip) return true;
    // A finger on the plot moves the cursor: it takes the handle.
    return event.pointerType !== 'touch' && Math.abs(this.#height(this.#at(time)) - height) <= NEAR;
  }

  #hover(event: PointerEvent): void {
    const { classList } = this.#lane.plotHost;
    classList.toggle(`near-${this.line}`, this.#isDragged || (event.buttons === 0 && this.#isNear(event)));
    classList.toggle('near-threshold', [...classList].some((name) => name !== 'near-threshold' && name.startsWith('near-')));
  }

  #down(event: PointerEvent): void {
    if (event.button !== 0 || event.shiftKey || !this.#isNear(event) || !this.#spec()) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    const host = this.#lane.plotHost;
    host.setPointerCapture(event.pointerId);
    this.element.focus({ preventScroll: true });
    this.#isDragged = true;
    this.#session.beginGesture(ESTIMATOR);
    const move = (moved: PointerEvent): void => {
      if (moved.pointerId !== event.pointerId) return;
      moved.stopImmediatePropagation();
      this.#move(this.#lane.plot.valueAt(this.#pointer(moved).height) / this.#toDisplayed(1), true);
    };
    const end = (ended: PointerEvent): void => {
      if (ended.pointerId !== event.pointerId) return;
      host.removeEventListener('pointermove', move, { capture: true });
      host.removeEventListener('pointerup', end, { capture: true });
      host.removeEventListener('pointercancel', end, { capture: true });
      this.#isDragged = false;
      this.#history.endGesture();
      this.#session.endGesture(ESTIMATOR);
    };
    host.addEventListener('pointermove', move, { capture: true });
    host.addEventListener('pointerup', end, { capture: true });
    host.addEventListener('pointercancel', end, { capture: true });
  }
}
