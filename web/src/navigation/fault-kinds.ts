/** What can fail how, with which amount to begin with. */

import type { Span } from '../state';
import type { Fault } from './door';

export const KINDS = ['bias', 'freeze', 'delay', 'noise', 'clock_jump', 'multipath'] as const;
export type FaultKind = (typeof KINDS)[number];

export type Channels = readonly { name: string; columns: readonly string[] }[];

/** Units of the columns that can fail, by the beginning of their names. */
const UNITS: readonly [RegExp, string][] = [
  [/^(accel_|acc6_)/, 'm/s^2'],
  [/^gyro_/, 'rad/s'],
  [/^mag_/, 'uT'],
  [/speed|^gnss_v[ned]$/, 'm/s'],
  [/^(steer|steering_wheel|course)/, 'rad'],
  [/^(gnss_alt|gnss_lat|gnss_lon|gnss_[ned]$|gnss_std|baro_alt|range_)/, 'm'],
];

/** A noticeable fault of each unit, SI. */
const USUAL: Readonly<Record<string, number>> = { 'm/s^2': 0.3, 'rad/s': 0.005236, uT: 10, 'm/s': 1, rad: 0.03491, m: 10, s: 0.5, '1': 5 };

function columnUnit(column: string): string {
  return UNITS.find(([pattern]) => pattern.test(column))?.[1] ?? '1';
}

/** Mean radius of the earth, m: 0.4 % off at worst, which is nothing to a fault. */
const EARTH = 6_371_009;

/** Metres on the ground for each SI unit of a fault's signal: latitude and longitude, in radians, are moved by metres. */
export function metresPer(kind: FaultKind, signal: string, latitude: number): number {
  if (kind !== 'bias') return 1;
  return signal === 'gnss_lat' ? EARTH : signal === 'gnss_lon' ? EARTH * Math.cos(latitude) : 1;
}

/** The window that is proposed, s: one in which a sensor is blind, else the middle third of what is shown, so that it is a step. */
export function proposedSpan(shown: Span, blind: readonly Span[]): Span {
  const inside = blind.filter(({ t0, t1 }) => t1 > shown.t0 && t0 < shown.t1).at(-1);
  const third = (shown.t1 - shown.t0) / 3;
  return inside ? { t0: inside.t0, t1: inside.t1 } : { t0: shown.t0 + third, t1: shown.t1 - third };
}

/** The unit of the amount of a fault. */
export function signalUnit(kind: FaultKind, signal: string): string {
  switch (kind) {
    case 'bias':
      return columnUnit(signal);
    case 'delay':
      return 's';
    case 'clock_jump':
    case 'multipath':
      return 'm';
    default:
      return '1';
  }
}

/** The amount that is proposed, SI or m. */
export function usualAmount(kind: FaultKind, signal: string): number {
  if (kind === 'noise') return 5;
  if (kind === 'clock_jump') return 100;
  if (kind === 'multipath') return 20;
  return USUAL[signalUnit(kind, signal)] ?? 1;
}

/** What says how good a measurement is, or whether, is none. */
const NO_MEASUREMENT = /^gnss_(std_|nsat|pdop|valid)/;

/** The signals of a drive that can fail in a way: columns, and whole channels where one amount makes sense for all. */
export function signalsFor(kind: FaultKind, channels: Channels): string[] {
  if (kind === 'clock_jump' || kind === 'multipath') return [];
  const columns = channels.flatMap((c) => c.columns).filter((c) => !NO_MEASUREMENT.test(c));
  const whole = channels.filter((c) => c.columns.length > 1 && !c.columns.includes(c.name)).map((c) => c.name);
  return kind === 'bias' ? columns : [...whole, ...columns];
}

/** Whether something in the drive can fail so; ranges of single satellites are no channel. */
export function isPossible(kind: FaultKind, channels: Channels, hasRanges: boolean): boolean {
  if (kind === 'clock_jump') return hasRanges;
  if (kind === 'multipath') return hasRanges || channels.some((c) => c.name === 'gnss');
  return signalsFor(kind, channels).length > 0;
}

/** The fault that a form describes. */
export function makeFault(kind: FaultKind, form: { signal: string; amount: number; satellites: number; from: number; to: number; seed: number }): Fault {
  const { signal, amount, satellites, from, to, seed } = form;
  const when = { from, to, seed };
  switch (kind) {
    case 'bias':
      return { kind, signal, amount, ...when };
    case 'freeze':
      return { kind, signal, ...when };
    case 'delay':
      return { kind, signal, seconds: amount, ...when };
    case 'noise':
      return { kind, signal, factor: amount, ...when };
    case 'clock_jump':
      return { kind, metres: amount, ...when };
    case 'multipath':
      return { kind, metres: amount, satellites: Math.max(1, Math.round(satellites)), ...when };
  }
}
