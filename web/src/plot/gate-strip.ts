/** What a filter made of the magnetic field over time, as a strip: colour tells the reason, height whether it was used. */

import { palette } from './palette';
import { type Look, type Row, type Stretch, Strip } from './strip';

/** Heights of the states of `gateState`, in parts of the row. */
const HEIGHTS = [0.3, 0.55, 1, 1, 1, 0.8, 0.55];

/** One number for the columns `gate` and `gate_reason`: 0 used, 1 less weight, 2 to 5 left out by reason, 6 believed again. */
export function gateState(gate: number, reason: number): number {
  if (gate === 2) return reason >= 1 && reason <= 4 ? 1 + reason : 5;
  return gate === 3 ? 6 : gate;
}

/** The colour of a state. */
export function gateColour(state: number): string {
  const name = `gate-${state}`;
  return (palette.value as Readonly<Record<string, string>>)[name] ?? palette.value.hairline;
}

export class GateStrip extends Strip {
  protected override look(_row: Row, { mode }: Stretch): Look {
    return { colour: gateColour(mode), share: HEIGHTS[mode] ?? 0.3 };
  }
}
