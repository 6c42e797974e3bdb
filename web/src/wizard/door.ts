/** What crosses the door of the readers for the table of columns (crates/import/src/examine): SI units and degrees as named. */

import type { Disk } from '../motion/disk-file';
import type { Keep } from '../worker/rpc';

/** Where a signal comes from: `scale * (raw value in SI) + offset`. */
export interface SignalSource {
  column: string;
  unit?: string;
  scale?: number;
  offset?: number;
  blank?: number[];
}

export interface Mount {
  roll_deg: number;
  pitch_deg: number;
  yaw_deg: number;
}

export interface Origin {
  lat_deg: number;
  lon_deg: number;
  alt: number;
}

/** What a log is read with, as saved. */
export interface Mapping {
  version: number;
  time: { column: string; unit?: string; offset?: number; fraction?: { column: string; unit: string }; skip_steps_back?: boolean };
  signals: Record<string, SignalSource>;
  drop_repeats?: string[];
  mounts?: Record<string, Mount>;
  delays?: Record<string, number>;
  disk?: Disk;
  origin?: Origin;
}

export type Confidence = 'guess' | 'likely' | 'certain';

export interface ColumnView {
  column: string;
  stated_unit: string | null;
  rate: number | null;
  range: [number, number] | null;
  values: number;
  held: boolean;
  signal: string | null;
  unit: string | null;
  scale: number;
  confidence: Confidence | null;
  why: string;
  name_says: string | null;
}

export interface Finding {
  weight: 'note' | 'guess' | 'contradiction';
  columns: string[];
  text: string;
}

/** What physics found about a log. */
export interface Found {
  mapping: Mapping;
  columns: ColumnView[];
  mounts: { channel: string; mount: Mount; sigma_deg: number; applied: boolean; why: string }[];
  delays: { channel: string; late: number; sigma: number; applied: boolean; why: string }[];
  findings: Finding[];
  names_believed: boolean;
}

/** A signal that a column can be read as; `units` holds one spelling of each with commas between them. */
export interface Choice {
  signal: string;
  channel: string;
  unit: string;
  units: string;
  doc: string;
}

/** What was found, of each column the least and the largest value of equal parts in turn, what can be chosen. */
export type Examined = [found: Found, pictures: Float64Array[], choices: Choice[]];

/** How one signal should be read instead. */
export interface Correction {
  signal: string;
  unit: string;
  scale: number;
}

/** A contradiction between what a mapping says and what the sensors measure. */
export interface Clash {
  signals: string[];
  columns: string[];
  text: string;
  corrections: Correction[];
}

/** Series of a trial, in the order of `TRIAL_SERIES` of the core. */
export const SERIES = [
  'roll', 'pitch', 'turned', 'accel_x', 'accel_y', 'accel_z', 'gyro_z', 'north', 'east', 'speed',
  'expected_x', 'expected_y', 'expected_turn', 'course', 'grade', 'compass', 'ground_speed',
] as const;
export type SeriesName = (typeof SERIES)[number];

/** Seconds between two values of a series. */
export const STEP = 0.1;

/** What a mapping makes of the log that was examined: SI units and radians, one value per tenth of a second from `start`. */
export interface Trial {
  clashes: Clash[];
  start: number;
  series: Float64Array<ArrayBuffer>[];
}

export interface WizardOperations {
  examine: { takes: { files: File[]; mapping: string | null; keep?: Keep }; gives: Examined };
  try_out: { takes: { mapping: string }; gives: Trial };
}
