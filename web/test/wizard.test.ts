import { expect, test } from 'vitest';
import type { Choice, ColumnView, Found, Mapping } from '../src/wizard/door';
import { assign, change, differs, doubts, guesses, setDelay, setMount, setOrigin, signalsOf, takeAll, takeColumn, takePhysics, unitsOf } from '../src/wizard/mapping';
import { outline } from '../src/wizard/picture';

const CHOICES: Choice[] = [
  { signal: 'accel_x', channel: 'imu', unit: 'm/s^2', units: 'm/s2, g, mg', doc: '' },
  { signal: 'accel_y', channel: 'imu', unit: 'm/s^2', units: 'm/s2, g, mg', doc: '' },
  { signal: 'gyro_z', channel: 'imu', unit: 'rad/s', units: 'rad/s, deg/s', doc: '' },
  { signal: 'gnss_lat', channel: 'gnss', unit: 'deg', units: 'rad, deg', doc: '' },
];
const MAPPING: Mapping = {
  version: 1,
  time: { column: 'ms', unit: 'ms' },
  signals: { accel_x: { column: 'ax', unit: 'g', scale: -1 }, gyro_z: { column: 'r' } },
};
const view = (column: string, confidence: ColumnView['confidence']): ColumnView => ({
  column, stated_unit: null, rate: 100, range: [0, 1], values: 9, held: false, signal: null, unit: null, scale: 1, confidence, why: '', name_says: null,
});
const found = (mapping: Mapping, columns: ColumnView[] = [], findings: Found['findings'] = []): Found => ({ mapping, columns, mounts: [], delays: [], findings, names_believed: true });

test('a signal moves to the column that it is given to, and unit and sign go with a column only where they fit', () => {
  const moved = assign(MAPPING, 'ax', 'accel_x', 'accel_y', CHOICES);
  expect(moved.signals['accel_y']).toEqual({ column: 'ax', unit: 'g', scale: -1 });
  expect(moved.signals['accel_x']).toBeUndefined();
  const other = assign(MAPPING, 'ax', 'accel_x', 'gyro_z', CHOICES);
  expect(other.signals).toEqual({ gyro_z: { column: 'ax' } });
  expect(signalsOf(other, 'r')).toEqual([]);
});

test('there is always one clock', () => {
  expect(assign(MAPPING, 'ms', 't', null, CHOICES)).toBe(MAPPING);
  const other = assign(MAPPING, 'r', 'gyro_z', 't', CHOICES);
  expect(other.time).toEqual({ column: 'r', unit: 's', offset: 0 });
  expect(other.signals['gyro_z']).toBeUndefined();
});

test('what needs no mention is left out of the file', () => {
  const plain = change(MAPPING, 'accel_x', { unit: 'm/s^2', scale: 1, offset: 0 }, CHOICES);
  expect(plain.signals['accel_x']).toEqual({ column: 'ax' });
  expect(change(MAPPING, 'accel_x', { offset: 0.5 }, CHOICES).signals['accel_x']).toEqual({ column: 'ax', unit: 'g', scale: -1, offset: 0.5 });
  expect(change(MAPPING, 't', { unit: 'us' }, CHOICES).time.unit).toBe('us');
  const mounted = setDelay(setMount(MAPPING, 'imu', { roll_deg: 0, pitch_deg: 3, yaw_deg: 0 }), 'gnss', 0.1);
  expect([mounted.mounts, mounted.delays]).toEqual([{ imu: { roll_deg: 0, pitch_deg: 3, yaw_deg: 0 } }, { gnss: 0.1 }]);
  const none = setDelay(setMount(mounted, 'imu', { roll_deg: 0, pitch_deg: 0, yaw_deg: 0 }), 'gnss', 0);
  expect(JSON.stringify(none)).toBe(JSON.stringify(MAPPING));
  expect(setOrigin(setOrigin(MAPPING, { lat_deg: 1, lon_deg: 2, alt: 3 }), null)).toEqual(MAPPING);
});

test('units are offered once, the one of a signal first', () => {
  expect(unitsOf(CHOICES, 'accel_x')).toEqual(['m/s^2', 'g', 'mg']);
  expect(unitsOf(CHOICES, 'gnss_lat')).toEqual(['deg', 'rad']);
});

test('a column read otherwise than proposed is told by sign, unit and signal, not by spelling', () => {
  const physics = found({ ...MAPPING, signals: { accel_x: { column: 'ax', unit: 'g', scale: 1 }, gyro_z: { column: 'r', unit: 'Rad/s' } } });
  expect(differs(MAPPING, physics, view('ax', 'certain'), CHOICES)).toBe(true);
  expect(differs(MAPPING, physics, view('r', 'certain'), CHOICES)).toBe(false);
  expect(differs(MAPPING, found({ ...MAPPING, signals: {} }), view('ax', null), CHOICES)).toBe(false);
});

test('only what physics is sure of is a doubt about a reading, and guesses are counted', () => {
  const signals = { accel_x: { column: 'ax', unit: 'g' }, gyro_z: { column: 'r', scale: -1 } };
  const physics = found({ ...MAPPING, signals, delays: { gnss: 0.1 } }, [view('ax', 'guess'), view('r', 'likely')]);
  expect(doubts(MAPPING, physics, CHOICES)).toEqual({ columns: ['r'], channels: ['gnss'] });
  expect(guesses(physics)).toBe(1);
  const taken = takeAll({ ...MAPPING, origin: { lat_deg: 1, lon_deg: 2, alt: 0 } }, physics);
  expect(doubts(taken, physics, CHOICES)).toEqual({ columns: [], channels: [] });
  expect(taken.origin?.lat_deg).toBe(1);
});

test('a guess does not overrule a name, nor does the mount that was found with it', () => {
  const mounts = { imu: { roll_deg: 0, pitch_deg: 0, yaw_deg: 3 }, mag: { roll_deg: 1, pitch_deg: 0, yaw_deg: 0 } };
  const swapped = { ...MAPPING, signals: { accel_y: { column: 'ax' }, gyro_z: { column: 'r', scale: -1 } }, mounts };
  const named = { ...view('ax', 'guess'), name_says: 'accel_x' };
  const taken = takeAll(MAPPING, found(swapped, [named, view('r', 'likely')]));
  expect(taken.signals).toEqual({ accel_x: MAPPING.signals['accel_x'], gyro_z: { column: 'r', scale: -1 } });
  expect(Object.keys(taken.mounts ?? {})).toEqual(['mag']);
  expect(takeAll(MAPPING, found(swapped, [view('ax', 'guess')]))).toEqual({ ...MAPPING, ...swapped });
});

test('one column, or mounts and delays alone, can be taken', () => {
  const physics = found({ ...MAPPING, signals: { accel_x: { column: 'ax' }, gyro_z: { column: 'r', scale: -1 } }, delays: { gnss: 0.1 } });
  const one = takeColumn(MAPPING, physics, 'r');
  expect(one.signals).toEqual({ accel_x: MAPPING.signals['accel_x'], gyro_z: { column: 'r', scale: -1 } });
  const placed = takePhysics({ ...MAPPING, mounts: { mag: { roll_deg: 1, pitch_deg: 0, yaw_deg: 0 } } }, physics);
  expect(placed).toEqual({ ...MAPPING, delays: { gnss: 0.1 } });
});

test('a small picture breaks where nothing was measured', () => {
  expect(outline([NaN, NaN], 10, 10)).toBe('');
  expect(outline([0, 1, NaN, NaN, 1, 1], 30, 12).split('M')).toHaveLength(3);
  expect(outline([5, 5], 10, 10)).toBe('M5.0 5.0L5.0 5.0Z');
});
