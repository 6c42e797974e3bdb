/** What changed: the numbers of the latest result beside those of the one before. */

import { h } from '../dom';
import type { Change, EstimatorInfo, Metric, RunReport, Score } from '../door';
import { t } from '../messages';
import type { Session } from '../session';
import type { RunState, Store } from '../state';
import { convertDifference, type Display, formatFixed, formatSignificant, formatTime, quantityOf, unitLabel } from '../units';
import { lampRow, lamps } from './consistency';
import { words } from './params';

/** An error or a share as displayed, without its unit. */
interface Shown {
  text: string;
  unit: string;
}

function shownError(column: string, unit: string, value: number, display: Display): Shown {
  const quantity = quantityOf(column, unit);
  const label = unitLabel(quantity, unit, display);
  return { text: formatSignificant(convertDifference(quantity, value, display)), unit: label === '' || label === '°' ? label : ` ${label}` };
}

function shownChange(change: Pick<Change, 'measure' | 'column' | 'unit'>, value: number, display: Display): Shown {
  if (change.measure === 'mode_accuracy') return { text: formatFixed(100 * value, 1), unit: ' %' };
  if (change.measure === 'consistency') return { text: formatSignificant(value), unit: '' };
  return shownError(change.column, change.unit, value, display);
}

/** By how much, in per cent; accuracies in percentage points. */
function difference({ measure, before, after, ratio }: Change): string {
  const percent = measure === 'mode_accuracy' ? 100 * (after - before) : 100 * ((ratio ?? 1) - 1);
  const text = Math.abs(percent) >= 10 ? formatFixed(percent, 0) : formatFixed(percent, 1);
  return `${percent > 0 ? '+' : ''}${text} %`;
}

/** The number that stands for a whole score, as the comparison would choose it. */
function keyNumber(score: Score): Pick<Change, 'measure' | 'column' | 'unit' | 'after'> | null {
  if (score.position) return { measure: 'horizontal_rmse', column: 'position', unit: 'm', after: score.position.rmse_horizontal };
  if (score.mode) return { measure: 'mode_accuracy', column: 'mode', unit: '1', after: score.mode.accuracy };
  const rmse = (truth: string): number | undefined => score.metrics.find((m) => m.truth === truth)?.rmse;
  const [roll, pitch, yaw] = [rmse('roll'), rmse('pitch'), rmse('yaw')];
  if (roll !== undefined && pitch !== undefined) {
    const after = yaw === undefined ? (roll + pitch) / 2 : (roll + pitch + yaw) / 3;
    return { measure: 'attitude_rmse', column: 'attitude', unit: 'rad', after };
  }
  const metric = score.metrics.find((m) => m.column === 'grade') ?? score.metrics[0];
  if (metric) return { measure: 'rmse', column: metric.column, unit: metric.unit, after: metric.rmse };
  return null;
}

/** What the views show; everything else is among all numbers. */
const KEY_COLUMNS = ['roll', 'pitch', 'yaw', 'grade', 'slope', 'speed', 'sideslip'];

/** The metrics worth a place above the parameters; the first few where none of the usual ones is there. */
function keyMetrics({ metrics, mode, position }: Score): Metric[] {
  const key = metrics.filter((m) => KEY_COLUMNS.includes(m.column));
  return key.length > 0 || mode || position ? key : metrics.slice(0, 6);
}

export class ScoreCard {
  readonly element = h('section.score', { 'aria-label': t.score.title });
  #store: Store;
  #session: Session;
  #estimator: EstimatorInfo | null = null;
  #headline = h('p.headline', { 'aria-live': 'polite' });
  #ghost = h('div.ghost-controls');
  #body = h('div.score-body');
  /** The full tables, for below the parameters. */
  readonly details = h('section.score.score-details', { 'aria-label': t.score.allNumbers });
  #isOpen = false;
  #stop: () => void = () => {};

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    this.element.append(this.#headline, this.#ghost, this.#body);
    store.display.on(() => this.#show());
    store.report.on(() => this.#show());
  }

  setEstimator(estimator: EstimatorInfo | null): void {
    this.#stop();
    this.#estimator = estimator;
    if (!estimator) return;
    this.#stop = this.#store.run(estimator.name).on((now, before) => {
      if (now.reply !== before.reply || now.isKept !== before.isKept || now.error !== before.error) this.#show();
      this.element.classList.toggle('running', now.running !== null);
    });
    this.#show();
  }

  #show(): void {
    const estimator = this.#estimator;
    if (!estimator) return;
    const run = this.#store.run(estimator.name).value;
    this.#headline.replaceChildren(...this.#headlineOf(run));
    this.#ghost.replaceChildren(...this.#ghostControls(estimator.name, run));
    const { current, previous } = run.reply ?? { current: null, previous: null };
    const before = previous?.score ?? null;
    const tops = current ? [this.#errors(current.score, before), lampRow(current.score.consistency)] : [];
    this.#body.replaceChildren(...tops.filter((e) => e !== null));
    const bottoms = current ? [lamps(current.score.consistency, before?.consistency ?? null, estimator.columns), this.#notices(current), this.#numbers(current)] : [];
    this.details.replaceChildren(...bottoms.filter((e) => e !== null));
  }

  #headlineOf({ reply, error }: RunState): (Node | string)[] {
    const display = this.#store.display.value;
    if (error) return [h('span.worse', {}, error)];
    if (!reply) return [this.#whyNot()];
    const headline = reply.change?.headline;
    if (headline) {
      const before = shownChange(headline, headline.before, display);
      const after = shownChange(headline, headline.after, display);
      const what = t.score.headline[headline.measure](words(headline.column));
      const verdict = headline.better === null ? 'equal' : headline.better ? 'better' : 'worse';
      return [
        h('strong', {}, t.score.change(what, before.text, after.text, after.unit, difference(headline))),
        ' ',
        h(`span.verdict.${verdict}`, {}, t.score[verdict]),
      ];
    }
    const key = keyNumber(reply.current.score);
    if (!key) return [t.score.noTruth];
    const { text, unit } = shownChange(key, key.after, display);
    return [h('strong', {}, t.score.now(t.score.headline[key.measure](words(key.column)), text, unit))];
  }

  #whyNot(): string {
    const missing = this.#store.report.value?.estimators.find((e) => e.name === this.#estimator?.name)?.missing.filter((n) => n.required) ?? [];
    if (missing.length === 0) return t.score.noRun;
    return t.views.notRunnable(this.#estimator?.title ?? '', missing.map((n) => n.label).join(', '));
  }

  #ghostControls(name: string, { reply, isKept }: RunState): HTMLElement[] {
    if (!reply) return [];
    if (!reply.previous) return [h('span.hint', {}, t.score.tuneHint)];
    const keep = h('input', { type: 'checkbox', checked: isKept });
    keep.addEventListener('change', () => this.#session.keepGhost(name, keep.checked));
    const clear = h('button.quiet', { type: 'button', onclick: () => this.#session.clearGhost(name) }, t.score.clearGhost);
    return [h('label', {}, keep, t.score.keepGhost), h('span.swatch', { 'data-colour': 'ghost', 'data-dashed': true }), clear];
  }

  /** Errors against truth, before and now. */
  #errors(now: Score, before: Score | null): HTMLElement | null {
    const display = this.#store.display.value;
    const rows: { name: string; before: string | null; now: string; better: boolean | null }[] = [];
    const judge = (b: number | undefined, a: number, sign = 1): boolean | null =>
      b === undefined || Math.abs(a - b) <= 0.005 * Math.abs(b) ? null : sign * (a - b) < 0;
    const add = (name: string, column: string, unit: string, after: number, earlier: number | undefined): void => {
      const shown = shownError(column, unit, after, display);
      rows.push({
        name: `${name}${shown.unit ? ` [${shown.unit.trim()}]` : ''}`,
        before: earlier === undefined ? null : shownError(column, unit, earlier, display).text,
        now: shown.text,
        better: judge(earlier, after),
      });
    };
    if (now.position) add(t.score.horizontal, 'position', 'm', now.position.rmse_horizontal, before?.position?.rmse_horizontal);
    if (now.mode) {
      const shown = (v: number | undefined): string | null => (v === undefined ? null : formatFixed(100 * v, 1));
      rows.push({
        name: `${t.score.accuracy} [%]`,
        before: shown(before?.mode?.accuracy),
        now: shown(now.mode.accuracy) ?? '',
        better: judge(before?.mode?.accuracy, now.mode.accuracy, -1),
      });
    }
    if (now.position?.rmse_vertical != null) {
      add(t.score.vertical, 'position', 'm', now.position.rmse_vertical, before?.position?.rmse_vertical ?? undefined);
    }
    for (const m of keyMetrics(now)) {
      add(words(m.column), m.column, m.unit, m.rmse, before?.metrics.find((b) => b.column === m.column)?.rmse);
    }
    if (rows.length === 0) return null;
    const cells = rows.map((r) => {
      const value = h('dd', {}, r.before !== null && h('span.before', {}, `${r.before} →`), ' ', h('span.now', {}, r.now));
      if (r.better !== null) value.classList.add(r.better ? 'better' : 'worse');
      return h('div', {}, h('dt', {}, r.name), value);
    });
    return h('dl.chips', { 'aria-label': `${t.score.quantity}, ${t.score.rmse}` }, ...cells);
  }

  #notices({ notices }: RunReport): HTMLElement | null {
    if (notices.length === 0) return null;
    const at = (time: number): string => formatTime(this.#store.sinceStart(time));
    const said = notices.map((n) =>
      h('li', {}, n.count > 1 ? t.score.notice(n.text, n.count.toLocaleString('en'), at(n.first)) : t.score.oneNotice(n.text, at(n.first))),
    );
    return h('div.notices', {}, h('h4', {}, t.score.notices), h('ul', {}, ...said));
  }

  #numbers({ score, seconds, rows }: RunReport): HTMLElement {
    const details = h('details', { open: this.#isOpen }, h('summary', {}, t.score.allNumbers));
    details.addEventListener('toggle', () => {
      this.#isOpen = details.open;
    });
    details.append(...[this.#metricTable(score), this.#positionList(score), this.#modeTables(score)].filter((e) => e !== null));
    details.append(h('p.note', {}, t.score.seconds(`${formatSignificant(seconds, 2)} ${t.units.seconds}`, rows.toLocaleString('en'))));
    return details;
  }

  #metricTable(score: Score): HTMLElement | null {
    if (score.metrics.length === 0) return null;
    const display = this.#store.display.value;
    const head = ['', t.score.rmse, t.score.bias, t.score.max, t.score.correlation, t.score.coverage, t.score.nees];
    const rows = score.metrics.map((m) => {
      const error = (v: number): string => shownError(m.column, m.unit, v, display).text;
      const unit = shownError(m.column, m.unit, 0, display).unit.trim();
      const cells = [
        error(m.rmse),
        error(m.bias),
        error(m.max),
        formatFixed(m.correlation, 3),
        m.coverage === null ? '–' : `${formatFixed(100 * m.coverage, 1)} %`,
        formatSignificant(m.nees, 2),
      ];
      return h('tr', {}, h('th', { scope: 'row' }, words(m.column), unit ? ` [${unit}]` : ''), ...cells.map((c) => h('td', {}, c)));
    });
    return h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': t.score.allNumbers }, h('table.numbers', {}, h('thead', {}, h('tr', {}, ...head.map((c) => h('th', { scope: 'col' }, c || h('span.hidden', {}, t.score.quantity))))), h('tbody', {}, ...rows)));
  }

  #positionList({ position }: Score): HTMLElement | null {
    if (!position) return null;
    const pairs: [string, number | null][] = [
      [t.score.rmse, position.rmse_horizontal],
      [t.score.median, position.median],
      [t.score.p95, position.p95],
      [t.score.max, position.max],
      [t.score.last, position.last],
      [t.score.vertical, position.rmse_vertical],
    ];
    return h('dl.pairs', {}, ...pairs.flatMap(([name, value]) => [h('dt', {}, name), h('dd', {}, `${formatSignificant(value)} m`)]));
  }

  #modeTables({ mode }: Score): HTMLElement | null {
    if (!mode) return null;
    const confusion = mode.confusion.map((row, i) =>
      h('tr', {}, h('th', { scope: 'row' }, t.modes[i] ?? ''), ...row.map((n) => h('td', {}, n.toLocaleString('en')))),
    );
    const latencies = (['launch', 'stop', 'corner_entry', 'corner_exit'] as const).flatMap((kind) => [
      h('dt', {}, t.score[kind]),
      h('dd', {}, `${formatFixed(mode[kind].mean, 2)} s`),
    ]);
    return h(
      'div',
      {},
      h('p.note', {}, `${t.score.accuracyGuarded}: ${formatFixed(100 * (mode.accuracy_guarded ?? Number.NaN), 1)} %`),
      h('table.numbers', {}, h('caption', {}, t.score.confusion), h('thead', {}, h('tr', {}, h('td'), ...t.modes.map((m) => h('th', { scope: 'col' }, m)))), h('tbody', {}, ...confusion)),
      h('p.note', {}, t.score.latency),
      h('dl.pairs', {}, ...latencies),
    );
  }
}
