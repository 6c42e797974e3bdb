/** What crosses the door of the closed loops (crates/gallery), and the conversation between the page and their worker. */

import type { ParamSpec, ParamValue, Progress } from '../door';

export type Settings = Record<string, ParamValue>;

export interface LoopInfo {
  name: string;
  title: string;
  doc: string;
  settings: Settings;
}

export interface LoopCatalogue {
  loops: LoopInfo[];
  parameters: { name: string; specs: ParamSpec[] }[];
  car_columns: { name: string }[];
  guidance_columns: { name: string }[];
}

/** A loop in a few numbers; null where one has no meaning. */
export type Summary = Record<string, number | null>;

/** Times and columns by name. */
export interface Rows {
  time: Float64Array;
  columns: Record<string, Float64Array>;
}

/** A loop driven to its end. */
export interface Driven {
  name: string;
  settings: Settings;
  summary: Summary;
  hasFailed: boolean;
  car: Rows;
  guidance: Rows;
  /** 72 numbers for each row of guidance; sector i is centred on 5 i deg from north. */
  magnitudes: Float64Array;
  blocked: Uint8Array;
  /** North, east. */
  path: Float64Array;
  /** North, east, radius. */
  obstacles: Float64Array;
  /** How far ahead of the place in the rows the front and the rear axle are, and the track, m. */
  size: Float64Array;
}

/** The loop that is being driven, as the worker sees it. */
export interface DrivenLoop {
  drive_some(budgetMs: number): Progress;
  has_failed(): boolean;
  settings(): Settings;
  summary(): Summary;
  times(source: 'car' | 'guidance'): Float64Array;
  column(source: 'car' | 'guidance', name: string): Float64Array;
  magnitudes(): Float64Array;
  blocked(): Uint8Array;
  path(): Float64Array;
  obstacles(): Float64Array;
  size(): Float64Array;
  free(): void;
}

export interface Wanted {
  id: number;
  name: string;
  /** What differs from the loop's own settings. */
  settings: Settings;
  seed: number;
}
export type ToWorker = { drive: Wanted[] };
export type FromWorker =
  | { catalogue: LoopCatalogue }
  | { id: number; fraction: number }
  | { id: number; driven: Driven }
  | { id: number; failed: string }
  | { dead: string };
