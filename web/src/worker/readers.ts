/** The readers' module: loaded when the worker is idle or the first file comes. */

import type { DriveHead, DrivePart, Progress } from '../door';
import { files as say } from '../messages/files';
import type { Maker } from './making';
import { inMemory, type Role, Shelf } from './shelf';

/** The readers as the worker sees them (crates/readers). */
export interface ReaderDoor extends Maker {
  begin(files: File[], mapping: string | undefined): void;
  read_some(budgetMs: number): Progress;
}

/** The loaded module. */
export interface ReaderModule {
  role(file: File): Role;
  reader(): ReaderDoor;
  /** Give the module's memory back, since that of WebAssembly never shrinks. Readers made before are of no use then. */
  reset(): void;
}

/** A reader for every drive: its memory is given back after it, and a reader that breaks takes nothing else with it. */
export class FileReaders implements ReaderDoor {
  #module: ReaderModule;
  #shelf: Shelf;
  #reader: ReaderDoor | null = null;
  #names = '';

  constructor(module: ReaderModule, shelf: Shelf) {
    this.#module = module;
    this.#shelf = shelf;
  }

  begin(files: File[], mapping: string | undefined): void {
    this.cancel();
    this.#names = files.map((f) => f.name).join(', ');
    this.#guarded(() => {
      const taken = this.#shelf.take(files, mapping, (file) => this.#module.role(file));
      this.#reader = this.#module.reader();
      this.#reader.begin(taken.files, taken.mapping);
    });
  }

  read_some(budgetMs: number): Progress {
    return this.#guarded(() => this.#there().read_some(budgetMs));
  }

  head(): DriveHead {
    return this.#guarded(() => this.#there().head());
  }

  next_part(): DrivePart | undefined {
    const part = this.#guarded(() => this.#there().next_part());
    if (!part) this.cancel();
    return part;
  }

  cancel(): void {
    if (this.#reader) this.#module.reset();
    this.#reader = null;
  }

  #there(): ReaderDoor {
    if (!this.#reader) throw new Error('nothing is being read');
    return this.#reader;
  }

  #guarded<T>(action: () => T): T {
    try {
      return action();
    } catch (reason) {
      this.#reader = null;
      this.#module.reset();
      const isBroken = reason instanceof WebAssembly.RuntimeError || reason instanceof RangeError;
      throw isBroken ? new Error(say.broken(this.#names, reason.message)) : reason;
    }
  }
}

let loading: Promise<ReaderDoor> | null = null;

/** The readers; after a failure the next call tries again. */
export function readers(): Promise<ReaderDoor> {
  loading ??= import('../generated/drivescope_readers.js')
    .then(async ({ default: init, Reader, role, __wbg_reset_state: reset }) => {
      await init();
      const made = { role: role as (file: File) => Role, reader: () => new Reader() as unknown as ReaderDoor, reset };
      return new FileReaders(made, new Shelf(inMemory));
    })
    .catch((reason: unknown) => {
      loading = null;
      throw reason;
    });
  return loading;
}
