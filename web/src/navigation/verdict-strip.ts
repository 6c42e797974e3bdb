/** Which measurements were used and which refused, over time: one row for each sensor; refused ones are tall. */

import { palette } from '../plot/palette';
import { type Look, type Row, type Stretch, stretches, Strip } from '../plot/strip';

/** Refused, used in part, used. */
const SHARES = [1, 0.6, 0.28] as const;

/** Runs of equal verdicts of a column that is 0 where refused and 1 where used; refused ones last, to be drawn on top. */
export function verdicts(times: ArrayLike<number>, accepted: Float64Array): Stretch[] {
  const kinds = accepted.map((share) => (share < 0.01 ? 0 : share < 0.99 ? 1 : share >= 0.99 ? 2 : Number.NaN));
  return stretches(times, kinds).sort((a, b) => b.mode - a.mode);
}

export class VerdictStrip extends Strip {
  protected override look(_row: Row, { mode }: Stretch): Look {
    const colour = [palette.value.bad, palette.value.threshold, palette.value.good][mode] ?? palette.value.muted;
    return { colour, share: SHARES[mode as 0 | 1 | 2] ?? SHARES[0] };
  }
}
