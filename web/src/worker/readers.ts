/** The readers' module: loaded when the worker is idle or the first file comes, and what passes from it to the core. */

import type { Door, DrivePart, DriveHead, Progress } from '../door';

/** The readers as the worker sees them (crates/readers). */
export interface ReaderDoor {
  begin(files: File[], mapping: string | undefined): void;
  read_some(budgetMs: number): Progress;
  head(): DriveHead;
  next_part(): DrivePart | undefined;
  cancel(): void;
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

/** Files on their way through the readers into the core. */
export class Reading {
  #reader: ReaderDoor;
  #door: Door;
  /** Rows of what has been read to its end. */
  #rows: number | null = null;

  constructor(reader: ReaderDoor, door: Door) {
    this.#reader = reader;
    this.#door = door;
  }

  begin(files: File[], mapping: string | null): void {
    this.#door.cancel_open();
    this.#reader.begin(files, mapping ?? undefined);
  }

  /** One piece of work: reading, or one part handed over; the core puts the drive in place when it has them all. */
  some(budget: number): Progress {
    if (this.#rows === null) {
      const progress = this.#reader.read_some(budget);
      if (!progress.done) return progress;
      this.#rows = progress.rows;
      this.#door.begin_parts(...this.#reader.head());
    } else {
      const part = this.#reader.next_part();
      if (!part) return this.#door.open_some(budget);
      this.#door.add_part(...part);
    }
    return { done: false, fraction: 1, stage: 'reading', rows: this.#rows };
  }

  cancel(): void {
    this.#reader.cancel();
    this.#door.cancel_open();
  }
}
