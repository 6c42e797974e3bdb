/** Decisions held against the truth or against labels: confusion and delays. */

import { h } from '../dom';
import type { Latency, ModeScore } from '../door';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import type { Session } from '../session';
import type { Store } from '../state';
import { formatFixed } from '../units';
import { latest } from '../worker/rpc';
import { ESTIMATOR } from './decisions';

type Reference = 'truth' | 'labels';

export class Against {
  readonly element = h('div.against');
  #store: Store;
  #session: Session;
  #chosen: Reference = 'truth';
  readonly #refresh = latest(() => this.#load());

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    store.run(ESTIMATOR).on((now, before) => {
      if (now.reply !== before.reply) this.#refresh();
    });
    store.labels.on((now, before) => {
      // What has just been painted is what one wants to see.
      if (now.length > 0 && before.length === 0) this.#chosen = 'labels';
      this.#refresh();
    });
    this.#refresh();
  }

  async #load(): Promise<void> {
    const store = this.#store;
    const { reply } = store.run(ESTIMATOR).value;
    const labels = store.labels.value;
    const truth = reply?.current.score.mode ?? null;
    const there: Reference[] = [...(truth ? ['truth' as const] : []), ...(labels.length > 0 ? ['labels' as const] : [])];
    const reference = there.includes(this.#chosen) ? this.#chosen : there[0];
    if (!reply || !reference) {
      this.element.replaceChildren(h('p.note', {}, reply ? say.against.none : say.explain.none));
      return;
    }
    const score = reference === 'truth' ? truth : await this.#session.rpc.call('labels_score', { source: `${ESTIMATOR}:current`, labels });
    this.element.replaceChildren(this.#choice(there, reference), ...(score ? tables(score) : [h('p.note', {}, say.against.notYet)]));
  }

  #choice(there: Reference[], chosen: Reference): HTMLElement {
    if (there.length < 2) return h('p.held', {}, `${say.against.hold} ${say.against[chosen]}.`);
    const select = h('select', {}, ...there.map((name) => h('option', { value: name, selected: name === chosen }, say.against[name])));
    select.addEventListener('change', () => {
      this.#chosen = select.value === 'labels' ? 'labels' : 'truth';
      this.#refresh();
    });
    return h('label.held', {}, say.against.hold, ' ', select);
  }
}

function tables(score: ModeScore): HTMLElement[] {
  const percent = (share: number | null): string => formatFixed(share === null ? null : 100 * share, 1);
  return [
    h('p', {}, say.against.accuracy(percent(score.accuracy), percent(score.accuracy_guarded))),
    h('div.pair', {}, confusion(score), delays(score)),
  ];
}

function confusion({ confusion: rows }: ModeScore): HTMLElement {
  const body = rows.map((row, i) => {
    const total = row.reduce((sum, n) => sum + n, 0);
    const cells = row.map((n, k) => {
      const cell = h('td', { 'data-right': i === k ? true : undefined }, n.toLocaleString('en'));
      cell.style.setProperty('--share', total > 0 ? `${((100 * n) / total).toFixed(1)}%` : '0%');
      return cell;
    });
    const share = total > 0 ? `${formatFixed((100 * (row[i] ?? 0)) / total, 1)} %` : '–';
    return h('tr', {}, h('th', { scope: 'row' }, t.modes[i] ?? ''), ...cells, h('td', {}, share));
  });
  const head = [say.against.trueMode, ...t.modes, say.against.share].map((name) => h('th', { scope: 'col' }, name));
  return h('table.numbers.confusion', {}, h('caption', {}, say.against.confusion), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...body));
}

function delays(score: ModeScore): HTMLElement {
  const row = (name: string, { mean, max, count, missed }: Latency): HTMLElement =>
    h('tr', {}, h('th', { scope: 'row' }, name), h('td', {}, formatFixed(mean, 2)), h('td', {}, formatFixed(max, 2)), h('td', {}, String(count)), h('td', { class: missed > 0 ? 'bad' : undefined }, String(missed)));
  const kinds = ['launch', 'stop', 'corner_entry', 'corner_exit'] as const;
  const { kind, mean, max, count, missed } = say.against;
  const head = [kind, mean, max, count, missed].map((name) => h('th', { scope: 'col' }, name));
  return h('table.numbers', {}, h('caption', {}, say.against.latency), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...kinds.map((k) => row(t.score[k], score[k]))));
}
