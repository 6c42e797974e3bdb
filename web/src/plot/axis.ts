/** What every plot is drawn over: time, or the distance driven. */

import { Signal } from '../signal';

/** Where instants stand from left to right. */
export interface Axis {
  readonly kind: 'time' | 'distance';
  /** Start of the drive, s. */
  readonly start: number;
  /** Where an instant stands: s or m from the start of the drive. */
  place(time: number): number;
  /** The instant that stands at a place. */
  time(place: number): number;
}

/** A stretch of time, s. */
interface Stretch {
  readonly t0: number;
  readonly t1: number;
}

/** A standing car moves by this along the axis, m/s: every place has one instant, and an hour takes a third of a metre. */
const CREEP = 1e-4;

/** Time from the start of the drive. */
export function timeAxis(start: number): Axis {
  return { kind: 'time', start, place: (time) => time - start, time: (place) => place + start };
}

/** Distance driven since `t0`, known at instants evenly from `t0` to `t1`; on straight lines between them. */
export function distanceAxis({ t0, t1 }: Stretch, driven: ArrayLike<number>): Axis {
  const last = driven.length - 1;
  const step = (t1 - t0) / last;
  const at = (knot: number): number => (driven[knot] as number) + CREEP * knot * step;
  const place = (time: number): number => {
    const knots = (time - t0) / step;
    if (knots <= 0) return CREEP * (time - t0);
    if (knots >= last) return at(last) + CREEP * (time - t1);
    const knot = Math.floor(knots);
    return at(knot) + (knots - knot) * (at(knot + 1) - at(knot));
  };
  const time = (wanted: number): number => {
    if (wanted <= 0) return t0 + wanted / CREEP;
    if (wanted >= at(last)) return t1 + (wanted - at(last)) / CREEP;
    let [low, high] = [0, last];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (at(middle) <= wanted) low = middle;
      else high = middle;
    }
    return t0 + step * (low + (wanted - at(low)) / (at(high) - at(low)));
  };
  return { kind: 'distance', start: t0, place, time };
}

/** The axis of all plots that have none of their own. */
export const axis = new Signal<Axis>(timeAxis(0));

/** Where an instant stands in a window, 0 at its left and 1 at its right. */
export function shareOf(time: number, { t0, t1 }: Stretch, on: Axis = axis.value): number {
  const from = on.place(t0);
  return (on.place(time) - from) / (on.place(t1) - from);
}

/** The instant at a share of a window. */
export function timeAt(share: number, { t0, t1 }: Stretch, on: Axis = axis.value): number {
  const from = on.place(t0);
  return on.time(from + share * (on.place(t1) - from));
}
