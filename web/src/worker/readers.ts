/** The readers' module: loaded when the worker is idle or the first file comes, and what passes from it to the core. */

import type { Door, DriveHead, DrivePart, Progress } from '../door';
import { files as say } from '../messages/files';
import type { Shelf } from './shelf';

/** The readers as the worker sees them (crates/readers). */
export interface ReaderDoor {
  begin(files: File[], mapping: string | undefined): void;
  read_some(budgetMs: number): Progress;
  head(): DriveHead;
  next_part(): DrivePart | undefined;
  cancel(): void;
}

/** What a file is to others that are dropped with it. */
export type Role = 'database' | 'bus' | 'log';

/** The loaded module. */
export interface Readers {
  role(file: File): Role;
  reader(): ReaderDoor;
  /** Give its memory back: WebAssembly's never shrinks. Readers made before are of no use then. */
  reset(): void;
}

let loading: Promise<Readers> | null = null;

/** The readers; after a failure the next call tries again. */
export function readers(): Promise<Readers> {
  loading ??= import('../generated/drivescope_readers.js')
    .then(async ({ default: init, Reader, role, __wbg_reset_state: reset }) => {
      await init();
      return { role: role as (file: File) => Role, reader: () => new Reader() as unknown as ReaderDoor, reset };
    })
    .catch((reason: unknown) => {
      loading = null;
      throw reason;
    });
  return loading;
}

/** Files on their way through the readers into the core. */
export class Reading {
  #readers: Readers;
  #door: Door;
  #shelf: Shelf;
  #reader: ReaderDoor | null = null;
  #names = '';
  /** Rows of what has been read to its end. */
  #rows: number | null = null;

  constructor(readers: Readers, door: Door, shelf: Shelf) {
    this.#readers = readers;
    this.#door = door;
    this.#shelf = shelf;
  }

  begin(files: File[], mapping: string | null): void {
    this.#door.cancel_open();
    this.#names = files.map((f) => f.name).join(', ');
    this.#read(() => {
      const taken = this.#shelf.take(files, mapping, (file) => this.#readers.role(file));
      this.#reader = this.#readers.reader();
      this.#reader.begin(taken.files, taken.mapping ?? undefined);
    });
  }

  /** One piece of work: reading, or one part handed over; the core puts the drive in place when it has them all. */
  some(budget: number): Progress {
    const reader = this.#reader;
    if (!reader) return this.#door.open_some(budget);
    if (this.#rows === null) {
      const progress = this.#read(() => reader.read_some(budget));
      if (!progress.done) return progress;
      this.#rows = progress.rows;
      this.#hand(() => this.#door.begin_parts(...reader.head()));
    } else {
      const part = this.#read(() => reader.next_part());
      if (part) this.#hand(() => this.#door.add_part(...part));
      else this.#free();
    }
    return { done: false, fraction: 1, stage: 'mapping', rows: this.#rows };
  }

  cancel(): void {
    this.#free();
    this.#door.cancel_open();
  }

  #free(): void {
    this.#reader = null;
    this.#readers.reset();
  }

  /** What the core refuses ends the reading. */
  #hand(action: () => void): void {
    try {
      action();
    } catch (reason) {
      this.#free();
      throw reason;
    }
  }

  /** A reader that breaks ends its own module, and neither the core nor the page. */
  #read<T>(action: () => T): T {
    try {
      return action();
    } catch (reason) {
      this.#free();
      if (reason instanceof WebAssembly.RuntimeError || reason instanceof RangeError) {
        throw new Error(say.broken(this.#names, reason.message));
      }
      throw reason;
    }
  }
}
