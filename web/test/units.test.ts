import { expect, test } from 'vitest';
import { axisSign, convert, convertDifference, DEFAULT_DISPLAY, digitsWithin, formatFixed, formatSignificant, formatTime, paramUnit, prettyUnit, quantityOf, unitLabel } from '../src/units';

const rad = { ...DEFAULT_DISPLAY, angle: 'rad', grade: 'angle' } as const;
const iso = { ...DEFAULT_DISPLAY, axes: 'iso' } as const;

test('the quantity of a column comes from its name and unit, also for its sigma', () => {
  expect(quantityOf('roll', 'rad')).toBe('angle');
  expect(quantityOf('grade_sigma', 'rad')).toBe('grade');
  expect(quantityOf('speed', 'm/s')).toBe('speed');
  expect(quantityOf('accel_x', 'm/s^2')).toBe('plain');
});

test('angles, grades and speeds are converted, and a grade in per cent is a tangent', () => {
  expect(convert('angle', Math.PI / 6, DEFAULT_DISPLAY)).toBeCloseTo(30, 12);
  expect(convert('grade', Math.atan(0.1), DEFAULT_DISPLAY)).toBeCloseTo(10, 12);
  expect(convert('grade', 0.1, rad)).toBe(0.1);
  expect(convert('speed', 10, DEFAULT_DISPLAY)).toBeCloseTo(36, 12);
  expect(convertDifference('grade', 0.01, DEFAULT_DISPLAY)).toBeCloseTo(1, 12);
});

test('ISO 8855 turns pitch, yaw and sideslip but neither roll nor the road', () => {
  for (const column of ['pitch', 'yaw', 'sideslip', 'down', 'gyro_z']) expect(axisSign(column, iso)).toBe(-1);
  for (const column of ['roll', 'grade', 'slope', 'speed', 'north', 'gyro_x']) expect(axisSign(column, iso)).toBe(1);
  expect(axisSign('pitch', DEFAULT_DISPLAY)).toBe(1);
});

test('units are printed as in books', () => {
  expect(prettyUnit('m/s^2')).toBe('m/s²');
  expect(prettyUnit('rad/sqrt(s)')).toBe('rad/√s');
  expect(prettyUnit('uT')).toBe('µT');
  expect(prettyUnit('1')).toBe('');
  expect(unitLabel('grade', 'rad', DEFAULT_DISPLAY)).toBe('%');
});

test('a parameter in radians per something is shown in degrees per something', () => {
  expect(paramUnit('rad/sqrt(s)', DEFAULT_DISPLAY).label).toBe('°/√s');
  expect(paramUnit('rad/sqrt(s)', DEFAULT_DISPLAY).factor).toBeCloseTo(57.29578, 5);
  expect(paramUnit('1/rad', DEFAULT_DISPLAY)).toEqual({ factor: 1, label: '1/rad' });
  expect(paramUnit('rad', rad)).toEqual({ factor: 1, label: 'rad' });
});

test('numbers keep their meaning digits, a real minus, and no negative zero', () => {
  expect(formatFixed(-0.001, 2)).toBe('0.00');
  expect(formatFixed(-1.5, 1)).toBe('−1.5');
  expect(formatFixed(Number.NaN, 1)).toBe('–');
  expect(formatSignificant(0.012345)).toBe('0.0123');
  expect(formatSignificant(1234.5)).toBe('1235');
  expect(formatSignificant(1.5e-7)).toBe('1.50e−7');
});

test('times carry over into the next minute when they are rounded', () => {
  expect(formatTime(59.96)).toBe('1:00.0');
  expect(formatTime(3599.99)).toBe('1:00:00.0');
  expect(formatTime(61, 0)).toBe('1:01');
  expect(formatTime(-1.5)).toBe('−0:01.5');
});

test('as many digits are shown as the reach of the error has that count, and no fewer than usual', () => {
  expect(digitsWithin([0.0123], 2)).toBe(3);
  expect(digitsWithin([0.1, 0.00042], 2)).toBe(5);
  expect(digitsWithin([35], 2)).toBe(2);
  expect(digitsWithin([], 1)).toBe(1);
  // No error, or none that is known, asks for nothing.
  expect(digitsWithin([0, Number.NaN, Infinity], 2)).toBe(2);
  expect(digitsWithin([1e-30], 2)).toBe(8);
});
