/** What crosses the door of the core for the compass doctor (crates/wasm/src/compass.rs): uT, radians, seconds. */

/** Hard and soft iron, as saved. */
export interface Calibration {
  version: number;
  kind: 'full' | 'planar';
  offset: [number, number, number];
  distortion: [number, number, number, number, number, number];
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

/** The compass doctor as the worker sees it. */
export interface CompassDoor {
  compass(year: number, latitude: number, longitude: number, withField: boolean): Diagnosis | null;
  compass_apply(calibration: string, mountYaw: number, clock: number): void;
  compass_undo(): void;
}

/** Its operations, as the page asks for them. */
export interface CompassOperations {
  compass: { takes: { year: number; latitude: number; longitude: number; withField: boolean }; gives: Diagnosis | null };
  compass_apply: { takes: { calibration: string; mountYaw: number; clock: number }; gives: null };
  compass_undo: { takes: Record<string, never>; gives: null };
}
