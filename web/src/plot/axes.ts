/** Ticks, ranges and the common left and right edges of all plots. */

import { formatTime } from '../units';
import type { Points } from './gaps';

/** Width of the column of numbers left of every plot, CSS px. */
export const LEFT = 54;
/** Room right of every plot, CSS px. */
export const RIGHT = 20;

/** The range of an axis that holds every curve, at least `least` high, with a little room. */
export function rangeOf(curves: Points[], least: number, isLog: boolean): [number, number] {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const curve of curves) {
    for (const value of curve) {
      if (value === null || (isLog && value <= 0)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return isLog ? [0.1, 10] : [-least / 2, least / 2];
  if (isLog) return [low / 1.3, Math.max(high, low * 10) * 1.3];
  const room = Math.max((high - low) * 0.06, (least - (high - low)) / 2);
  return [low - room, high + room];
}

/** Share of a band's points that may leave the plot at either edge: a filter that has just started knows nothing. */
const LEAVES = 0.03;

/** The value that all but the share `LEAVES` of the points stay inside of: at the low end, or with `sign` -1 at the high end. */
function edge(points: Points, sign: 1 | -1): number {
  const values = Float64Array.from(points.filter((v): v is number => v !== null), (v) => sign * v).sort();
  return values.length > 0 ? sign * (values[Math.floor(LEAVES * values.length)] as number) : Number.NaN;
}

/** Widen a range for the bands about its curves, but let what dwarfs the curves or lasts a moment leave the plot. */
export function withBands(range: [number, number], bands: readonly (readonly [Points, Points])[]): [number, number] {
  const room = 0.3 * (range[1] - range[0]);
  const lows = bands.map(([low]) => edge(low, 1)).filter(Number.isFinite);
  const highs = bands.map(([, high]) => edge(high, -1)).filter(Number.isFinite);
  return [Math.max(Math.min(range[0], ...lows), range[0] - room), Math.min(Math.max(range[1], ...highs), range[1] + room)];
}

/** Labels of instants, as fine as their spacing. */
export function timeLabels(times: number[], spacing: number): string[] {
  const digits = spacing >= 1 ? 0 : spacing >= 0.1 ? 1 : spacing >= 0.01 ? 2 : 3;
  return times.map((time) => formatTime(time, digits));
}

/** Spacings of time ticks, s. */
export const TIME_STEPS = [
  0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200,
];

/** Spacings of distance ticks, m. */
export const DISTANCE_STEPS = Array.from({ length: 10 }, (_, i) => [1, 2, 5].map((m) => m * 10 ** (i - 3))).flat();

/** Labels of places, m from the start, as fine as their spacing; from 2 km on in km, unless that hides what is small. */
export function distanceLabels(places: number[], spacing: number): string[] {
  const isFar = spacing >= 10 && Math.max(...places) >= 2000;
  const digits = Math.max(0, -Math.floor(Math.log10(isFar ? spacing / 1000 : spacing) + 1e-9));
  return places.map((place) => (isFar ? `${(place / 1000).toFixed(digits)} km` : `${place.toFixed(digits)} m`));
}

/** Spacings of value ticks. */
export const VALUE_STEPS = Array.from({ length: 16 }, (_, i) => [1, 2, 2.5, 5].map((m) => m * 10 ** (i - 7))).flat();

/** Spacings of the ticks of an angle in degrees that goes round. */
export const TURN_STEPS = [0.1, 0.2, 0.25, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180];

/** Labels of a value axis: as many digits as its spacing needs. */
export function valueLabels(values: (number | null)[], spacing: number): string[] {
  let digits = 0;
  for (let scaled = Math.abs(spacing); digits < 6 && Math.abs(scaled - Math.round(scaled)) > 1e-6; scaled *= 10) digits++;
  return values.map((value) => {
    if (value === null) return '';
    const text = Math.abs(value) >= 1e5 ? value.toExponential(0) : value.toFixed(digits);
    return text.replace('-', '−');
  });
}
