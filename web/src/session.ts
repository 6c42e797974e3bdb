/** The page's side of the session: opens drives, runs estimators with the latest tuning, tells the store. */

import type { DriveReport } from './door';
import { t } from './messages';
import { estimatorOf, isRunnable, overlayRun, type Store } from './state';
import { sameFor, type Tuning } from './tuning';
import { Cancelled, type OpenRequest, type Pending, RpcClient, type RunReply, TooLarge, Unloaded } from './worker/rpc';

/** A run expected to end sooner than this (s) is let finish while a slider moves, so that the curve follows. */
const SHORT_RUN = 0.4;

interface Runner {
  pending: Pending<RunReply> | null;
  /** What the run under way, or the latest result, was tuned with. */
  tuned: Tuning | null;
  /** A run was asked for while another was under way. */
  isAsked: boolean;
}

export class Session {
  readonly rpc: RpcClient;
  #store: Store;
  #runners = new Map<string, Runner>();
  #opening: Pending<DriveReport> | null = null;
  /** Opens the rest of a drive of which only the beginning is there. */
  #rest: (() => Promise<void>) | null = null;
  /** What was the rest before the opening under way; it is that again if that fails. */
  #restBefore: (() => Promise<void>) | null = null;

  constructor(store: Store, worker: Worker) {
    this.#store = store;
    this.rpc = new RpcClient(worker);
    this.rpc.onDead = (reason) => {
      store.error.value = t.errors.dead(reason);
    };
    worker.addEventListener('error', () => {
      store.error.value = t.errors.worker;
    });
    store.tuning.on((tuning) => this.#retune(tuning));
    store.overlays.on((now, before) => this.#overlay(now, before));
    store.wanted.on(() => this.#catchUp());
    store.estimator.on(() => this.#catchUp());
  }

  /** Open a drive and estimate it; what is open stays until that has succeeded. True if it has. */
  async open(request: OpenRequest, label: string, isRest = false): Promise<boolean> {
    const store = this.#store;
    const rest = this.#rest ?? (this.#opening ? this.#restBefore : null);
    this.#opening?.cancel();
    this.#rest = null;
    this.#restBefore = rest;
    const pending = this.rpc.start('open', request, (progress) => {
      if (this.#opening === pending) store.work.value = { label, progress, cancel: pending.cancel };
    });
    this.#opening = pending;
    const builtIn = request.kind === 'simulation' && request.composed === null ? { name: request.name, seed: request.seed } : null;
    store.coming.value = builtIn;
    store.work.value = { label, progress: null, cancel: pending.cancel };
    // What was said of a drive holds while its rest is opened.
    if (!isRest) store.error.value = null;
    store.offer.value = null;
    try {
      const report = await pending.answer;
      for (const runner of this.#runners.values()) runner.tuned = null;
      store.builtIn.value = builtIn;
      store.opened.value = request;
      store.openDrive(report);
      if (report.is_partial && request.kind === 'simulation') {
        const whole = { ...request, first: null };
        this.#rest = async () => {
          if (await this.open(whole, label, true)) await this.runAll();
        };
      }
      return true;
    } catch (reason) {
      // An opening that another one has overtaken leaves everything to that.
      if (this.#opening === pending) {
        this.#rest = rest;
        this.#store.isRestHeld.value = true;
      }
      if (reason instanceof TooLarge && request.kind === 'files') store.offer.value = { ...reason.offer, request, label };
      if (reason instanceof Unloaded) store.error.value = t.files.unloaded(label);
      else if (!(reason instanceof Cancelled)) store.error.value = reason instanceof Error ? reason.message : String(reason);
      return false;
    } finally {
      if (this.#opening === pending) {
        this.#opening = null;
        store.coming.value = null;
        store.work.value = null;
      }
    }
  }

  /** Run every estimator that is wanted and can run; then open the rest of a drive of which only the beginning is there. */
  async runAll(): Promise<void> {
    this.#store.isRestHeld.value = false;
    const names = [...this.#wanted(), ...this.#store.overlays.value.map(overlayRun)];
    for (const name of names) this.#request(name);
    const drive = this.#store.report.value;
    await Promise.all(names.map((name) => new Promise<void>((resolve) => this.#whenIdle(name, resolve))));
    const isStopped = names.some((name) => this.#store.run(name).value.isStopped);
    if (isStopped) this.#store.isRestHeld.value = true;
    else if (this.#rest && this.#store.report.value === drive) await this.#rest();
  }

  /** Estimate anew what has been estimated: the drive's measurements have changed. */
  rerun(): void {
    for (const [name, runner] of this.#runners) {
      if (runner.tuned && this.#isKept(name)) this.#request(name);
      else if (runner.tuned) {
        runner.tuned = null;
        this.#store.clearRun(name);
      }
    }
  }

  /** Give up every run under way; earlier results stay. */
  stop(): void {
    for (const runner of this.#runners.values()) {
      runner.isAsked = false;
      runner.pending?.cancel();
    }
  }

  /** Hold the result before the latest one as the ghost, whatever is run next, or let go of it. */
  keepGhost(estimator: string, isKept: boolean): void {
    this.#store.patchRun(estimator, { isKept });
    void this.rpc.call('keep_previous', { estimator, keep: isKept });
  }

  /** Forget the ghost. */
  clearGhost(estimator: string): void {
    const { reply } = this.#store.run(estimator).value;
    if (reply) this.#store.patchRun(estimator, { reply: { ...reply, previous: null, change: null } });
    this.keepGhost(estimator, false);
    void this.rpc.call('drop_previous', { estimator });
  }

  /** While a slider is dragged, the result from before the drag is what the new one is compared with. */
  beginGesture(estimator: string): void {
    const run = this.#store.run(estimator).value;
    if (run.isKept) return;
    void this.rpc.call('drop_previous', { estimator });
    void this.rpc.call('keep_previous', { estimator, keep: true });
  }

  /** The drag is over: once its last result is there, the next change is compared with that. */
  endGesture(estimator: string): void {
    this.#whenIdle(estimator, () => {
      const { isKept } = this.#store.run(estimator).value;
      if (!isKept) void this.rpc.call('keep_previous', { estimator, keep: false });
    });
  }

  #whenIdle(estimator: string, action: () => void): void {
    const pending = this.#runners.get(estimator)?.pending;
    if (!pending) action();
    else void pending.answer.catch(() => undefined).then(() => setTimeout(() => this.#whenIdle(estimator, action)));
  }

  #retune(tuning: Tuning): void {
    for (const [estimator, runner] of this.#runners) {
      if (runner.tuned && this.#isKept(estimator) && !sameFor(estimatorOf(estimator), tuning, runner.tuned)) this.#request(estimator);
    }
  }

  /** The estimators that are to be run. */
  #wanted(): string[] {
    const names = (this.#store.catalogue.value?.estimators ?? []).map((e) => e.name);
    return names.filter((name) => this.#store.isWanted(name));
  }

  /** Whether the result of a run is kept up to date; a further run is, until it is forgotten. */
  #isKept(run: string): boolean {
    return estimatorOf(run) !== run || this.#store.isWanted(run);
  }

  /** Run what has become wanted and has no result for the open drive as it is tuned now. */
  #catchUp(): void {
    if (!this.#store.report.value) return;
    for (const name of this.#wanted()) {
      const tuned = this.#runners.get(name)?.tuned;
      if (!tuned || !sameFor(name, this.#store.tuning.value, tuned)) this.#request(name);
    }
  }

  /** Run the variants that have been added, forget those that have been taken away. */
  #overlay(now: readonly string[], before: readonly string[]): void {
    for (const variant of before.filter((v) => !now.includes(v))) {
      const name = overlayRun(variant);
      const runner = this.#runners.get(name);
      this.#runners.delete(name);
      if (runner) runner.isAsked = false;
      runner?.pending?.cancel();
      this.#store.clearRun(name);
      void this.rpc.call('forget_run', { name });
    }
    for (const variant of now.filter((v) => !before.includes(v))) this.#request(overlayRun(variant));
  }

  #runner(estimator: string): Runner {
    let runner = this.#runners.get(estimator);
    if (!runner) {
      runner = { pending: null, tuned: null, isAsked: false };
      this.#runners.set(estimator, runner);
    }
    return runner;
  }

  #request(estimator: string): void {
    const runner = this.#runner(estimator);
    if (!runner.pending) {
      void this.#run(estimator, runner);
      return;
    }
    runner.isAsked = true;
    const seconds = this.#store.run(estimator).value.reply?.current.seconds;
    if (seconds === undefined || seconds > SHORT_RUN) runner.pending.cancel();
  }

  async #run(estimator: string, runner: Runner): Promise<void> {
    const store = this.#store;
    do {
      runner.isAsked = false;
      const [name, variant] = estimator.split('@') as [string, string | undefined];
      if (!isRunnable(store.report.value, name)) return;
      const drive = store.report.value;
      const isWanted = (): boolean => store.report.value === drive && this.#runners.get(estimator) === runner;
      const tuning = store.tuning.value;
      const pending = this.rpc.start(
        'run',
        { estimator, params: { ...tuning.params[name], ...(variant === undefined ? {} : { variant }) }, vehicle: tuning.vehicle },
        (running) => {
          if (isWanted()) store.patchRun(estimator, { running });
        },
      );
      runner.pending = pending;
      runner.tuned = tuning;
      store.patchRun(estimator, { running: { done: false, fraction: 0, stage: 'estimating', rows: 0 }, error: null, isStopped: false });
      try {
        const reply = await pending.answer;
        if (isWanted()) store.patchRun(estimator, { reply, running: null });
      } catch (reason) {
        const isCancelled = reason instanceof Cancelled;
        const error = isCancelled ? null : reason instanceof Error ? reason.message : String(reason);
        const isStopped = isCancelled && !runner.isAsked;
        if (isWanted()) store.patchRun(estimator, { running: null, error, isStopped });
      }
      runner.pending = null;
    } while (runner.isAsked);
  }
}
