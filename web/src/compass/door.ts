/** What crosses the doors for the compass doctor (crates/doctor, and crates/wasm/src/compass.rs): uT, radians, seconds. */

import type { DriveHead, DrivePart } from '../door';

/** Hard and soft iron, as saved. */
export interface Calibration {
  version: number;
  kind: 'full' | 'planar';
  offset: [number, number, number];
  distortion: [number, number, number, number, number, number];
}

/** The version of calibrations that the core reads and writes. */
const VERSION = 1;

/** Read a saved calibration; throws a sentence. */
export function readCalibration(text: string, sentence: (reason: string) => string): Calibration {
  let value: Partial<Calibration>;
  try {
    value = JSON.parse(text) as Partial<Calibration>;
  } catch (reason) {
    throw new Error(sentence(reason instanceof Error ? reason.message : String(reason)));
  }
  if (value?.version !== VERSION) throw new Error(sentence(`version ${String(value?.version)}, not ${VERSION}`));
  const isNumbers = (list: unknown, length: number): boolean => Array.isArray(list) && list.length === length && list.every(Number.isFinite);
  if (!isNumbers(value.offset, 3) || !isNumbers(value.distortion, 6)) throw new Error(sentence('no three offsets and six distortions'));
  if (value.kind !== 'full' && value.kind !== 'planar') throw new Error(sentence(`kind ${String(value.kind)}`));
  return value as Calibration;
}

/** A heading held against the GNSS course. */
export interface AgainstCourse {
  consistency: { plain: number; balanced: number; sectors: number; points: number };
  mount_yaw: number;
  rms: number;
  sectors: { begins: number; points: number; mean: number; rms: number }[];
}

export interface Diagnosis {
  /** North, east, down. */
  earth: [number, number, number];
  quality: { samples: number; used: number; sectors: number; noise: number; residual: number; residual_relative: number; offset_sigma: number; gain: [number, number]; kind: 'full' | 'planar' | null };
  calibration: Calibration | null;
  refusal_text: string | null;
  clock: { offset: number; sigma: number; lever: number } | null;
  before: AgainstCourse | null;
  after: AgainstCourse | null;
  warning: string | null;
  notes: string[];
  scatter: { raw: number[][]; calibrated: number[][]; ellipse: number[][]; radius: number };
  applied: Calibration | null;
  now: AgainstCourse | null;
  warning_now: string | null;
}

/** What the core does for the doctor. */
export interface CompassDoor {
  /** What the doctor examines of the drive, as it was read. */
  hand_over(): DriveHead;
  next_part(): DrivePart | undefined;
  keep_field(raw: Float64Array[], calibrated: Float64Array[]): void;
  compass_apply(numbers: Float64Array, planar: boolean, mountYaw: number, clock: number): void;
  compass_undo(): void;
}

/** Its operations, as the page asks for them. */
export interface CompassOperations {
  compass: { takes: { year: number; latitude: number; longitude: number; withField: boolean }; gives: Diagnosis | null };
  compass_apply: { takes: { calibration: Calibration; mountYaw: number; clock: number }; gives: null };
  compass_undo: { takes: Record<string, never>; gives: null };
}
