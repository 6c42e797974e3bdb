/** The worker that owns the session: long work in short pieces, so that a message is never kept waiting. */

import type { Door, Progress } from '../door';
import init, { Session } from '../generated/drivescope_wasm.js';
import type { Blind } from '../navigation/door';
import { loadDoctor, Surgery } from './doctor';
import { type DrivesDoor, loadDrives } from './drives';
import { Making } from './making';
import { EXAMINING, Examining, examined, keep, tryOut } from './examining';
import { type FileReaders, readers } from './readers';
import { type FromWorker, type Operations, type Request, TooLarge, type ToWorker } from './rpc';

/** Milliseconds of work between two looks at the messages. */
const BUDGET = 30;
/** Milliseconds without work after which the readers are loaded, so that a file can be opened later without a network. */
const IDLE = 500;

interface Job {
  id: number;
  estimator: string | null;
  /** Runs go before it: the rest of a drive whose beginning is being looked at. */
  yields: boolean;
  /** What it needs is still being loaded. */
  waits: boolean;
  begun: boolean;
  begin(): void;
  some(): Progress;
  cancel(): void;
  finish(): unknown;
}

const ready = Promise.all([init().then(() => new Session() as unknown as Door), loadDrives()]);
const jobs: Job[] = [];
let isDead = false;

function post(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

/** A panic leaves a module unusable; anything else is a sentence for the reader. */
function fail(id: number, reason: unknown): void {
  if (reason instanceof WebAssembly.RuntimeError) {
    isDead = true;
    post({ dead: reason.message });
    return;
  }
  const message = reason instanceof Error ? reason.message : String(reason);
  post({ id, ok: false, message, cancelled: false, ...(reason instanceof TooLarge ? { offer: reason.offer } : {}) });
}

function runJob(door: Door, { id, args }: Request<'run'>): Job {
  const { estimator, params, vehicle, blind } = args;
  return {
    id,
    estimator,
    yields: false,
    waits: false,
    begun: false,
    begin: () => {
      if (blind) door.begin_blind_run(estimator, params, vehicle ?? undefined, blind.map((b) => b.sensor), flatten(blind));
      else door.begin_run(estimator, params, vehicle ?? undefined);
    },
    some: () => door.run_some(estimator, BUDGET),
    cancel: () => door.cancel_run(estimator),
    finish: () => ((hasEstimated = true), {
      current: door.result(estimator, 'current'),
      previous: door.result(estimator, 'previous'),
      change: door.change(estimator),
    }),
  };
}

/** Windows as the core takes them: begin, end, begin, end, ... */
function flatten(windows: readonly Blind[]): Float64Array {
  return Float64Array.from(windows.flatMap((w) => [w.t0, w.t1]));
}

/** A sweep goes on when nothing else is to be done; another one takes its place. */
function sweepJob(door: Door, { id, args }: Request<'sweep'>): Job {
  const { estimator, params, vehicle, plan } = args;
  return {
    id,
    estimator: 'sweep',
    yields: true,
    waits: false,
    begun: false,
    begin: () => door.begin_sweep(estimator, params, vehicle ?? undefined, plan.sensor, plan.length, plan.step, plan.recovery),
    some: () => door.sweep_some(BUDGET),
    cancel: () => door.cancel_sweep(),
    finish: () => {
      const swept = door.swept();
      door.cancel_sweep();
      return swept;
    },
  };
}

/** The simulation whose beginning is the open drive and that can go on. */
let resumable: Simulated | null = null;

type Simulated = Extract<Operations['open']['takes'], { kind: 'simulation' }>;
type Dropped = Extract<Operations['open']['takes'], { kind: 'files' }>;

/** What an opened drive ends: every run of the one before, and the doctor's examination. */
function endRuns(): void {
  surgery.leave();
  jobs.splice(0).forEach((job) => post({ id: job.id, ok: false, message: '', cancelled: true }));
}

function simulationJob(door: Door, drives: DrivesDoor, id: number, args: Simulated): Job {
  const making = new Making(drives, (budget) => drives.simulate_some(budget), door);
  const goesOn = resumable?.name === args.name && resumable.seed === args.seed && resumable.composed === args.composed;
  return {
    id,
    estimator: null,
    yields: goesOn,
    waits: false,
    begun: false,
    begin: () => {
      const isThere = goesOn && resumable !== null;
      resumable = null;
      if (!isThere) drives.begin(args.name, args.seed ?? undefined, args.composed ?? undefined, args.first ?? undefined);
    },
    some: () => making.some(BUDGET),
    cancel: () => making.cancel(),
    finish: () => {
      endRuns();
      keep(null, null);
      if (!drives.is_partial()) return door.report();
      resumable = args;
      return { ...door.report(), is_partial: true };
    },
  };
}

function openJob(door: Door, drives: DrivesDoor, { id, args }: Request<'open'>): Job {
  return args.kind === 'files' ? filesJob(door, drives, id, args) : simulationJob(door, drives, id, args);
}

/** The job is there at once, so that it can be cancelled and overtaken, and waits for the readers. */
function filesJob(door: Door, drives: DrivesDoor, id: number, args: Dropped): Job {
  let reader: FileReaders | null = null;
  let making: Making | null = null;
  const job: Job = {
    id,
    estimator: null,
    yields: false,
    waits: true,
    begun: false,
    begin: () => {
      resumable = null;
      drives.cancel();
      reader?.begin(args.files, args.mapping ?? undefined, args.keep);
    },
    some: () => {
      if (!making) throw new Error('the readers are not there');
      return making.some(BUDGET);
    },
    cancel: () => making?.cancel(),
    finish: () => {
      endRuns();
      keep(args, reader?.examination() ?? null);
      return door.report();
    },
  };
  whenLoaded(job, (loaded) => {
    reader = loaded;
    making = new Making(loaded, (budget) => loaded.read_some(budget), door);
    job.waits = false;
  });
  return job;
}

/** Let a job begin once the readers are there, or end it where they cannot be loaded. */
function whenLoaded(job: Job, ready: (loaded: FileReaders) => void): void {
  readers().then(
    (loaded) => {
      ready(loaded);
      schedule();
    },
    () => {
      if (!jobs.includes(job)) return;
      jobs.splice(jobs.indexOf(job), 1);
      post({ id: job.id, ok: false, message: '', cancelled: false, isUnloaded: true });
    },
  );
}

function examineJob({ id, args }: Request<'examine'>): Job {
  const job = new Examining(id, args, BUDGET);
  whenLoaded(job, (loaded) => job.ready(loaded));
  return job;
}

function cancel(id: number): void {
  const index = jobs.findIndex((job) => job.id === id);
  if (index < 0) return;
  const [job] = jobs.splice(index, 1);
  if (job?.begun) job.cancel();
  post({ id, ok: false, message: '', cancelled: true });
}

/** Opening goes before estimating, but for the rest of a drive; otherwise first come, first served. */
function enqueue(job: Job): void {
  const same = jobs.find((other) => other.estimator === job.estimator);
  if (same) cancel(same.id);
  // An examination has the reader that a file is opened with.
  const examining = jobs.find((other) => other.estimator === EXAMINING);
  if (job.estimator === null && examining) cancel(examining.id);
  if (job.estimator === null) jobs.unshift(job);
  else jobs.push(job);
  schedule();
}

const tick = new MessageChannel();
let isScheduled = false;
tick.port1.onmessage = () => {
  isScheduled = false;
  work();
};

function schedule(): void {
  if (jobs.length === 0) loadWhenIdle();
  if (isScheduled || jobs.every((job) => job.waits) || isDead) return;
  isScheduled = true;
  tick.port2.postMessage(null);
}

let idle: ReturnType<typeof setTimeout> | undefined;
/** Whether something has been estimated: before, a pause is only that of a slow opening. */
let hasEstimated = false;

/** Load the readers once nothing was to be done for a while. A failure is told when a file comes. */
function loadWhenIdle(): void {
  clearTimeout(idle);
  if (!hasEstimated) return;
  idle = setTimeout(() => {
    if (jobs.length === 0) readers().catch(() => undefined);
  }, IDLE);
}

function work(): void {
  const ready = jobs.filter((j) => !j.waits);
  const job = ready.find((j) => !j.yields) ?? ready[0];
  if (!job) return;
  try {
    if (!job.begun) {
      job.begun = true;
      job.begin();
    }
    const progress = job.some();
    if (progress.done) {
      jobs.splice(jobs.indexOf(job), 1);
      post({ id: job.id, ok: true, value: job.finish() });
    } else {
      post({ id: job.id, progress });
    }
  } catch (reason) {
    jobs.splice(jobs.indexOf(job), 1);
    fail(job.id, reason);
  }
  schedule();
}

/** An answer with the buffers to hand over. */
type Answer<T> = [T, Transferable[]];

const surgery = new Surgery(loadDoctor);

/** The operations that are answered at once, or once the doctor is there. */
const answers: {
  [O in Exclude<keyof Operations, 'open' | 'run' | 'sweep' | 'examine'>]: (
    door: Door,
    args: Operations[O]['takes'],
    drives: DrivesDoor,
  ) => Answer<Operations[O]['gives']> | Promise<Answer<Operations[O]['gives']>>;
} = {
  catalogue: (door, _, drives) => [{ ...door.catalogue(), drives: drives.catalogue() }, []],
  sketch: (_, { name }, drives) => {
    const flat = drives.sketch(name);
    return [flat, [flat.buffer]];
  },
  description: (_, { name }, drives) => [drives.description(name), []],
  forget_run: (door, { name }) => [(door.forget_run(name), null), []],
  keep_previous: (door, { estimator, keep }) => [(door.keep_previous(estimator, keep), null), []],
  drop_previous: (door, { estimator }) => [(door.drop_previous(estimator), null), []],
  drift: (door, { blinded, seeing, windows }) => [door.drift(blinded, seeing, flatten(windows)) ?? [], []],
  set_faults: (door, { faults }) => {
    // A sweep would go on with what is no longer there.
    const sweep = jobs.find((job) => job.estimator === 'sweep');
    if (sweep) cancel(sweep.id);
    return [(door.set_faults(faults), null), []];
  },
  compass: async (door, { year, latitude, longitude, withField }) => [await surgery.compass(door, year, latitude, longitude, withField), []],
  compass_apply: (door, { calibration, mountYaw, clock }) => {
    const numbers = [...calibration.offset, ...calibration.distortion];
    const isPlanar = calibration.kind === 'planar';
    door.compass_apply(Float64Array.from(numbers), isPlanar, mountYaw, clock);
    surgery.apply([...numbers, isPlanar ? 1 : 0, mountYaw, clock]);
    return [null, []];
  },
  compass_undo: (door) => {
    door.compass_undo();
    surgery.apply([]);
    return [null, []];
  },
  profile: (door, { name }) => [door.profile(name), []],
  keep_pass: (door, { name }) => [(door.keep_pass(name), null), []],
  forget_passes: (door) => [(door.forget_passes(), null), []],
  profile_file: (door, { isMap }) => {
    const bytes = door.profile_file(isMap);
    return [bytes, [bytes.buffer]];
  },
  lamps: (door, { vehicle }) => [door.lamps(vehicle ?? undefined), []],
  sensor_offers: (door) => [door.sensor_offers(), []],
  spread: (door, { items, t0, t1 }) => [items.map((i) => door.spread(i.source, i.column, t0, t1)), []],
  distance: (door, { source, column, t0, t1, count }) => {
    const driven = door.distance(source, column, t0, t1, count);
    return [driven, [driven.buffer]];
  },
  decisions: (door, { source }) => [door.decisions(source), []],
  labels_paint: (door, { labels, from, to, mode }) => [door.labels_paint(labels, from, to, mode), []],
  labels_score: (door, { source, labels }) => [door.labels_score(source, labels), []],
  disk_rests: async (door, { shortest }) => [await surgery.rests(door, shortest), []],
  disk_calibrate: async (door, { poses }) => [await surgery.calibrate(door, poses), []],
  disk_apply: (door, { numbers }) => [door.disk_apply(numbers), []],
  grid: (door, { items, t0, t1, buckets }) => {
    const times = door.grid_times(t0, t1, buckets);
    const columns = items.map((i) => door.grid(i.source, i.column, t0, t1, buckets, i.step));
    return [{ t0, t1, times, columns }, [times.buffer, ...columns.map((c) => c.buffer)]];
  },
  values: (door, { items, times }) => {
    const values = Float64Array.from(times.flatMap((t) => items.map((i) => door.value_at(i.source, i.column, t))));
    return [values, [values.buffer]];
  },
  path: (door, { source, t0, t1, points }) => {
    const path = door.path(source, t0, t1, points);
    return [path, [path.buffer]];
  },
  try_out: (_, { mapping }) => tryOut(mapping),
  csv: (door, { source }) => {
    const bytes = door.export_csv(source);
    return [bytes, [bytes.buffer]];
  },
};

self.onmessage = async (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if ('cancel' in message) {
    cancel(message.cancel);
    return;
  }
  try {
    const [door, drives] = await ready;
    if (isDead) return;
    if (message.op === 'open') enqueue(openJob(door, drives, message as Request<'open'>));
    else if (message.op === 'run') enqueue(runJob(door, message as Request<'run'>));
    else if (message.op === 'examine') {
      const request = message as Request<'examine'>;
      const known = examined(request.args);
      if (known) post({ id: request.id, ok: true, value: known });
      else enqueue(examineJob(request));
    }
    else if (message.op === 'sweep') enqueue(sweepJob(door, message as Request<'sweep'>));
    else {
      const answer = answers[message.op] as (door: Door, args: unknown, drives: DrivesDoor) => Answer<unknown> | Promise<Answer<unknown>>;
      const [value, transfer] = await answer(door, message.args, drives);
      post({ id: message.id, ok: true, value }, transfer);
    }
  } catch (reason) {
    fail(message.id, reason);
  }
};
