import { expect, test } from 'vitest';
import type { Door, DriveHead, DrivePart, Progress } from '../src/door';
import { Reading, type ReaderDoor, type Role } from '../src/worker/readers';
import { Shelf } from '../src/worker/shelf';

const HEAD = ['a.csv', undefined, undefined, undefined, {}] as unknown as DriveHead;
const PART = (name: string): DrivePart => [name, ['x'], new Float64Array(1), [new Float64Array(1)]];

const role = (file: File): Role => (file.name.endsWith('.dbc') ? 'database' : file.name.endsWith('.blf') ? 'bus' : 'log');
const file = (name: string, text = ''): File => new File([text], name);

function staged(parts: DrivePart[], refuses = false, breaks = false): { said: string[]; reading: Reading } {
  const said: string[] = [];
  let pieces = 2;
  const reader: ReaderDoor = {
    begin: () => said.push('read'),
    read_some: (): Progress => {
      if (breaks) throw new WebAssembly.RuntimeError('unreachable');
      return { done: --pieces === 0, fraction: 0.5, stage: 'reading', rows: 7 };
    },
    head: () => HEAD,
    next_part: () => parts.shift(),
    cancel: () => said.push('reader cancelled'),
  };
  const door = {
    begin_parts: (name: string) => said.push(`begin ${name}`),
    add_part: (name: string) => {
      if (refuses) throw new Error(`part ${name}`);
      said.push(`add ${name}`);
    },
    open_some: (): Progress => (said.push('open'), { done: true, fraction: 1, stage: 'reading', rows: 7 }),
    cancel_open: () => said.push('opening cancelled'),
  };
  const readers = { role, reader: () => reader, reset: () => said.push('memory given back') };
  return { said, reading: new Reading(readers, door as unknown as Door, new Shelf((f) => f)) };
}

test('a file is read, handed over one part at a time, and opened last, when its memory is given back', () => {
  const { said, reading } = staged([PART('imu'), PART('truth')]);
  reading.begin([file('a.csv')], null);
  while (!reading.some(30).done);
  expect(said).toEqual(['opening cancelled', 'read', 'begin a.csv', 'add imu', 'add truth', 'memory given back', 'open']);
});

test('a part that the core refuses ends the reading and gives its memory back', () => {
  const { said, reading } = staged([PART('imu')], true);
  reading.begin([file('a.csv')], null);
  expect(() => {
    while (!reading.some(30).done);
  }).toThrow('part imu');
  expect(said.at(-1)).toBe('memory given back');
});

test('readers that break are a sentence with the file and no broken core', () => {
  const { said, reading } = staged([], false, true);
  reading.begin([file('a.csv')], null);
  let thrown: unknown;
  try {
    reading.some(30);
  } catch (reason) {
    thrown = reason;
  }
  expect(thrown).not.toBeInstanceOf(WebAssembly.RuntimeError);
  expect((thrown as Error).message).toMatch(/^a\.csv: reading it ended unexpectedly \(unreachable\)/);
  expect(said.at(-1)).toBe('memory given back');
});

test('a database alone is kept, is added to those before, and has the last bus log read again', () => {
  const shelf = new Shelf((f) => f);
  const names = (files: File[]): string[] => shelf.take(files, 'map', role).files.map((f) => f.name);
  expect(() => names([file('a.dbc')])).toThrow('a.dbc: a database of bus signals, kept');
  expect(names([file('x.blf')])).toEqual(['x.blf', 'a.dbc']);
  expect(names([file('b.dbc')])).toEqual(['x.blf', 'a.dbc', 'b.dbc']);
  const newer = file('a.dbc', 'newer');
  expect(shelf.take([newer], null, role)).toEqual({ files: [expect.objectContaining({ name: 'x.blf' }), expect.objectContaining({ name: 'b.dbc' }), newer], mapping: 'map' });
  // What comes with a log takes the place of those.
  expect(names([file('y.blf'), file('c.dbc')])).toEqual(['y.blf', 'c.dbc']);
  expect(names([file('z.blf')])).toEqual(['z.blf', 'c.dbc']);
});

test('a log without frames takes no database, and one that follows it waits for a bus log', () => {
  const shelf = new Shelf((f) => f);
  const names = (files: File[]): string[] => shelf.take(files, null, role).files.map((f) => f.name);
  names([file('x.blf'), file('a.dbc')]);
  expect(names([file('log.csv')])).toEqual(['log.csv']);
  expect(() => names([file('b.dbc')])).toThrow('kept for this session');
});
