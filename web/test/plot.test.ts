import { expect, test } from 'vitest';
import { rangeOf, timeLabels, valueLabels, withBands } from '../src/plot/axes';
import { band, breakTurns, withGaps } from '../src/plot/gaps';
import { outagesOf } from '../src/plot/map';
import { stretches } from '../src/plot/strip';

test('what is not finite becomes a gap, also at the start where uPlot would lose its range', () => {
  expect(withGaps(Float64Array.of(Number.NaN, 1, Number.POSITIVE_INFINITY, 2), (v) => 2 * v)).toEqual([null, 2, null, 4]);
});

test('an angle that goes round leaves no line across the plot', () => {
  expect(breakTurns([160, 165, 170, -175, -170, -160, null, 170], 180)).toEqual([160, null, null, null, null, -160, null, 170]);
  expect(breakTurns([-90, 89], 180)).toEqual([-90, 89]);
});

test('a band is three sigmas wide and open where there is no sigma', () => {
  const { low, high } = band(Float64Array.of(1, 2), Float64Array.of(0.1, Number.NaN));
  expect(low[0]).toBeCloseTo(0.7, 12);
  expect(high[0]).toBeCloseTo(1.3, 12);
  expect(low[1]).toBeNaN();
});

test('a flat curve does not fill the plot with noise', () => {
  const [low, high] = rangeOf([[0.001, -0.001, null]], 2, false);
  expect(high - low).toBeGreaterThanOrEqual(2);
  expect(rangeOf([[]], 2, false)).toEqual([-1, 1]);
});

test('a logarithmic range takes positive values only', () => {
  const [low, high] = rangeOf([[0, -1, 0.5, 50]], 1, true);
  expect(low).toBeGreaterThan(0);
  expect(high).toBeGreaterThan(50);
});

test('a band that dwarfs the curves is cut off', () => {
  expect(withBands([-1, 1], [[[-100], [100]]])).toEqual([-1.6, 1.6]);
  expect(withBands([-1, 1], [[[-0.5], [0.5]], [[null], [null]]])).toEqual([-1, 1]);
  // What lasts a moment does not stretch the axis, however many curves have it.
  const start = [-90, ...new Array<number>(99).fill(-1.2)];
  expect(withBands([-1, 1], [[start, start.map((v) => -v)], [start, start.map((v) => -v)]])).toEqual([-1.2, 1.2]);
});

test('labels are as fine as the ticks are close', () => {
  expect(timeLabels([60, 90], 30)).toEqual(['1:00', '1:30']);
  expect(timeLabels([0.05], 0.05)).toEqual(['0:00.05']);
  expect(valueLabels([-0.5, 0, 0.5], 0.5)).toEqual(['−0.5', '0.0', '0.5']);
  expect(valueLabels([-5, 0], 5)).toEqual(['−5', '0']);
  // A label of too few digits would say 0.3 where the line stands at 0.25.
  expect(valueLabels([-0.25, 0], 0.25)).toEqual(['−0.25', '0.00']);
});

test('equal modes join into a stretch and a gap parts them', () => {
  const times = [0, 1, 2, 3, 4, 5];
  expect(stretches(times, [1, 1, 2, Number.NaN, 2, 2])).toEqual([
    { t0: -0.5, t1: 1.5, mode: 1 },
    { t0: 1.5, t1: 2.5, mode: 2 },
    { t0: 3.5, t1: 5.5, mode: 2 },
  ]);
});

test('an outage is a hole between fixes, before the first or after the last, not the rhythm of a slow receiver', () => {
  const path = (times: number[]): Float64Array => Float64Array.from(times.flatMap((t) => [t, 0, 0, 0, 0]));
  expect(outagesOf(path([0, 1, 2, 10, 11, 12]), { t0: 0, t1: 20 })).toEqual([{ t0: 2, t1: 10 }, { t0: 12, t1: 20 }]);
  expect(outagesOf(path([0, 3, 6, 9]), { t0: 0, t1: 10 })).toEqual([]);
  expect(outagesOf(path([]), { t0: 0, t1: 10 })).toEqual([]);
});
