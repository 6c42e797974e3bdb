import { expect, test } from 'vitest';
import { Doctor } from '../src/compass/doctor';
import type { Calibration } from '../src/compass/door';
import { keep, stillHolds } from '../src/compass/kept';
import type { DriveReport } from '../src/door';
import type { Session } from '../src/session';
import { Store } from '../src/state';

const calibration: Calibration = { version: 1, kind: 'full', offset: [1, 2, 3], distortion: [0, 0, 0, 0, 0, 0] };
const usual = { mag_x: { column: 'bx' }, mag_y: { column: 'by' }, gnss_lat: { column: 'lat' }, accel_x: { column: 'ax' } };

function read(signals: object, bytes = 10): DriveReport {
  const log = { name: 'a.csv', bytes, rows: 1, mapping: { version: 1, time: { column: 't' }, signals } };
  return { name: 'a', kind: 'file', start: 0, end: 1, channels: [], truth: [], has_vehicle: false, estimators: [], import: log } as unknown as DriveReport;
}

test('a calibration holds for the same log read with other axes of another sensor', () => {
  const kept = keep(read(usual), calibration, 0.5, 1);
  expect(stillHolds(kept, read({ ...usual, accel_x: { column: 'ay' } }))).toEqual(kept);
  expect(stillHolds(kept, read({ ...usual, gnss_lat: { column: 'breite' } }))).toEqual({ ...kept, clock: 0 });
});

test('a calibration does not hold for another log or another reading of its sensor', () => {
  const kept = keep(read(usual), calibration, 0, 0);
  expect(stillHolds(kept, read({ ...usual, mag_x: { column: 'bx', scale: -1 } }))).toBeNull();
  expect(stillHolds(kept, read(usual, 11))).toBeNull();
  expect(stillHolds(null, read(usual))).toBeNull();
  expect(keep({ ...read(usual), import: null }, calibration, 0, 0)).toBeNull();
});

test('the doctor applies a calibration again when the log is read anew, until it is taken back', async () => {
  const store = new Store();
  const calls: [string, unknown][] = [];
  const rpc = { call: (name: string, args: unknown) => (calls.push([name, args]), Promise.resolve(null)) };
  const doctor = new Doctor(store, { rpc, rerun: () => undefined } as unknown as Session);
  const applied = (): unknown[] => calls.splice(0).flatMap(([name, args]) => (name === 'compass_apply' ? [args] : []));
  const settled = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));
  const log = (signals: object): DriveReport => ({ ...read(signals), channels: [{ name: 'mag', rows: 1, rate_hz: 1, columns: ['mag_x'] }] });
  store.report.value = log(usual);
  await doctor.apply(calibration, 0.5, 2);
  await settled();
  expect(applied()).toHaveLength(1);
  store.report.value = log({ ...usual, accel_x: { column: 'ay' } });
  await settled();
  expect(applied()).toEqual([{ calibration, mountYaw: 0.5, clock: 2 }]);
  await doctor.undo();
  store.report.value = log(usual);
  await settled();
  expect(applied()).toEqual([]);
});
