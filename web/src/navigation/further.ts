/** A further run of an estimator, as it is tuned but for something, kept up to date while the room is entered. */

import type { ParamValue } from '../door';
import { navigation as say } from '../messages/navigation';
import type { Session } from '../session';
import type { Store } from '../state';
import { Cancelled, type Pending, type RunReply } from '../worker/rpc';
import type { Blind } from './door';

/** A run that lasts longer, s, does not follow a drag. */
const SHORT = 0.4;

/** What is different from the estimator's own run. */
export interface Different {
  params?: Record<string, ParamValue>;
  blind?: readonly Blind[];
}

export class FurtherRun {
  /** `gnss_ins@blind`. */
  readonly name: string;
  /** Called when a result is there or has been forgotten. */
  onResult: () => void = () => {};
  readonly #store: Store;
  readonly #session: Session;
  readonly #base: string;
  readonly #different: () => Different | null;
  #pending: Pending<RunReply> | null = null;
  #isAsked = false;
  /** There is something in the core to be forgotten. */
  #isThere = false;
  /** How often it has been forgotten: an answer from before that is late. */
  #forgotten = 0;

  /** `different` says how it differs from the run of `base`; null for no run at all. */
  constructor(store: Store, session: Session, base: string, suffix: string, different: () => Different | null) {
    this.#store = store;
    this.#session = session;
    this.#base = base;
    this.#different = different;
    this.name = `${base}@${suffix}`;
    store.report.on(() => this.#drop());
    store.room.on(() => this.refresh());
    store.run(base).on((now, before) => {
      if (now.reply !== before.reply) this.refresh();
    });
  }

  get isRunning(): boolean {
    return this.#pending !== null;
  }

  /** Whether a run is so quick that it can follow a drag. */
  get isQuick(): boolean {
    const { reply } = this.#store.run(this.name).value;
    return reply !== null && reply.current.seconds <= SHORT;
  }

  /** What is asked for may have changed. */
  refresh(): void {
    const isWanted = this.#store.room.value === 'navigation' && this.#different() !== null && this.#store.run(this.#base).value.reply !== null;
    if (!isWanted) {
      this.#forget();
      return;
    }
    this.#isAsked = true;
    if (!this.#pending) void this.#go();
    else if (!this.isQuick) this.#pending.cancel();
  }

  #forget(): void {
    this.#drop();
    if (!this.#isThere) return;
    this.#isThere = false;
    this.#forgotten++;
    this.#store.clearRun(this.name);
    void this.#session.rpc.call('forget_run', { name: this.name });
    this.onResult();
  }

  /** Give up what is under way; another drive has forgotten the rest already. */
  #drop(): void {
    this.#isAsked = false;
    this.#pending?.cancel();
  }

  async #go(): Promise<void> {
    const store = this.#store;
    const { rpc } = this.#session;
    while (this.#isAsked) {
      this.#isAsked = false;
      const different = this.#different();
      if (!different) break;
      const drive = store.report.value;
      const { params, vehicle } = store.tuning.value;
      const forgotten = this.#forgotten;
      const isWanted = (): boolean => store.report.value === drive && this.#forgotten === forgotten;
      const pending = rpc.start(
        'run',
        { estimator: this.name, params: { ...params[this.#base], ...different.params }, vehicle, ...(different.blind ? { blind: different.blind } : {}) },
        (running) => isWanted() && store.patchRun(this.name, { running }),
      );
      this.#pending = pending;
      this.#isThere = true;
      try {
        const reply = await pending.answer;
        if (isWanted()) {
          // What was before it is not shown: it only takes memory. Another drive has forgotten it already.
          rpc.call('drop_previous', { estimator: this.name }).catch(() => undefined);
          store.patchRun(this.name, { reply: { ...reply, previous: null, change: null }, running: null, error: null });
        }
      } catch (reason) {
        const error = reason instanceof Cancelled ? null : say.failed(reason instanceof Error ? reason.message : String(reason));
        if (isWanted()) store.patchRun(this.name, { running: null, error });
      }
      this.#pending = null;
      this.onResult();
    }
  }
}
