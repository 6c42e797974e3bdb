/** The mode timeline that explains itself: decisions with their rules, the statistics with thresholds to drag, labels. */

import { h } from '../dom';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import { ModeStrip, type StripRow } from '../plot/mode-strip';
import { stretches } from '../plot/strip';
import { TimeArea } from '../plot/time-area';
import type { Session } from '../session';
import type { Signal } from '../signal';
import type { Store } from '../state';
import type { History, Tuning } from '../tuning';
import { formatTime } from '../units';
import { type CurveSpec, type LaneSpec, sourceOf, STYLES } from '../views/curves';
import { modeKey } from '../views/mode';
import type { TableColumn } from '../views/table';
import { TimeView } from '../views/time-view';
import { type GridItem, latest } from '../worker/rpc';
import { DecisionStrip } from './decision-strip';
import { ESTIMATOR } from './decisions';
import { type Decision, decisionAt, explain, type Moment, type Settings, type Statistic, STATISTICS, UNITS } from './explain';
import { Grip } from './grips';
import { stretchesOf } from './labels';
import { Painter } from './paint';
import { LINES, tuned } from './threshold';

const of = (which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator: ESTIMATOR, which });
const DECIDED: CurveSpec = { id: 'decided', label: t.curves.decided, source: of('current'), column: 'mode', style: STYLES.estimate, isOn: true };
const ROWS: CurveSpec[] = [DECIDED, { ...DECIDED, id: 'before', label: t.curves.ghost, source: of('previous') }, { ...DECIDED, id: 'truth', label: t.curves.truth, source: 'truth' }];

function lane(statistic: Statistic): LaneSpec {
  const threshold = `${statistic}_threshold`;
  return {
    key: statistic,
    title: say.lanes[statistic],
    quantity: UNITS[statistic] === 'rad/s' ? 'rate' : 'plain',
    unit: UNITS[statistic],
    isLog: true,
    least: 1,
    weight: 1,
    curves: [
      { id: statistic, label: t.lanes.statistic.toLowerCase(), source: of('current'), column: statistic, style: { colour: 'estimate', width: 1.2 }, isOn: true, isMagnitude: true },
      { id: threshold, label: t.curves.threshold, source: of('current'), column: threshold, style: STYLES.threshold, isOn: true },
      { id: `${threshold}-before`, label: t.curves.ghost, source: of('previous'), column: threshold, style: { ...STYLES.ghost, isStep: true }, isOn: true },
    ],
  };
}

export class MotionModeView extends TimeView {
  #strip: ModeStrip;
  #marks: DecisionStrip;
  #host = h('div.strip', { role: 'img', 'aria-label': t.views.plotLabel(t.lanes.mode, '') });
  #why = h('p.explained', { 'aria-live': 'off' });
  #note = h('p.note.below-lanes', {}, say.threshold.hint);
  #rows: StripRow[] = [];
  #grips: Grip[] = [];
  #decisions: Signal<readonly Decision[]>;
  readonly #explain = latest(() => this.#loadMoment());

  constructor(store: Store, session: Session, history: History<Tuning>, decisions: Signal<readonly Decision[]>) {
    const painter = new Painter(store, session, () => decisions.value);
    super(store, session, { title: say.mode, key: '1', id: 'motion-mode', lanes: STATISTICS.map(lane), controls: [painter.button] });
    this.#decisions = decisions;
    const legend = h('div.legend', {}, h('h3.lane-title', {}, t.lanes.mode), ...t.modes.map(modeKey));
    const marks = h('div.strip.marks', { 'aria-hidden': 'true' });
    this.body.prepend(painter.toolbar, h('div.strip-lane', {}, legend, this.#host, marks, this.#why));
    this.body.append(this.#note);
    this.#strip = new ModeStrip(this.#host);
    this.#marks = new DecisionStrip(marks);
    this.#host.append(new TimeArea(store).element, painter.layer);
    marks.append(new TimeArea(store).element);
    for (const line of LINES) {
      const own = this.lanes.find((l) => l.spec.key === (line.startsWith('yaw') ? 'yd' : line));
      if (own) this.#grips.push(new Grip(store, session, history, own, line, () => this.#grips));
    }
    store.window.watch((window) => {
      this.#strip.setWindow(window);
      this.#mark();
    });
    store.labels.on(() => this.#show());
    store.cursor.on(this.#explain);
    store.tuning.on(() => this.#showNote());
    store.display.on(() => {
      this.#mark();
      this.#explain();
    });
    decisions.watch(() => {
      this.#mark();
      this.#explain();
    });
    this.#showNote();
  }

  #param(name: string): unknown {
    const info = this.store.catalogue.value?.estimators.find((e) => e.name === ESTIMATOR);
    return info ? tuned(info, this.store.tuning.value.params[ESTIMATOR], name) : null;
  }

  #settings(): Settings {
    return { yawOn: Number(this.#param('yaw_on')), yawOff: Number(this.#param('yaw_off')), escapeTime: Number(this.#param('escape_time')) };
  }

  #showNote(): void {
    this.#note.textContent = this.#param('adaptive') === true ? `${say.threshold.hint} ${say.threshold.adaptive}` : say.threshold.hint;
  }

  #mark(): void {
    this.#marks.show(this.#decisions.value, this.store.window.value, this.store.display.value);
  }

  protected override extraItems(): GridItem[] {
    const { store } = this;
    const rows = ROWS.flatMap((curve) => {
      const source = sourceOf(store, curve);
      return source === null ? [] : [{ source, column: 'mode', step: true }];
    });
    const source = sourceOf(store, DECIDED);
    const thresholds = source === null ? [] : (['jd', 'td', 'fd'] as const).map((s) => ({ source, column: `${s}_threshold`, step: true }));
    return [...rows, ...thresholds];
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    const present = ROWS.filter((curve) => sourceOf(this.store, curve) !== null);
    this.#rows = present.map((curve, i) => ({ label: curve.label, kind: 'mode', stretches: stretches(times, columns[i] ?? []) }));
    const settings = this.#settings();
    const drawn = columns.slice(present.length);
    const constant = (value: number): Float64Array => new Float64Array(times.length).fill(value);
    const isThere = drawn.length > 0;
    for (const grip of this.#grips) {
      if (grip.line === 'yaw_on') grip.take(times, isThere ? constant(settings.yawOn) : null);
      else if (grip.line === 'yaw_off') grip.take(times, isThere ? constant(settings.yawOff) : null);
      else grip.take(times, drawn[(['jd', 'td', 'fd'] as const).indexOf(grip.line)] ?? null);
    }
    this.#show();
    this.#explain();
  }

  protected override extraColumns(): TableColumn[] {
    return ROWS.flatMap((curve) => {
      const source = sourceOf(this.store, curve);
      return source === null ? [] : [{ source, column: 'mode', label: `${t.lanes.mode}, ${curve.label}`, quantity: 'plain' as const, unit: '1' }];
    });
  }

  #show(): void {
    const painted = stretchesOf(this.store.labels.value, this.store.span.value.t1);
    const labels: StripRow[] = painted.length > 0 ? [{ label: say.rows.labels, kind: 'mode', stretches: painted }] : [];
    const rows = [...this.#rows, ...labels];
    this.#host.style.height = `${Math.max(1, rows.length) * 18}px`;
    this.#strip.setRows(rows);
  }

  async #loadMoment(): Promise<void> {
    const source = sourceOf(this.store, DECIDED);
    const time = this.store.cursor.value;
    if (source === null) {
      this.#why.textContent = '';
      return;
    }
    const columns = ['rule', ...STATISTICS.flatMap((s) => [s, `${s}_threshold`])];
    const values = await this.session.rpc.call('values', { items: columns.map((column) => ({ source, column })), times: [time] });
    const pair = (k: number): { value: number; threshold: number } => ({ value: values[1 + 2 * k] ?? Number.NaN, threshold: values[2 + 2 * k] ?? Number.NaN });
    const now: Moment = { time, rule: values[0] ?? Number.NaN, statistics: { jd: pair(0), td: pair(1), fd: pair(2), yd: pair(3) } };
    const list = this.#decisions.value;
    const decision = list[decisionAt(list, time)] ?? null;
    const label = (at: number): string => formatTime(this.store.sinceStart(at), 2);
    const [first = '', ...rest] = explain(decision, now, this.#settings(), this.store.display.value, label);
    this.#why.replaceChildren(h('strong', {}, first), ...rest.flatMap((sentence) => [' ', sentence]));
  }
}
