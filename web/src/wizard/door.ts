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

export interface WizardOperations {
  examine: { takes: { files: File[]; mapping: string | null; keep?: Keep }; gives: Examined };
}
