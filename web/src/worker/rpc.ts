/** The typed conversation between the page and its worker. */

import type { CompassOperations } from '../compass/door';
import type { MotionOperations } from '../motion/door';
import type { Catalogue, Comparison, DriveReport, ParamValue, Progress, RunReport } from '../door';
import type { Blind, NavigationOperations } from '../navigation/door';
import type { RoadOperations } from '../road/door';
import type { WizardOperations } from '../wizard/door';

/** What is read of a large file: columns by name, a part of its time (s after its beginning), every nth row. */
export interface Keep {
  columns?: string[];
  from?: number;
  to?: number;
  every?: number;
}

/** What would make a file fit that was refused for its size. */
export interface Offer {
  columns: number;
  seconds: number | null;
  every: number;
}

export type OpenRequest =
  /** `composed` is a drive's JSON text, null for a built-in one. With `first`, done once that many seconds are simulated: the report says that it is partial, and asking again goes on. */
  | { kind: 'simulation'; name: string; seed: number | null; first: number | null; composed: string | null }
  | { kind: 'files'; files: File[]; mapping: string | null; keep?: Keep };

/** One column on the grid of a window. */
export interface GridItem {
  source: string;
  column: string;
  step: boolean;
}
export interface GridReply {
  t0: number;
  t1: number;
  times: Float64Array;
  columns: Float64Array[];
}
export interface RunReply {
  current: RunReport;
  previous: RunReport | null;
  change: Comparison | null;
}

/** Every operation: what it takes and what it gives. */
export interface Operations extends CompassOperations, MotionOperations, NavigationOperations, RoadOperations, WizardOperations {
  catalogue: { takes: Record<string, never>; gives: Catalogue };
  open: { takes: OpenRequest; gives: DriveReport };
  /** With `blind`, sensors see nothing in some windows. */
  run: { takes: { estimator: string; params: Record<string, ParamValue>; vehicle: string | null; blind?: readonly Blind[] }; gives: RunReply };
  /** Length, number of points, points, speeds; see the core. */
  sketch: { takes: { name: string }; gives: Float64Array };
  /** JSON of a built-in drive. */
  description: { takes: { name: string }; gives: string };
  /** Forget a further run, `orientation@triad`. */
  forget_run: { takes: { name: string }; gives: null };
  keep_previous: { takes: { estimator: string; keep: boolean }; gives: null };
  drop_previous: { takes: { estimator: string }; gives: null };
  grid: { takes: { items: GridItem[]; t0: number; t1: number; buckets: number }; gives: GridReply };
  /** Every item at every instant, instant by instant. */
  values: { takes: { items: { source: string; column: string }[]; times: number[] }; gives: Float64Array };
  path: { takes: { source: string; t0: number; t1: number; points: number }; gives: Float64Array };
  csv: { takes: { source: string }; gives: Uint8Array };
}
export type Operation = keyof Operations;

export interface Request<O extends Operation = Operation> {
  id: number;
  op: O;
  args: Operations[O]['takes'];
}
export type ToWorker = Request | { cancel: number };
export type FromWorker =
  | { id: number; ok: true; value: unknown }
  /** With `isUnloaded`, what reads files could not be loaded. */
  | { id: number; ok: false; message: string; cancelled: boolean; isUnloaded?: boolean; offer?: Offer }
  | { id: number; progress: Progress }
  | { dead: string };

/** Thrown when work was given up because someone asked for that. */
export class Cancelled extends Error {
  constructor() {
    super('cancelled');
  }
}

/** Thrown when what reads files could not be loaded. */
export class Unloaded extends Error {
  constructor() {
    super('not loaded');
  }
}

/** Thrown when a file does not fit into memory; the message is the sentence for the reader. */
export class TooLarge extends Error {
  readonly offer: Offer;

  constructor(message: string, offer: Offer) {
    super(message);
    this.offer = offer;
  }
}

/** An answer that is under way. */
export interface Pending<T> {
  answer: Promise<T>;
  cancel(): void;
}

interface Waiting {
  resolve(value: unknown): void;
  reject(reason: Error): void;
  onProgress: ((progress: Progress) => void) | undefined;
}

/** The page's end of the conversation. */
export class RpcClient {
  #next = 1;
  #waiting = new Map<number, Waiting>();
  #port: Pick<Worker, 'postMessage'>;
  /** Called once when the worker cannot go on. */
  onDead: (message: string) => void = () => {};

  constructor(port: Pick<Worker, 'postMessage' | 'addEventListener'>) {
    this.#port = port;
    port.addEventListener('message', (event) => this.#receive((event as MessageEvent<FromWorker>).data));
  }

  /** Ask; the answer may be waited for or cancelled. */
  start<O extends Operation>(
    op: O,
    args: Operations[O]['takes'],
    onProgress?: (progress: Progress) => void,
  ): Pending<Operations[O]['gives']> {
    const id = this.#next++;
    const answer = new Promise<Operations[O]['gives']>((resolve, reject) => {
      this.#waiting.set(id, { resolve: resolve as (value: unknown) => void, reject, onProgress });
    });
    this.#port.postMessage({ id, op, args } satisfies Request<O>);
    return { answer, cancel: () => this.#port.postMessage({ cancel: id } satisfies ToWorker) };
  }

  /** Ask and wait. */
  call<O extends Operation>(op: O, args: Operations[O]['takes']): Promise<Operations[O]['gives']> {
    return this.start(op, args).answer;
  }

  #receive(message: FromWorker): void {
    if ('dead' in message) {
      this.onDead(message.dead);
      for (const waiting of this.#waiting.values()) waiting.reject(new Cancelled());
      this.#waiting.clear();
      return;
    }
    const waiting = this.#waiting.get(message.id);
    if (!waiting) return;
    if ('progress' in message) {
      waiting.onProgress?.(message.progress);
      return;
    }
    this.#waiting.delete(message.id);
    if (message.ok) waiting.resolve(message.value);
    else if (message.isUnloaded) waiting.reject(new Unloaded());
    else if (message.offer) waiting.reject(new TooLarge(message.message, message.offer));
    else waiting.reject(message.cancelled ? new Cancelled() : new Error(message.message));
  }
}

/** Run `action` now, or, while it runs, once more afterwards: the last request always wins and none piles up. */
export function latest(action: () => Promise<void>): () => void {
  let running = false;
  let again = false;
  const run = async (): Promise<void> => {
    running = true;
    do {
      again = false;
      try {
        await action();
      } catch (reason) {
        if (!(reason instanceof Cancelled)) console.error(reason);
      }
    } while (again);
    running = false;
  };
  return () => {
    if (running) again = true;
    else void run();
  };
}
