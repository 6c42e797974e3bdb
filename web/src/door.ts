/** What crosses the door of the core (crates/wasm): plain objects with the core's own names, SI units and radians. */

import type { CompassDoor } from './compass/door';
import type { NavigationDoor } from './navigation/door';
import type { MotionDoor } from './motion/door';
import type { RoadDoor } from './road/door';
import type { Mapping } from './wizard/door';

export type ParamValue = number | boolean | string | null;

export interface Progress {
  done: boolean;
  fraction: number | null;
  stage: 'reading' | 'mapping' | 'simulating' | 'estimating';
  rows: number;
}

export interface Need {
  label: string;
  required: boolean;
  why: string;
}

interface ParamCommon {
  name: string;
  symbol: string;
  unit: string;
  doc: string;
  source: string;
}
export interface NumberParam extends ParamCommon {
  kind: 'number';
  default: number;
  min: number;
  max: number;
  scale: 'linear' | 'log';
}
export interface OptionalParam extends ParamCommon {
  kind: 'optional';
  min: number;
  max: number;
}
export interface ToggleParam extends ParamCommon {
  kind: 'toggle';
  default: boolean;
}
export interface ChoiceParam extends ParamCommon {
  kind: 'choice';
  default: string;
  options: string[];
}
export type ParamSpec = NumberParam | OptionalParam | ToggleParam | ChoiceParam;

export interface Column {
  name: string;
  unit: string;
  doc: string;
  sigma_of: string | null;
  truth: string | null;
  nis: number | null;
}

export interface EstimatorInfo {
  name: string;
  title: string;
  doc: string;
  vehicle: string;
  needs: Need[];
  params: ParamSpec[];
  columns: Column[];
}

export interface Catalogue {
  version: string;
  estimators: EstimatorInfo[];
  drives: { name: string; title: string; doc: string; duration: number }[];
  vehicles: { name: string; doc: string }[];
}

/** How a log was read: which raw column became which signal, and what was left aside. */
export interface OpenReport {
  name: string;
  bytes: number;
  rows: number;
  epoch: string | null;
  layout: { separator: string; decimal: string; header_row: number | null; unit_row: number | null; skipped_lines: number };
  used: { signal: string; column: string; conversion: string; why: string; confidence: 'guess' | 'likely' | 'certain'; values: number }[];
  unused: { column: string; reason: string }[];
  notes: string[];
  warnings: OpenWarning[];
  /** Whether its columns were held against physics when it was opened. */
  is_examined: boolean;
  /** What the log was read with, for saving. */
  mapping: Mapping | null;
}

/** Something that was passed over or looks wrong. */
export interface OpenWarning {
  message: string;
  column: string | null;
  row: number | null;
  count: number;
}

export interface DriveReport {
  name: string;
  kind: 'simulated' | 'file';
  start: number;
  end: number;
  channels: { name: string; rows: number; rate_hz: number; columns: string[] }[];
  truth: string[];
  has_vehicle: boolean;
  import: OpenReport | null;
  estimators: { name: string; runnable: boolean; missing: Need[] }[];
  /** Whether the rest of the drive is still to come (said by the worker). */
  is_partial?: boolean;
}

export interface Metric {
  column: string;
  unit: string;
  truth: string;
  count: number;
  rmse: number;
  bias: number;
  max: number;
  rmse_centred: number;
  correlation: number | null;
  coverage: number | null;
  nees: number | null;
}

export interface Consistency {
  column: string;
  dof: number;
  count: number;
  mean: number;
  inside: number;
  effective: number;
  band: [number, number];
  verdict: 'consistent' | 'cautious' | 'optimistic';
  sigma_factor: number;
}

export interface PositionScore {
  count: number;
  rmse_horizontal: number;
  median: number;
  p95: number;
  max: number;
  last: number;
  rmse_vertical: number | null;
}

export interface Latency {
  count: number;
  missed: number;
  mean: number | null;
  max: number | null;
}

export interface ModeScore {
  count: number;
  accuracy: number;
  accuracy_guarded: number | null;
  confusion: number[][];
  launch: Latency;
  stop: Latency;
  corner_entry: Latency;
  corner_exit: Latency;
}

export interface Score {
  metrics: Metric[];
  consistency: Consistency[];
  position: PositionScore | null;
  mode: ModeScore | null;
}

export interface RunReport {
  estimator: string;
  params: Record<string, ParamValue>;
  rows: number;
  start: number | null;
  end: number | null;
  seconds: number;
  notices: { text: string; count: number; first: number }[];
  score: Score;
}

export type Measure = 'rmse' | 'attitude_rmse' | 'horizontal_rmse' | 'mode_accuracy' | 'consistency';

export interface Change {
  measure: Measure;
  column: string;
  unit: string;
  before: number;
  after: number;
  ratio: number | null;
  better: boolean | null;
}

export interface Comparison {
  headline: Change | null;
  metrics: Change[];
  consistency: Change[];
}

/** What a drive says besides its columns: name, parameters of the car, rear axle, Unix time of t = 0, how it was read, if it was, and the numbers of its six-accelerometer disk. */
export type DriveHead = [string, Float64Array | undefined, number | undefined, number | undefined, OpenReport | undefined, Float64Array | undefined];
/** Part of a drive: name, names of its columns, times, columns; an empty column has no value. */
export type DrivePart = [string, string[], Float64Array, Float64Array[]];

/** The session as the worker sees it. */
export interface Door extends CompassDoor, MotionDoor, NavigationDoor, RoadDoor {
  catalogue(): Omit<Catalogue, 'drives'>;
  begin_parts(...head: DriveHead): void;
  add_part(...part: DrivePart): void;
  end_parts(): void;
  cancel_parts(): void;
  report(): DriveReport;
  begin_run(estimator: string, params: Record<string, ParamValue>, vehicle: string | null | undefined): void;
  run_some(estimator: string, budgetMs: number): Progress;
  forget_run(name: string): void;
  cancel_run(estimator: string): void;
  result(estimator: string, which: 'current' | 'previous'): RunReport | null;
  change(estimator: string): Comparison | null;
  keep_previous(estimator: string, keep: boolean): void;
  drop_previous(estimator: string): void;
  grid_times(t0: number, t1: number, buckets: number): Float64Array;
  grid(source: string, column: string, t0: number, t1: number, buckets: number, step: boolean): Float64Array;
  value_at(source: string, column: string, t: number): number;
  path(source: string, t0: number, t1: number, maxPoints: number): Float64Array;
  export_csv(source: string): Uint8Array;
}
