/** How far a blinded run went off: one row for each window, with its begin and end to be typed. */

import { h, iconButton } from '../dom';
import { navigation as say } from '../messages/navigation';
import type { Store } from '../state';
import { convertDifference, formatFixed, formatSignificant, formatTime, unitLabel } from '../units';
import type { Blind, Drift, DriftAt } from './door';
import { parseTime } from './windows';

/** Times into a window at which the drift is told, s; 0 stands for its end. */
const COLUMNS = [10, 30, 60, 0] as const;

/** The drift at a time into its window, or at its end; null where the window ends before. */
export function driftAt(drift: Drift, window: Blind, after: number): DriftAt | null {
  const length = window.t1 - window.t0;
  if (after === 0) return drift.at[drift.at.length - 1] ?? null;
  return after <= length + 1e-6 ? (drift.at.find((a) => Math.abs(a.after - after) < 1e-6) ?? null) : null;
}

/** Metres and per cent of the way; a dash where there is no value. */
export function driftText(at: DriftAt | null): string {
  if (!at || at.distance === null || !Number.isFinite(at.distance)) return '–';
  const share = at.share === null || !Number.isFinite(at.share) ? '' : ` (${formatSignificant(100 * at.share, 2)} %)`;
  return `${formatFixed(at.distance, at.distance < 100 ? 2 : 0)} m${share}`;
}

export interface TableRow {
  window: Blind;
  /** Null while it is being computed, and where there is no estimate to drift. */
  drift: Drift | null;
  isKnown: boolean;
}

export interface TableActions {
  change(window: Blind, t0: number, t1: number): void;
  remove(window: Blind): void;
}

export function driftTable(store: Store, rows: readonly TableRow[], actions: TableActions): HTMLElement {
  const texts = say.table;
  const display = store.display.value;
  const unit = unitLabel('angle', 'rad', display);
  const head = [texts.sensor, texts.from, texts.to, texts.driven, ...COLUMNS.map((after) => (after === 0 ? texts.end : texts.after(String(after)))), texts.largest, `${texts.yaw} [${unit}]`, ''];
  const body = rows.map(({ window, drift, isKnown }) => {
    const name = `${say.rows[window.sensor]} ${formatTime(store.sinceStart(window.t0))}`;
    const yaw = drift?.at[drift.at.length - 1]?.yaw;
    const isPlace = window.sensor !== 'mag';
    const cells = isPlace ? COLUMNS.map((after) => (drift ? driftText(driftAt(drift, window, after)) : isKnown ? '–' : '…')) : COLUMNS.map(() => '');
    return h('tr', {},
      h('th', { scope: 'row' }, say.rows[window.sensor]),
      h('td', {}, timeField(store, window, 't0', texts.fromOf(name), actions)),
      h('td', {}, timeField(store, window, 't1', texts.toOf(name), actions)),
      h('td', {}, isPlace && drift ? `${formatFixed(drift.driven, 0)} m` : ''),
      ...cells.map((text) => h('td', {}, text)),
      h('td', {}, isPlace && drift ? `${formatFixed(drift.largest, 2)} m` : ''),
      h('td', {}, drift && typeof yaw === 'number' ? formatFixed(convertDifference('angle', yaw, display), 2) : '–'),
      h('td', {}, iconButton('close', texts.remove(name), () => actions.remove(window))));
  });
  const table = h('table.numbers', {},
    h('caption', {}, rows.some((r) => r.isKnown && !r.drift) ? `${texts.caption}. ${texts.noEstimate}` : texts.caption),
    h('thead', {}, h('tr', {}, ...head.map((text) => (text === '' ? h('td') : h('th', { scope: 'col' }, text))))),
    h('tbody', {}, ...body));
  return h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': texts.caption }, table);
}

function timeField(store: Store, window: Blind, end: 't0' | 't1', label: string, actions: TableActions): HTMLInputElement {
  const shown = formatTime(store.sinceStart(window[end]));
  const input = h('input.time-field', { type: 'text', inputmode: 'decimal', value: shown, 'aria-label': label, 'data-field': `${window.sensor}-${end}` });
  input.addEventListener('change', () => {
    const time = parseTime(input.value) + store.span.value.t0;
    const [t0, t1] = end === 't0' ? [time, window.t1] : [window.t0, time];
    if (Number.isFinite(time) && t1 > t0) actions.change(window, t0, t1);
    else input.value = shown;
  });
  return input;
}
