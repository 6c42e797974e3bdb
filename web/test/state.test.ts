import { expect, test } from 'vitest';
import type { DriveReport } from '../src/door';
import { Store } from '../src/state';

const REPORT: DriveReport = {
  name: 'a', kind: 'simulated', start: 10, end: 110, channels: [], truth: [], has_vehicle: true, import: null, estimators: [],
};

function openStore(): Store {
  const store = new Store();
  store.openDrive(REPORT);
  return store;
}

test('a new drive is shown whole and forgets the runs of the old one', () => {
  const store = new Store();
  store.patchRun('slope', { error: 'x' });
  store.openDrive(REPORT);
  expect(store.window.value).toEqual({ t0: 10, t1: 110 });
  expect(store.run('slope').value.error).toBeNull();
});

test('zooming keeps the instant under the pointer and the drive has ends', () => {
  const store = openStore();
  store.zoom(0.5, 35);
  expect(store.window.value).toEqual({ t0: 22.5, t1: 72.5 });
  store.pan(-5);
  expect(store.window.value).toEqual({ t0: 10, t1: 60 });
  store.zoom(100, 30);
  expect(store.window.value).toEqual({ t0: 10, t1: 110 });
});

test('there is a least stretch, so that zooming never ends in nothing', () => {
  const store = openStore();
  store.show(50, 50);
  expect(store.window.value.t1 - store.window.value.t0).toBeCloseTo(0.05, 9);
});

test('the page turns when the cursor leaves what is shown', () => {
  const store = openStore();
  store.show(10, 30);
  store.moveCursor(31);
  store.follow();
  expect(store.window.value.t0).toBeLessThan(31);
  expect(store.window.value.t1).toBeGreaterThan(31);
  store.moveCursor(1000);
  expect(store.cursor.value).toBe(110);
});
