/** What physics found about the open log: kept from its opening, or found by reading the files once more when nothing else is to be done. */

import type { Progress } from '../door';
import type { Examined, Trial } from '../wizard/door';
import { type FileReaders, readers, type Thinned } from './readers';
import type { Operations } from './rpc';

/** The name of the work in the queue; opening a drive ends it. */
export const EXAMINING = 'examine';

type Files = Operations['examine']['takes'];

/** What was found about the open log, and its columns, thinned, on which mappings are tried. */
let kept: { files: string; examined: Examined; thin: Thinned } | null = null;

/** Files and what is read of them, so that they are known again: every message has copies of its own. */
function named({ files, keep }: Pick<Files, 'files' | 'keep'>): string {
  return JSON.stringify([files.map((f) => [f.name, f.size, f.lastModified]), keep]);
}

/** Keep what was found about files that were opened; where their columns were not examined, what was found before stays if it is of the same files. */
export function keep(files: Pick<Files, 'files' | 'keep'> | null, found: [...Examined, Thinned] | null): void {
  const name = files ? named(files) : '';
  if (found) kept = { files: name, examined: [found[0], found[1], found[2]], thin: found[3] };
  else if (kept?.files !== name) kept = null;
}

/** What was found about files; null where they have to be read for that. */
export function examined(files: Files): Examined | null {
  return kept?.files === named(files) ? kept.examined : null;
}

/** What a mapping makes of the open log. */
export async function tryOut(mapping: string): Promise<[Trial, Transferable[]]> {
  const loaded = await readers();
  if (!kept) throw new Error('nothing was examined');
  const [clashes, series] = loaded.tryOut(kept.thin, mapping);
  return [{ clashes, start: kept.thin[0], series }, series.map((s) => s.buffer)];
}

export class Examining {
  readonly estimator = EXAMINING;
  readonly yields = true;
  readonly id: number;
  waits = true;
  begun = false;
  #args: Files;
  #reader: FileReaders | null = null;
  #budget: number;

  constructor(id: number, args: Files, budget: number) {
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
    keep(this.#args, this.#there().examination());
    const found = examined(this.#args);
    if (!found) throw new Error('nothing was examined');
    return found;
  }

  #there(): FileReaders {
    if (!this.#reader) throw new Error('the readers are not there');
    return this.#reader;
  }
}
