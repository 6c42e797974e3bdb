/** The decisions in what is shown, as a table that leads to each. */

import { h } from '../dom';
import { motion as say } from '../messages/motion';
import type { Signal } from '../signal';
import { perFrame } from '../signal';
import type { Store } from '../state';
import { formatTime } from '../units';
import { change, type Decision, decisionAt, figures } from './explain';

/** Rows at most. */
const MOST = 100;

export class DecisionTable {
  readonly element = h('div.decisions.scroll', { tabindex: '0', role: 'region', 'aria-label': say.decisions.title });
  #store: Store;
  #decisions: Signal<readonly Decision[]>;
  #rows = new Map<Decision, HTMLElement>();

  constructor(store: Store, decisions: Signal<readonly Decision[]>) {
    this.#store = store;
    this.#decisions = decisions;
    const show = perFrame(() => this.#show());
    const mark = perFrame(() => this.#mark());
    for (const signal of [store.window, store.display, decisions]) (signal as Signal<unknown>).on(show);
    store.cursor.on(mark);
    show();
  }

  #show(): void {
    const store = this.#store;
    const { t0, t1 } = store.window.value;
    const all = this.#decisions.value.filter((d) => d.time >= t0 && d.time <= t1);
    const shown = all.slice(0, MOST);
    this.#rows = new Map(shown.map((decision) => [decision, this.#row(decision)]));
    const { caption, time, change: what, rule, figures: numbers } = say.decisions;
    const head = [time, what, rule, numbers].map((name, i) => h(i === 0 ? 'th' : 'th.text', { scope: 'col' }, name));
    const table = h('table.numbers', {}, h('caption', {}, caption(shown.length, all.length)), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...this.#rows.values()));
    this.element.replaceChildren(all.length === 0 ? h('p.note', {}, say.decisions.none) : table);
    this.#mark();
  }

  #row(decision: Decision): HTMLElement {
    const at = formatTime(this.#store.sinceStart(decision.time), 2);
    const go = (): void => {
      this.#store.isPlaying.value = false;
      this.#store.moveCursor(decision.time);
      this.#store.follow();
    };
    const button = h('button.quiet', { type: 'button', 'aria-label': say.decisions.go(at), onclick: go }, at);
    const what = figures(decision, this.#store.display.value);
    return h('tr', {}, h('th', { scope: 'row' }, button), h('td.text', {}, h('span.mode-swatch', { 'data-mode': decision.to }), ' ', change(decision)), h('td.text', {}, say.rules[decision.rule] ?? ''), h('td.text', {}, what || say.decisions.noFigures));
  }

  #mark(): void {
    const list = this.#decisions.value;
    const now = list[decisionAt(list, this.#store.cursor.value)];
    for (const [decision, row] of this.#rows) row.toggleAttribute('data-now', decision === now);
  }
}
