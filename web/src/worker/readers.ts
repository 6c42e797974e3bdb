/** The readers' module: loaded when the worker is idle or the first file comes. */

import type { Progress } from '../door';
import type { Maker } from './making';

/** The readers as the worker sees them (crates/readers). */
export interface ReaderDoor extends Maker {
  begin(files: File[], mapping: string | undefined): void;
  read_some(budgetMs: number): Progress;
}

let loading: Promise<ReaderDoor> | null = null;

/** The readers; after a failure the next call tries again. */
export function readers(): Promise<ReaderDoor> {
  loading ??= import('../generated/drivescope_readers.js')
    .then(async ({ default: init, Reader }) => {
      await init();
      return new Reader() as unknown as ReaderDoor;
    })
    .catch((reason: unknown) => {
      loading = null;
      throw reason;
    });
  return loading;
}
