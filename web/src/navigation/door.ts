/** What crosses the door of the core for blinded sensors and faults (crates/wasm/src/outages.rs, faults.rs): SI units and radians. */

import type { ParamValue, Progress } from '../door';

/** A sensor that can be blinded. */
export type Sensor = 'gnss' | 'mag' | 'odometer';

/** A stretch of time in which a sensor is blind, s. */
export interface Blind {
  readonly sensor: Sensor;
  readonly t0: number;
  readonly t1: number;
}

/** The drift at one time into a window; what has no value is null or no number. */
export interface DriftAt {
  after: number;
  distance: number | null;
  growth: number | null;
  share: number | null;
  yaw: number | null;
}

export interface Drift {
  window: [number, number];
  driven: number | null;
  largest: number | null;
  at: DriftAt[];
}

/** Median, 95th percentile and largest over the windows of a sweep. */
export interface Distribution {
  after: number;
  count: number;
  distance: [number, number, number];
  share: [number, number, number];
  yaw: [number, number, number];
}

export interface Swept {
  drifts: Drift[];
  distribution: Distribution[];
}

/** How the window moves over the drive, s. */
export interface SweepPlan {
  sensor: Sensor;
  length: number;
  step: number;
  recovery: number;
}

/** A fault as the core reads it. */
export type Fault = { readonly from: number; readonly to: number; readonly seed: number } & (
  | { readonly kind: 'bias'; readonly signal: string; readonly amount: number }
  | { readonly kind: 'freeze'; readonly signal: string }
  | { readonly kind: 'delay'; readonly signal: string; readonly seconds: number }
  | { readonly kind: 'noise'; readonly signal: string; readonly factor: number }
  | { readonly kind: 'clock_jump'; readonly metres: number }
  | { readonly kind: 'multipath'; readonly metres: number; readonly satellites: number }
);

/** Blinded sensors and faults as the worker sees them. */
export interface NavigationDoor {
  begin_blind_run(name: string, params: Record<string, ParamValue>, car: string | undefined, sensors: Sensor[], flat: Float64Array): void;
  drift(blinded: string, seeing: string, flat: Float64Array): Drift[] | null;
  begin_sweep(estimator: string, params: Record<string, ParamValue>, car: string | undefined, sensor: Sensor, length: number, step: number, recovery: number): void;
  sweep_some(budgetMs: number): Progress;
  swept(): Swept | null;
  cancel_sweep(): void;
  set_faults(faults: readonly Fault[]): void;
}

/** Their operations, as the page asks for them. */
export interface NavigationOperations {
  drift: { takes: { blinded: string; seeing: string; windows: readonly Blind[] }; gives: Drift[] };
  sweep: { takes: { estimator: string; params: Record<string, ParamValue>; vehicle: string | null; plan: SweepPlan }; gives: Swept };
  set_faults: { takes: { faults: readonly Fault[] }; gives: null };
}
