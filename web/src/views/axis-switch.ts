/** Whether plots are drawn over time or over the distance driven, and how the distance is known. */

import { h } from '../dom';
import { t } from '../messages';
import { axis, distanceAxis, timeAxis } from '../plot/axis';
import type { Session } from '../session';
import type { Store } from '../state';
import { latest } from '../worker/rpc';

/** Instants a second at which the distance is asked for, and how many at most. */
const RATE = 10;
const MOST = 36_000;

/** A column of speed. */
interface Speed {
  source: string;
  column: string;
}

/** The speed that makes the distance: the truth does not move while something is tuned; else the best estimate there is, else what was measured. */
export function speedOf(store: Store): Speed | null {
  const report = store.report.value;
  if (!report) return null;
  if (report.truth.includes('vx')) return { source: 'truth', column: 'vx' };
  const estimator = ['slope', 'gnss_ins'].find((name) => store.run(name).value.reply);
  if (estimator !== undefined) return { source: `${estimator}:current`, column: 'speed' };
  const columns = report.channels.flatMap((c) => c.columns);
  const measured = ['speed', 'wheel_speed_rl', 'wheel_speed_fl', 'gnss_speed'].find((c) => columns.includes(c));
  return measured === undefined ? null : { source: 'drive', column: measured };
}

/** The distance driven over the whole drive, at even instants; null where no speed is known. */
export async function drivenBy(session: Session, store: Store, speed: Speed | null): Promise<Float64Array | null> {
  if (!speed) return null;
  const { t0, t1 } = store.span.value;
  const count = Math.round(Math.min(MOST, Math.max(100, RATE * (t1 - t0))));
  const driven = await session.rpc.call('distance', { ...speed, t0, t1, count });
  return driven.length > 1 ? driven : null;
}

/** Draw all plots over what the reader wants. */
function followAxis(store: Store, session: Session): void {
  const load = latest(async () => {
    const span = store.span.value;
    if (store.over.value === 'time') {
      if (axis.value.kind !== 'time') axis.value = timeAxis(span.t0);
      return;
    }
    const driven = await drivenBy(session, store, speedOf(store));
    if (store.span.value === span && store.over.value === 'distance' && driven) axis.value = distanceAxis(span, driven);
  });
  store.over.watch(load);
  store.report.on(load);
  for (const name of ['slope', 'gnss_ins']) {
    store.run(name).on((now, before) => {
      if (now.reply !== before.reply && speedOf(store)?.source === `${name}:current`) load();
    });
  }
}

/** The switch, which also makes the plots follow it. */
export function axisSwitch(store: Store, session: Session): HTMLElement {
  const choice = h('select.axis-switch', { 'aria-label': t.axis.label });
  choice.append(h('option', { value: 'time' }, t.axis.time), h('option', { value: 'distance' }, t.axis.distance));
  choice.addEventListener('change', () => {
    store.over.value = choice.value === 'distance' ? 'distance' : 'time';
  });
  store.over.watch((over) => {
    choice.value = over;
  });
  const explain = (): void => {
    const source = speedOf(store)?.source ?? '';
    const by = source === 'truth' ? t.axis.byTruth : source === 'drive' ? t.axis.byMeasured : source === '' ? t.axis.unknown : t.axis.byEstimate;
    choice.title = `${t.axis.label}: ${by}`;
  };
  store.report.watch(explain);
  axis.on(explain);
  followAxis(store, session);
  return choice;
}
