/** The numbers behind a plot, for those who cannot or do not want to look at curves. */

import { h, icon } from '../dom';
import { t } from '../messages';
import { axis, timeAt } from '../plot/axis';
import type { Session } from '../session';
import type { Store } from '../state';
import { axisSign, convert, digitsOf, formatFixed, formatSignificant, formatTime, type Quantity, unitLabel } from '../units';
import { latest } from '../worker/rpc';

export interface TableColumn {
  source: string;
  column: string;
  label: string;
  quantity: Quantity;
  unit: string;
}

/** Rows of a table. */
const ROWS = 100;

export class TablePanel {
  readonly element = h('div.table-panel', { hidden: true, tabindex: '0', role: 'region' });
  readonly button: HTMLButtonElement;
  readonly refresh: () => void;
  #columns: () => TableColumn[];
  #store: Store;
  #session: Session;
  #title: string;

  constructor(store: Store, session: Session, title: string, columns: () => TableColumn[]) {
    this.#store = store;
    this.#session = session;
    this.#title = title;
    this.#columns = columns;
    this.element.setAttribute('aria-label', t.views.tableOf(title));
    this.button = h('button.icon-button', { type: 'button', 'aria-expanded': 'false' }, icon('table'));
    this.button.addEventListener('click', () => this.toggle());
    this.#label();
    const load = latest(() => this.#load());
    this.refresh = () => {
      if (!this.element.hidden) load();
    };
    store.window.on(this.refresh);
    store.display.on(this.refresh);
    axis.on(this.refresh);
  }

  toggle(): void {
    this.element.hidden = !this.element.hidden;
    this.button.setAttribute('aria-expanded', String(!this.element.hidden));
    this.#label();
    this.refresh();
  }

  #label(): void {
    const label = `${this.#title}: ${this.element.hidden ? t.views.showTable : t.views.hideTable}`;
    this.button.title = label;
    this.button.setAttribute('aria-label', label);
  }

  async #load(): Promise<void> {
    const columns = this.#columns();
    // All columns at the same instants, whatever rates their sources have.
    const times = Array.from({ length: ROWS }, (_, i) => timeAt((i + 0.5) / ROWS, this.#store.window.value));
    const items = columns.map(({ source, column }) => ({ source, column }));
    const flat = await this.#session.rpc.call('values', { items, times });
    const values = times.map((_, i) => flat.subarray(i * items.length, (i + 1) * items.length));
    this.element.replaceChildren(this.#table(columns, times, values));
  }

  #table(columns: TableColumn[], times: number[], rows: Float64Array[]): HTMLTableElement {
    const display = this.#store.display.value;
    const { t0, t1 } = this.#store.window.value;
    const head = columns.map((c) => {
      const unit = unitLabel(c.quantity, c.unit, display);
      return h('th', { scope: 'col' }, c.label, unit ? ` [${unit}]` : '');
    });
    const cell = (c: TableColumn, value: number): string => {
      if (c.column === 'mode') return t.modes[value] ?? '–';
      const shown = convert(c.quantity, axisSign(c.column, display) * value, display);
      return c.quantity === 'plain' ? formatSignificant(shown, 4) : formatFixed(shown, digitsOf(c.quantity, display));
    };
    const digits = t1 - t0 > 100 ? 1 : 3;
    const way = axis.value.kind === 'distance' ? axis.value : null;
    const wayHead = way ? [h('th', { scope: 'col' }, `${t.axis.column} [m]`)] : [];
    const wayCell = (time: number): HTMLElement[] => (way ? [h('td', {}, formatFixed(way.place(time), 1))] : []);
    const body = rows.map((row, i) =>
      h('tr', {}, h('th', { scope: 'row' }, formatTime(this.#store.sinceStart(times[i] ?? 0), digits)), ...wayCell(times[i] ?? 0), ...columns.map((c, k) => h('td', {}, cell(c, row[k] ?? Number.NaN)))),
    );
    return h(
      'table',
      {},
      h('caption', {}, t.views.tableCaption(this.#title, formatTime(this.#store.sinceStart(t0)), formatTime(this.#store.sinceStart(t1)), rows.length)),
      h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, t.units.time), ...wayHead, ...head)),
      h('tbody', {}, ...body),
    );
  }
}
