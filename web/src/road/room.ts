/** The room of road and forces: slope, road grade and body pitch, longitudinal acceleration, forces of the axles, and the road's profile. */

import '../style/road.css';
import { h } from '../dom';
import { t } from '../messages';
import { road as say } from '../messages/road';
import type { Room } from '../rooms';
import type { Session } from '../session';
import type { Store } from '../state';
import type { History, Tuning } from '../tuning';
import { type CurveSpec, type LaneSpec, STYLES } from '../views/curves';
import type { TableColumn } from '../views/table';
import { TimeView } from '../views/time-view';
import type { GridItem } from '../worker/rpc';
import { AccelerationFigures } from './figures';
import { LampLane } from './lamps';
import { OfferPanel } from './offers';
import { ProfileView } from './profile';

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
  const { lanes, curves } = say;
  return [
    {
      key: 'angles', title: lanes.angles, quantity: 'grade', unit: 'rad', least: 0.02, weight: 1.6,
      curves: [
        { ...truth('pitch', curves.trueSlope), isOn: false },
        { ...truth('body_pitch', curves.trueBodyPitch), isOn: false },
        truth('grade', curves.trueGrade),
        estimate('body_pitch', curves.bodyPitch, STYLES.third),
        estimate('slope', curves.slope, STYLES.second),
        estimate('grade', curves.grade),
        before('grade'),
      ],
    },
  ];
}

function accelerationLanes(): LaneSpec[] {
  const { lanes, curves } = say;
  const measured: CurveSpec = { id: 'measured', label: curves.measured, source: 'drive', column: 'accel_x', style: STYLES.raw, isOn: true };
  return [
    {
      key: 'acceleration', title: lanes.acceleration, quantity: 'plain', unit: 'm/s^2', least: 1, weight: 1,
      curves: [measured, estimate('accel_x_net', curves.net, STYLES.second), estimate('accel_x_estimated', curves.estimated), before('accel_x_estimated')],
    },
  ];
}

function forceLanes(): LaneSpec[] {
  const { lanes, curves } = say;
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

/** The three angles in one plot, and beneath it what of them can be known. */
class SlopeView extends TimeView {
  #lamps: LampLane;

  constructor(store: Store, session: Session, offers: HTMLElement) {
    super(store, session, { title: say.slope, key: '1', id: 'road-slope', lanes: slopeLanes() });
    this.#lamps = new LampLane(store, session);
    this.#lamps.onLit = this.refresh;
    this.element.insertBefore(offers, this.body);
    this.body.append(this.#lamps.element);
  }

  protected override extraItems(): GridItem[] {
    return this.#lamps.items();
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    if (columns.length > 0) this.#lamps.take(times, columns);
  }

  protected override extraColumns(): TableColumn[] {
    return this.#lamps.tableColumns();
  }
}

export function roadRoom(store: Store, session: Session, history: History<Tuning>): Room {
  const acceleration = new TimeView(store, session, { title: say.acceleration, key: '2', id: 'road-acceleration', lanes: accelerationLanes() });
  const figures = new AccelerationFigures(store, session);
  acceleration.body.append(figures.element);
  const forces = new TimeView(store, session, { title: say.forces, key: '3', id: 'road-forces', lanes: forceLanes() });
  forces.body.append(h('p.lane-note', {}, say.effective));
  const views = [new SlopeView(store, session, new OfferPanel(store, session, history).element), acceleration, forces];
  const profile = new ProfileView(store, session);
  for (const view of views) view.changed();
  const seen = new ResizeObserver(() => {
    figures.refresh();
    profile.refresh();
  });
  seen.observe(acceleration.element);
  return {
    elements: [...views, profile].map((v) => v.element),
    pictures: () => [...views, profile].map((v, i) => [['slope', 'acceleration', 'forces', 'profile'][i] ?? '', v.canvases()]),
  };
}
