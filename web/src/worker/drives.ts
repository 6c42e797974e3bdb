/** The module of the simulated drives, loaded with the core. */

import type { Catalogue, Progress } from '../door';
import init, { Simulator } from '../generated/drivescope_drives.js';
import type { Maker } from './making';

/** The simulated drives as the worker sees them (crates/drives). */
export interface DrivesDoor extends Maker {
  catalogue(): Catalogue['drives'];
  sketch(name: string): Float64Array;
  description(name: string): string;
  begin(name: string, seed: number | undefined, composed: string | undefined, first: number | undefined): void;
  /** Done means that a drive, or its beginning, can be handed over. */
  simulate_some(budgetMs: number): Progress;
  is_partial(): boolean;
}

export async function loadDrives(): Promise<DrivesDoor> {
  await init();
  return new Simulator() as unknown as DrivesDoor;
}
