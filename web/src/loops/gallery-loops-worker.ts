/** The closed loops' own worker: drives the loops that are wanted last, in short pieces, so that newer wishes overtake. */

import init, { DrivenLoop, loop_catalogue } from '../generated/drivescope_gallery.js';
import type * as door from './door';

/** Milliseconds of work between two looks at the messages. */
const BUDGET = 30;

let catalogue: door.LoopCatalogue | null = null;
let waiting: door.Wanted[] = [];
let current: { wanted: door.Wanted; loop: door.DrivenLoop } | null = null;

function post(message: door.FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

function leave(): void {
  current?.loop.free();
  current = null;
}

/** A panic leaves the module unusable; anything else is a sentence for the reader. */
function fail(id: number, reason: unknown): void {
  const message = reason instanceof Error ? reason.message : String(reason);
  current = null;
  post(reason instanceof WebAssembly.RuntimeError ? { dead: message } : { id, failed: message });
}

function rows(loop: door.DrivenLoop, source: 'car' | 'guidance', columns: { name: string }[]): door.Rows {
  return { time: loop.times(source), columns: Object.fromEntries(columns.map(({ name }) => [name, loop.column(source, name)])) };
}

function finish(known: door.LoopCatalogue, { id, name }: door.Wanted, loop: door.DrivenLoop): void {
  const driven: door.Driven = {
    name,
    settings: loop.settings(),
    summary: loop.summary(),
    hasFailed: loop.has_failed(),
    car: rows(loop, 'car', known.car_columns),
    guidance: rows(loop, 'guidance', known.guidance_columns),
    magnitudes: loop.magnitudes(),
    blocked: loop.blocked(),
    path: loop.path(),
    obstacles: loop.obstacles(),
    size: loop.size(),
  };
  leave();
  const columns = [driven.car, driven.guidance].flatMap((r) => [r.time, ...Object.values(r.columns)]);
  const buffers = [...columns, driven.magnitudes, driven.blocked, driven.path, driven.obstacles, driven.size].map((c) => c.buffer);
  post({ id, driven }, buffers);
}

const tick = new MessageChannel();
let isScheduled = false;

function schedule(): void {
  if (isScheduled || (!current && waiting.length === 0)) return;
  isScheduled = true;
  tick.port2.postMessage(null);
}

tick.port1.onmessage = () => {
  isScheduled = false;
  const id = current?.wanted.id ?? waiting[0]?.id ?? 0;
  try {
    if (!current) {
      const wanted = waiting.shift();
      if (!wanted) return;
      current = { wanted, loop: new DrivenLoop(wanted.name, wanted.settings, wanted.seed) as unknown as door.DrivenLoop };
    }
    const progress = current.loop.drive_some(BUDGET);
    if (progress.done && catalogue) finish(catalogue, current.wanted, current.loop);
    else post({ id, fraction: progress.fraction ?? 0 });
  } catch (reason) {
    fail(id, reason);
  }
  schedule();
};

const ready = init().then(
  () => {
    catalogue = loop_catalogue() as door.LoopCatalogue;
    post({ catalogue });
  },
  (reason: unknown) => post({ dead: reason instanceof Error ? reason.message : String(reason) }),
);

self.onmessage = async (event: MessageEvent<door.ToWorker>) => {
  await ready;
  leave();
  waiting = event.data.drive;
  schedule();
};
