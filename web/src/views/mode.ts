/** The motion mode as a strip, with the statistic that decided it and its threshold beneath. */

import { h } from '../dom';
import { t } from '../messages';
import { ModeStrip, type StripRow } from '../plot/mode-strip';
import { stretches } from '../plot/strip';
import { TimeArea } from '../plot/time-area';
import type { Session } from '../session';
import type { Store } from '../state';
import { type GridItem, latest } from '../worker/rpc';
import { type CurveSpec, type LaneSpec, sourceOf, STYLES } from './curves';
import type { TableColumn } from './table';
import { TimeView } from './time-view';

type Statistic = 'jd' | 'td' | 'fd' | 'yd';
const STATISTICS: Statistic[] = ['jd', 'td', 'fd', 'yd'];
const ESTIMATOR = 'motion_mode';

const DECIDED: CurveSpec = {
  id: 'decided',
  label: t.curves.decided,
  source: { estimator: ESTIMATOR, which: 'current' },
  column: 'mode',
  style: STYLES.estimate,
  isOn: true,
};
const BEFORE: CurveSpec = { ...DECIDED, id: 'before', label: t.curves.ghost, source: { estimator: ESTIMATOR, which: 'previous' } };
const TRUE: CurveSpec = { ...DECIDED, id: 'truth', label: t.curves.truth, source: 'truth' };
const ROWS = [DECIDED, BEFORE, TRUE];

function statisticLane(): LaneSpec {
  const of = (which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator: ESTIMATOR, which });
  const curves = STATISTICS.flatMap((name): CurveSpec[] => [
    { id: name, label: t.statistics[name], source: of('current'), column: name, style: { colour: 'estimate', width: 1.2 }, isOn: true, isMagnitude: true },
    { id: `${name}-threshold`, label: t.curves.threshold, source: of('current'), column: `${name}_threshold`, style: STYLES.threshold, isOn: true },
    { id: `${name}-ghost`, label: t.curves.ghost, source: of('previous'), column: name, style: STYLES.ghost, isOn: true, isMagnitude: true },
  ]);
  return { key: 'statistic', title: t.lanes.statistic, quantity: 'plain', unit: '1', curves, isLog: true, least: 1, weight: 1 };
}

class ModeView extends TimeView {
  #strip: ModeStrip;
  #host = h('div.strip');
  #value = h('div.legend', {}, h('h3.lane-title', {}, t.lanes.mode));
  #outages: { t0: number; t1: number }[] = [];
  #rows: StripRow[] = [];
  #now = h('span.now');
  readonly #showMode = latest(() => this.#loadMode());

  constructor(store: Store, session: Session, choose: HTMLElement) {
    super(store, session, { title: t.views.mode, key: '3', lanes: [statisticLane()], controls: [choose] });
    this.body.prepend(h('div.strip-lane', {}, this.#value, this.#host));
    this.#strip = new ModeStrip(this.#host);
    this.#host.append(new TimeArea(store).element);
    this.#host.setAttribute('role', 'img');
    this.#host.setAttribute('aria-label', t.views.plotLabel(t.lanes.mode, ''));
    t.modes.forEach((name, mode) => this.#value.append(modeKey(name, mode)));
    this.#value.append(this.#now);
    store.window.watch((window) => this.#strip.setWindow(window));
    store.cursor.on(this.#showMode);
  }

  setOutages(outages: { t0: number; t1: number }[]): void {
    this.#outages = outages;
    this.#show();
  }

  protected override extraItems(): GridItem[] {
    return ROWS.flatMap((curve) => {
      const source = sourceOf(this.store, curve);
      return source === null ? [] : [{ source, column: curve.column, step: true }];
    });
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    const present = ROWS.filter((curve) => sourceOf(this.store, curve) !== null);
    this.#rows = present.map((curve, i) => ({
      label: curve.label,
      kind: 'mode' as const,
      stretches: columns[i]?.length ? stretches(times, columns[i]) : [],
    }));
    this.#show();
  }

  protected override extraColumns(): TableColumn[] {
    return ROWS.flatMap((curve) => {
      const source = sourceOf(this.store, curve);
      return source === null ? [] : [{ source, column: 'mode', label: `${t.lanes.mode}, ${curve.label}`, quantity: 'plain' as const, unit: '1' }];
    });
  }

  #show(): void {
    const gaps: StripRow[] =
      this.#outages.length > 0
        ? [{ label: t.curves.gnss, kind: 'outage', stretches: this.#outages.map((o) => ({ ...o, mode: 0 })) }]
        : [];
    const rows = [...this.#rows, ...gaps];
    this.#host.style.height = `${Math.max(1, rows.length) * 16}px`;
    this.#strip.setRows(rows);
    this.#showMode();
  }

  async #loadMode(): Promise<void> {
    if (!this.store.report.value) return;
    const present = ROWS.flatMap((curve) => {
      const source = sourceOf(this.store, curve);
      return source === null ? [] : [{ source, column: curve.column, label: curve.label }];
    });
    const values = await this.session.rpc.call('values', { items: present.map(({ source, column }) => ({ source, column })), times: [this.store.cursor.value] });
    this.#now.textContent = present.map(({ label }, i) => `${label} ${t.modes[values[i] ?? Number.NaN] ?? '–'}`).join(' · ');
  }
}

/** A key of the strip: colour, height and name of a mode. */
export function modeKey(name: string, mode: number): HTMLElement {
  return h('span.mode-key', {}, h('span.mode-swatch', { 'data-mode': mode }), name);
}

export function modeView(store: Store, session: Session): ModeView {
  const choose = h('div.segmented', { role: 'radiogroup', 'aria-label': t.statistics.choose });
  const view = new ModeView(store, session, choose);
  const apply = (statistic: Statistic): void => {
    view.lanes[0]?.offer((curve) => curve.id.split('-')[0] === statistic);
    view.changed();
  };
  for (const statistic of STATISTICS) {
    const input = h('input', { type: 'radio', name: 'statistic', value: statistic, checked: statistic === 'jd' });
    input.addEventListener('change', () => apply(statistic));
    choose.append(h('label', { title: t.statistics[statistic] }, input, h('span', {}, statistic.toUpperCase())));
  }
  apply('jd');
  return view;
}

export type { ModeView };
