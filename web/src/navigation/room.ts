/** The room of navigation: errors, sensors blinded, faults, and what each measurement was worth. */

import '../style/navigation.css';
import { h } from '../dom';
import { navigation as say } from '../messages/navigation';
import { outagesOf } from '../plot/map';
import type { Room } from '../rooms';
import type { Session } from '../session';
import type { Store } from '../state';
import { latest } from '../worker/rpc';
import { BASE, isSmoothed } from './curves';
import type { FaultSwitch } from './fault-switch';
import { FaultView } from './faults';
import { FurtherRun } from './further';
import { OutageView } from './outages';
import { ErrorViews, MeasurementView } from './views';

/** Fixes asked for to find where there are none. */
const FIXES = 20_000;

export function navigationRoom(store: Store, session: Session, faults: FaultSwitch): Room {
  const smoothed = new FurtherRun(store, session, BASE, 'smooth', () => ({ params: { smoother: isSmoothed(store) ? 'off' : 'rts' } }));
  const errors = new ErrorViews(store, session, () => {
    const note = h('span.run-status', { role: 'status' });
    store.run(smoothed.name).watch(({ running, error }) => {
      note.textContent = running ? say.smoothing(Math.round(100 * (running.fraction ?? 0))) : (error ?? '');
    });
    return note;
  });
  const outages = new OutageView(store, session);
  const measurements = new MeasurementView(store, session);
  const panel = new FaultView(store, faults, session.rpc);
  const gaps = latest(async () => {
    const { t0, t1 } = store.span.value;
    outages.setGaps(outagesOf(await session.rpc.call('path', { source: 'drive', t0, t1, points: FIXES }), { t0, t1 }));
  });
  store.report.watch((report) => report && gaps());
  smoothed.refresh();
  measurements.changed();
  return {
    elements: [...errors.elements, outages.element, panel.element, measurements.element],
    pictures: () => [
      ['errors', errors.shown.canvases()],
      ['outages', outages.canvases()],
      ['measurements', measurements.canvases().filter((c) => c.checkVisibility())],
    ],
  };
}
