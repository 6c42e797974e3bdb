/** Motion modes over time as a strip, with what goes along with them: labels, detectors of rest, aids, gaps of GNSS. */

import { modeColour, palette } from './palette';
import { type Look, type Row, type Stretch, Strip } from './strip';

/** A row of the strip; of `on` rows only the stretches of 1 are drawn. */
export interface StripRow extends Row {
  kind: 'mode' | 'outage' | 'on';
}

export class ModeStrip extends Strip<StripRow> {
  protected override look({ kind }: StripRow, { mode }: Stretch): Look {
    if (kind === 'outage') return { colour: palette.value.outage, share: 0.5 };
    if (kind === 'on') return { colour: palette.value.estimate, share: mode === 1 ? 0.8 : 0 };
    return { colour: modeColour(mode), share: 0.34 + 0.33 * mode };
  }
}
