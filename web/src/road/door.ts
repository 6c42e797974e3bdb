/** What crosses the door of the core for the road (crates/wasm/src/profile.rs): SI units and radians. */

/** What a road profile was made of. */
export interface ProfileReport {
  /** Names of the drives whose passes are kept, and whether each shares a stretch with this road. */
  kept: [string, boolean][];
  /** Passes of this drive, and the most that met at one place. */
  laps: number;
  passes: number;
  points: number;
  length: number;
  /** Why there is none; empty before there is an estimate. */
  refusal: string | null;
}

/** What a drive says of its own sensors. */
export interface Offers {
  latency: { delay: number; sigma: number; correlation: number } | null;
  is_late: boolean;
  offset: { offset: number; sigma: number; distance: number } | null;
  is_offset: boolean;
  has_height: boolean;
}

/** The road as the worker sees it. */
export interface RoadDoor {
  profile(name: string): ProfileReport;
  keep_pass(name: string): void;
  forget_passes(): void;
  profile_file(isMap: boolean): Uint8Array;
  lamps(vehicle: string | undefined): string[];
  sensor_offers(): Offers;
  spread(source: string, column: string, t0: number, t1: number): Float64Array;
  distance(source: string, column: string, t0: number, t1: number, count: number): Float64Array;
}

/** Its operations, as the page asks for them. */
export interface RoadOperations {
  /** Make the profile of the source `road:profile`; `name` is that of the drive's pass. */
  profile: { takes: { name: string }; gives: ProfileReport };
  keep_pass: { takes: { name: string }; gives: null };
  forget_passes: { takes: Record<string, never>; gives: null };
  profile_file: { takes: { isMap: boolean }; gives: Uint8Array };
  /** Make the source `road:lamps`; gives the reasons by their number, from 1. */
  lamps: { takes: { vehicle: string | null }; gives: string[] };
  sensor_offers: { takes: Record<string, never>; gives: Offers };
  /** For each item its number of values, mean, standard deviation, least and greatest; empty without values. */
  spread: { takes: { items: { source: string; column: string }[]; t0: number; t1: number }; gives: Float64Array[] };
  /** Distance that a column of speed makes, at `count` even instants. */
  distance: { takes: { source: string; column: string; t0: number; t1: number; count: number }; gives: Float64Array };
}
