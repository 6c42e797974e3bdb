/** What crosses the door of the core for the room of motion (crates/wasm/src/motion.rs): SI units, seconds. */

import type { ModeScore } from '../door';

/** Three numbers in body axes: forward, right, down. */
export type Triple = [number, number, number];

/** A stretch in which the disk lay still, with the pose that it seems to mean. */
export interface Rest {
  span: [number, number];
  mean: number[];
  spread: number;
  force: Triple;
  pose: Triple;
}

export interface DiskSensor {
  position: Triple;
  axis: Triple;
  bias: number;
}

/** A calibrated disk; sigmas are for means that err by 1 m/s^2. */
export interface Calibration {
  disk: { sensors: DiskSensor[] };
  residual: number[] | null;
  axis_sigma: Triple;
  bias_sigma: number;
}

/** A calibration, the numbers of its disk, and what it cannot know. */
export type Calibrated = [Calibration, number[], string[]];

/** The room of motion as the worker sees it. */
export interface MotionDoor {
  decisions(source: string): Float64Array;
  labels_paint(labels: Float64Array, from: number, to: number, mode: number): Float64Array;
  labels_score(source: string, labels: Float64Array): ModeScore | null;
  disk_apply(numbers: Float64Array): Float64Array;
}

/** Its operations, as the page asks for them. */
export interface MotionOperations {
  /** Thirteen numbers for each change of mode; see `decisionsOf`. */
  decisions: { takes: { source: string }; gives: Float64Array };
  /** Labels are times and, in the second half, modes; a mode of NaN wipes. */
  labels_paint: { takes: { labels: Float64Array; from: number; to: number; mode: number }; gives: Float64Array };
  labels_score: { takes: { source: string; labels: Float64Array }; gives: ModeScore | null };
  disk_rests: { takes: { shortest: number }; gives: Rest[] };
  /** Nine numbers a pose: specific force, then the six means. */
  disk_calibrate: { takes: { poses: Float64Array }; gives: Calibrated };
  /** The 42 numbers of a disk, or none for the drawing; gives what it was read as before. */
  disk_apply: { takes: { numbers: Float64Array }; gives: Float64Array };
}
