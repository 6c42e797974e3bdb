/** What the reader has tuned: only what differs from the defaults, with undo, and as text in the address. */

import type { Catalogue, ParamSpec, ParamValue } from './door';
import { ROOM_NAMES, type RoomName } from './room-names';

export interface Tuning {
  /** By estimator, then by parameter. */
  readonly params: Readonly<Record<string, Readonly<Record<string, ParamValue>>>>;
  /** Name of a car, or null for the drive's own. */
  readonly vehicle: string | null;
}

export const UNTUNED: Tuning = { params: {}, vehicle: null };

/** The default of a parameter; null for one that is found by itself. */
export function defaultOf(spec: ParamSpec): ParamValue {
  return spec.kind === 'optional' ? null : spec.default;
}

/** A tuning with one value changed; a value equal to the default is forgotten. */
export function withParam(tuning: Tuning, estimator: string, spec: ParamSpec, value: ParamValue): Tuning {
  const own = { ...tuning.params[estimator] };
  if (value === defaultOf(spec)) delete own[spec.name];
  else own[spec.name] = value;
  return { ...tuning, params: { ...tuning.params, [estimator]: own } };
}

/** Whether an estimator runs the same with both. */
export function sameFor(estimator: string, a: Tuning, b: Tuning): boolean {
  if (a.vehicle !== b.vehicle) return false;
  const [own, other] = [a.params[estimator] ?? {}, b.params[estimator] ?? {}];
  const names = Object.keys(own);
  return names.length === Object.keys(other).length && names.every((name) => Object.is(own[name], other[name]));
}

/** Undo and redo. Changes of one gesture (a slider's drag) are one step. */
export class History<T> {
  #past: T[] = [];
  #future: T[] = [];
  #gesture: string | null = null;
  #now: T;

  constructor(now: T) {
    this.#now = now;
  }

  get now(): T {
    return this.#now;
  }
  get canUndo(): boolean {
    return this.#past.length > 0;
  }
  get canRedo(): boolean {
    return this.#future.length > 0;
  }

  /** Make `next` the present. Changes in a row with the same `gesture` are undone together. */
  push(next: T, gesture: string | null = null): void {
    if (gesture === null || gesture !== this.#gesture) this.#past.push(this.#now);
    this.#gesture = gesture;
    this.#future = [];
    this.#now = next;
  }

  /** The next change starts a step of its own. */
  endGesture(): void {
    this.#gesture = null;
  }

  undo(): boolean {
    return this.#step(this.#past, this.#future);
  }

  redo(): boolean {
    return this.#step(this.#future, this.#past);
  }

  #step(from: T[], to: T[]): boolean {
    const next = from.pop();
    this.#gesture = null;
    if (next === undefined) return false;
    to.push(this.#now);
    this.#now = next;
    return true;
  }
}

/** What an address says: a built-in drive, the room that is entered, variants drawn beside the estimate, and a tuning. */
export interface Address {
  drive: string | null;
  seed: number | null;
  room: RoomName;
  overlays: readonly string[];
  /** What plots are drawn over; time where it is not said. */
  over?: 'distance' | 'time';
  tuning: Tuning;
}

/** The part of an address after `#`. */
export function toHash({ drive, seed, room, overlays, over, tuning }: Address): string {
  const search = new URLSearchParams();
  if (drive !== null) search.set('drive', drive);
  if (seed !== null) search.set('seed', String(seed));
  if (room !== 'overview') search.set('room', room);
  if (overlays.length > 0) search.set('overlays', overlays.join(' '));
  if (over === 'distance') search.set('over', over);
  if (tuning.vehicle !== null) search.set('vehicle', tuning.vehicle);
  for (const [estimator, own] of Object.entries(tuning.params)) {
    for (const [name, value] of Object.entries(own)) search.set(`${estimator}.${name}`, String(value));
  }
  return search.toString();
}

function parseValue(spec: ParamSpec, text: string): ParamValue | undefined {
  switch (spec.kind) {
    case 'toggle':
      return text === 'true' ? true : text === 'false' ? false : undefined;
    case 'choice':
      return spec.options.includes(text) ? text : undefined;
    default: {
      if (spec.kind === 'optional' && text === 'null') return null;
      const value = text.trim() === '' ? Number.NaN : Number(text);
      return value >= spec.min && value <= spec.max ? value : undefined;
    }
  }
}

/** The variants that a text names, each once and in the order of the choice. */
function overlaysOf(text: string, catalogue: Catalogue): string[] {
  const named = text.split(' ');
  const specs = catalogue.estimators.flatMap((e) => e.params.filter((p) => e.name === 'orientation' && p.name === 'variant'));
  return specs.flatMap((spec) => (spec.kind === 'choice' ? spec.options.filter((option) => named.includes(option)) : []));
}

/** Read an address; what this build does not know or cannot take is left out. */
export function fromHash(hash: string, catalogue: Catalogue): Address {
  const search = new URLSearchParams(hash.replace(/^#/, ''));
  const drive = search.get('drive');
  const vehicle = search.get('vehicle');
  const seed = search.get('seed');
  let tuning: Tuning = {
    params: {},
    vehicle: catalogue.vehicles.some((v) => v.name === vehicle) ? vehicle : null,
  };
  for (const estimator of catalogue.estimators) {
    for (const spec of estimator.params) {
      const text = search.get(`${estimator.name}.${spec.name}`);
      const value = text === null ? undefined : parseValue(spec, text);
      if (value !== undefined) tuning = withParam(tuning, estimator.name, spec, value);
    }
  }
  return {
    drive: catalogue.drives.some((d) => d.name === drive) ? drive : null,
    seed: seed !== null && /^\d{1,15}$/.test(seed) ? Number(seed) : null,
    room: ROOM_NAMES.find((name) => name === search.get('room')) ?? 'overview',
    overlays: overlaysOf(search.get('overlays') ?? '', catalogue),
    ...(search.get('over') === 'distance' ? { over: 'distance' as const } : {}),
    tuning,
  };
}
