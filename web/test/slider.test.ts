import { expect, test } from 'vitest';
import { fromTravel, toTravel, TRAVEL } from '../src/slider';

const log = { min: 1e-4, max: 1, scale: 'log' } as const;
const linear = { min: -0.5, max: 0.5, scale: 'linear' } as const;

test('a logarithmic slider gives equal ratios to equal steps', () => {
  expect(toTravel(log, 1e-2)).toBeCloseTo(TRAVEL / 2, 9);
  expect(fromTravel(log, TRAVEL / 4)).toBeCloseTo(1e-3, 12);
});

test('both ends are reached exactly', () => {
  for (const spec of [log, linear, { min: 0.3, max: 7.7 }]) {
    expect(fromTravel(spec, 0)).toBe(spec.min);
    expect(fromTravel(spec, TRAVEL)).toBe(spec.max);
  }
});

test('going there and back stays within a step', () => {
  for (const spec of [log, linear]) {
    for (let travel = 1; travel < TRAVEL; travel += 7) {
      expect(Math.abs(toTravel(spec, fromTravel(spec, travel)) - travel)).toBeLessThan(2.5);
    }
  }
});

test('values are round enough to be read and stay in range', () => {
  expect(String(fromTravel(log, 333)).length).toBeLessThan(9);
  expect(String(fromTravel(linear, 333)).length).toBeLessThan(9);
  expect(fromTravel(linear, 2 * TRAVEL)).toBe(0.5);
  expect(toTravel(log, 5)).toBe(TRAVEL);
});

test('a logarithmic range that touches zero falls back to equal steps instead of NaN', () => {
  expect(fromTravel({ min: 0, max: 10, scale: 'log' }, TRAVEL / 2)).toBe(5);
});
