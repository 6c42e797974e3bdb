import { expect, test } from 'vitest';
import { meanQuantile } from '../src/navigation/curves';
import type { Blind, Drift } from '../src/navigation/door';
import { driftAt, driftText } from '../src/navigation/drift-table';
import { isPossible, makeFault, metresPer, proposedSpan, signalsFor, signalUnit, usualAmount } from '../src/navigation/fault-kinds';
import { distanceOf, worstOf, yawOf } from '../src/navigation/sweep';
import { dragged, moved, parseTime, tidy, windowAt, windowOf } from '../src/navigation/windows';
import { held } from '../src/plot/gaps';
import { ellipseOf, readable } from '../src/plot/ellipse';

const DRIVE = { t0: 100, t1: 400 };
const blind = (t0: number, t1: number, sensor: Blind['sensor'] = 'gnss'): Blind => ({ sensor, t0, t1 });

test('a window drawn backwards or over the edge lies inside the drive, its ends in order and apart', () => {
  expect(windowOf('gnss', 180, 120, DRIVE)).toEqual(blind(120, 180));
  expect(windowOf('mag', 90, 110, DRIVE)).toEqual(blind(100, 110, 'mag'));
  expect(windowOf('gnss', 400, 400, DRIVE)).toEqual(blind(399.5, 400));
});

test('a window moved against the end of the drive keeps its length', () => {
  expect(moved(blind(350, 390), 30, DRIVE)).toEqual(blind(360, 400));
  expect(moved(blind(110, 120), -30, DRIVE)).toEqual(blind(100, 110));
});

test('windows of one sensor that touch become one, those of two sensors stay apart', () => {
  const all = [blind(200, 220), blind(150, 160, 'odometer'), blind(120, 180), blind(180, 190), blind(185, 230, 'mag')];
  expect(tidy(all)).toEqual([blind(120, 190), blind(200, 220), blind(185, 230, 'mag'), blind(150, 160, 'odometer')]);
});

test('near an end it is the end that is taken hold of, within a window the window, of a short one too', () => {
  const windows = [blind(120, 180), blind(200, 203), blind(150, 170, 'odometer')];
  expect(windowAt(windows, 'gnss', 122, 5)).toMatchObject({ index: 0, part: 'start' });
  expect(windowAt(windows, 'gnss', 183, 5)).toMatchObject({ index: 0, part: 'end' });
  expect(windowAt(windows, 'gnss', 150, 5)).toMatchObject({ index: 0, part: 'whole' });
  expect(windowAt(windows, 'gnss', 201.5, 5)).toMatchObject({ index: 1, part: 'whole' });
  expect(windowAt(windows, 'gnss', 195, 2)).toBeNull();
  expect(windowAt(windows, 'mag', 150, 5)).toBeNull();
});

test('an end dragged past the other turns the window round instead of making its length negative', () => {
  expect(dragged(blind(120, 180), 'start', 80, DRIVE)).toEqual(blind(180, 200));
  expect(dragged(blind(120, 180), 'end', 30, DRIVE)).toEqual(blind(120, 210));
  expect(dragged(blind(120, 180), 'whole', 30, DRIVE)).toEqual(blind(150, 210));
});

test('a time is typed as seconds, minutes or hours; anything else is no number', () => {
  expect([parseTime('90'), parseTime('1:30.5'), parseTime('1:01:30'), parseTime(' 2,5 ')]).toEqual([90, 90.5, 3690, 2.5]);
  for (const text of ['', 'soon', '1:', '-3', '1:2:3:4']) expect(parseTime(text)).toBeNaN();
});

test('the drift is told at times that the window reaches and at its end', () => {
  const at = (after: number, distance: number | null): Drift['at'][number] => ({ after, distance, growth: distance, share: 0.01, yaw: 0 });
  const drift: Drift = { window: [120, 165], driven: 500, largest: 3, at: [at(10, 0.5), at(30, 1), at(45, 2.25)] };
  const window = blind(120, 165);
  expect(driftAt(drift, window, 30)?.distance).toBe(1);
  expect(driftAt(drift, window, 60)).toBeNull();
  expect(driftText(driftAt(drift, window, 0))).toBe('2.25 m (1.0 %)');
  expect(driftText(null)).toBe('–');
  expect(driftText({ ...at(10, null), share: null })).toBe('–');
  const worse = { ...drift, at: [at(45, 9)] };
  const unknown = { ...drift, at: [at(45, null)] };
  expect(worstOf([drift, unknown, worse], distanceOf)).toBe(worse);
  expect(distanceOf(unknown)).toBeNull();
});

test('the worst window of a compass is the one whose yaw goes off most, whichever way', () => {
  const off = (yaw: number | null): Drift => ({ window: [0, 10], driven: null, largest: null, at: [{ after: 10, distance: null, growth: null, share: null, yaw }] });
  const [left, right, unknown] = [off(-0.3), off(0.2), off(null)] as const;
  expect(worstOf([right, unknown, left], yawOf)).toBe(left);
  expect([yawOf(left), yawOf(unknown), distanceOf(left)]).toEqual([0.3, null, null]);
  expect(worstOf([unknown], yawOf)).toBeNull();
});

test('the interval of a mean over satellites is that of chi-square over their number', () => {
  // Quantiles of tables: 2.5 and 97.5 % for 4, 8 and 12 degrees of freedom.
  for (const [n, low, high] of [[4, 0.4844, 11.143], [8, 2.18, 17.535], [12, 4.404, 23.337]] as const) {
    expect(Math.abs((n * meanQuantile(n, -1.96)) / low - 1)).toBeLessThan(0.08);
    expect(Math.abs((n * meanQuantile(n, 1.96)) / high - 1)).toBeLessThan(0.005);
  }
  expect(meanQuantile(0, 1.96)).toBeNaN();
});

test('an ellipse lies along the direction in which the errors go together', () => {
  const diagonal = ellipseOf(0, 0, 1, 1, 0.5);
  expect(diagonal?.bearing).toBeCloseTo(Math.PI / 4, 12);
  expect(diagonal?.long).toBeCloseTo(3 * Math.sqrt(1.5), 12);
  expect(diagonal?.short).toBeCloseTo(3 * Math.sqrt(0.5), 12);
  expect(ellipseOf(0, 0, 1, 1, -0.5)?.bearing).toBeCloseTo(-Math.PI / 4, 12);
  // East is the worse known one: the long axis lies to the east.
  expect(Math.abs(ellipseOf(0, 0, 1, 2, 0)?.bearing ?? 0)).toBeCloseTo(Math.PI / 2, 12);
  expect(ellipseOf(0, 0, 2, 1, Number.NaN)?.bearing).toBeCloseTo(0, 12);
  expect(ellipseOf(0, 0, Number.NaN, 1, 0)).toBeNull();
});

test('ellipses along a path are drawn where they can be told apart, and not where they are dots', () => {
  const row = Array.from({ length: 100 }, (_, i) => ellipseOf(i, 0, 1, 1, 0) ?? { north: 0, east: 0, long: 0, short: 0, bearing: 0 });
  expect(readable(row, 0.5)).toEqual([]);
  const drawn = readable(row, 2);
  expect(drawn.length).toBeGreaterThan(4);
  for (let i = 1; i < drawn.length; i++) expect(2 * ((drawn[i]?.north ?? 0) - (drawn[i - 1]?.north ?? 0))).toBeGreaterThanOrEqual(34);
});

test('single values become a staircase that ends where none follows for long', () => {
  const gap = Number.NaN;
  expect([...held([1, gap, gap, 2, gap, gap], [0, 0.5, 1, 1.5, 2, 4], 1)]).toEqual([1, 1, 1, 2, 2, gap]);
});

test('a fault offers only what can fail so, with the amount in its unit', () => {
  const channels = [{ name: 'imu', columns: ['accel_x', 'gyro_z'] }, { name: 'gnss', columns: ['gnss_lat', 'gnss_nsat', 'gnss_std_n'] }];
  // One step for a whole channel would add metres to radians.
  expect(signalsFor('bias', channels)).toEqual(['accel_x', 'gyro_z', 'gnss_lat']);
  expect(signalsFor('freeze', channels)).toEqual(['imu', 'gnss', 'accel_x', 'gyro_z', 'gnss_lat']);
  expect(signalsFor('clock_jump', channels)).toEqual([]);
  expect([signalUnit('bias', 'gyro_z'), signalUnit('delay', 'gyro_z'), signalUnit('multipath', '')]).toEqual(['rad/s', 's', 'm']);
  expect([isPossible('clock_jump', channels, false), isPossible('multipath', channels, false), isPossible('multipath', channels.slice(0, 1), false), isPossible('bias', [], true)]).toEqual([false, true, false, false]);
  const form = { signal: 'imu', amount: 4, satellites: 2.4, from: 1, to: 2, seed: 7 };
  expect(makeFault('noise', form)).toEqual({ kind: 'noise', signal: 'imu', factor: 4, from: 1, to: 2, seed: 7 });
  expect(makeFault('multipath', form)).toEqual({ kind: 'multipath', metres: 4, satellites: 2, from: 1, to: 2, seed: 7 });
});

test('a fault is proposed inside what is shown, so that it is a step, or where a sensor is blind', () => {
  expect(proposedSpan(DRIVE, [])).toEqual({ t0: 200, t1: 300 });
  expect(proposedSpan(DRIVE, [blind(120, 180), blind(210, 240)])).toEqual({ t0: 210, t1: 240 });
  // A window that is not shown is not meant.
  expect(proposedSpan({ t0: 250, t1: 400 }, [blind(120, 180)])).toEqual({ t0: 300, t1: 350 });
});

test('a place is moved by metres, whatever the latitude', () => {
  expect([signalUnit('bias', 'gnss_lat'), signalUnit('bias', 'gnss_lon'), usualAmount('bias', 'gnss_lon')]).toEqual(['m', 'm', 10]);
  // A minute of arc along a meridian is a nautical mile; at 60 degrees one along the parallel is half of it.
  const minute = Math.PI / 180 / 60;
  expect(minute * metresPer('bias', 'gnss_lat', 1)).toBeCloseTo(1853, 0);
  expect(minute * metresPer('bias', 'gnss_lon', Math.PI / 3)).toBeCloseTo(926.6, 0);
  expect([metresPer('bias', 'gnss_alt', 1), metresPer('noise', 'gnss_lat', 1), metresPer('delay', 'gnss_lon', 1)]).toEqual([1, 1, 1]);
});
