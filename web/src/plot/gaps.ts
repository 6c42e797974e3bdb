/** The one place where "no value here" turns from NaN (columns) into null (plots). */

export type Points = (number | null)[];

/** Values as a plot wants them, each through `shown`; what is not finite becomes a gap. */
export function withGaps(values: ArrayLike<number>, shown: (value: number) => number): Points {
  const out: Points = new Array(values.length);
  for (let i = 0; i < values.length; i++) {
    const value = shown(values[i] as number);
    out[i] = Number.isFinite(value) ? value : null;
  }
  return out;
}

/**
 * Break an angle's curve where it goes round, so that no line crosses the plot: `half` is half a turn.
 *
 * A point on either side of the jump goes too: two points share a pixel, and a plot joins what shares one.
 */
export function breakTurns(points: Points, half: number): Points {
  const out = [...points];
  for (let i = 1; i < points.length; i++) {
    const [before, after] = [points[i - 1], points[i]];
    if (before === null || after === null || Math.abs((after as number) - (before as number)) <= half) continue;
    for (let k = Math.max(0, i - 2); k <= Math.min(points.length - 1, i + 1); k++) out[k] = null;
  }
  return out;
}

/** Single values as a staircase: each holds until the next one, but no longer than `longest`. */
export function held(values: ArrayLike<number>, times: ArrayLike<number>, longest: number): Float64Array {
  const out = Float64Array.from(values);
  let last = -1;
  for (let i = 0; i < out.length; i++) {
    if (Number.isFinite(out[i])) last = i;
    else if (last >= 0 && (times[i] as number) - (times[last] as number) <= longest) out[i] = out[last] as number;
  }
  return out;
}

/** The edges of a band about `values`, three sigmas wide on either side; gaps where there is no sigma. */
export function band(values: ArrayLike<number>, sigmas: ArrayLike<number>): { low: Float64Array; high: Float64Array } {
  const low = new Float64Array(values.length);
  const high = new Float64Array(values.length);
  for (let i = 0; i < values.length; i++) {
    const value = values[i] as number;
    const reach = 3 * (sigmas[i] ?? Number.NaN);
    low[i] = value - reach;
    high[i] = value + reach;
  }
  return { low, high };
}
