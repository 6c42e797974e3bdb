/** The lanes of the room: errors against the truth, states, sensors. */

import { t } from '../messages';
import { navigation as say } from '../messages/navigation';
import type { Store } from '../state';
import { type CurveSpec, type LaneSpec, STYLES, type Which } from '../views/curves';

export const BASE = 'gnss_ins';
/** Further runs. */
export const SMOOTHED = `${BASE}@smooth`;
export const BLINDED = `${BASE}@blind`;
/** The estimator that uses the magnetometer. */
export const COMPASS = 'orientation';
export const BLIND_COMPASS = `${COMPASS}@blind`;

/** Whether the filter is tuned to look back; then the further run beside it is the one that does not. */
export function isSmoothed(store: Store): boolean {
  return store.tuning.value.params[BASE]?.['smoother'] === 'rts';
}

const names = say.curves;
const baseName = (store: Store): string => (isSmoothed(store) ? names.smoothed : names.filter);
const otherName = (store: Store): string => (isSmoothed(store) ? names.filter : names.smoothed);

function curve(estimator: string, which: Which, column: string, label: string, style: CurveSpec['style'], more: Partial<CurveSpec> = {}): CurveSpec {
  const isError = which.endsWith('_errors');
  return { id: `${estimator}-${which}`, label, source: { estimator, which }, column, sigma: `${column}_sigma`, style, isOn: true, isError, ...more };
}

/** Filter, smoothed and blinded run of a column, and the run before, from back to front. */
function family(column: string, kind: '' | '_errors'): CurveSpec[] {
  const [current, previous] = [`current${kind}`, `previous${kind}`] as [Which, Which];
  const { sigma: _, ...ghost } = curve(BASE, previous, column, t.curves.ghost, STYLES.ghost);
  const others: CurveSpec[] =
    column === 'yaw'
      ? [curve('attitude', current, column, names.attitude, STYLES.raw, { isOn: false }), curve(BLIND_COMPASS, current, column, names.blindCompass, STYLES.threshold)]
      : [curve('gnss', current, column, names.receiver, STYLES.raw, { isOn: false })];
  for (const other of others) delete other.sigma;
  return [
    ...others,
    curve(BLINDED, current, column, names.blinded, STYLES.blind),
    curve(BASE, current, column, names.filter, STYLES.estimate, { name: baseName }),
    curve(SMOOTHED, current, column, names.smoothed, STYLES.second, { name: otherName }),
    ghost,
  ];
}

/** A filter on a standing car finds its yaw when that drives off. */
const SETTLING = 30;

const PLACES = ['north', 'east', 'down'] as const;
const TRUTHS: Record<string, string> = { north: 'n', east: 'e', down: 'd', yaw: 'yaw' };

export function errorLanes(): LaneSpec[] {
  const places = PLACES.map((key): LaneSpec => ({ key, title: say.lanes[key], quantity: 'plain', unit: 'm', least: 0.5, weight: 1, settling: SETTLING, curves: family(key, '_errors') }));
  return [...places, { key: 'yaw', title: t.lanes.yaw, quantity: 'angle', unit: 'rad', least: 0.01, weight: 1, settling: SETTLING, curves: family('yaw', '_errors') }];
}

function truth(column: string): CurveSpec {
  return { id: `${column}-truth`, label: t.curves.truth, source: 'truth', column, style: STYLES.truth, isOn: true };
}

export function stateLanes(): LaneSpec[] {
  const lane = (key: string, rest: Pick<LaneSpec, 'title' | 'quantity' | 'unit' | 'least'> & Partial<LaneSpec>): LaneSpec => ({
    key, weight: 1, ...rest, curves: [truth(TRUTHS[key] ?? key), ...family(key, '')],
  });
  return [
    ...PLACES.map((key) => lane(key, { title: say.lanes[key], quantity: 'plain', unit: 'm', least: 1 })),
    lane('yaw', { title: t.lanes.yaw, quantity: 'angle', unit: 'rad', least: 0.1, isCircular: true }),
  ];
}

/**
 * Measurements whose statistics the filter tells, with their degrees of freedom; 0 for a mean over satellites, whose interval narrows with their number.
 */
export const MEASUREMENTS = [
  ['position', 3], ['velocity', 3], ['odometer', 1], ['nhc', 2], ['zupt', 3], ['zaru', 3], ['range', 0], ['range_rate', 0],
] as const;
export type Measurement = (typeof MEASUREMENTS)[number][0];

/** 2.5 % and 97.5 % quantiles of chi-square by degrees of freedom. */
const BANDS: Record<0 | 1 | 2 | 3, [number, number] | null> = { 0: null, 1: [0.000982, 5.024], 2: [0.0506, 7.378], 3: [0.2158, 9.348] };

/** Quantile of chi-square over its degrees of freedom, by that of the normal distribution (Wilson and Hilferty; within 8 % from 4 on); none without any. */
export function meanQuantile(degrees: number, normal: number): number {
  if (!(degrees > 0)) return Number.NaN;
  const variance = 2 / (9 * degrees);
  return Math.max(0, 1 - variance + normal * Math.sqrt(variance)) ** 3;
}

/** Below this a statistic is drawn at the edge of its plot. */
const FLOOR = 0.01;

export function statisticLane(): LaneSpec {
  const current = { estimator: BASE, which: 'current' } as const;
  const curves = MEASUREMENTS.flatMap(([name, dof]): CurveSpec[] => {
    const column = `${name}_nis`;
    const band = BANDS[dof];
    const level = (id: string, label: string, value: number): CurveSpec => ({ id: `${name}:${id}`, label, source: 'level', column, style: STYLES.threshold, isOn: true, level: value });
    const moving = (id: string, label: string, normal: number): CurveSpec => ({ id: `${name}:${id}`, label, source: current, column: 'satellites', style: STYLES.threshold, isOn: true, of: (count) => meanQuantile(count, normal) });
    const edges = band ? [...(band[0] > FLOOR ? [level('low', names.low, band[0])] : []), level('high', names.high, band[1])] : [moving('low', names.low, -1.96), moving('high', names.high, 1.96)];
    return [...edges, { id: `${name}:nis`, label: names.nis, source: current, column, style: { colour: 'estimate', width: 1.2 }, isOn: true, hold: 1.5 }];
  });
  return { key: 'nis', title: say.lanes.nis, quantity: 'plain', unit: '1', isLog: true, floor: FLOOR, least: 1, weight: 1.2, curves };
}

export function satelliteLane(): LaneSpec {
  const current = { estimator: BASE, which: 'current' } as const;
  const column = (name: string, label: string, style: CurveSpec['style']): CurveSpec => ({ id: name, label, source: current, column: name, style: { ...style, isStep: true }, isOn: true, hold: 2 });
  return {
    key: 'satellites', title: say.lanes.satellites, quantity: 'plain', unit: '1', least: 4, weight: 0.9,
    curves: [column('satellites', names.satellites, { colour: 'estimate', width: 1.5 }), column('pdop', names.pdop, { colour: 'second', width: 1.5 })],
  };
}

/** Slowly changing states of which one is looked at, with their units. */
export const SLOW = [
  ...(['x', 'y', 'z'] as const).map((axis) => [`accel_bias_${axis}`, 'm/s^2'] as const),
  ...(['x', 'y', 'z'] as const).map((axis) => [`gyro_bias_${axis}`, 'rad/s'] as const),
  ['odometer_scale', '1'], ['clock_bias', 'm'], ['clock_drift', 'm/s'],
] as const;
