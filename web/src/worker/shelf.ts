/** What is remembered from one dropping of files to the next: databases of bus signals, and the bus log that may need one. */

import { files as say } from '../messages/files';

/** What a file is to others that are dropped with it. */
export type Role = 'database' | 'bus' | 'log';

/** Of a worker; the page's types do not have it. */
declare class FileReaderSync {
  readAsArrayBuffer(blob: Blob): ArrayBuffer;
}

export interface Taken {
  files: File[];
  mapping: string | undefined;
}

export class Shelf {
  #databases: File[] = [];
  #log: Taken | null = null;
  #copy: (file: File) => File;

  /** `copy` makes a file independent of the disk, where it may be changed later. */
  constructor(copy: (file: File) => File) {
    this.#copy = copy;
  }

  /**
   * What is to be read for these files. Databases alone are added to those that are kept and the bus log that was dropped
   * last is read again; with a log they take the place of those.
   */
  take(files: File[], mapping: string | undefined, role: (file: File) => Role): Taken {
    const roles = files.map(role);
    const logs = files.filter((_, i) => roles[i] !== 'database');
    const databases = files.filter((_, i) => roles[i] === 'database').map(this.#copy);
    if (logs.length === 0 && databases.length > 0) {
      const names = databases.map((f) => f.name);
      this.#databases = [...this.#databases.filter((f) => !names.includes(f.name)), ...databases];
      if (!this.#log) throw new Error(say.kept(names.join(', ')));
      return { files: [...this.#log.files, ...this.#databases], mapping: mapping ?? this.#log.mapping };
    }
    if (databases.length > 0) this.#databases = databases;
    const isBus = roles.includes('bus');
    this.#log = isBus ? { files: logs, mapping } : null;
    return { files: isBus ? [...logs, ...this.#databases] : files, mapping };
  }
}

/** A copy of a file in memory. */
export function inMemory(file: File): File {
  return new File([new FileReaderSync().readAsArrayBuffer(file)], file.name);
}
