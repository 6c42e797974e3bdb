/** The table of raw columns: what each measured, what it is read as, and why. */

import { h } from '../dom';
import { wizard as say } from '../messages/wizard';
import type { Signal } from '../signal';
import type { Examined, Mapping } from './door';
import { signalsOf } from './mapping';
import { Row } from './row';

export class ColumnTable {
  readonly element = h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': say.table });
  #body = h('tbody');
  #table = h('table.report-table.columns-table', {}, h('thead', {}, h('tr', {}, ...Object.values(say.head).map((text) => h('th', { scope: 'col' }, text)))), this.#body);
  #draft: Signal<Mapping | null>;
  #examined: Examined | null = null;
  /** Rows by column and signal; what one says stays true while these are the same. */
  #rows = new Map<string, Row>();

  constructor(draft: Signal<Mapping | null>) {
    this.#draft = draft;
    draft.on(() => this.#show());
  }

  show(examined: Examined | null): void {
    if (examined === this.#examined) return;
    this.#examined = examined;
    this.#rows.clear();
    this.#show();
  }

  #show(): void {
    const mapping = this.#draft.value;
    if (!mapping || !this.#examined) {
      this.#rows.clear();
      this.element.replaceChildren();
      return;
    }
    if (!this.#table.isConnected) this.element.replaceChildren(this.#table);
    const before = [...this.#body.children];
    const [column, index] = this.#focusedRow(before);
    const rows = this.#arranged(mapping, this.#examined);
    rows.forEach((row) => row.update());
    const elements = rows.map((row) => row.element);
    if (elements.length === before.length && elements.every((e, i) => e === before[i])) return;
    // Rows that stay are not taken out: a control that is being left would lose what it was about to do.
    for (const gone of before.filter((e) => !elements.includes(e as HTMLTableRowElement))) gone.remove();
    elements.forEach((e, i) => this.#body.children[i] !== e && this.#body.insertBefore(e, this.#body.children[i] ?? null));
    if (column === undefined || this.element.contains(document.activeElement)) return;
    const same = elements.filter((e) => e.dataset['column'] === column);
    (same[index] ?? same[0])?.querySelector<HTMLElement>('select.signal')?.focus();
  }

  /** The column of the row with the keyboard, and which of its rows that is. */
  #focusedRow(rows: Element[]): [string | undefined, number] {
    const row = rows.find((e) => e.contains(document.activeElement)) as HTMLElement | undefined;
    const column = row?.dataset['column'];
    return [column, rows.filter((e) => (e as HTMLElement).dataset['column'] === column).indexOf(row as Element)];
  }

  #arranged(mapping: Mapping, [found, pictures, choices]: Examined): Row[] {
    const shared = { draft: this.#draft, found, choices };
    const kept = this.#rows;
    this.#rows = new Map();
    return found.columns.flatMap((view, i) => {
      const signals: (string | null)[] = signalsOf(mapping, view.column);
      return (signals.length > 0 ? signals : [null]).map((signal, index) => {
        const key = JSON.stringify([view.column, signal, index]);
        const row = kept.get(key) ?? new Row(shared, view, signal, index, index === 0 ? pictures[i] : undefined);
        this.#rows.set(key, row);
        return row;
      });
    });
  }
}
