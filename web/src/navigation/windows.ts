/** Windows of blindness: put in, moved, resized, joined and taken out again. All times in s. */

import type { Blind, Sensor } from './door';

/** The rows of the brush from top to bottom. */
export const SENSORS: readonly Sensor[] = ['gnss', 'mag', 'odometer'];

/** Shortest window, s. */
export const SHORTEST = 0.5;

export interface Limits {
  readonly t0: number;
  readonly t1: number;
}

/** A window inside the drive, its ends in order and apart. */
export function windowOf(sensor: Sensor, a: number, b: number, limits: Limits): Blind {
  const inside = (time: number): number => Math.min(limits.t1, Math.max(limits.t0, time));
  const [t0, t1] = [inside(Math.min(a, b)), inside(Math.max(a, b))];
  if (t1 - t0 >= SHORTEST) return { sensor, t0, t1 };
  const start = Math.max(limits.t0, Math.min(t0, limits.t1 - SHORTEST));
  return { sensor, t0: start, t1: Math.min(limits.t1, start + SHORTEST) };
}

/** A window moved by `by`, kept whole inside the drive. */
export function moved(window: Blind, by: number, limits: Limits): Blind {
  const shift = Math.min(limits.t1 - window.t1, Math.max(limits.t0 - window.t0, by));
  return { ...window, t0: window.t0 + shift, t1: window.t1 + shift };
}

/** In the order of rows, then of time; windows of a sensor that touch are one. */
export function tidy(windows: readonly Blind[]): Blind[] {
  const rank = (w: Blind): number => SENSORS.indexOf(w.sensor);
  const out: Blind[] = [];
  for (const window of [...windows].sort((a, b) => rank(a) - rank(b) || a.t0 - b.t0)) {
    const last = out[out.length - 1];
    if (last && last.sensor === window.sensor && window.t0 <= last.t1) out[out.length - 1] = { ...last, t1: Math.max(last.t1, window.t1) };
    else out.push(window);
  }
  return out;
}

export type Part = 'start' | 'end' | 'whole';

/** The window of a row at a time, and which part of it is meant: an end if it is nearer than `reach`, s. */
export function windowAt(windows: readonly Blind[], sensor: Sensor, time: number, reach: number): { index: number; part: Part } | null {
  let best: { index: number; part: Part; distance: number } | null = null;
  windows.forEach((window, index) => {
    if (window.sensor !== sensor || time < window.t0 - reach || time > window.t1 + reach) return;
    const [start, end] = [Math.abs(time - window.t0), Math.abs(time - window.t1)];
    // Of a short window the middle third moves it.
    const edge = Math.min(reach, (window.t1 - window.t0) / 3);
    const isOutside = time < window.t0 || time > window.t1;
    const part: Part = Math.min(start, end) <= edge || isOutside ? (start < end ? 'start' : 'end') : 'whole';
    const distance = isOutside ? Math.min(start, end) : 0;
    if (!best || distance < best.distance) best = { index, part, distance };
  });
  return best;
}

/** A window with one of its ends, or all of it, dragged by `by`. */
export function dragged(window: Blind, part: Part, by: number, limits: Limits): Blind {
  if (part === 'whole') return moved(window, by, limits);
  const [a, b] = part === 'start' ? [window.t0 + by, window.t1] : [window.t0, window.t1 + by];
  return windowOf(window.sensor, a, b, limits);
}

/** `m:ss` or plain seconds as seconds; no number for anything else. */
export function parseTime(text: string): number {
  const match = /^\s*(?:(\d+):)?(?:(\d+):)?(\d+(?:[.,]\d*)?)\s*$/.exec(text);
  if (!match) return Number.NaN;
  const [hours, minutes] = match[2] === undefined ? [0, Number(match[1] ?? 0)] : [Number(match[1]), Number(match[2])];
  return hours * 3600 + minutes * 60 + Number((match[3] ?? '').replace(',', '.'));
}
