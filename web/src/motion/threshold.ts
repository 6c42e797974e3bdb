/** From where a threshold line is dragged to the parameters that put it there. */

import type { EstimatorInfo, ParamSpec, ParamValue } from '../door';
import { clamp } from '../slider';
import { defaultOf, type Tuning, withParam } from '../tuning';

/** A line that can be dragged; yaw has one that begins corners and one that ends them. */
export type Line = 'jd' | 'td' | 'fd' | 'yaw_on' | 'yaw_off';
export const LINES: readonly Line[] = ['jd', 'td', 'fd', 'yaw_on', 'yaw_off'];
export const FOLLOWING = ['jd', 'td', 'fd'] as const;

/** The parameter that moves a line. */
export function paramOf(line: Line): string {
  return line === 'yaw_on' || line === 'yaw_off' ? line : `${line}_threshold`;
}

/** A parameter's value as tuned. */
export function tuned(info: EstimatorInfo, params: Readonly<Record<string, ParamValue>> | undefined, name: string): ParamValue {
  const spec = info.params.find((p) => p.name === name);
  return params?.[name] ?? (spec ? defaultOf(spec) : null);
}

/** A threshold, kept in its parameter's range and rounded as sliders round. */
function rounded(spec: ParamSpec, value: number): number {
  const short = Number(value.toPrecision(3));
  return spec.kind === 'number' ? clamp(spec, short) : short;
}

/**
 * The tuning that puts a line at a threshold, SI.
 *
 * Where thresholds follow the noise floor, they stop following it: the other two stay fixed where `lines` has them.
 */
export function moved(tuning: Tuning, info: EstimatorInfo, line: Line, threshold: number, lines: Readonly<Record<(typeof FOLLOWING)[number], number>>): Tuning {
  const spec = (name: string): ParamSpec | undefined => info.params.find((p) => p.name === name);
  let next = tuning;
  const put = (name: string, value: ParamValue): void => {
    const own = spec(name);
    if (own) next = withParam(next, info.name, own, typeof value === 'number' ? rounded(own, value) : value);
  };
  const isFollowing = FOLLOWING.some((l) => l === line) && tuned(info, tuning.params[info.name], 'adaptive') === true;
  if (isFollowing) {
    put('adaptive', false);
    for (const other of FOLLOWING) if (Number.isFinite(lines[other])) put(paramOf(other), lines[other]);
  }
  put(paramOf(line), threshold);
  return next;
}
