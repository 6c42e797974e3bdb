/** Examining a log by physics: the files are read once more, when nothing else is to be done. */

import type { Progress } from '../door';
import type { Examined, Trial } from '../wizard/door';
import { type FileReaders, readers, type Thinned } from './readers';
import type { Operations } from './rpc';

/** The name of the work in the queue; opening a drive ends it. */
export const EXAMINING = 'examine';

/** The log that was examined last, thinned; mappings are tried on it. */
let thin: Thinned | null = null;

/** What a mapping makes of the log that was examined last. */
export async function tryOut(mapping: string): Promise<[Trial, Transferable[]]> {
  const loaded = await readers();
  if (!thin) throw new Error('nothing was examined');
  const [clashes, series] = loaded.tryOut(thin, mapping);
  return [{ clashes, start: thin[0], series }, series.map((s) => s.buffer)];
}

export class Examining {
  readonly estimator = EXAMINING;
  readonly yields = true;
  readonly id: number;
  waits = true;
  begun = false;
  #args: Operations['examine']['takes'];
  #reader: FileReaders | null = null;
  #budget: number;

  constructor(id: number, args: Operations['examine']['takes'], budget: number) {
    this.id = id;
    this.#args = args;
    this.#budget = budget;
  }

  /** What reads files is there. */
  ready(reader: FileReaders): void {
    this.#reader = reader;
    this.waits = false;
  }

  begin(): void {
    const { files, mapping, keep } = this.#args;
    this.#there().beginExamination(files, mapping ?? undefined, keep);
  }

  some(): Progress {
    return this.#there().read_some(this.#budget);
  }

  cancel(): void {
    this.#reader?.cancel();
  }

  finish(): Examined {
    const [found, pictures, choices, thinned] = this.#there().examination();
    thin = thinned;
    return [found, pictures, choices];
  }

  #there(): FileReaders {
    if (!this.#reader) throw new Error('the readers are not there');
    return this.#reader;
  }
}
