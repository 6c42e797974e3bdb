/** Everything the page knows, in one place; views listen to the parts they show. */

import type { Catalogue, DriveReport, Progress } from './door';
import type { Blind, Fault } from './navigation/door';
import type { Disk } from './motion/disk-file';
import { type Axis, axis, timeAxis } from './plot/axis';
import type { RoomName } from './room-names';
import { Signal } from './signal';
import { type Tuning, UNTUNED } from './tuning';
import { DEFAULT_DISPLAY, type Display } from './units';
import type { Offer, OpenRequest, RunReply } from './worker/rpc';

/** A stretch of time, s. */
export interface Span {
  readonly t0: number;
  readonly t1: number;
}

/** Where the runs of one estimator stand. */
export interface RunState {
  /** The latest result with the one before it; null before the first. */
  readonly reply: RunReply | null;
  /** Progress of the run under way. */
  readonly running: Progress | null;
  /** The sentence with which the last run ended, if it failed. */
  readonly error: string | null;
  /** Whether someone stopped the last run. */
  readonly isStopped: boolean;
  /** Whether the curve before stays whatever is tuned next. */
  readonly isKept: boolean;
}

/** The estimator of which several variants can be drawn at once. */
export const OVERLAID = 'orientation';

/** The name of the further run of a variant. */
export function overlayRun(variant: string): string {
  return `${OVERLAID}@${variant}`;
}

/** The estimator of a run: its name up to `@`. */
export function estimatorOf(run: string): string {
  return run.split('@')[0] ?? run;
}

const NO_RUN: RunState = { reply: null, running: null, error: null, isStopped: false, isKept: false };

/** Opening, under way. */
export interface Work {
  readonly label: string;
  readonly progress: Progress | null;
  cancel(): void;
}

/** Share of the rows from which a notice is trouble. */
const OFTEN = 0.02;

/** Shortest stretch that can be zoomed into, s, and m of a plot over distance. */
const SHORTEST = 0.05;
const SHORTEST_WAY = 0.5;

export class Store {
  readonly catalogue = new Signal<Catalogue | null>(null);
  readonly report = new Signal<DriveReport | null>(null);
  readonly work = new Signal<Work | null>(null);
  readonly error = new Signal<string | null>(null);
  /** What can be read of a log that does not fit into memory, with what asked for it. */
  readonly offer = new Signal<(Offer & { request: Extract<OpenRequest, { kind: 'files' }>; label: string }) | null>(null);
  /** Whether the rest of a drive waits to be asked for, because someone stopped it or opening another has failed. */
  readonly isRestHeld = new Signal(false);
  /** What the open drive was opened with. */
  readonly opened = new Signal<OpenRequest | null>(null);
  readonly builtIn = new Signal<{ name: string; seed: number | null } | null>(null);
  /** The built-in drive that is being opened: the address already tells it. */
  readonly coming = new Signal<{ name: string; seed: number | null } | null>(null);

  readonly span = new Signal<Span>({ t0: 0, t1: 1 });
  readonly window = new Signal<Span>({ t0: 0, t1: 1 });
  readonly cursor = new Signal(0);
  readonly isPlaying = new Signal(false);
  readonly rate = new Signal(10);
  /** What plots are to be drawn over; `axis` is what they are drawn over, which is time until the distance is known. */
  readonly over = new Signal<Axis['kind']>('time');

  readonly display = new Signal<Display>(DEFAULT_DISPLAY);
  readonly theme = new Signal<'auto' | 'light' | 'dark'>('auto');
  readonly tuning = new Signal<Tuning>(UNTUNED);
  readonly room = new Signal<RoomName>('overview');
  readonly estimator = new Signal<string>('orientation');
  /** Estimators that what is shown needs, each as often as something needs it; see `want`. */
  readonly wanted = new Signal<readonly string[]>([]);
  /** Variants of orientation that are drawn with the one that is tuned. */
  readonly overlays = new Signal<readonly string[]>([]);
  /** Windows in which sensors are blind in further runs. */
  readonly blind = new Signal<readonly Blind[]>([]);
  /** Faults in the open drive. */
  readonly faults = new Signal<readonly Fault[]>([]);
  /** Motion modes painted by hand: times and, in the second half, modes. */
  readonly labels = new Signal<Float64Array>(new Float64Array(0));
  /** The calibrated six-accelerometer disk that the open log is read with; null for the drawing. */
  readonly disk = new Signal<Disk | null>(null);
  #runs = new Map<string, Signal<RunState>>();

  /** Something is shown that needs these estimators: they are run for every drive, until what is returned is called. */
  want(estimators: readonly string[]): () => void {
    this.wanted.value = [...this.wanted.value, ...estimators];
    let rest = estimators;
    return () => {
      const left = [...this.wanted.value];
      for (const name of rest) left.splice(left.indexOf(name), 1);
      rest = [];
      this.wanted.value = left;
    };
  }

  /** Whether an estimator is to be run: for what is shown, or because it was chosen to be tuned. */
  isWanted(estimator: string): boolean {
    return this.estimator.value === estimator || this.wanted.value.includes(estimator);
  }

  /** The runs of an estimator. */
  run(estimator: string): Signal<RunState> {
    let run = this.#runs.get(estimator);
    if (!run) {
      run = new Signal(NO_RUN);
      this.#runs.set(estimator, run);
    }
    return run;
  }

  /** Change some of what is known of an estimator's runs. */
  patchRun(estimator: string, patch: Partial<RunState>): void {
    const run = this.run(estimator);
    run.value = { ...run.value, ...patch };
  }

  /** Forget an estimator's runs. */
  clearRun(estimator: string): void {
    this.run(estimator).value = NO_RUN;
  }

  /** A new drive is open: its whole length is shown and nothing has been estimated. The rest of a drive moves nothing. */
  openDrive(report: DriveReport): void {
    const span = { t0: report.start, t1: Math.max(report.end, report.start + SHORTEST) };
    const isRest = this.report.value?.is_partial === true && report.is_partial !== true && this.report.value.name === report.name && report.kind === 'simulated';
    const [window, cursor] = [this.window.value, this.cursor.value];
    const isZoomed = window.t1 - window.t0 < this.span.value.t1 - this.span.value.t0;
    if (!isRest) this.isPlaying.value = false;
    if (!isRest) this.labels.value = new Float64Array(0);
    this.disk.value = report.import?.mapping?.disk ?? null;
    for (const run of this.#runs.values()) run.value = NO_RUN;
    axis.value = timeAxis(span.t0);
    this.span.value = span;
    this.window.value = isRest && isZoomed ? window : span;
    this.cursor.value = isRest ? cursor : span.t0;
    this.report.value = report;
  }

  /** An instant as counted from the start of the drive, s. */
  sinceStart(time: number): number {
    return time - this.span.value.t0;
  }

  /** Show a stretch, kept inside the drive; where it has to be moved or widened, along the axis `on`. */
  show(t0: number, t1: number, on: Axis = axis.value): void {
    this.#showPlaces(on.place(t0), on.place(t1), on);
  }

  #showPlaces(from: number, to: number, on: Axis): void {
    const { t0, t1 } = this.span.value;
    const [start, end] = [on.place(t0), on.place(t1)];
    const shortest = on.kind === 'time' ? SHORTEST : SHORTEST_WAY;
    const length = Math.min(Math.max(to - from, shortest), end - start);
    const left = Math.min(Math.max((from + to - length) / 2, start), end - length);
    // Both ends of the drive are met exactly.
    this.window.value = { t0: left <= start ? t0 : on.time(left), t1: left + length >= end ? t1 : on.time(left + length) };
  }

  /** Show `factor` times as much, with the instant `about` staying in place. */
  zoom(factor: number, about: number, on: Axis = axis.value): void {
    const { t0, t1 } = this.window.value;
    const [from, to, still] = [on.place(t0), on.place(t1), on.place(about)];
    this.#showPlaces(still - (still - from) * factor, still + (to - still) * factor, on);
  }

  /** Move what is shown by a share of its length. */
  pan(share: number, on: Axis = axis.value): void {
    const [from, to] = [on.place(this.window.value.t0), on.place(this.window.value.t1)];
    this.#showPlaces(from + share * (to - from), to + share * (to - from), on);
  }

  /** Put the cursor at an instant of the drive. */
  moveCursor(time: number): void {
    const span = this.span.value;
    this.cursor.value = Math.min(span.t1, Math.max(span.t0, time));
  }

  /** Turn the page when the cursor has left what is shown. */
  follow(): void {
    const { t0, t1 } = this.window.value;
    const time = this.cursor.value;
    if (time >= t0 && time <= t1) return;
    const [place, length] = [axis.value.place(time), axis.value.place(t1) - axis.value.place(t0)];
    this.#showPlaces(place - 0.05 * length, place + 0.95 * length, axis.value);
  }
}

/** A gate that leaves disturbed fields out does what it is for, however often. */
const GATED = /magnetic field that does not fit .* was left out/;

/** What an estimator noticed so often that its curves are not to be believed. */
export function trouble({ reply }: RunState): { text: string; count: number } | null {
  const most = reply?.current.notices.filter((n) => !GATED.test(n.text)).reduce((a, b) => (b.count > a.count ? b : a), { text: '', count: 0 });
  return reply && most && most.count > OFTEN * reply.current.rows ? most : null;
}

/** Whether an estimator has everything it needs in the open drive. */
export function isRunnable(report: DriveReport | null, estimator: string): boolean {
  return report?.estimators.find((e) => e.name === estimator)?.runnable ?? false;
}
