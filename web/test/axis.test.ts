import { afterEach, expect, test } from 'vitest';
import { distanceLabels } from '../src/plot/axes';
import { axis, distanceAxis, shareOf, timeAt, timeAxis } from '../src/plot/axis';
import { outages } from '../src/road/lamps';
import { corrections } from '../src/road/offers';
import { Store } from '../src/state';
import { formatDistance } from '../src/units';

/** 10 s at 10 m/s, 10 s of standing, 10 s at 20 m/s, from t = 100 s on. */
const SPAN = { t0: 100, t1: 130 };
const DRIVEN = Array.from({ length: 31 }, (_, s) => (s <= 10 ? 10 * s : s <= 20 ? 100 : 100 + 20 * (s - 20)));
const WAY = distanceAxis(SPAN, DRIVEN);

afterEach(() => {
  axis.value = timeAxis(0);
});

test('an instant stands where the car was then, and every place has one instant, standing or not', () => {
  // A standing car creeps by a tenth of a millimetre per second, so that nothing is lost.
  expect(WAY.place(105)).toBeCloseTo(50, 2);
  expect(WAY.place(115)).toBeCloseTo(100, 2);
  expect(WAY.place(125)).toBeCloseTo(200, 2);
  for (const time of [100, 103.7, 110, 112.5, 119.99, 120, 127.3, 130]) expect(WAY.time(WAY.place(time))).toBeCloseTo(time, 6);
  const places = Array.from({ length: 301 }, (_, k) => WAY.place(100 + k / 10));
  expect(places.every((place, k) => k === 0 || place > (places[k - 1] as number))).toBe(true);
});

test('a share of a window is a share of its way', () => {
  expect(shareOf(125, SPAN, WAY)).toBeCloseTo(200 / 300, 4);
  expect(timeAt(0.5, SPAN, WAY)).toBeCloseTo(122.5, 3);
  expect(shareOf(115, SPAN, timeAxis(100))).toBe(0.5);
  const still = { t0: 112, t1: 118 };
  expect(shareOf(115, still, WAY)).toBeCloseTo(0.5, 6);
});

test('zooming and moving keep to the way where plots are drawn over it', () => {
  const store = new Store();
  store.span.value = SPAN;
  store.window.value = SPAN;
  axis.value = WAY;
  const about = 122.5;
  const share = shareOf(about, store.window.value);
  store.zoom(0.5, about);
  expect(shareOf(about, store.window.value)).toBeCloseTo(share, 6);
  expect(WAY.place(store.window.value.t1) - WAY.place(store.window.value.t0)).toBeCloseTo(150, 1);
  store.pan(0.1);
  expect(WAY.place(store.window.value.t0)).toBeCloseTo(75 + 15, 1);
  store.pan(99);
  expect(store.window.value.t1).toBe(130);
  store.zoom(99, about);
  expect(store.window.value).toEqual(SPAN);
  // A stretch of standing can be shown: half a metre about it.
  store.show(112, 118);
  expect(WAY.place(store.window.value.t1) - WAY.place(store.window.value.t0)).toBeCloseTo(0.5, 6);
});

test('places are labelled in one unit, as fine as their spacing', () => {
  expect(distanceLabels([0, 50, 100], 50)).toEqual(['0 m', '50 m', '100 m']);
  expect(distanceLabels([0, 1000, 2000], 1000)).toEqual(['0 km', '1 km', '2 km']);
  expect(distanceLabels([2000, 2500], 500)).toEqual(['2.0 km', '2.5 km']);
  expect(distanceLabels([12_345.5, 12_346], 0.5)).toEqual(['12345.5 m', '12346.0 m']);
  expect([formatDistance(999.4), formatDistance(12_345), formatDistance(Number.NaN)]).toEqual(['999 m', '12.35 km', '–']);
});

test('lamps that are out for the same reason are told together', () => {
  expect(outages(['slope', 'grade', 'bias', 'altitude'], [0, 2, 2, 1], ['no datum', 'standing'])).toEqual([
    [['grade', 'bias'], 'standing'],
    [['altitude'], 'no datum'],
  ]);
  expect(outages(['slope'], [Number.NaN], [])).toEqual([]);
});

test('a drive offers what it is clear about, rounded and inside the range of its parameter', () => {
  const clear = corrections({
    latency: { delay: 0.0523, sigma: 0.004, correlation: 0.9 },
    is_late: true,
    offset: { offset: -0.7104, sigma: 0.02, distance: 1700 },
    is_offset: true,
    has_height: true,
  });
  expect(clear.map(({ param, value }) => [param, value])).toEqual([
    ['wheel_latency', 0.052],
    ['accel_offset', -0.71],
    ['use_gnss_height', true],
    ['two_way', true],
  ]);
  expect(clear[1]?.finding).toContain('4.2°');
  const unclear = corrections({ latency: null, is_late: false, offset: null, is_offset: false, has_height: false });
  expect(unclear.map(({ param }) => param)).toEqual(['two_way']);
});
