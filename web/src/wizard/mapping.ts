/** Changing a mapping by hand, and holding it against what physics proposes. Every function returns a new mapping. */

import { columns as say } from '../messages/columns';
import { formatSignificant } from '../units';
import type { Choice, ColumnView, Found, Mapping, Mount, SignalSource } from './door';

/** The clock among the signals. */
export const CLOCK = 't';

/** Signals that are read from a column; the clock is one of them. */
export function signalsOf(mapping: Mapping, column: string): string[] {
  const signals = Object.entries(mapping.signals).filter(([, source]) => source.column === column);
  return [...(mapping.time.column === column ? [CLOCK] : []), ...signals.map(([signal]) => signal)];
}

/** Without the entries of one key; undefined in place of an empty object, so that it is left out of the file. */
function without<T>(record: Record<string, T> | undefined, key: string): Record<string, T> | undefined {
  const rest = Object.entries(record ?? {}).filter(([name]) => name !== key);
  return rest.length > 0 ? Object.fromEntries(rest) : undefined;
}

/**
 * Read `column` as `signal` (null for nothing) in place of `before`. A signal that another column had moves; unit, scale
 * and offset of a column go with it where the unit is one of the new signal. There is always a clock: taking it away
 * changes nothing.
 */
export function assign(mapping: Mapping, column: string, before: string | null, signal: string | null, choices: Choice[]): Mapping {
  if (before === signal || before === CLOCK) return mapping;
  const left = before === null ? mapping.signals : (without(mapping.signals, before) ?? {});
  if (signal === null) return { ...mapping, signals: left };
  if (signal === CLOCK) return { ...mapping, signals: left, time: { column, unit: 's', offset: 0 } };
  const was: SignalSource | undefined = before === null ? undefined : mapping.signals[before];
  const units = unitsOf(choices, signal);
  const isKept = was !== undefined && (was.unit === undefined ? unitOf(choices, before ?? '') === unitOf(choices, signal) : units.includes(was.unit));
  const source: SignalSource = was && isKept ? { ...was, column } : { column };
  return { ...mapping, signals: { ...left, [signal]: source } };
}

/** The unit of a signal where a mapping names none. */
export function unitOf(choices: Choice[], signal: string): string {
  if (signal === CLOCK) return 's';
  return choices.find((c) => c.signal === signal)?.unit ?? '1';
}

const TIME_UNITS = ['s', 'ms', 'us', 'ns', 'min'];

/** One spelling of a unit: `m/s2` and `m/s^2` are one. */
export function plainUnit(unit: string): string {
  return unit.toLowerCase().replace(/[\s^*_]/g, '').replace('µ', 'u').replace('°', 'deg');
}

/** The units that a signal may be read in, the one that needs no name first. */
export function unitsOf(choices: Choice[], signal: string): string[] {
  if (signal === CLOCK) return TIME_UNITS;
  const choice = choices.find((c) => c.signal === signal);
  if (!choice) return [];
  const others = choice.units.split(', ').filter((unit) => plainUnit(unit) !== plainUnit(choice.unit));
  return [choice.unit, ...others];
}

/** Change how a signal is read; a value that needs no mention is left out. */
export function change(mapping: Mapping, signal: string, patch: Partial<Pick<SignalSource, 'unit' | 'scale' | 'offset'>>, choices: Choice[]): Mapping {
  if (signal === CLOCK) {
    const { unit, offset } = patch;
    return { ...mapping, time: { ...mapping.time, ...(unit === undefined ? {} : { unit }), ...(offset === undefined ? {} : { offset }) } };
  }
  const was = mapping.signals[signal];
  if (!was) return mapping;
  const { unit, scale, offset, ...rest } = { ...was, ...patch };
  const source: SignalSource = { ...rest };
  if (unit !== undefined && unit !== unitOf(choices, signal)) source.unit = unit;
  if (scale !== undefined && scale !== 1) source.scale = scale;
  if (offset !== undefined && offset !== 0) source.offset = offset;
  return { ...mapping, signals: { ...mapping.signals, [signal]: source } };
}

/** With other entries for optional members; an undefined one is left out. */
function withMember<K extends 'mounts' | 'delays' | 'origin'>(mapping: Mapping, key: K, value: Mapping[K] | undefined): Mapping {
  const { [key]: _, ...rest } = mapping;
  return (value === undefined ? rest : { ...rest, [key]: value }) as Mapping;
}

/** A mount; one without any angle is none. */
export function setMount(mapping: Mapping, channel: string, mount: Mount): Mapping {
  const isNone = mount.roll_deg === 0 && mount.pitch_deg === 0 && mount.yaw_deg === 0;
  return withMember(mapping, 'mounts', isNone ? without(mapping.mounts, channel) : { ...mapping.mounts, [channel]: mount });
}

/** A delay, s. */
export function setDelay(mapping: Mapping, channel: string, late: number): Mapping {
  return withMember(mapping, 'delays', late === 0 ? without(mapping.delays, channel) : { ...mapping.delays, [channel]: late });
}

/** The origin of local coordinates; null for the first place of the log. */
export function setOrigin(mapping: Mapping, origin: Mapping['origin'] | null): Mapping {
  return withMember(mapping, 'origin', origin ?? undefined);
}

/** Mounts and delays as physics found them; columns and units stay as they are. */
export function takePhysics(mapping: Mapping, found: Found): Mapping {
  return withMember(withMember(mapping, 'mounts', found.mapping.mounts), 'delays', found.mapping.delays);
}

/**
 * Everything that physics proposes; what it has no opinion of (origin, disk) stays. A column whose name says what it is stays as it
 * is read where physics only guesses otherwise, and then its sensor's mount too, which was found with the guess.
 */
export function takeAll(mapping: Mapping, found: Found): Mapping {
  const named = new Set(found.columns.filter((c) => c.confidence === 'guess' && c.name_says !== null).map((c) => c.column));
  const guessed = new Set([...named].filter((c) => signalsOf(mapping, c).join() !== signalsOf(found.mapping, c).join()));
  const of = (from: Mapping, isGuessed: boolean) => Object.entries(from.signals).filter(([, source]) => guessed.has(source.column) === isGuessed);
  const kept = of(mapping, true);
  const signals = Object.fromEntries([...kept, ...of(found.mapping, false)]);
  const channels = new Set(kept.map(([signal]) => (/^(accel|gyro)_/.test(signal) ? 'imu' : (signal.split('_')[0] ?? signal))));
  const { mounts } = found.mapping;
  const fitting = Object.entries(mounts ?? {}).filter(([channel]) => !channels.has(channel));
  const taken = { ...mapping, ...found.mapping, signals, ...(mapping.origin ? { origin: mapping.origin } : {}), ...(mapping.disk ? { disk: mapping.disk } : {}) };
  return mounts ? withMember(taken, 'mounts', fitting.length > 0 ? Object.fromEntries(fitting) : undefined) : taken;
}

/** Read one column as physics proposes. */
export function takeColumn(mapping: Mapping, found: Found, column: string): Mapping {
  const signals = Object.fromEntries(Object.entries(mapping.signals).filter(([, source]) => source.column !== column));
  const proposed = Object.entries(found.mapping.signals).filter(([, source]) => source.column === column);
  const time = found.mapping.time.column === column ? found.mapping.time : mapping.time;
  return { ...mapping, time, signals: { ...signals, ...Object.fromEntries(proposed) } };
}

/** How a signal is read, as text, so that two ways can be compared; null where it is not read from the column. */
function reading(mapping: Mapping, signal: string, choices: Choice[]): string {
  if (signal === CLOCK) return JSON.stringify([plainUnit(mapping.time.unit ?? 's'), mapping.time.offset ?? 0]);
  const { unit, scale = 1, offset = 0 } = mapping.signals[signal] ?? { column: '' };
  return JSON.stringify([plainUnit(unit ?? unitOf(choices, signal)), scale, offset]);
}

/** Whether a column is read otherwise than physics proposes; columns that it says nothing of are as they should be. */
export function differs(mapping: Mapping, found: Found, view: ColumnView, choices: Choice[]): boolean {
  const [now, proposed] = [signalsOf(mapping, view.column), signalsOf(found.mapping, view.column)];
  if (proposed.length === 0) return false;
  if (now.join() !== proposed.join()) return true;
  return now.some((signal) => reading(mapping, signal, choices) !== reading(found.mapping, signal, choices));
}

/** What an examination is sure of and a reading has otherwise. */
export interface Doubts {
  columns: string[];
  /** Channels with a mount or a delay that the reading has not. */
  channels: string[];
}

export function doubts(mapping: Mapping, found: Found, choices: Choice[]): Doubts {
  const sure = found.columns.filter((c) => c.confidence === 'likely' || c.confidence === 'certain');
  const missing = (now: object | undefined, proposed: object | undefined): string[] => Object.keys(proposed ?? {}).filter((c) => !Object.hasOwn(now ?? {}, c));
  return {
    columns: sure.filter((c) => differs(mapping, found, c, choices)).map((c) => c.column),
    channels: [...new Set([...missing(mapping.mounts, found.mapping.mounts), ...missing(mapping.delays, found.mapping.delays)])],
  };
}

/** How much was guessed of an examined log. */
export function guesses(found: Found): number {
  return found.findings.filter((f) => f.weight === 'guess').length + found.columns.filter((c) => c.confidence === 'guess').length;
}

/** How a column is read, in a few words: `gyro_z, deg/s, x -1`. */
export function inWords(mapping: Mapping, column: string, choices: Choice[]): string {
  const words = signalsOf(mapping, column).map((signal) => {
    const source = signal === CLOCK ? { ...mapping.time, scale: 1 } : mapping.signals[signal];
    const scale = source?.scale ?? 1;
    const offset = source?.offset ?? 0;
    return [signal, source?.unit ?? unitOf(choices, signal), scale === 1 ? '' : `× ${Math.abs(scale) === 1 ? '−1' : formatSignificant(scale)}`, offset === 0 ? '' : `+ ${formatSignificant(offset)}`].filter(Boolean).join(', ');
  });
  return words.length > 0 ? words.join('; ') : say.unused;
}
