/** The gallery's own worker: lists the claims and tries one at a time in short pieces, so that it can be stopped. */

import init, { Attempt, paper_catalogue } from '../generated/drivescope_gallery.js';
import type * as door from './door';

/** Milliseconds of work between two looks at the messages. */
const BUDGET = 50;

let attempt: door.Attempt | null = null;
let id = '';
let seconds = 0;

function post(message: door.FromWorker): void {
  self.postMessage(message);
}

/** A panic leaves the module unusable; anything else is a sentence for the reader. */
function fail(reason: unknown): void {
  const message = reason instanceof Error ? reason.message : String(reason);
  attempt = null;
  post(reason instanceof WebAssembly.RuntimeError ? { dead: message } : { failed: id, message });
}

function leave(): void {
  attempt?.free();
  attempt = null;
}

const tick = new MessageChannel();
tick.port1.onmessage = () => {
  if (!attempt) return;
  try {
    const start = performance.now();
    const progress = attempt.run_some(BUDGET);
    seconds += (performance.now() - start) / 1000;
    if (progress.done) {
      const finding = attempt.result();
      leave();
      post({ finding, seconds });
    } else {
      post({ running: id, fraction: progress.fraction ?? 0, stage: progress.stage });
      tick.port2.postMessage(null);
    }
  } catch (reason) {
    fail(reason);
  }
};

const ready = init().then(
  () => post({ papers: paper_catalogue() as door.Paper[] }),
  (reason: unknown) => post({ dead: reason instanceof Error ? reason.message : String(reason) }),
);

self.onmessage = async (event: MessageEvent<door.ToWorker>) => {
  await ready;
  leave();
  if ('stop' in event.data) return;
  id = event.data.run;
  seconds = 0;
  try {
    attempt = new Attempt(id) as unknown as door.Attempt;
    tick.port2.postMessage(null);
  } catch (reason) {
    fail(reason);
  }
};
