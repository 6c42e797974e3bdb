import { expect, test } from 'vitest';
import type { OpenReport } from '../src/door';
import type { Clash, ColumnView, Examined, Found, Mapping, Trial } from '../src/wizard/door';
import { SERIES, STEP } from '../src/wizard/door';
import { issuesOf } from '../src/wizard/issues';
import { Motion } from '../src/wizard/motion';
import { columnsOf, recognise, type Shelved } from '../src/wizard/shelf';

const MAPPING: Mapping = { version: 1, time: { column: 't' }, signals: { accel_x: { column: 'ax' }, gyro_z: { column: 'r', scale: -1 } } };
const shelved = (name: string, columns: string[], mapping = MAPPING): Shelved => ({ name, columns, mapping });

test('a file is recognised by the names of its columns, one more or less, and never without a column that is needed', () => {
  const known = [shelved('one', ['t', 'ax', 'r', 'a', 'b']), shelved('two', ['t', 'ax', 'r', 'x', 'y'])];
  expect(recognise(['y', 'x', 'r', 'ax', 't'], known)?.name).toBe('two');
  expect(recognise(['t', 'ax', 'r', 'a', 'b', 'new'], known)?.name).toBe('one');
  expect(recognise(['t', 'ax', 'r'], known)).toBeNull();
  expect(recognise(['t', 'r', 'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h'], [shelved('lacks ax', ['t', 'r', 'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h'])])).toBeNull();
  expect(recognise(['t'], [])).toBeNull();
});

test('the columns of a file are those used and those left aside, each once', () => {
  const report = { used: [{ column: 't' }, { column: 'ax' }, { column: 'ax' }], unused: [{ column: 'note' }] } as unknown as OpenReport;
  expect(columnsOf(report)).toEqual(['ax', 'note', 't']);
});

const view = (column: string): ColumnView => ({
  column, stated_unit: null, rate: 100, range: [0, 1], values: 9, held: false, signal: null, unit: null, scale: 1, confidence: 'likely', why: 'because', name_says: null,
});
const CHOICES = [
  { signal: 'accel_x', channel: 'imu', unit: 'm/s^2', units: 'm/s2, g', doc: '' },
  { signal: 'gyro_z', channel: 'imu', unit: 'rad/s', units: 'rad/s, deg/s', doc: '' },
];
const PROPOSED: Mapping = { ...MAPPING, signals: { accel_x: { column: 'ax', unit: 'g' }, gyro_z: { column: 'r' } }, delays: { gnss: 0.2 } };
const FOUND: Found = {
  mapping: PROPOSED,
  columns: [view('ax'), view('r')],
  mounts: [],
  delays: [{ channel: 'gnss', late: 0.2, sigma: 0.01, applied: true, why: 'turns' }],
  findings: [{ weight: 'contradiction', columns: ['ax'], text: 'said otherwise' }],
  names_believed: true,
};
const EXAMINED: Examined = [FOUND, [], CHOICES];
const clash = (column: string, signal: string): Clash => ({ signals: [signal], columns: [column], text: `${column} is wrong`, corrections: [{ signal, unit: 'deg/s', scale: 1 }] });
const trial = (clashes: Clash[]): Trial => ({ clashes, start: 0, series: [] });

test('what is measured goes before what is proposed, each is said once, and each correction changes only what it is about', () => {
  const issues = issuesOf({ mapping: MAPPING, trial: trial([clash('r', 'gyro_z')]), examined: EXAMINED, weak: [], first: MAPPING });
  expect(issues.map((i) => i.what)).toEqual(['r', 'ax', 'delay of Satellites']);
  expect(issues[0]?.fix?.(MAPPING).signals).toEqual({ ...MAPPING.signals, gyro_z: { column: 'r', unit: 'deg/s' } });
  expect(issues[1]?.fix?.(MAPPING).signals['accel_x']).toEqual({ column: 'ax', unit: 'g' });
  expect(issues[2]?.fix?.(MAPPING).delays).toEqual({ gnss: 0.2 });
});

test('a proposal that contradicts itself is not urged on, and what was changed and agrees is no issue any more', () => {
  const changed: Mapping = { ...MAPPING, signals: { ...MAPPING.signals, accel_x: { column: 'ax', scale: 2 } }, delays: { gnss: 0.1 } };
  expect(issuesOf({ mapping: changed, trial: trial([]), examined: EXAMINED, weak: [clash('ax', 'accel_x'), clash('r', 'gyro_z')], first: MAPPING })).toEqual([]);
});

/** Twenty seconds northward at 10 m/s, then to the right at 0.1 rad/s by the gyro alone. */
function motion(sign: number): Motion {
  const bins = 400;
  const of = (name: string, i: number): number => {
    const t = i * STEP;
    if (name === 'speed') return 10;
    if (name === 'turned') return t < 20 ? 0 : sign * 0.1 * (t - 20);
    if (name === 'north') return 10 * t;
    if (name === 'east' || name === 'course') return 0;
    return NaN;
  };
  return new Motion({ clashes: [], start: 5, series: SERIES.map((name) => Float64Array.from({ length: bins }, (_, i) => of(name, i))) });
}

test('the way by speed and gyro begins where the car is, as it heads, and bends to the side that the gyro says', () => {
  const right = motion(1);
  expect(right.piece(30)).toEqual([20, 40]);
  const { ground, own } = right.ways(30);
  expect(own[0]).toEqual(ground[0]);
  expect(own.at(-1)?.[0]).toBeGreaterThan(80);
  expect(motion(-1).ways(30).own.at(-1)?.[0]).toBeLessThan(-80);
  expect(right.sensed(40)?.heading).toBeCloseTo(1.5, 1);
  expect(right.overGround(40)).toEqual({ place: [0, 350], heading: 0 });
});

test('the piece stays while the instant lies in it and never leaves the log; numbers are means of what is known', () => {
  const m = motion(1);
  expect(m.piece(30)).toEqual(m.piece(39));
  expect(m.piece(5)).toEqual([5, 25]);
  expect(m.piece(44.9)[1]).toBeCloseTo(m.t1, 9);
  expect(m.mean('speed', 5)).toBe(10);
  expect(m.mean('pitch', 20)).toBeNaN();
  expect(m.most((t) => -Math.abs(t - 33.2))).toBeCloseTo(33.2, 1);
});
