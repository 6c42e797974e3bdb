/** The trajectory seen from above, with the car at the cursor. */

import { h, iconButton } from '../dom';
import { t } from '../messages';
import { type Layers, MapPlot, outagesOf, type Path } from '../plot/map';
import type { Session } from '../session';
import { isRunnable, type Store } from '../state';
import { formatFixed } from '../units';
import { latest } from '../worker/rpc';
import { modeKey } from './mode';
import { type TableColumn, TablePanel } from './table';

const NAVIGATION = 'gnss_ins';
const MODES = 'motion_mode';
/** Points of a path that are drawn; more could not be told apart. */
const POINTS = 6000;
/** Fixes asked for: enough that an hour at 5 Hz is not thinned and an outage is one. */
const FIXES = 20_000;
const NOTHING: Path = new Float64Array();

type LayerName = keyof Layers['isShown'];

export class TrajectoryView {
  readonly element: HTMLElement;
  readonly #store: Store;
  readonly #session: Session;
  #map: MapPlot;
  #host = h('div.map', { role: 'img', 'aria-label': t.views.mapLabel });
  #note = h('p.view-note', { hidden: true });
  #readout = h('p.map-readout');
  #layers: Layers;
  #buttons = new Map<LayerName, HTMLButtonElement>();
  #touches = new Map<number, { x: number; y: number }>();
  #table: TablePanel;
  /** Stretches without fixes, for other views. */
  onOutages: (outages: Layers['outages']) => void = () => {};

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    this.#layers = {
      estimate: NOTHING,
      previous: NOTHING,
      truth: NOTHING,
      fixes: NOTHING,
      outages: [],
      window: store.window.value,
      isShown: { estimate: true, previous: true, truth: true, fixes: true },
    };
    this.#table = new TablePanel(store, session, t.views.trajectory, () => this.#tableColumns());
    const legend = h(
      'div.legend',
      {},
      this.#toggle('estimate', t.curves.path, 'estimate', false),
      ...t.modes.map((name, mode) => modeKey(name, mode)),
      this.#toggle('previous', t.curves.ghost, 'ghost', true),
      this.#toggle('truth', t.curves.truth, 'truth', false),
      this.#toggle('fixes', t.curves.fixes, 'raw', false),
    );
    const fit = iconButton('fit', t.views.fit, () => this.#map.fit());
    const header = h('header.view-header', {}, h('h2', { title: t.views.focus(t.views.trajectory, '4') }, t.views.trajectory), h('span.spacer'), fit, this.#table.button);
    this.#host.append(this.#readout, this.#note);
    this.element = h('section.view.trajectory', { tabindex: '-1', 'aria-label': t.views.trajectory, 'data-view': '4', 'data-key': '4' }, header, legend, h('div.view-body', {}, this.#host, this.#table.element));
    this.#map = new MapPlot(this.#host);
    this.#listen();
    this.#follow();
    store.want([NAVIGATION, MODES]);
  }

  #toggle(name: LayerName, label: string, colour: string, isDashed: boolean): HTMLButtonElement {
    const swatch = h('span.swatch', { 'data-colour': colour, 'data-dashed': isDashed || undefined });
    const button = h('button.legend-entry', { type: 'button', 'aria-pressed': 'true', title: t.curves.show(label) }, swatch, label);
    button.addEventListener('click', () => {
      const isShown = !this.#layers.isShown[name];
      button.setAttribute('aria-pressed', String(isShown));
      this.#update({ isShown: { ...this.#layers.isShown, [name]: isShown } });
    });
    this.#buttons.set(name, button);
    return button;
  }

  #update(patch: Partial<Layers>): void {
    this.#layers = { ...this.#layers, ...patch };
    for (const [name, button] of this.#buttons) button.hidden = this.#layers[name].length === 0;
    this.#map.setLayers(this.#layers);
    const { estimate, truth, fixes } = this.#layers;
    const isEmpty = estimate.length + truth.length + fixes.length === 0;
    this.#note.textContent = this.#why(isEmpty);
    this.#note.hidden = this.#note.textContent === '';
  }

  /** Why there is no estimated path. */
  #why(isEmpty: boolean): string {
    const report = this.#store.report.value;
    const { error, running, reply } = this.#store.run(NAVIGATION).value;
    const title = this.#store.catalogue.value?.estimators.find((e) => e.name === NAVIGATION)?.title ?? NAVIGATION;
    if (error) return t.errors.runFailed(title, error);
    if (!report || running || reply || isRunnable(report, NAVIGATION)) return '';
    const missing = report.estimators.find((e) => e.name === NAVIGATION)?.missing.filter((n) => n.required) ?? [];
    const cannot = t.views.notRunnable(title, missing.map((n) => n.label).join(', '));
    return isEmpty ? `${t.views.noPosition} ${cannot}` : cannot;
  }

  #follow(): void {
    const { rpc } = this.#session;
    const store = this.#store;
    const path = (source: string, points = POINTS): Promise<Path> => {
      const { t0, t1 } = store.span.value;
      return rpc.call('path', { source, t0, t1, points });
    };
    const loadDrive = latest(async () => {
      const [truth, fixes] = await Promise.all([path('truth'), path('drive', FIXES)]);
      const outages = outagesOf(fixes, store.span.value);
      this.#update({ truth, fixes, outages });
      this.onOutages(outages);
    });
    const loadRuns = latest(async () => {
      const { reply, running } = store.run(NAVIGATION).value;
      const source = reply ? 'current' : running ? 'running' : null;
      const [estimate, previous] = await Promise.all([
        source ? path(`${NAVIGATION}:${source}`) : NOTHING,
        reply?.previous ? path(`${NAVIGATION}:previous`) : NOTHING,
      ]);
      this.#update({ estimate, previous });
      this.#table.refresh();
      this.element.dataset['drawn'] = reply ? NAVIGATION : '';
      loadCar();
    });
    const loadCar = latest(() => this.#loadCar());
    store.report.on(() => {
      this.#map.fit();
      this.#update({ estimate: NOTHING, previous: NOTHING, truth: NOTHING, fixes: NOTHING, outages: [] });
      loadDrive();
      loadCar();
    });
    let last = 0;
    store.run(NAVIGATION).on((now, before) => {
      const isNews = now.reply !== before.reply || now.error !== before.error;
      if (!isNews && (now.reply || performance.now() - last < 200)) return;
      last = performance.now();
      loadRuns();
    });
    store.run(MODES).on((now, before) => {
      if (now.reply !== before.reply) loadRuns();
    });
    store.cursor.on(loadCar);
    store.window.on((window) => this.#update({ window }));
  }

  async #loadCar(): Promise<void> {
    const store = this.#store;
    const { reply, running } = store.run(NAVIGATION).value;
    const navigation = `${NAVIGATION}:${reply ? 'current' : running ? 'running' : 'none'}`;
    const items = [
      ...['north', 'east', 'yaw', 'north_sigma', 'east_sigma'].map((column) => ({ source: navigation, column })),
      { source: 'orientation:current', column: 'yaw' },
      { source: 'truth', column: 'yaw' },
    ];
    const values = await this.#session.rpc.call('values', { items, times: [store.cursor.value] });
    let [north, east] = [values[0] ?? Number.NaN, values[1] ?? Number.NaN];
    const yaw = [values[2], values[5], values[6]].find((v) => v !== undefined && Number.isFinite(v)) ?? Number.NaN;
    const sigma = Math.max(values[3] ?? Number.NaN, values[4] ?? Number.NaN);
    if (!Number.isFinite(north)) [north, east] = this.#nearest(store.cursor.value);
    const isKnown = Number.isFinite(north) && Number.isFinite(east);
    this.#map.setCar(isKnown ? { north, east, yaw, sigma } : null);
    const words = isKnown ? [t.map.readout(formatFixed(north, 1), formatFixed(east, 1))] : [];
    if (Number.isFinite(sigma)) words.push(t.map.sigma(formatFixed(3 * sigma, 1)));
    this.#readout.textContent = words.join('  ');
  }

  /** The place nearest in time on the truth, or of the fixes, for a log without an estimate. */
  #nearest(time: number): [number, number] {
    const path = this.#layers.truth.length > 0 ? this.#layers.truth : this.#layers.fixes;
    let best: [number, number] = [Number.NaN, Number.NaN];
    for (let i = 0; i < path.length && (path[i] as number) <= time; i += 5) best = [path[i + 1] as number, path[i + 2] as number];
    return best;
  }

  #listen(): void {
    const host = this.#map.canvas;
    const place = (event: PointerEvent | WheelEvent): [number, number] => {
      const box = host.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    let moved = 0;
    host.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.#map.zoom(Math.exp(-Math.max(-200, Math.min(200, event.deltaY)) * 0.002), ...place(event));
    }, { passive: false });
    host.addEventListener('pointerdown', (event) => {
      host.setPointerCapture(event.pointerId);
      this.#touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
      moved = 0;
    });
    host.addEventListener('pointermove', (event) => {
      const touch = this.#touches.get(event.pointerId);
      if (!touch) return;
      const [dx, dy] = [event.clientX - touch.x, event.clientY - touch.y];
      const other = [...this.#touches.entries()].find(([id]) => id !== event.pointerId)?.[1];
      if (other) {
        const before = Math.hypot(touch.x - other.x, touch.y - other.y);
        const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
        if (before > 12 && after > 12) this.#map.zoom(after / before, ...place(event));
        this.#map.pan(dx / 2, dy / 2);
      } else this.#map.pan(dx, dy);
      moved += Math.abs(dx) + Math.abs(dy);
      this.#touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    const end = (event: PointerEvent): void => {
      if (this.#touches.delete(event.pointerId) && moved < 4 && event.type === 'pointerup') {
        const time = this.#map.timeAt(...place(event));
        if (time !== null) this.#store.moveCursor(time);
      }
    };
    host.addEventListener('pointerup', end);
    host.addEventListener('pointercancel', end);
    host.addEventListener('dblclick', () => this.#map.fit());
  }

  zoom(factor: number): void {
    this.#map.zoom(factor);
  }

  fit(): void {
    this.#map.fit();
  }

  get canvas(): HTMLCanvasElement {
    return this.#map.canvas;
  }

  #tableColumns(): TableColumn[] {
    const metre = { quantity: 'plain' as const, unit: 'm' };
    const columns = (source: string, label: string, north: string, east: string): TableColumn[] => [
      { source, column: north, label: `${label}, ${t.map.northColumn}`, ...metre },
      { source, column: east, label: `${label}, ${t.map.eastColumn}`, ...metre },
    ];
    const { reply } = this.#store.run(NAVIGATION).value;
    const truth = this.#store.report.value?.truth ?? [];
    return [
      ...(reply ? columns(`${NAVIGATION}:current`, t.curves.path, 'north', 'east') : []),
      ...(reply ? [{ source: `${MODES}:current`, column: 'mode', label: t.lanes.mode, quantity: 'plain' as const, unit: '1' }] : []),
      ...(truth.includes('n') ? columns('truth', t.curves.truth, 'n', 'e') : []),
    ];
  }
}
