import { beforeEach, expect, test } from 'vitest';
import type { DriveReport, RunReport } from '../src/door';
import { Session } from '../src/session';
import { Store } from '../src/state';
import { UNTUNED } from '../src/tuning';
import type { FromWorker, Request, ToWorker } from '../src/worker/rpc';

const REPORT: DriveReport = {
  name: 'a', kind: 'simulated', start: 0, end: 10, channels: [], truth: [], has_vehicle: true, import: null,
  estimators: ['slope', 'gnss'].map((name) => ({ name, runnable: true, missing: [] })),
};
const ESTIMATORS = ['slope', 'gnss'].map((name) => ({ name, title: '', doc: '', vehicle: '', needs: [], params: [], columns: [] }));

/** A worker whose answers the test gives. */
class FakeWorker {
  sent: ToWorker[] = [];
  #listener: (event: MessageEvent) => void = () => {};

  postMessage(message: ToWorker): void {
    this.sent.push(message);
  }
  addEventListener(type: string, listener: (event: MessageEvent) => void): void {
    if (type === 'message') this.#listener = listener;
  }
  async give(message: FromWorker): Promise<void> {
    this.#listener({ data: message } as MessageEvent);
    await new Promise((resolve) => setTimeout(resolve));
  }
  /** The requests of one operation so far. */
  asked(op: string): Request[] {
    return this.sent.filter((m): m is Request => 'op' in m && m.op === op);
  }
}

let worker: FakeWorker;
let store: Store;
let session: Session;

beforeEach(async () => {
  worker = new FakeWorker();
  store = new Store();
  store.want(['slope']);
  session = new Session(store, worker as unknown as Worker);
  store.catalogue.value = { version: '', estimators: ESTIMATORS, drives: [], vehicles: [] };
  const opened = session.open({ kind: 'simulation', name: 'a', seed: null, first: null, composed: null }, 'a');
  await worker.give({ id: 1, ok: true, value: REPORT });
  expect(await opened).toBe(true);
});

function tune(walk: number): void {
  store.tuning.value = { ...UNTUNED, params: { slope: { walk } } };
}

/** End the run asked for last. */
function finish(seconds: number): Promise<void> {
  const runs = worker.asked('run');
  const current = { seconds } as RunReport;
  return worker.give({ id: runs[runs.length - 1]?.id ?? 0, ok: true, value: { current, previous: null, change: null } });
}

test('while a short run is under way it is let finish, and then only the latest value is run', async () => {
  void session.runAll();
  await finish(0.1);
  [1, 2, 3, 4].forEach(tune);
  expect(worker.asked('run').length).toBe(2);
  expect(worker.sent.some((m) => 'cancel' in m)).toBe(false);
  await finish(0.1);
  const runs = worker.asked('run');
  expect(runs.length).toBe(3);
  expect(runs[2]?.args).toMatchObject({ params: { walk: 4 } });
  await finish(0.1);
  expect(worker.asked('run').length).toBe(3);
});

test('a long run is given up for a newer value', async () => {
  void session.runAll();
  await finish(3);
  tune(1);
  tune(2);
  const running = worker.asked('run')[1]?.id ?? 0;
  expect(worker.sent).toContainEqual({ cancel: running });
  await worker.give({ id: running, ok: false, message: '', cancelled: true });
  expect(worker.asked('run')[2]?.args).toMatchObject({ params: { walk: 2 } });
  expect(store.run('slope').value.isStopped).toBe(false);
});

test('stopping says so and does not start again by itself', async () => {
  void session.runAll();
  session.stop();
  const running = worker.asked('run')[0]?.id ?? 0;
  await worker.give({ id: running, ok: false, message: '', cancelled: true });
  expect(store.run('slope').value.isStopped).toBe(true);
  expect(worker.asked('run').length).toBe(1);
});

test('a drive that cannot be opened leaves the open one and says why', async () => {
  const opened = session.open({ kind: 'files', files: [], mapping: null }, 'bad.csv');
  const asked = worker.asked('open');
  await worker.give({ id: asked[1]?.id ?? 0, ok: false, message: 'bad.csv: expected rows, found none', cancelled: false });
  expect(await opened).toBe(false);
  expect(store.report.value).toBe(REPORT);
  expect(store.error.value).toBe('bad.csv: expected rows, found none');
  expect(store.work.value).toBeNull();
});

test('a result of the drive before does not end up in the new one', async () => {
  void session.runAll();
  const run = worker.asked('run')[0]?.id ?? 0;
  const opened = session.open({ kind: 'simulation', name: 'b', seed: null, first: null, composed: null }, 'b');
  await worker.give({ id: worker.asked('open')[1]?.id ?? 0, ok: true, value: { ...REPORT, name: 'b' } });
  await opened;
  await worker.give({ id: run, ok: true, value: { current: { seconds: 1 }, previous: null, change: null } });
  expect(store.run('slope').value.reply).toBeNull();
});

test('during a drag everything is compared with what was before it', async () => {
  void session.runAll();
  await finish(0.1);
  session.beginGesture('slope');
  tune(1);
  expect(worker.asked('keep_previous').at(-1)?.args).toEqual({ estimator: 'slope', keep: true });
  session.endGesture('slope');
  expect(worker.asked('keep_previous').at(-1)?.args).toMatchObject({ keep: true });
  await finish(0.1);
  await new Promise((resolve) => setTimeout(resolve, 5));
  expect(worker.asked('keep_previous').at(-1)?.args).toEqual({ estimator: 'slope', keep: false });
});

/** The estimators that were asked for, in order. */
function estimators(): unknown[] {
  return worker.asked('run').map(({ args }) => (args as { estimator: string }).estimator);
}

test('only what a shown view needs is run, and what becomes wanted is run then, once', async () => {
  void session.runAll();
  await finish(0.1);
  expect(estimators()).toEqual(['slope']);
  const release = store.want(['gnss']);
  await finish(0.1);
  const again = store.want(['gnss', 'slope']);
  expect(estimators()).toEqual(['slope', 'gnss']);
  release();
  release();
  expect(store.isWanted('gnss')).toBe(true);
  again();
  expect([store.isWanted('gnss'), store.isWanted('slope')]).toEqual([false, true]);
});

test('an estimator that is chosen to be tuned is run; once nothing needs it, tuning leaves it alone until it is chosen again', async () => {
  void session.runAll();
  await finish(0.1);
  store.estimator.value = 'gnss';
  await finish(0.1);
  store.estimator.value = 'slope';
  store.tuning.value = { ...UNTUNED, params: { gnss: { walk: 1 } } };
  expect(estimators()).toEqual(['slope', 'gnss']);
  store.estimator.value = 'gnss';
  expect(estimators()).toEqual(['slope', 'gnss', 'gnss']);
  expect(worker.asked('run')[2]?.args).toMatchObject({ params: { walk: 1 } });
});

test('when the measurements have changed, a result that nothing needs is forgotten and not run again', async () => {
  void session.runAll();
  await finish(0.1);
  store.estimator.value = 'gnss';
  await finish(0.1);
  store.estimator.value = 'slope';
  session.rerun();
  await finish(0.1);
  expect(estimators()).toEqual(['slope', 'gnss', 'slope']);
  expect([store.run('gnss').value.reply, store.run('slope').value.reply === null]).toEqual([null, false]);
});
