/** The view in which sensors are blinded: the brush, the drift in each window, and the sweep over the whole drive. */

import { h, iconButton } from '../dom';
import { t } from '../messages';
import { navigation as say } from '../messages/navigation';
import type { Session } from '../session';
import { isRunnable, type Span, type Store } from '../state';
import { History } from '../tuning';
import { formatTime } from '../units';
import { latest } from '../worker/rpc';
import { Brush } from './brush';
import { BASE, BLIND_COMPASS, BLINDED, COMPASS } from './curves';
import type { Blind, Drift, Sensor } from './door';
import { driftTable, type TableRow } from './drift-table';
import { FurtherRun } from './further';
import { SweepPanel } from './sweep';
import { parseTime, SENSORS, tidy, windowOf } from './windows';

/** Length of a window that is put in without being drawn, s. */
const USUAL = 60;
const CHANNELS: Record<Sensor, string> = { gnss: 'gnss', mag: 'magnetometer', odometer: 'wheels' };
/** The estimator that needs ranges of single satellites. */
const RECEIVER = 'gnss';

export class OutageView {
  readonly element: HTMLElement;
  readonly #store: Store;
  readonly #session: Session;
  readonly #brush: Brush;
  readonly #runs: Record<'place' | 'compass', FurtherRun>;
  readonly #sweep: SweepPanel;
  #history = new History<readonly Blind[]>([]);
  #windows: readonly Blind[] = [];
  #chosen: Blind | null = null;
  /** The drift in each window of which it is known; null where there is no estimate. */
  #drifts: ReadonlyMap<Blind, Drift | null> = new Map();
  #gaps: readonly Span[] = [];
  readonly #table = h('div.drift-table');
  readonly #note = h('p.note');
  readonly #undo = iconButton('undo', say.undo, () => this.#step('undo'));
  readonly #redo = iconButton('redo', say.redo, () => this.#step('redo'));
  readonly #clear = h('button.quiet', { type: 'button' }, say.clear);
  readonly #status = h('span.run-status', { role: 'status' });
  #release: (() => void) | null = null;
  readonly #measure: () => void;

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    this.#brush = new Brush(store);
    this.#runs = {
      place: new FurtherRun(store, session, BASE, 'blind', () => (this.#of('place').length > 0 ? { blind: this.#windows } : null)),
      compass: new FurtherRun(store, session, COMPASS, 'blind', () => (this.#of('compass').length > 0 ? { blind: this.#windows } : null)),
    };
    this.#sweep = new SweepPanel(store, session, (sensor) => this.#isThere(sensor), (window) => this.#apply([...this.#windows, window]));
    this.#clear.addEventListener('click', () => this.#apply([]));
    const title = say.outages;
    const header = h('header.view-header', {}, h('h2', { title: t.views.focus(title, '2') }, title), this.#status, h('span.spacer'), this.#undo, this.#redo, this.#clear);
    const intro = h('p.note.brush-note', {}, say.brushNote);
    const body = h('div.outage-body', {}, this.#addForm(), this.#table, this.#note, this.#sweep.element);
    this.element = h('section.view', { tabindex: '-1', 'aria-label': title, 'data-view': 'navigation-outages', 'data-key': '2' }, header, this.#brush.element, intro, body);
    this.#measure = latest(() => this.#loadDrifts());
    this.#brush.onChoose = (window) => {
      this.#chosen = window;
      this.#show();
    };
    this.#brush.onChange = (windows, isDone) => this.#brushed(windows, isDone);
    for (const run of Object.values(this.#runs)) {
      run.onResult = () => {
        this.#measure();
        this.#say();
      };
      store.run(run.name).on(() => this.#say());
    }
    store.report.on((_, before) => this.#opened(before?.name ?? null));
    store.display.on(() => this.#show());
    store.run(BASE).on((now, before) => {
      if (now.reply !== before.reply) this.#sweep.forget();
    });
    this.#show();
  }

  /** Stretches in which the receiver itself had nothing. */
  setGaps(gaps: readonly Span[]): void {
    this.#gaps = gaps;
    this.#show();
  }

  /** Windows that concern the position, or the compass. */
  #of(what: 'place' | 'compass'): readonly Blind[] {
    return this.#windows.filter((w) => (w.sensor === 'mag') === (what === 'compass'));
  }

  #isThere(sensor: Sensor): boolean {
    const report = this.#store.report.value;
    const estimator = sensor === 'mag' ? COMPASS : BASE;
    const isMeasured = report?.channels.some((c) => c.name === CHANNELS[sensor]) ?? false;
    return isRunnable(report, estimator) && (isMeasured || (sensor === 'gnss' && isRunnable(report, RECEIVER)));
  }

  #opened(before: string | null): void {
    const report = this.#store.report.value;
    if (!report || report.name !== before) {
      this.#windows = [];
      this.#history = new History<readonly Blind[]>([]);
      this.#store.blind.value = [];
    }
    this.#chosen = null;
    this.#drifts = new Map();
    this.#sweep.forget();
    this.#show();
  }

  /** Windows from the brush; while something is dragged, only a quick run follows. */
  #brushed(windows: readonly Blind[], isDone: boolean): void {
    if (isDone) {
      this.#apply(windows);
      return;
    }
    if (!this.#runs.place.isQuick) return;
    this.#windows = windows;
    this.#store.blind.value = windows;
    this.#runs.place.refresh();
  }

  /** Windows that someone has made. */
  #apply(windows: readonly Blind[]): void {
    const next = tidy(windows);
    this.#history.push(next);
    this.#set(next);
  }

  #step(way: 'undo' | 'redo'): void {
    if (this.#history[way]()) this.#set(this.#history.now);
  }

  #set(next: readonly Blind[]): void {
    this.#windows = next;
    this.#chosen = null;
    const needsCompass = this.#of('compass').length > 0;
    if (needsCompass && !this.#release) this.#release = this.#store.want([COMPASS]);
    else if (!needsCompass) {
      this.#release?.();
      this.#release = null;
    }
    this.#store.blind.value = next;
    this.#show();
    for (const run of Object.values(this.#runs)) run.refresh();
  }

  #show(): void {
    const rows = SENSORS.map((sensor) => ({ sensor, isThere: this.#isThere(sensor) }));
    this.#brush.set({ rows, windows: this.#windows, gaps: this.#gaps, chosen: this.#chosen });
    this.#undo.disabled = !this.#history.canUndo;
    this.#redo.disabled = !this.#history.canRedo;
    this.#clear.disabled = this.#windows.length === 0;
    this.#showTable();
    this.#say();
    this.#sweep.refresh();
  }

  #say(): void {
    const store = this.#store;
    const runs = Object.values(this.#runs).map((run) => store.run(run.name).value);
    const running = runs.find((run) => run.running);
    const error = runs.find((run) => run.error)?.error ?? '';
    this.#status.textContent = running ? say.blinding(Math.round(100 * (running.running?.fraction ?? 0))) : error;
  }

  #showTable(): void {
    const isEmpty = this.#windows.length === 0;
    const hasTruth = this.#store.report.value?.truth.includes('n') ?? false;
    this.#note.textContent = isEmpty ? '' : hasTruth ? say.table.note : say.table.noTruth;
    if (isEmpty) {
      this.#table.replaceChildren();
      return;
    }
    const rows = this.#windows.map((window): TableRow => ({ window, isKnown: this.#drifts.has(window), drift: this.#drifts.get(window) ?? null }));
    const focused = document.activeElement instanceof HTMLElement && this.#table.contains(document.activeElement) ? document.activeElement.dataset['field'] : undefined;
    const replace = (old: Blind, next: Blind[]): void => this.#apply(this.#windows.flatMap((w) => (w === old ? next : [w])));
    this.#table.replaceChildren(
      driftTable(this.#store, rows, {
        change: (window, t0, t1) => replace(window, [windowOf(window.sensor, t0, t1, this.#store.span.value)]),
        remove: (window) => replace(window, []),
      }),
    );
    if (focused) this.#table.querySelector<HTMLElement>(`[data-field="${focused}"]`)?.focus({ preventScroll: true });
  }

  async #loadDrifts(): Promise<void> {
    const store = this.#store;
    const known = new Map<Blind, Drift | null>();
    for (const [what, blinded, seeing] of [['place', BLINDED, BASE], ['compass', BLIND_COMPASS, COMPASS]] as const) {
      const own = this.#of(what);
      if (own.length === 0 || store.run(blinded).value.reply === null) continue;
      const drifts = await this.#session.rpc.call('drift', { blinded, seeing, windows: own });
      for (const window of own) known.set(window, drifts.find((d) => Math.abs(d.window[0] - window.t0) < 1e-6 && Math.abs(d.window[1] - window.t1) < 1e-6) ?? null);
    }
    this.#drifts = known;
    this.element.dataset['drifts'] = String([...known.values()].filter((drift) => drift !== null).length);
    this.#showTable();
  }

  /** Windows by keyboard and for exact times. */
  #addForm(): HTMLElement {
    const store = this.#store;
    const texts = say.add;
    const sensor = h('select', { 'aria-label': texts.sensor }, ...SENSORS.map((s) => h('option', { value: s }, say.rows[s])));
    const field = (label: string): HTMLInputElement => h('input.time-field', { type: 'text', inputmode: 'decimal', 'aria-label': label });
    const [from, to] = [field(texts.from), field(texts.to)];
    const propose = (): void => {
      const { t0, t1 } = store.span.value;
      // At its beginning the filter does not know yet where it is.
      const wanted = store.cursor.value < t0 + 0.1 * (t1 - t0) ? t0 + 0.3 * (t1 - t0) : store.cursor.value;
      const start = Math.min(Math.max(wanted, t0), Math.max(t0, t1 - USUAL));
      if (!isTyped) [from.value, to.value] = [formatTime(store.sinceStart(start)), formatTime(store.sinceStart(start + USUAL))];
    };
    let isTyped = false;
    for (const input of [from, to]) input.addEventListener('input', () => (isTyped = true));
    store.cursor.watch(propose);
    store.report.on(() => {
      isTyped = false;
      propose();
    });
    const form = h('form.add-window', {}, h('span', {}, texts.title), sensor, from, h('span', {}, texts.until), to, h('button', { type: 'submit' }, texts.add));
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      const start = store.span.value.t0;
      const [t0, t1] = [start + parseTime(from.value), start + parseTime(to.value)];
      const chosen = sensor.value as Sensor;
      const problem = !(t1 > t0) ? texts.badTimes : !this.#isThere(chosen) ? texts.notThere(say.rows[chosen]) : '';
      from.setCustomValidity(problem);
      if (problem !== '') {
        from.reportValidity();
        from.setCustomValidity('');
        return;
      }
      isTyped = false;
      this.#apply([...this.#windows, windowOf(chosen, t0, t1, store.span.value)]);
    });
    return form;
  }

  canvases(): HTMLCanvasElement[] {
    return [this.#brush.canvas(), ...this.#sweep.canvases()];
  }
}
