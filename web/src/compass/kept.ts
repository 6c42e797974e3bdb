/** A calibration that was applied outlives reading the same log by another mapping, where that leaves its sensor alone. */

import type { DriveReport } from '../door';
import type { Calibration } from './door';

/** What was applied, and what it holds for. */
export interface Kept {
  readonly calibration: Calibration;
  readonly mountYaw: number;
  readonly clock: number;
  readonly compass: string;
  readonly receiver: string;
}

interface Mapping {
  time?: unknown;
  signals?: Record<string, unknown>;
}

/** How an open log's signals whose names pass were read, as text; null for a drive that is not from a file. */
function reading(report: DriveReport, passes: (signal: string) => boolean): string | null {
  if (!report.import) return null;
  const { name, bytes, mapping } = report.import;
  const { time, signals } = (mapping ?? {}) as Mapping;
  return JSON.stringify([name, bytes, time, Object.entries(signals ?? {}).filter(([signal]) => passes(signal))]);
}

const compassOf = (report: DriveReport): string | null => reading(report, (signal) => signal.startsWith('mag_'));
const receiverOf = (report: DriveReport): string | null => reading(report, (signal) => signal.startsWith('gnss_') || signal === 'course');

/** What to keep of a calibration applied to an open drive; null where there is no log to be read again. */
export function keep(report: DriveReport | null, calibration: Calibration, mountYaw: number, clock: number): Kept | null {
  const compass = report && compassOf(report);
  const receiver = report && receiverOf(report);
  return compass && receiver ? { calibration, mountYaw, clock, compass, receiver } : null;
}

/** What holds for a drive that has just been opened; the clock's offset only where the receiver is read as before too. */
export function stillHolds(kept: Kept | null, report: DriveReport): Kept | null {
  if (!kept || kept.compass !== compassOf(report)) return null;
  return kept.receiver === receiverOf(report) ? kept : { ...kept, clock: 0 };
}
