/** A view over time: lanes that share the window and the cursor, a table behind them, and what there is to say. */

import { h } from '../dom';
import { t } from '../messages';
import { axis } from '../plot/axis';
import type { Session } from '../session';
import { estimatorOf, isRunnable, type Store, trouble } from '../state';
import { latest } from '../worker/rpc';
import { type CurveSpec, estimatorsOf, type LaneSpec } from './curves';
import { Lane } from './lane';
import { type TableColumn, TablePanel } from './table';

export interface TimeViewOptions {
  title: string;
  /** The key that leads to it in its room, and its name in the page where that is another. */
  key: string;
  id?: string;
  lanes: LaneSpec[];
  /** Estimators that are not spoken of where they cannot run. */
  quiet?: readonly string[];
  /** Elements between title and buttons. */
  controls?: HTMLElement[];
}

export class TimeView {
  readonly element: HTMLElement;
  readonly lanes: Lane[];
  readonly body = h('div.view-body');
  protected readonly store: Store;
  protected readonly session: Session;
  readonly title: string;
  #note = h('p.view-note', { hidden: true });
  #table: TablePanel;
  #estimators: string[];
  #quiet: readonly string[];
  /** Ask for what is visible, once more if it changes meanwhile. */
  readonly refresh: () => void;
  readonly #readCursor: () => void;
  #lastProgress = 0;

  constructor(store: Store, session: Session, options: TimeViewOptions) {
    this.store = store;
    this.session = session;
    this.title = options.title;
    this.#estimators = estimatorsOf(options.lanes);
    this.#quiet = options.quiet ?? [];
    const last = options.lanes.length - 1;
    this.lanes = options.lanes.map((spec, i) => new Lane(store, spec, spec.hasTimeAxis ?? i === last));
    this.#table = new TablePanel(store, session, options.title, () => this.#tableColumns());
    const label = t.views.focus(options.title, options.key);
    const header = h('header.view-header', {}, h('h2', { title: label }, options.title), ...(options.controls ?? []), h('span.spacer'), this.#table.button);
    this.body.append(...this.lanes.map((l) => l.element), this.#note, this.#table.element);
    this.element = h('section.view', { tabindex: '-1', 'aria-label': options.title, 'data-view': options.id ?? options.key, 'data-key': options.key }, header, this.body);
    this.refresh = latest(() => this.#load());
    this.#readCursor = latest(() => this.#loadCursor());
    for (const lane of this.lanes) {
      lane.onToggle = () => this.changed();
      lane.onSize = () => {
        this.refresh();
        this.#readCursor();
      };
    }
    this.#follow();
  }

  #follow(): void {
    const { store } = this;
    store.window.on(this.refresh);
    store.cursor.on(this.#readCursor);
    store.display.on(this.#readCursor);
    store.report.on(() => this.changed());
    for (const name of this.#estimators) {
      store.run(name).on((now, before) => {
        if (now.reply !== before.reply || now.error !== before.error || now.isStopped !== before.isStopped) this.changed();
        else if (!now.reply && now.running) this.#progressed();
      });
    }
  }

  /** While the first result is being computed, draw what there is, a few times a second. */
  #progressed(): void {
    const now = performance.now();
    if (now - this.#lastProgress < 150) return;
    this.#lastProgress = now;
    this.changed();
  }

  /** What is there to be shown has changed. */
  changed(): void {
    for (const lane of this.lanes) lane.updateLegend();
    this.#updateNote();
    this.refresh();
    this.#readCursor();
    this.#table.refresh();
  }

  #updateNote(): void {
    const report = this.store.report.value;
    const titles = (name: string): string => this.store.catalogue.value?.estimators.find((e) => e.name === estimatorOf(name))?.title ?? name;
    const sentences = this.#estimators.flatMap((name) => {
      const { error, reply, running } = this.store.run(name).value;
      // A further run is there only if someone asked for it.
      const isFurther = estimatorOf(name) !== name;
      if (error) return [t.errors.runFailed(titles(name), error)];
      const worst = trouble(this.store.run(name).value);
      if (worst) return [t.views.trouble(titles(name), worst.text, worst.count.toLocaleString('en'))];
      if (isFurther || this.#quiet.includes(name) || reply || running || !report || isRunnable(report, name)) return [];
      const missing = report.estimators.find((e) => e.name === name)?.missing.filter((n) => n.required) ?? [];
      return [t.views.notRunnable(titles(name), missing.map((n) => n.label).join(', '))];
    });
    this.#note.textContent = sentences.join(' ');
    // Over the plots where they are empty, below them where there is something to see.
    this.#note.classList.toggle('below', this.#estimators.some((name) => this.store.run(name).value.reply));
    this.#note.hidden = sentences.length === 0;
  }

  /** A view in a room that is not entered asks for nothing; it does when it gets a size. */
  #isSeen(): boolean {
    return this.element.checkVisibility();
  }

  /** Further columns that a view needs on the same grid. */
  protected extraItems(): { source: string; column: string; step: boolean }[] {
    return [];
  }
  protected takeExtra(_times: Float64Array, _columns: Float64Array[]): void {}

  async #load(): Promise<void> {
    const report = this.store.report.value;
    if (!report || !this.#isSeen()) return;
    const { t0, t1 } = this.store.window.value;
    // Over distance a stretch of standing takes instants and no room.
    const buckets = Math.max(...this.lanes.map((l) => l.pixels), 50) * (axis.value.kind === 'time' ? 1 : 2);
    const perLane = this.lanes.map((lane) => lane.items());
    const extra = this.extraItems();
    const items = [...perLane.flat(), ...extra];
    const reply = await this.session.rpc.call('grid', { items, t0, t1, buckets });
    if (this.store.report.value !== report) return;
    let next = 0;
    this.lanes.forEach((lane, i) => {
      const own = perLane[i] ?? [];
      lane.take(reply, reply.columns.slice(next, next + own.length), own);
      next += own.length;
    });
    this.takeExtra(reply.times, reply.columns.slice(next));
    this.element.dataset['drawn'] = this.#estimators.filter((name) => this.store.run(name).value.reply).join(' ');
  }

  async #loadCursor(): Promise<void> {
    if (!this.store.report.value || !this.#isSeen()) return;
    const shown = this.lanes.map((lane) => lane.shown());
    const items = shown.flat().flatMap(({ curve, source }) => [
      { source, column: curve.column },
      { source, column: curve.sigma ?? '' },
    ]);
    const values = await this.session.rpc.call('values', { items, times: [this.store.cursor.value] });
    let next = 0;
    this.lanes.forEach((lane, i) => {
      const own = (shown[i] ?? []).map(({ curve }) => {
        const pair = { curve, value: values[next] ?? Number.NaN, sigma: values[next + 1] ?? Number.NaN };
        next += 2;
        return pair;
      });
      lane.showValues(own);
    });
  }

  /** Further columns of the table. */
  protected extraColumns(): TableColumn[] {
    return [];
  }

  #tableColumns(): TableColumn[] {
    const lanes = this.lanes.flatMap((lane) =>
      lane.shown().filter(({ curve }) => !curve.of).map(({ curve, source }) => ({
        source,
        column: curve.column,
        label: columnLabel(lane, curve),
        quantity: lane.spec.quantity,
        unit: lane.spec.unit,
      })),
    );
    return [...this.extraColumns(), ...lanes];
  }

  /** The canvases from top to bottom, for a picture. */
  canvases(): HTMLCanvasElement[] {
    return [...this.body.querySelectorAll('canvas')];
  }
}

function columnLabel(lane: Lane, curve: CurveSpec): string {
  return `${lane.spec.title}, ${curve.label}`;
}
