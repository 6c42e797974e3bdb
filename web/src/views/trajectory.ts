/** The trajectory seen from above, with the car at the cursor. */

import { h, iconButton } from '../dom';
import { t } from '../messages';
import { ellipseOf, type Ellipse } from '../plot/ellipse';
import { type Layers, MapPlot, outagesOf, type Path } from '../plot/map';
import type { Session } from '../session';
import { isRunnable, type Store } from '../state';
import { formatFixed } from '../units';
import { latest } from '../worker/rpc';
import { modeKey } from './mode';
import { type TableColumn, TablePanel } from './table';

const NAVIGATION = 'gnss_ins';
const MODES = 'motion_mode';
/** Further runs that a room may ask for. */
const SMOOTHED = `${NAVIGATION}@smooth`;
const BLINDED = `${NAVIGATION}@blind`;
/** Instants of a window at which the ellipse of the errors is looked up; the map draws those that can be told apart. */
const ELLIPSES = 500;
/** Points of a path that are drawn; more could not be told apart. */
const POINTS = 6000;
/** Fixes asked for: enough that an hour at 5 Hz is not thinned and an outage is one. */
const FIXES = 20_000;
const NOTHING: Path = new Float64Array();

/** Numbers of each point of a path. */
const FIELDS = 5;
/** What an ellipse is made of. */
const PLACE = ['north', 'east', 'north_sigma', 'east_sigma', 'north_east_correlation'];

function ellipseAt(values: Float64Array): Ellipse | null {
  const [north, east, sigmaNorth, sigmaEast, correlation] = values;
  return ellipseOf(north ?? Number.NaN, east ?? Number.NaN, sigmaNorth ?? Number.NaN, sigmaEast ?? Number.NaN, correlation ?? Number.NaN);
}

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
      smoothed: NOTHING,
      blinded: NOTHING,
      blind: store.blind.value,
      rejected: NOTHING,
      ellipses: [],
      outages: [],
      window: store.window.value,
      isShown: { estimate: true, previous: true, truth: true, fixes: true, smoothed: true, blinded: true, rejected: true, ellipses: true },
    };
    this.#table = new TablePanel(store, session, t.views.trajectory, () => this.#tableColumns());
    const legend = h(
      'div.legend',
      {},
      this.#toggle('estimate', t.curves.path, 'estimate', false),
      ...t.modes.map((name, mode) => modeKey(name, mode)),
      this.#toggle('previous', t.curves.ghost, 'ghost', true),
      this.#toggle('truth', t.curves.truth, 'truth', false),
      this.#toggle('smoothed', t.map.smoothed, 'second', false),
      this.#toggle('blinded', t.map.blinded, 'blind', false),
      this.#toggle('fixes', t.curves.fixes, 'raw', false, 'dots'),
      this.#toggle('rejected', t.map.rejected, 'bad', false, 'cross'),
      this.#toggle('ellipses', t.map.ellipses, 'estimate', false, 'band'),
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

  #toggle(name: LayerName, label: string, colour: string, isDashed: boolean, shape: 'line' | 'band' | 'cross' | 'dots' = 'line'): HTMLButtonElement {
    const swatch = h(`span.swatch.${shape}`, { 'data-colour': colour, 'data-dashed': isDashed || undefined });
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
      loadErrors();
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
      loadErrors();
      loadCar();
    });
    const loadErrors = latest(() => this.#loadErrors());
    for (const [run, layer] of [[SMOOTHED, 'smoothed'], [BLINDED, 'blinded']] as const) {
      const load = latest(async () => {
        const isThere = store.run(run).value.reply !== null;
        this.#update({ [layer]: isThere ? await path(`${run}:current`) : NOTHING });
      });
      store.run(run).on((now, before) => {
        if (now.reply !== before.reply) load();
      });
    }
    const loadCar = latest(() => this.#loadCar());
    store.report.on(() => {
      this.#map.fit();
      this.#update({ estimate: NOTHING, previous: NOTHING, truth: NOTHING, fixes: NOTHING, rejected: NOTHING, ellipses: [], outages: [] });
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
    store.window.on((window) => {
      this.#update({ window });
      loadErrors();
    });
    store.faults.on(loadDrive);
    store.blind.on((blind) => this.#update({ blind }));
  }

  /** How sure the filter is along what is shown, and which fixes it refused. */
  async #loadErrors(): Promise<void> {
    const { rpc } = this.#session;
    const source = `${NAVIGATION}:current`;
    if (!this.#store.run(NAVIGATION).value.reply) {
      this.#update({ ellipses: [], rejected: NOTHING });
      return;
    }
    const { t0, t1 } = this.#store.window.value;
    const times = Array.from({ length: ELLIPSES }, (_, i) => t0 + ((i + 0.5) / ELLIPSES) * (t1 - t0));
    const { fixes } = this.#layers;
    const fixTimes = Array.from({ length: fixes.length / FIELDS }, (_, i) => fixes[i * FIELDS] as number);
    const [errors, accepted] = await Promise.all([
      rpc.call('values', { items: PLACE.map((column) => ({ source, column })), times }),
      rpc.call('values', { items: [{ source, column: 'position_accepted' }], times: fixTimes }),
    ]);
    const ellipses = times.flatMap((_, i) => ellipseAt(errors.subarray(i * PLACE.length, (i + 1) * PLACE.length)) ?? []);
    const refused = fixTimes.flatMap((_, i) => (accepted[i] === 0 ? [...fixes.subarray(i * FIELDS, (i + 1) * FIELDS)] : []));
    this.#update({ ellipses, rejected: Float64Array.from(refused) });
    this.element.dataset['rejected'] = String(refused.length / FIELDS);
  }

  async #loadCar(): Promise<void> {
    const store = this.#store;
    const { reply, running } = store.run(NAVIGATION).value;
    const navigation = `${NAVIGATION}:${reply ? 'current' : running ? 'running' : 'none'}`;
    const items = [
      ...[...PLACE, 'yaw'].map((column) => ({ source: navigation, column })),
      { source: 'orientation:current', column: 'yaw' },
      { source: 'truth', column: 'yaw' },
    ];
    const values = await this.#session.rpc.call('values', { items, times: [store.cursor.value] });
    let [north, east] = [values[0] ?? Number.NaN, values[1] ?? Number.NaN];
    const yaw = [...values.subarray(PLACE.length)].find((v) => v !== undefined && Number.isFinite(v)) ?? Number.NaN;
    const ellipse = ellipseAt(values);
    if (!Number.isFinite(north)) [north, east] = this.#nearest(store.cursor.value);
    const isKnown = Number.isFinite(north) && Number.isFinite(east);
    this.#map.setCar(isKnown ? { north, east, yaw, ellipse } : null);
    const words = isKnown ? [t.map.readout(formatFixed(north, 1), formatFixed(east, 1))] : [];
    if (isKnown && ellipse) words.push(t.map.sigma(formatFixed(ellipse.long, 1)));
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
      ...(this.#layers.smoothed.length > 0 ? columns(`${SMOOTHED}:current`, t.map.smoothed, 'north', 'east') : []),
      ...(this.#layers.blinded.length > 0 ? columns(`${BLINDED}:current`, t.map.blinded, 'north', 'east') : []),
      ...(reply ? [{ source: `${MODES}:current`, column: 'mode', label: t.lanes.mode, quantity: 'plain' as const, unit: '1' }] : []),
      ...(truth.includes('n') ? columns('truth', t.curves.truth, 'n', 'e') : []),
    ];
  }
}
