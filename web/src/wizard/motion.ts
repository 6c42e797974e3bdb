/** The motion of a trial at one instant and around it, for pictures and numbers. SI units and radians, headings from north. */

import { SERIES, type SeriesName, STEP, type Trial } from './door';

/** Seconds of the way that is shown. */
export const PIECE = 20;
/** Values on either side that a number is the mean of. */
const MEAN = 5;
const GRAVITY = 9.80665;

type Place = [east: number, north: number];

export class Motion {
  readonly t0: number;
  readonly t1: number;
  #trial: Trial;
  #begin = 0;

  constructor(trial: Trial) {
    this.#trial = trial;
    this.t0 = trial.start;
    this.t1 = trial.start + Math.max(0, this.#of('roll').length - 1) * STEP;
    this.#begin = trial.start;
  }

  /** The value of a series at an instant; NaN where there is none. */
  at(name: SeriesName, time: number): number {
    return this.#of(name)[this.#bin(time)] ?? NaN;
  }

  /** The mean of a series around an instant. */
  mean(name: SeriesName, time: number): number {
    const bin = this.#bin(time);
    const part = this.#of(name).subarray(Math.max(0, bin - MEAN), bin + MEAN + 1).filter((v) => !Number.isNaN(v));
    return part.length > 0 ? part.reduce((a, b) => a + b, 0) / part.length : NaN;
  }

  /** What the accelerometer should show forward: the change of speed, and gravity along the road where its grade is known. */
  expectedForward(time: number): number {
    const grade = this.at('grade', time);
    return this.at('expected_x', time) + (Number.isFinite(grade) ? GRAVITY * Math.sin(grade) : 0);
  }

  /** The piece of the way that an instant lies in: it stays while the instant does. */
  piece(time: number): [number, number] {
    if (time < this.#begin || time > this.#begin + PIECE) this.#begin = time - PIECE / 2;
    this.#begin = Math.max(this.t0, Math.min(this.#begin, this.t1 - PIECE));
    return [this.#begin, Math.min(this.t1, this.#begin + PIECE)];
  }

  /** The way by places, and that by speed and gyro from where the piece begins. */
  ways(time: number): { ground: Place[]; own: Place[] } {
    const bins = this.#pieceBins(time);
    return { ground: bins.map((i) => this.#ground(i)), own: this.#own(bins).map(({ place }) => place) };
  }

  /** The car by speed and gyro. */
  sensed(time: number): { place: Place; heading: number } | null {
    const bins = this.#pieceBins(time);
    return this.#own(bins)[bins.indexOf(this.#bin(time))] ?? null;
  }

  /** The car by places. */
  overGround(time: number): { place: Place; heading: number } | null {
    const place = this.#ground(this.#bin(time));
    const heading = this.at('course', time);
    return Number.isFinite(place[0]) && Number.isFinite(heading) ? { place, heading } : null;
  }

  /** The instant at which something is largest, a few seconds from both ends. */
  most(size: (time: number) => number): number {
    let [best, at] = [-Infinity, this.t0];
    for (let time = this.t0 + 3; time < this.t1 - 3; time += 2 * STEP) {
      const value = size(time);
      if (value > best) [best, at] = [value, time];
    }
    return at;
  }

  #of(name: SeriesName): Float64Array {
    return this.#trial.series[SERIES.indexOf(name)] ?? new Float64Array(0);
  }

  #bin(time: number): number {
    return Math.round((time - this.t0) / STEP);
  }

  #pieceBins(time: number): number[] {
    const [from, to] = this.piece(time).map((t) => this.#bin(t)) as [number, number];
    return Array.from({ length: to - from + 1 }, (_, i) => from + i);
  }

  #ground(bin: number): Place {
    return [this.#of('east')[bin] ?? NaN, this.#of('north')[bin] ?? NaN];
  }

  /** Dead reckoning over some bins; empty without a gyro or a speed. */
  #own(bins: number[]): { place: Place; heading: number }[] {
    const [turned, course, compass, speed, ground] = (['turned', 'course', 'compass', 'speed', 'ground_speed'] as const).map((name) => this.#of(name)) as [Float64Array, Float64Array, Float64Array, Float64Array, Float64Array];
    const known = (series: Float64Array) => (i: number): boolean => Number.isFinite(series[i] ?? NaN);
    if (!bins.some(known(turned))) return [];
    // The gyro tells turning and no heading: that is the course's, once, else the compass's.
    const anchor = bins.find((i) => known(course)(i) && known(turned)(i));
    const start = anchor ?? bins.find(known(turned)) ?? 0;
    const zero = anchor === undefined ? (compass[start] ?? NaN) : (course[anchor] ?? 0);
    const offset = (Number.isFinite(zero) ? zero : 0) - (turned[start] ?? 0);
    const first = bins.find((i) => Number.isFinite(this.#ground(i)[0]));
    let [east, north] = first === undefined ? [0, 0] : this.#ground(first);
    let heading = offset + (turned[bins.find(known(turned)) ?? 0] ?? 0);
    return bins.map((i) => {
      if (known(turned)(i)) heading = offset + (turned[i] ?? 0);
      const v = known(speed)(i) ? (speed[i] ?? 0) : known(ground)(i) ? (ground[i] ?? 0) : 0;
      const at: Place = [east, north];
      east += v * Math.sin(heading) * STEP;
      north += v * Math.cos(heading) * STEP;
      return { place: at, heading };
    });
  }
}
