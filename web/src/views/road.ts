/** The room of road and forces: slope, road grade and body pitch, longitudinal acceleration, forces of the axles. */

import { t } from '../messages';
import type { Room } from '../rooms';
import type { Session } from '../session';
import type { Store } from '../state';
import { type CurveSpec, type LaneSpec, STYLES } from './curves';
import { TimeView } from './time-view';

const CURRENT: CurveSpec['source'] = { estimator: 'slope', which: 'current' };
const PREVIOUS: CurveSpec['source'] = { estimator: 'slope', which: 'previous' };

/** A column of the estimator with its band. */
function estimate(column: string, label: string, style: CurveSpec['style'] = STYLES.estimate): CurveSpec {
  return { id: column, label, source: CURRENT, column, sigma: `${column}_sigma`, style, isOn: true };
}

/** The same column before the last change. */
function before(column: string): CurveSpec {
  return { id: `${column}-ghost`, label: t.curves.ghost, source: PREVIOUS, column, style: STYLES.ghost, isOn: true };
}

function truth(column: string, label: string = t.curves.truth): CurveSpec {
  return { id: `${column}-truth`, label, source: 'truth', column, style: STYLES.truth, isOn: true };
}

function slopeLanes(): LaneSpec[] {
  const { lanes, curves } = t.road;
  return [
    {
      key: 'angles', title: lanes.angles, quantity: 'grade', unit: 'rad', least: 0.02, weight: 1.4,
      curves: [truth('grade'), estimate('slope', curves.slope, STYLES.second), estimate('grade', curves.grade), before('grade')],
    },
    {
      key: 'body_pitch', title: lanes.bodyPitch, quantity: 'angle', unit: 'rad', least: 0.01, weight: 0.9,
      curves: [truth('body_pitch'), estimate('body_pitch', t.curves.estimate), before('body_pitch')],
    },
  ];
}

function accelerationLanes(): LaneSpec[] {
  const { lanes, curves } = t.road;
  const measured: CurveSpec = { id: 'measured', label: curves.measured, source: 'drive', column: 'accel_x', style: STYLES.raw, isOn: true };
  return [
    {
      key: 'acceleration', title: lanes.acceleration, quantity: 'plain', unit: 'm/s^2', least: 1, weight: 1,
      curves: [measured, estimate('accel_x_net', curves.net, STYLES.second), estimate('accel_x_estimated', curves.estimated), before('accel_x_estimated')],
    },
  ];
}

function forceLanes(): LaneSpec[] {
  const { lanes, curves } = t.road;
  return [
    {
      key: 'longitudinal', title: lanes.longitudinal, quantity: 'plain', unit: 'N', least: 500, weight: 1,
      curves: [estimate('force_xf', curves.front), before('force_xf')],
    },
    {
      key: 'lateral', title: lanes.lateral, quantity: 'plain', unit: 'N', least: 500, weight: 1,
      curves: [truth('force_yf', curves.trueFront), truth('force_yr', curves.trueRear), estimate('force_yr', curves.rear, STYLES.second), estimate('force_yf', curves.front), before('force_yf')],
    },
  ];
}

export function roadRoom(store: Store, session: Session): Room {
  const views = [
    new TimeView(store, session, { title: t.road.slope, key: '1', id: 'road-slope', lanes: slopeLanes() }),
    new TimeView(store, session, { title: t.road.acceleration, key: '2', id: 'road-acceleration', lanes: accelerationLanes() }),
    new TimeView(store, session, { title: t.road.forces, key: '3', id: 'road-forces', lanes: forceLanes() }),
  ];
  for (const view of views) view.changed();
  return {
    elements: views.map((v) => v.element),
    pictures: () => views.map((v, i) => [['slope', 'acceleration', 'forces'][i] ?? '', v.canvases()]),
  };
}
