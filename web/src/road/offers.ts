/** What the drive says of its own sensors, and the corrections that this offers. */

import { h } from '../dom';
import type { ParamValue } from '../door';
import { road as say } from '../messages/road';
import type { Session } from '../session';
import type { Store } from '../state';
import { type History, type Tuning, withParam } from '../tuning';
import { formatFixed, formatSignificant } from '../units';
import { latest } from '../worker/rpc';
import type { Offers } from './door';

const ESTIMATOR = 'slope';
const GRAVITY = 9.80665;
const DEGREES = 180 / Math.PI;

/** A correction: a parameter of the estimator and the value that the drive suggests. */
export interface Correction {
  param: 'wheel_latency' | 'accel_offset' | 'use_gnss_height' | 'two_way';
  value: ParamValue;
  finding: string;
}

/** The corrections that a drive offers, in the order in which they are worth applying. */
export function corrections({ latency, is_late, offset, is_offset, has_height }: Offers): Correction[] {
  const { offers } = say;
  const out: Correction[] = [];
  if (latency && is_late) {
    const value = Math.min(0.3, Math.round(latency.delay * 1000) / 1000);
    out.push({ param: 'wheel_latency', value, finding: offers.late(formatFixed(1000 * latency.delay, 0), formatFixed(1000 * latency.sigma, 0)) });
  }
  if (offset && is_offset) {
    const value = Math.min(3, Math.max(-3, Math.round(offset.offset * 1000) / 1000));
    const lean = formatFixed(DEGREES * Math.asin(Math.min(1, Math.abs(offset.offset) / GRAVITY)), 1);
    out.push({ param: 'accel_offset', value, finding: offers.offset(formatFixed(offset.offset, 3), formatFixed(offset.sigma, 3), lean) });
  }
  // With the mount still in the data heights would pull the grade towards the wrong bias.
  if (has_height && offset) out.push({ param: 'use_gnss_height', value: true, finding: offers.height });
  out.push({ param: 'two_way', value: true, finding: offers.twoWay });
  return out;
}

/** What was looked for and needs no correction. */
function inOrder({ latency, is_late, offset, is_offset }: Offers): string[] {
  const { offers } = say;
  const ms = (seconds: number): string => formatFixed(1000 * seconds, 0);
  const out = [];
  if (!latency) out.push(offers.noLatency);
  else if (!is_late) out.push(offers.inTime(ms(latency.delay), ms(latency.sigma)));
  if (!offset) out.push(offers.noHeights);
  else if (!is_offset) out.push(offers.noOffset(formatFixed(offset.offset, 3), formatFixed(offset.sigma, 3)));
  return out;
}

export class OfferPanel {
  readonly element: HTMLElement;
  #details: HTMLDetailsElement;
  #store: Store;
  #session: Session;
  #history: History<Tuning>;
  #summary = h('span');
  #list = h('ul');
  #fine = h('p.note');
  #score = h('p.grade-score', { 'aria-live': 'polite', hidden: true });
  #all: HTMLButtonElement;
  #offers: Offers | null = null;
  /** The drive that the offers are of. */
  #of: unknown = null;

  constructor(store: Store, session: Session, history: History<Tuning>) {
    this.#store = store;
    this.#session = session;
    this.#history = history;
    this.#all = h('button', { type: 'button', onclick: () => this.#apply(this.#open()) }, say.offers.all);
    this.#details = h('details.offers', { hidden: true }, h('summary', {}, this.#summary), this.#list, h('div.offers-foot', {}, this.#fine, this.#all));
    this.element = h('div.road-sensors', {}, this.#score, this.#details);
    const load = latest(() => this.#load());
    store.report.on(load);
    store.room.on(load);
    store.run(ESTIMATOR).on((now, before) => {
      if (now.reply !== before.reply) load();
    });
    store.tuning.on(() => this.#show());
    store.display.on(() => this.#show());
    load();
  }

  async #load(): Promise<void> {
    const report = this.#store.report.value;
    // Once for each drive, after it has been estimated: looking takes a moment.
    if (!report || this.#store.room.value !== 'road' || !this.#store.run(ESTIMATOR).value.reply) {
      this.#details.hidden = this.#score.hidden = true;
      return;
    }
    if (this.#of !== report) {
      this.#offers = await this.#session.rpc.call('sensor_offers', {});
      this.#of = report;
      if (this.#offers.is_late || this.#offers.is_offset) this.#details.open = true;
    }
    this.#show();
  }

  #value(param: string): ParamValue | undefined {
    const spec = this.#store.catalogue.value?.estimators.find((e) => e.name === ESTIMATOR)?.params.find((p) => p.name === param);
    const own = this.#store.tuning.value.params[ESTIMATOR]?.[param];
    return own ?? (spec && spec.kind !== 'optional' ? spec.default : undefined);
  }

  /** What is offered and not applied. */
  #open(): Correction[] {
    return this.#offers ? corrections(this.#offers).filter(({ param, value }) => this.#value(param) !== value) : [];
  }

  /** Apply corrections, or take one back, as one step that can be undone. */
  #apply(list: Correction[], isBack = false): void {
    let tuning = this.#store.tuning.value;
    const specs = this.#store.catalogue.value?.estimators.find((e) => e.name === ESTIMATOR)?.params ?? [];
    for (const { param, value } of list) {
      const spec = specs.find((p) => p.name === param);
      if (spec) tuning = withParam(tuning, ESTIMATOR, spec, isBack && spec.kind !== 'optional' ? spec.default : value);
    }
    this.#history.push(tuning);
    this.#store.tuning.value = tuning;
  }

  #show(): void {
    const offers = this.#offers;
    const { reply } = this.#store.run(ESTIMATOR).value;
    this.#details.hidden = !offers || !reply;
    if (!offers || !reply) return;
    const open = this.#open();
    const texts = say.offers;
    this.#summary.textContent = texts.title(open.length);
    this.#list.replaceChildren(
      ...corrections(offers).map((correction) => {
        const isApplied = !open.some((o) => o.param === correction.param);
        const label = isApplied ? texts.takeBack : texts.apply[correction.param];
        const button = h('button', { type: 'button', 'aria-label': `${label}: ${correction.finding}`, onclick: () => this.#apply([correction], isApplied) }, label);
        return h('li', { 'data-applied': isApplied || undefined }, h('span', {}, correction.finding), button);
      }),
    );
    this.#fine.textContent = inOrder(offers).join(' ');
    this.#fine.hidden = this.#fine.textContent === '';
    this.#all.hidden = open.length < 2;
    const grade = reply.current.score.metrics.find((m) => m.column === 'grade');
    this.#score.hidden = !grade;
    if (grade) {
      const degrees = (value: number): string => formatSignificant(DEGREES * value, 2);
      const correlation = grade.correlation === null ? '' : texts.correlation(formatFixed(grade.correlation, 3));
      this.#score.textContent = texts.score(correlation, degrees(grade.rmse_centred), degrees(grade.rmse));
    }
  }
}
