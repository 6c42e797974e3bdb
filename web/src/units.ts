/** From SI and radians to what a person reads: units, axis convention, number of digits. */

export interface Display {
  angle: 'deg' | 'rad';
  speed: 'km/h' | 'm/s' | 'mph';
  grade: 'percent' | 'angle';
  axes: 'sae' | 'iso';
}

export const DEFAULT_DISPLAY: Display = { angle: 'deg', speed: 'km/h', grade: 'percent', axes: 'sae' };

/** What a number is of, which decides how it is shown. */
export type Quantity = 'angle' | 'rate' | 'grade' | 'speed' | 'plain';

const DEGREES = 180 / Math.PI;
const SPEED_FACTOR: Record<Display['speed'], number> = { 'km/h': 3.6, 'm/s': 1, mph: 1 / 0.44704 };
const GRADES = new Set(['grade', 'slope']);
/** Columns whose sign is the other way round in ISO 8855: y points to the left and z up there. */
const FLIPPED = /^(pitch|yaw|body_pitch|suspension_pitch|sideslip|course|down|d|v_down|vd|yaw_rate|gyro_[yz]|accel_[yz]|mag_[yz]|(gyro|accel)_bias_[yz]|lateral_speed|vy|force_y.*)$/;

/** The quantity of a column, from its name and SI unit. */
export function quantityOf(column: string, unit: string): Quantity {
  const base = column.replace(/_sigma$/, '');
  if (unit === 'rad') return GRADES.has(base) ? 'grade' : 'angle';
  if (unit === 'm/s' && /speed|^v[xy]?$/.test(base)) return 'speed';
  return 'plain';
}

/** -1 for a column that ISO 8855 counts the other way, when that is displayed; else 1. */
export function axisSign(column: string, display: Display): 1 | -1 {
  return display.axes === 'iso' && FLIPPED.test(column) ? -1 : 1;
}

/** An SI value as displayed. */
export function convert(quantity: Quantity, value: number, display: Display): number {
  switch (quantity) {
    case 'angle':
    case 'rate':
      return display.angle === 'deg' ? value * DEGREES : value;
    case 'grade':
      if (display.grade === 'percent') return 100 * Math.tan(value);
      return display.angle === 'deg' ? value * DEGREES : value;
    case 'speed':
      return value * SPEED_FACTOR[display.speed];
    case 'plain':
      return value;
  }
}

/** An SI error or sigma as displayed: a small difference, so the tangent is a factor. */
export function convertDifference(quantity: Quantity, value: number, display: Display): number {
  return quantity === 'grade' && display.grade === 'percent' ? 100 * value : convert(quantity, value, display);
}

/** The displayed unit; `unit` is the SI unit, used for plain quantities. */
export function unitLabel(quantity: Quantity, unit: string, display: Display): string {
  switch (quantity) {
    case 'angle':
      return display.angle === 'deg' ? '°' : 'rad';
    case 'rate':
      return display.angle === 'deg' ? '°/s' : 'rad/s';
    case 'grade':
      if (display.grade === 'percent') return '%';
      return display.angle === 'deg' ? '°' : 'rad';
    case 'speed':
      return display.speed;
    case 'plain':
      return prettyUnit(unit);
  }
}

/** A unit as printed in books: `m/s^2` is `m/s²`, `sqrt(s)` is `√s`, a pure number has none. */
export function prettyUnit(unit: string): string {
  if (unit === '1') return '';
  return unit
    .replace(/\^2/g, '²')
    .replace(/\^3/g, '³')
    .replace(/\^4/g, '⁴')
    .replace(/sqrt\(([^)]*)\)/g, '√$1')
    .replace(/\buT\b/g, 'µT')
    .replace(/ /g, ' ');
}

/** Whether a parameter of this unit is an angle (or an angle per something) that degrees suit better. */
function isAngular(unit: string): boolean {
  return /^rad($|\/)/.test(unit);
}

/** How a parameter is shown: its SI value times `factor`, in `label`. */
export function paramUnit(unit: string, display: Display): { factor: number; label: string } {
  if (isAngular(unit) && display.angle === 'deg') {
    return { factor: DEGREES, label: prettyUnit(unit.replace(/^rad/, '°')) };
  }
  return { factor: 1, label: prettyUnit(unit) };
}

/** A number with a real minus sign; a dash for none. */
export function formatFixed(value: number | null | undefined, digits: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace('-', '') : text).replace('-', '−');
}

/** A number with about `significant` digits, without useless zeros in front or an exponent where it reads worse. */
export function formatSignificant(value: number | null | undefined, significant = 3): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size < -4 || size > 6) return value.toExponential(significant - 1).replace('-', '−').replace('e-', 'e−').replace('e+', 'e');
  return formatFixed(value, Math.min(8, Math.max(0, significant - 1 - size)));
}

/** Digits after the point that suit a displayed quantity; of a plain one, those that suit `least`, the smallest range it is drawn in. */
export function digitsOf(quantity: Quantity, display: Display, least = 1): number {
  if (quantity === 'plain') return Math.min(5, Math.max(0, 2 - Math.floor(Math.log10(least))));
  if (quantity === 'angle' || quantity === 'rate' || (quantity === 'grade' && display.grade === 'angle')) return display.angle === 'deg' ? 2 : 4;
  return quantity === 'grade' ? 2 : 1;
}

/** Digits after the point with which each of these reaches shows two that count; at least `least`. */
export function digitsWithin(reaches: readonly number[], least: number): number {
  const needed = reaches.filter((reach) => reach > 0 && reach < Infinity).map((reach) => 1 - Math.floor(Math.log10(reach)));
  return Math.min(8, Math.max(least, ...needed));
}

/** Seconds as `m:ss.s`, or `h:mm:ss.s`. */
export function formatTime(seconds: number, digits = 1): string {
  if (!Number.isFinite(seconds)) return '–';
  const scale = 10 ** digits;
  const total = Math.round(Math.abs(seconds) * scale) / scale;
  const hours = Math.floor(total / 3600);
  const minutes = Math.floor((total % 3600) / 60);
  const rest = (total % 60).toFixed(digits).padStart(digits > 0 ? 3 + digits : 2, '0');
  const sign = seconds < 0 ? '−' : '';
  return hours > 0 ? `${sign}${hours}:${String(minutes).padStart(2, '0')}:${rest}` : `${sign}${minutes}:${rest}`;
}

/** Metres, from a kilometre on in kilometres. */
export function formatDistance(metres: number): string {
  if (!Number.isFinite(metres)) return '–';
  return metres < 1000 ? `${formatFixed(metres, 0)} m` : `${formatFixed(metres / 1000, 2)} km`;
}
