/** From where a threshold line is dragged to the parameter that puts it there. */

import type { EstimatorInfo, NumberParam, ParamValue } from '../door';
import { clamp } from '../slider';
import { defaultOf } from '../tuning';

/** A line that can be dragged; yaw has one that begins corners and one that ends them. */
export type Line = 'jd' | 'td' | 'fd' | 'yaw_on' | 'yaw_off';
export const LINES: readonly Line[] = ['jd', 'td', 'fd', 'yaw_on', 'yaw_off'];

/** The parameter that moves a line: the fixed threshold, or where thresholds follow the noise floor its factor. */
export function paramOf(line: Line, isAdaptive: boolean): string {
  if (line === 'yaw_on' || line === 'yaw_off') return line;
  if (!isAdaptive) return `${line}_threshold`;
  return line === 'fd' ? 'launch_threshold_factor' : 'threshold_factor';
}

/** A parameter's value as tuned. */
export function tuned(info: EstimatorInfo, params: Readonly<Record<string, ParamValue>> | undefined, name: string): ParamValue {
  const spec = info.params.find((p) => p.name === name);
  return params?.[name] ?? (spec ? defaultOf(spec) : null);
}

/**
 * The parameter's value that puts a line where it is wanted, rounded as sliders are.
 *
 * `now` is where the line lies with `value`: a factor scales it. What is wanted may lie out of the parameter's range.
 */
export function valueFor(spec: NumberParam, isFactor: boolean, value: number, now: number, wanted: number): number {
  const target = isFactor ? (now > 0 ? (value * wanted) / now : value) : wanted;
  return clamp(spec, Number(target.toPrecision(3)));
}
