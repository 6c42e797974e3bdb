/** Land navigation: which aid held the filter when, and what each is worth when it is switched. */

import { h } from '../dom';
import type { EstimatorInfo, ParamValue, RunReport } from '../door';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import { ModeStrip, type StripRow } from '../plot/mode-strip';
import { stretches } from '../plot/strip';
import { TimeArea } from '../plot/time-area';
import type { Session } from '../session';
import { isRunnable, type Store } from '../state';
import { type History, sameFor, type Tuning, withParam } from '../tuning';
import { convertDifference, formatSignificant, unitLabel } from '../units';
import { type CurveSpec, type LaneSpec, sourceOf, STYLES } from '../views/curves';
import type { TableColumn } from '../views/table';
import { TimeView } from '../views/time-view';
import { Cancelled, type GridItem, latest, type Pending, type RunReply } from '../worker/rpc';
import { tuned } from './threshold';

const ESTIMATOR = 'land_ins';
export const AIDS = ['zupt', 'zaru', 'nhc', 'straight', 'wheel', 'gnss'] as const;
export type Aid = (typeof AIDS)[number];
/** The channel that an aid needs. */
const CHANNELS: Partial<Record<Aid, string>> = { wheel: 'wheels', gnss: 'gnss' };
/** A run that lasts longer than this, s, is tried with switched aids only when asked for. */
const QUICK = 0.4;

function lane(): LaneSpec {
  const of = (which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator: ESTIMATOR, which });
  const speed = (id: string, label: string, source: CurveSpec['source'], column: string, style: CurveSpec['style']): CurveSpec => ({ id, label, source, column, style, isOn: true });
  return {
    key: 'speed', title: t.lanes.speed, quantity: 'speed', unit: 'm/s', least: 1, weight: 1,
    curves: [
      speed('truth', t.curves.truth, 'truth', 'vx', STYLES.truth),
      { ...speed('speed', t.curves.estimate, of('current'), 'speed', STYLES.estimate), sigma: 'speed_sigma' },
      speed('ghost', t.curves.ghost, of('previous'), 'speed', STYLES.ghost),
    ],
  };
}

/** Root mean square errors of a run; null without truth. */
export interface Errors {
  position: number | null;
  velocity: number | null;
  attitude: number | null;
}

/** The errors of a run: horizontal position, velocity as a vector, attitude as the mean of its angles. */
export function errorsOf({ score }: RunReport): Errors {
  const rmse = (column: string): number => score.metrics.find((m) => m.column === column)?.rmse ?? Number.NaN;
  const velocity = Math.hypot(rmse('v_north'), rmse('v_east'), rmse('v_down'));
  const attitude = (rmse('roll') + rmse('pitch') + rmse('yaw')) / 3;
  const known = (value: number): number | null => (Number.isFinite(value) ? value : null);
  return { position: score.position?.rmse_horizontal ?? null, velocity: known(velocity), attitude: known(attitude) };
}

export class AidView extends TimeView {
  #strip: ModeStrip;
  #host = h('div.strip', { role: 'img', 'aria-label': say.aids.label });
  #now = h('span.now');
  #table = h('div.aid-table');
  #history: History<Tuning>;
  #tried = new Map<Aid, Errors>();
  #trial: Pending<RunReply> | null = null;
  #trying: Aid | null = null;
  #due: ReturnType<typeof setTimeout> | undefined;
  readonly #showNow = latest(() => this.#loadNow());

  constructor(store: Store, session: Session, history: History<Tuning>) {
    super(store, session, { title: say.aids.title, key: '3', id: 'motion-aids', lanes: [lane()] });
    this.#history = history;
    const legend = h('div.legend', {}, h('h3.lane-title', {}, say.aids.aid), this.#now);
    this.body.prepend(h('div.strip-lane', {}, legend, this.#host));
    this.body.append(this.#table);
    this.#strip = new ModeStrip(this.#host);
    this.#host.style.height = `${AIDS.length * 16}px`;
    this.#host.append(new TimeArea(store).element);
    store.window.watch((window) => this.#strip.setWindow(window));
    store.cursor.on(this.#showNow);
    store.display.on(() => this.#showTable());
    store.tuning.on((now, before) => {
      if (!sameFor(ESTIMATOR, now, before)) this.#forget();
    });
    store.run(ESTIMATOR).on((now, before) => {
      if (now.reply !== before.reply) this.#replied();
    });
    this.#replied();
  }

  #isOn(aid: Aid): boolean {
    const info = this.#info();
    return info ? tuned(info, this.store.tuning.value.params[ESTIMATOR], aid) === true : false;
  }

  #info(): EstimatorInfo | null {
    return this.store.catalogue.value?.estimators.find((e) => e.name === ESTIMATOR) ?? null;
  }

  #isUsable(aid: Aid): boolean {
    const channel = CHANNELS[aid];
    return channel === undefined || (this.store.report.value?.channels.some((c) => c.name === channel) ?? false);
  }

  protected override extraItems(): GridItem[] {
    const source = this.#source();
    return source === null ? [] : AIDS.map((aid) => ({ source, column: `${aid}_active`, step: true }));
  }

  #source(): string | null {
    return sourceOf(this.store, { id: '', label: '', source: { estimator: ESTIMATOR, which: 'current' }, column: 'zupt_active', style: STYLES.estimate, isOn: true });
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    const rows = AIDS.map((aid, i): StripRow => ({ label: say.aids.names[aid] ?? aid, kind: 'on', stretches: stretches(times, columns[i] ?? []) }));
    this.#strip.setRows(rows);
    this.#showNow();
  }

  protected override extraColumns(): TableColumn[] {
    const source = this.#source();
    return source === null ? [] : AIDS.map((aid) => ({ source, column: `${aid}_active`, label: say.aids.names[aid] ?? aid, quantity: 'plain', unit: '1' }));
  }

  async #loadNow(): Promise<void> {
    const source = this.#source();
    if (source === null) {
      this.#now.textContent = '';
      return;
    }
    const values = await this.session.rpc.call('values', { items: AIDS.map((aid) => ({ source, column: `${aid}_active` })), times: [this.store.cursor.value] });
    this.#now.textContent = say.aids.now(AIDS.filter((_, i) => (values[i] ?? 0) > 0.5).map((aid) => say.aids.names[aid]).join(', '));
  }

  /** A result has come: what was tried with switched aids belongs to the one before. */
  #replied(): void {
    this.#forget();
    const { reply } = this.store.run(ESTIMATOR).value;
    if (!reply || reply.current.seconds > QUICK || errorsOf(reply.current).position === null) return;
    this.#due = setTimeout(() => void this.#try(), 500);
  }

  #forget(): void {
    clearTimeout(this.#due);
    this.#trial?.cancel();
    this.#trial = null;
    this.#trying = null;
    this.#tried.clear();
    this.#showTable();
  }

  /** Run with one aid after the other switched. */
  async #try(): Promise<void> {
    const { store, session } = this;
    if (this.#trial || !this.element.checkVisibility()) return;
    const { reply } = store.run(ESTIMATOR).value;
    const tuning = store.tuning.value;
    for (const aid of AIDS.filter((a) => this.#isUsable(a) && !this.#tried.has(a))) {
      const name = `${ESTIMATOR}@${aid}`;
      const params: Record<string, ParamValue> = { ...tuning.params[ESTIMATOR], [aid]: !this.#isOn(aid) };
      const trial = session.rpc.start('run', { estimator: name, params, vehicle: tuning.vehicle });
      this.#trial = trial;
      this.#trying = aid;
      this.#showTable();
      try {
        const { current } = await trial.answer;
        if (this.#trial !== trial || store.run(ESTIMATOR).value.reply !== reply) return;
        this.#tried.set(aid, errorsOf(current));
      } catch (reason) {
        if (this.#trial === trial) this.#trial = this.#trying = null;
        if (!(reason instanceof Cancelled)) store.error.value = reason instanceof Error ? reason.message : String(reason);
        return;
      } finally {
        void session.rpc.call('forget_run', { name });
      }
    }
    this.#trial = this.#trying = null;
    this.#showTable();
  }

  #toggle(aid: Aid, isOn: boolean): void {
    const spec = this.#info()?.params.find((p) => p.name === aid);
    if (!spec) return;
    const next = withParam(this.store.tuning.value, ESTIMATOR, spec, isOn);
    this.#history.push(next);
    this.store.estimator.value = ESTIMATOR;
    this.store.tuning.value = next;
    // The table is made anew: the switch keeps the focus.
    this.#table.querySelector<HTMLElement>(`[data-aid="${aid}"] input`)?.focus();
  }

  #showTable(): void {
    const { store } = this;
    const { reply } = store.run(ESTIMATOR).value;
    if (!isRunnable(store.report.value, ESTIMATOR)) {
      this.#table.replaceChildren();
      return;
    }
    const present = reply ? errorsOf(reply.current) : null;
    const display = store.display.value;
    const texts = say.aids;
    const units = [texts.position, `${texts.velocity} [${unitLabel('speed', 'm/s', display)}]`, `${texts.attitude} [${unitLabel('angle', 'rad', display)}]`];
    const head = [texts.aid, texts.state, texts.switched, ...units].map((name, i) => h(i > 0 && i < 3 ? 'th.text' : 'th', { scope: 'col' }, name));
    const first = h('tr.present', {}, h('th', { scope: 'row' }, texts.present), h('td'), h('td'), ...this.#cells(present, null));
    const rows = AIDS.map((aid) => this.#row(aid, present));
    const table = h('table.numbers', {}, h('caption', {}, texts.caption), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, first, ...rows));
    const hasTruth = present === null || present.position !== null;
    const compare = h('button', { type: 'button', disabled: this.#trial !== null, onclick: () => void this.#try() }, texts.compare);
    const isAllTried = AIDS.every((aid) => this.#tried.has(aid) || !this.#isUsable(aid));
    const action = !hasTruth ? h('p.note', {}, texts.noTruth) : isAllTried || !reply ? null : compare;
    const focused = document.activeElement?.closest<HTMLElement>('[data-aid]')?.dataset['aid'];
    this.#table.replaceChildren(h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': texts.caption }, table), ...(action ? [action] : []), h('p.note', {}, texts.note));
    if (focused) this.#table.querySelector<HTMLElement>(`[data-aid="${focused}"] input`)?.focus({ preventScroll: true });
  }

  #row(aid: Aid, present: Errors | null): HTMLElement {
    const texts = say.aids;
    const isOn = this.#isOn(aid);
    const name = texts.names[aid] ?? aid;
    const input = h('input', { type: 'checkbox', role: 'switch', checked: isOn, 'aria-label': texts.switchOne(name) });
    input.addEventListener('change', () => this.#toggle(aid, input.checked));
    const state = h('td.text', {}, h('label.toggle', {}, input, h('span', {}, isOn ? texts.on : texts.off)));
    const head = h('th', { scope: 'row', title: texts.about[aid] }, name, h('small', {}, texts.about[aid]));
    const tried = this.#tried.get(aid);
    if (!this.#isUsable(aid)) return h('tr', { 'data-aid': aid }, head, state, h('td.text', { colspan: 4 }, texts.idle));
    const what = this.#trying === aid && !tried ? texts.trying(name) : isOn ? texts.without(name) : texts.with(name);
    return h('tr', { 'data-aid': aid }, head, state, h('td.text', {}, what), ...this.#cells(tried ?? null, present));
  }

  #cells(errors: Errors | null, present: Errors | null): HTMLElement[] {
    const display = this.store.display.value;
    const shown: [number | null | undefined, number | null | undefined, (v: number) => number][] = [
      [errors?.position, present?.position, (v) => v],
      [errors?.velocity, present?.velocity, (v) => convertDifference('speed', v, display)],
      [errors?.attitude, present?.attitude, (v) => convertDifference('angle', v, display)],
    ];
    return shown.map(([value, before, convert]) => {
      const isKnown = typeof value === 'number' && typeof before === 'number';
      const verdict = !isKnown || Math.abs(value - before) <= 0.005 * before ? undefined : value < before ? 'better' : 'worse';
      return h('td', { class: verdict }, typeof value === 'number' ? formatSignificant(convert(value)) : '–', verdict ? h('span.hidden', {}, ` (${t.score[verdict]})`) : null);
    });
  }
}
