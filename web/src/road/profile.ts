/** The road's profile: grade and altitude against distance, merged from every pass over it, to be looked at and saved. */

import { h, icon, onResize, save } from '../dom';
import { t } from '../messages';
import { road as say } from '../messages/road';
import { LEFT, RIGHT } from '../plot/axes';
import { type Axis, distanceAxis, timeAxis } from '../plot/axis';
import { band, withGaps } from '../plot/gaps';
import { TimeArea } from '../plot/time-area';
import { TimePlot } from '../plot/time-plot';
import type { Session } from '../session';
import { Signal } from '../signal';
import type { Store } from '../state';
import { convert, convertDifference, formatDistance, unitLabel } from '../units';
import { drivenBy } from '../views/axis-switch';
import { STYLES } from '../views/curves';
import { latest } from '../worker/rpc';
import type { ProfileReport } from './door';
import { profileTable } from './profile-table';

const SOURCE = 'road:profile';
/** The two plots: column, quantity, unit and least height of the axis, SI. */
const LANES = [
  { column: 'grade', quantity: 'grade', unit: 'rad', least: 0.02, hasTruth: true },
  { column: 'altitude', quantity: 'plain', unit: 'm', least: 5, hasTruth: false },
] as const;

/** What the passes of the open drive are called. */
function passName(store: Store): string {
  const { value } = store.builtIn;
  const name = store.report.value?.name ?? '';
  return value ? t.drives.withSeed(name, value.seed === null ? t.drives.ownSeed : String(value.seed)) : name;
}

interface ProfileLane {
  plot: TimePlot;
  host: HTMLElement;
  unit: HTMLElement;
}

export class ProfileView {
  readonly element: HTMLElement;
  #store: Store;
  #session: Session;
  #axis = new Signal<Axis>(timeAxis(0));
  #lanes: ProfileLane[] = [];
  #body = h('div.view-body');
  #table = h('div.table-panel', { hidden: true, tabindex: '0', role: 'region', 'aria-label': t.views.tableOf(say.profile.title) });
  #note = h('p.profile-note', { 'aria-live': 'polite' });
  #keep: HTMLButtonElement;
  #forget: HTMLButtonElement;
  #files: HTMLButtonElement[];
  #report: ProfileReport | null = null;
  /** The result that the profile was made from. */
  #of: unknown = null;
  readonly refresh = latest(() => this.#load());

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const p = say.profile;
    const button = (label: string, title: string, action: () => Promise<void>): HTMLButtonElement =>
      h('button', { type: 'button', title, onclick: () => void action().catch((reason: unknown) => this.#tell(reason)) }, label);
    this.#keep = button(p.keep, p.keepTitle, () => this.#change('keep'));
    this.#forget = button(p.forget, p.forgetTitle, () => this.#change('forget'));
    this.#files = [button(p.csv, p.csvTitle, () => this.#save(false)), button(p.map, p.mapTitle, () => this.#save(true))];
    const label = t.views.focus(p.title, '5');
    const header = h('header.view-header', {}, h('h2', { title: label }, p.title), h('span.spacer'), this.#keep, this.#forget, ...this.#files, this.#tableButton());
    LANES.forEach((_, i) => this.#lane(i));
    this.#body.append(this.#table);
    this.element = h('section.view', { tabindex: '-1', 'aria-label': p.title, 'data-view': 'road-profile', 'data-key': '5' }, header, this.#note, this.#body);
    store.window.on(() => {
      this.#setWindow();
      this.refresh();
    });
    store.display.on(this.refresh);
    store.report.on(this.refresh);
    store.run('slope').on((now, before) => {
      if (now.reply !== before.reply) this.refresh();
    });
  }

  #tell(reason: unknown): void {
    this.#store.error.value = reason instanceof Error ? reason.message : String(reason);
  }

  #lane(index: number): void {
    const { column, hasTruth } = LANES[index] as (typeof LANES)[number];
    const unit = h('span.lane-unit');
    const key = (colour: string, label: string): HTMLElement => h('span.road-key', {}, h('span.swatch', { 'data-colour': colour }), label);
    const legend = h('div.legend', {}, h('h3.lane-title', {}, say.profile.lanes[column]), unit, key('estimate', say.profile.merged), ...(hasTruth ? [key('truth', t.curves.truth)] : []));
    const host = h('div.plot', { role: 'img' });
    const isLast = index === LANES.length - 1;
    this.#body.append(h(`div.lane${isLast ? '.with-time-axis' : ''}`, {}, legend, host));
    const plot = new TimePlot(host, { styles: [STYLES.truth, STYLES.estimate], isLog: false, hasTimeAxis: isLast, axis: this.#axis });
    host.append(new TimeArea(this.#store, this.#axis).element);
    onResize(host, (width, height) => {
      if (width === 0) return;
      plot.setSize(width, height);
      this.refresh();
    });
    this.#lanes.push({ plot, host, unit });
  }

  #tableButton(): HTMLButtonElement {
    const button = h('button.icon-button', { type: 'button', 'aria-expanded': 'false' }, icon('table'));
    const name = (): void => {
      const label = `${say.profile.title}: ${this.#table.hidden ? t.views.showTable : t.views.hideTable}`;
      button.title = label;
      button.setAttribute('aria-label', label);
      button.setAttribute('aria-expanded', String(!this.#table.hidden));
    };
    button.addEventListener('click', () => {
      this.#table.hidden = !this.#table.hidden;
      name();
      this.refresh();
    });
    name();
    return button;
  }

  async #change(what: 'keep' | 'forget'): Promise<void> {
    const { rpc } = this.#session;
    await (what === 'keep' ? rpc.call('keep_pass', { name: passName(this.#store) }) : rpc.call('forget_passes', {}));
    this.#of = null;
    this.refresh();
  }

  async #save(isMap: boolean): Promise<void> {
    const bytes = await this.#session.rpc.call('profile_file', { isMap });
    const name = `${(this.#store.report.value?.name ?? 'road').replace(/\.[^.]*$/, '').replace(/[^\w.-]+/g, '_')}_profile`;
    if (isMap) save(`${name}.geojson`, bytes as Uint8Array<ArrayBuffer>, 'application/geo+json');
    else save(`${name}.csv`, bytes as Uint8Array<ArrayBuffer>, 'text/csv');
  }

  #setWindow(): void {
    const { t0, t1 } = this.#store.window.value;
    const start = this.#store.span.value.t0;
    for (const { plot } of this.#lanes) plot.setWindow(t0 - start, t1 - start);
  }

  async #load(): Promise<void> {
    const store = this.#store;
    if (!store.report.value || !this.element.checkVisibility()) return;
    const { reply } = store.run('slope').value;
    if (reply !== this.#of || this.#report === null) await this.#make();
    await this.#draw();
    this.element.dataset['drawn'] = reply ? 'slope' : '';
  }

  /** Have the core make the profile from the latest result. */
  async #make(): Promise<void> {
    const store = this.#store;
    const { reply } = store.run('slope').value;
    const span = store.span.value;
    const { rpc } = this.#session;
    this.#of = reply;
    try {
      this.#report = await rpc.call('profile', { name: passName(store) });
    } catch (reason) {
      const refusal = reason instanceof Error ? reason.message : String(reason);
      this.#report = { kept: this.#report?.kept ?? [], laps: 0, passes: 0, points: 0, length: 0, refusal };
    }
    const driven = reply ? await drivenBy(this.#session, store, { source: 'slope:current', column: 'speed' }) : null;
    if (driven && store.span.value === span) this.#axis.value = distanceAxis(span, driven);
    this.#setWindow();
    this.#say(this.#report);
  }

  #say({ kept, laps, passes, length, refusal }: ProfileReport): void {
    const p = say.profile;
    const isPartial = this.#store.report.value?.is_partial === true;
    const own = passName(this.#store);
    this.#keep.disabled = refusal !== null || isPartial || kept.some(([name]) => name === own);
    this.#forget.disabled = kept.length === 0;
    for (const file of this.#files) file.disabled = refusal !== null;
    const others = kept.filter(([name]) => name !== own);
    const names = (isThere: boolean): string => others.filter(([, common]) => common === isThere).map(([name]) => name).join('; ');
    const sentences = [
      refusal === null ? p.made(formatDistance(length), laps, passes) : refusal,
      names(true) ? p.withOthers(names(true)) : '',
      names(false) ? p.apart(names(false)) : '',
      kept.some(([name]) => name === own) ? p.isKept : '',
      refusal === null && this.#store.tuning.value.params['slope']?.['two_way'] !== true ? p.oneWay : '',
    ];
    this.#note.textContent = sentences.filter((s) => s !== '').join(' ');
  }

  async #draw(): Promise<void> {
    const store = this.#store;
    const display = store.display.value;
    const axis = this.#axis.value;
    const { rpc } = this.#session;
    const { t0, t1 } = store.window.value;
    const isThere = this.#report?.refusal === null && axis.kind === 'distance';
    const buckets = Math.max(50, (this.#lanes[0]?.host.clientWidth ?? 600) - LEFT - RIGHT);
    const items = LANES.flatMap(({ column }) => [column, `${column}_sigma`]).map((column) => ({ source: SOURCE, column, step: false }));
    const reply = isThere
      ? await rpc.call('grid', { items, t0: axis.place(t0), t1: axis.place(t1), buckets })
      : { times: new Float64Array(), columns: items.map(() => new Float64Array()) };
    const times = Array.from(reply.times, (place) => axis.time(place));
    const hasTruth = store.report.value?.truth.includes('grade') ?? false;
    const truth = hasTruth && isThere ? await rpc.call('values', { items: [{ source: 'truth', column: 'grade' }], times }) : new Float64Array();
    const since = times.map((time) => time - store.span.value.t0);
    LANES.forEach(({ column, quantity, unit, least, hasTruth: isTruthShown }, i) => {
      const lane = this.#lanes[i] as ProfileLane;
      const [values, sigmas] = [reply.columns[2 * i] ?? new Float64Array(), reply.columns[2 * i + 1] ?? new Float64Array()];
      const shown = (value: number): number => convert(quantity, value, display);
      const edges = band(values, sigmas);
      const line = withGaps(values, shown);
      const isShown = line.length > 0;
      const true_ = isTruthShown && truth.length > 0 ? withGaps(truth, shown) : [];
      lane.unit.textContent = unitLabel(quantity, unit, display);
      lane.host.setAttribute('aria-label', say.profile.plotLabel(say.profile.lanes[column], unitLabel(quantity, unit, display)));
      lane.plot.setData(since, [
        { line: true_, isShown: true_.length > 0, isBandShown: false },
        { line, low: withGaps(edges.low, shown), high: withGaps(edges.high, shown), isShown, isBandShown: isShown },
      ], convertDifference(quantity, least, display));
    });
    if (!this.#table.hidden && isThere) this.#table.replaceChildren(await profileTable(store, rpc, axis));
  }

  canvases(): HTMLCanvasElement[] {
    return [...this.#body.querySelectorAll('canvas')];
  }
}
