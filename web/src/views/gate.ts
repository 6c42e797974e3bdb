/** The magnetic gate under the attitude: for each filter that has one, what it made of the field and why. */

import { h } from '../dom';
import { t } from '../messages';
import { words } from '../panel/params';
import { gateState, GateStrip } from '../plot/gate-strip';
import { stretches } from '../plot/strip';
import { TimeArea } from '../plot/time-area';
import type { Session } from '../session';
import { OVERLAID, overlayRun, type Store } from '../state';
import { convert, digitsOf, formatFixed, formatSignificant, unitLabel } from '../units';
import { type GridItem, latest } from '../worker/rpc';
import type { TableColumn } from './table';
import { drawnVariants, mainVariant } from './variants';

/** Variants with a gate. */
const GATED = new Set(['robust', 'robust_ax']);
const COLUMNS = ['gate', 'gate_reason', 'field_norm_error', 'dip_error', 'field_nis'] as const;

interface Row {
  label: string;
  source: string;
}

export class GateLane {
  readonly element: HTMLElement;
  #store: Store;
  #session: Session;
  #host = h('div.strip', { role: 'img', 'aria-label': t.gate.label });
  #strip: GateStrip;
  #now = h('span.now', { 'aria-live': 'off' });
  readonly #read = latest(() => this.#load());

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const keys = t.gate.keys.map((name, state) => h('span.mode-key', { title: t.gate.states[state] }, h('span.gate-swatch', { 'data-gate': state }), name));
    const legend = h('div.legend', {}, h('h3.lane-title', {}, t.gate.title), ...keys, this.#now);
    this.element = h('div.strip-lane.gate-lane', { hidden: true }, legend, this.#host);
    this.#strip = new GateStrip(this.#host);
    this.#host.append(new TimeArea(store).element);
    store.window.watch((window) => this.#strip.setWindow(window));
    store.cursor.on(this.#read);
    store.display.on(this.#read);
  }

  #rows(): Row[] {
    const store = this.#store;
    const main = mainVariant(store);
    const named = [{ variant: main, run: OVERLAID }, ...drawnVariants(store).map((variant) => ({ variant, run: overlayRun(variant) }))];
    return named.flatMap(({ variant, run }) => {
      const { reply, running } = store.run(run).value;
      if (!GATED.has(variant ?? '')) return [];
      const which = reply ? 'current' : running && running.rows > 0 ? 'running' : null;
      return which ? [{ label: words(variant ?? ''), source: `${run}:${which}` }] : [];
    });
  }

  items(): GridItem[] {
    return this.#rows().flatMap(({ source }) => ['gate', 'gate_reason'].map((column) => ({ source, column, step: true })));
  }

  take(times: Float64Array, columns: Float64Array[]): void {
    const rows = this.#rows().map(({ label }, i) => {
      const [gate, reason] = [columns[2 * i], columns[2 * i + 1]];
      return { label, stretches: gate && reason ? stretches(times, gate.map((g, k) => gateState(g, reason[k] ?? Number.NaN))) : [] };
    });
    this.element.hidden = rows.every((row) => row.stretches.length === 0);
    this.#host.style.height = `${Math.max(1, rows.length) * 16}px`;
    this.#strip.setRows(rows);
    this.#read();
  }

  tableColumns(): TableColumn[] {
    return this.#rows().flatMap(({ source, label }) =>
      (['gate', 'reason'] as const).map((key) => ({ source, column: key === 'gate' ? 'gate' : 'gate_reason', label: `${t.gate[key === 'gate' ? 'column' : 'reason']}, ${label}`, quantity: 'plain' as const, unit: '1' })),
    );
  }

  async #load(): Promise<void> {
    const rows = this.#rows();
    if (rows.length === 0 || !this.#store.report.value) return;
    const items = rows.flatMap(({ source }) => COLUMNS.map((column) => ({ source, column })));
    const values = await this.#session.rpc.call('values', { items, times: [this.#store.cursor.value] });
    const texts = rows.map(({ label }, i) => {
      const [gate, reason, norm, dip, nis] = values.subarray(COLUMNS.length * i, COLUMNS.length * (i + 1));
      const state = gateState(gate ?? Number.NaN, reason ?? Number.NaN);
      const what = t.gate.states[state] ?? t.gate.none;
      const figure = this.#figure(state, norm ?? Number.NaN, dip ?? Number.NaN, nis ?? Number.NaN);
      const text = figure ? `${what}, ${figure}` : what;
      return rows.length > 1 ? `${label}: ${text}` : text;
    });
    this.#now.textContent = texts.join(' · ');
  }

  /** The number that decided. */
  #figure(state: number, norm: number, dip: number, nis: number): string {
    const display = this.#store.display.value;
    const signed = (value: number, digits: number): string => `${value > 0 ? '+' : ''}${formatFixed(value, digits)}`;
    if (state === 3) {
      const unit = unitLabel('angle', 'rad', display);
      return Number.isFinite(dip) ? t.gate.dip(`${signed(convert('angle', dip, display), digitsOf('angle', display) - 1)}${unit === '°' ? unit : ` ${unit}`}`) : '';
    }
    if (state === 4) return Number.isFinite(nis) ? t.gate.nis(formatSignificant(nis)) : '';
    return Number.isFinite(norm) && state >= 0 ? t.gate.norm(signed(norm, 1)) : '';
  }
}
