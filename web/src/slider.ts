/** Between a slider's travel and a parameter's value. */

import type { NumberParam, OptionalParam } from './door';

/** Steps of a slider's travel. */
export const TRAVEL = 1000;

type Ranged = Pick<NumberParam, 'min' | 'max'> & Partial<Pick<NumberParam, 'scale'>>;

function isLog(spec: Ranged): boolean {
  return spec.scale === 'log' && spec.min > 0;
}

/** Where on the travel a value lies, 0 to `TRAVEL`. */
export function toTravel(spec: Ranged, value: number): number {
  const { min, max } = spec;
  const share = isLog(spec)
    ? Math.log(Math.max(value, min) / min) / Math.log(max / min)
    : (value - min) / (max - min);
  return TRAVEL * Math.min(1, Math.max(0, share));
}

/** The value at a place on the travel, rounded to three digits and kept in range. */
export function fromTravel(spec: Ranged, travel: number): number {
  const { min, max } = spec;
  const share = Math.min(1, Math.max(0, travel / TRAVEL));
  if (share === 0) return min;
  if (share === 1) return max;
  if (isLog(spec)) return clamp(spec, roundTo(min * (max / min) ** share, 3));
  // Linear: as fine as a step of the travel, wherever in the range.
  const step = 10 ** Math.floor(Math.log10((max - min) / TRAVEL));
  return clamp(spec, Number((Math.round((min + share * (max - min)) / step) * step).toPrecision(12)));
}

function roundTo(value: number, digits: number): number {
  return Number(value.toPrecision(digits));
}

/** A value kept inside a parameter's range. */
export function clamp(spec: Pick<NumberParam | OptionalParam, 'min' | 'max'>, value: number): number {
  return Math.min(spec.max, Math.max(spec.min, value));
}
