/** The six-accelerometer sensor: its rates beside plain integration, and the way to its calibration. */

import { h } from '../dom';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import type { Session } from '../session';
import type { Store } from '../state';
import { type CurveSpec, type LaneSpec, STYLES } from '../views/curves';
import { TimeView } from '../views/time-view';
import { DiskDialog } from './disk-dialog';

const ESTIMATOR = 'gyro_free';

function lanes(): LaneSpec[] {
  const of = (which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator: ESTIMATOR, which });
  return (['x', 'y', 'z'] as const).map((axis): LaneSpec => ({
    key: `rate_${axis}`,
    title: say.disk.lanes[axis],
    quantity: 'rate',
    unit: 'rad/s',
    least: 0.02,
    weight: 1,
    curves: [
      { id: 'plain', label: say.disk.plain, source: of('current'), column: `plain_rate_${axis}`, style: STYLES.raw, isOn: axis === 'z' },
      { id: 'truth', label: t.curves.truth, source: 'truth', column: `gyro_${axis}`, style: STYLES.truth, isOn: true },
      { id: 'filter', label: say.disk.filter, source: of('current'), column: `rate_${axis}`, sigma: `rate_${axis}_sigma`, style: STYLES.estimate, isOn: true },
      { id: 'ghost', label: t.curves.ghost, source: of('previous'), column: `rate_${axis}`, style: STYLES.ghost, isOn: true },
    ],
  }));
}

export function diskView(store: Store, session: Session): { view: TimeView; dialog: HTMLDialogElement } {
  const dialog = new DiskDialog(store, session);
  const open = h('button', { type: 'button', 'aria-haspopup': 'dialog', hidden: true, onclick: () => dialog.show() }, say.disk.button);
  const view = new TimeView(store, session, { title: say.disk.title, key: '6', id: 'motion-disk', lanes: lanes(), controls: [open] });
  const hasDisk = (): boolean => store.report.value?.channels.some((c) => c.columns.includes('acc6_1')) ?? false;
  const show = (): void => {
    open.hidden = !hasDisk();
    open.textContent = store.disk.value ? say.disk.buttonApplied : say.disk.button;
    // Without a disk there is nothing to plot: the note says so.
    view.element.classList.toggle('without', !hasDisk());
  };
  store.report.watch(show);
  store.disk.on(show);
  return { view, dialog: dialog.element };
}
