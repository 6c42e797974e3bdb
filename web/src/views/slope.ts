/** The road's grade with its band, and the speed beneath. */

import { t } from '../messages';
import type { Session } from '../session';
import type { Store } from '../state';
import { type CurveSpec, type LaneSpec, STYLES } from './curves';
import { TimeView } from './time-view';

export function slopeView(store: Store, session: Session): TimeView {
  const of = (which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator: 'slope', which });
  const grade: LaneSpec = {
    key: 'grade',
    title: t.lanes.grade,
    quantity: 'grade',
    unit: 'rad',
    least: 0.02,
    weight: 1.3,
    curves: [
      { id: 'truth', label: t.curves.truth, source: 'truth', column: 'grade', style: STYLES.truth, isOn: true },
      { id: 'slope', label: t.curves.slope, source: of('current'), column: 'slope', sigma: 'slope_sigma', style: STYLES.second, isOn: false },
      { id: 'estimate', label: t.curves.estimate, source: of('current'), column: 'grade', sigma: 'grade_sigma', style: STYLES.estimate, isOn: true },
      { id: 'ghost', label: t.curves.ghost, source: of('previous'), column: 'grade', style: STYLES.ghost, isOn: true },
    ],
  };
  const speed: LaneSpec = {
    key: 'speed',
    title: t.lanes.speed,
    quantity: 'speed',
    unit: 'm/s',
    least: 1,
    weight: 0.9,
    curves: [
      { id: 'truth', label: t.curves.truth, source: 'truth', column: 'vx', style: STYLES.truth, isOn: true },
      { id: 'measured', label: t.curves.measured, source: 'drive', column: 'speed', style: STYLES.raw, isOn: true },
      { id: 'estimate', label: t.curves.estimate, source: of('current'), column: 'speed', sigma: 'speed_sigma', style: STYLES.estimate, isOn: true },
      { id: 'ghost', label: t.curves.ghost, source: of('previous'), column: 'speed', style: STYLES.ghost, isOn: true },
    ],
  };
  return new TimeView(store, session, { title: t.views.slope, key: '2', lanes: [grade, speed] });
}
