/** The readers' module: loaded when the worker is idle or the first file comes. */

import type { DriveHead, DrivePart, Progress } from '../door';
import { files as say } from '../messages/files';
import type { Maker } from './making';
import type { Clash, Examined } from '../wizard/door';
import { type Keep, type Offer, TooLarge } from './rpc';
import { inMemory, type Role, Shelf } from './shelf';

/** Columns of a log thinned to tenths of a second: the middle of the first bin (s), names, columns. */
export type Thinned = [start: number, names: string[], columns: Float64Array[]];

/** The readers as the worker sees them (crates/readers). */
export interface ReaderDoor extends Maker {
  begin(files: File[], mapping: string | undefined, keep: string): void;
  begin_examination(files: File[], keep: string): void;
  read_some(budgetMs: number): Progress;
  examination(): [...Examined, Thinned] | undefined;
  /** What would make the file fit that was refused for its size. */
  offer(): Offer | undefined;
}

/** The most that columns may take, bytes: the core holds them too, and a module has 4 GB. */
const MOST = 1.5e9;

/** What columns may take on this computer, bytes; few browsers say how much memory it has, and none more than 8 GB. */
function memory(): number {
  const gigabytes = (navigator as { deviceMemory?: number }).deviceMemory ?? 8;
  return Math.min(MOST, (gigabytes * 1e9) / 4);
}

/** The loaded module. */
export interface ReaderModule {
  role(file: File): Role;
  reader(): ReaderDoor;
  tryMapping(...args: [...Thinned, mapping: string]): [Clash[], Float64Array<ArrayBuffer>[]];
  /** Give the module's memory back, since that of WebAssembly never shrinks. Readers made before are of no use then. */
  reset(): void;
}

/** A reader for every drive: its memory is given back after it, and a reader that breaks takes nothing else with it. */
export class FileReaders implements Maker {
  #module: ReaderModule;
  #shelf: Shelf;
  #memory: number;
  #reader: ReaderDoor | null = null;
  #names = '';
  /** What was found about the log that was read last. */
  #examined: [...Examined, Thinned] | null = null;

  /** `memory` is what columns may take, bytes. */
  constructor(module: ReaderModule, shelf: Shelf, memory: number) {
    this.#memory = memory;
    this.#module = module;
    this.#shelf = shelf;
  }

  begin(files: File[], mapping: string | undefined, keep: Keep = {}): void {
    this.#start(files, mapping, (reader, taken) => reader.begin(taken.files, taken.mapping, this.#kept(keep)));
  }

  /** Read files in order to examine them; `mapping` is remembered as that of a bus log. */
  beginExamination(files: File[], mapping: string | undefined, keep: Keep = {}): void {
    this.#start(files, mapping, (reader, taken) => reader.begin_examination(taken.files, this.#kept(keep)));
  }

  #kept(keep: Keep): string {
    return JSON.stringify({ ...keep, memory: this.#memory });
  }

  #start(files: File[], mapping: string | undefined, begin: (reader: ReaderDoor, taken: ReturnType<Shelf['take']>) => void): void {
    this.cancel();
    this.#examined = null;
    this.#names = files.map((f) => f.name).join(', ');
    this.#guarded(() => {
      const taken = this.#shelf.take(files, mapping, (file) => this.#module.role(file));
      this.#reader = this.#module.reader();
      begin(this.#reader, taken);
    });
  }

  /** What was found about the log that was read last, null where that was not asked; it is no longer held here, and the reader's memory is given back. */
  examination(): [...Examined, Thinned] | null {
    this.#end();
    const found = this.#examined;
    this.#examined = null;
    return found;
  }

  /** What a mapping makes of a thinned log. */
  tryOut(thin: Thinned, mapping: string): [Clash[], Float64Array<ArrayBuffer>[]] {
    return this.#guarded(() => this.#module.tryMapping(...thin, mapping));
  }

  read_some(budgetMs: number): Progress {
    return this.#guarded(() => this.#there().read_some(budgetMs));
  }

  head(): DriveHead {
    return this.#guarded(() => this.#there().head());
  }

  next_part(): DrivePart | undefined {
    const part = this.#guarded(() => this.#there().next_part());
    if (!part) this.#end();
    return part;
  }

  /** Keep what was found, give the rest back. */
  #end(): void {
    this.#examined = (this.#reader && this.#guarded(() => this.#there().examination())) ?? this.#examined;
    this.cancel();
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
      const isBroken = reason instanceof WebAssembly.RuntimeError || reason instanceof RangeError;
      const offer = isBroken ? undefined : this.#reader?.offer();
      this.#reader = null;
      this.#module.reset();
      if (isBroken) throw new Error(say.broken(this.#names, reason.message));
      throw offer && reason instanceof Error ? new TooLarge(reason.message, offer) : reason;
    }
  }
}

let loading: Promise<FileReaders> | null = null;

/** The readers; after a failure the next call tries again. */
export function readers(): Promise<FileReaders> {
  loading ??= import('../generated/drivescope_readers.js')
    .then(async ({ default: init, Reader, role, try_mapping, __wbg_reset_state: reset }) => {
      await init();
      const made: ReaderModule = {
        role: role as ReaderModule['role'],
        reader: () => new Reader() as unknown as ReaderDoor,
        tryMapping: try_mapping as ReaderModule['tryMapping'],
        reset,
      };
      return new FileReaders(made, new Shelf(inMemory), memory());
    })
    .catch((reason: unknown) => {
      loading = null;
      throw reason;
    });
  return loading;
}
