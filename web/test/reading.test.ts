import { expect, test } from 'vitest';
import type { Door, DriveHead, DrivePart, Progress } from '../src/door';
import { Making } from '../src/worker/making';
import { examined, keep } from '../src/worker/examining';
import type { Keep } from '../src/worker/rpc';
import { FileReaders, type ReaderDoor, type Thinned } from '../src/worker/readers';
import { type Role, Shelf } from '../src/worker/shelf';
import type { Examined } from '../src/wizard/door';

const HEAD = ['a.csv', undefined, undefined, undefined, {}] as unknown as DriveHead;
const PART = (name: string): DrivePart => [name, ['x'], new Float64Array(1), [new Float64Array(1)]];

const role = (file: File): Role => (file.name.endsWith('.dbc') ? 'database' : file.name.endsWith('.blf') ? 'bus' : 'log');
const file = (name: string, text = ''): File => new File([text], name, { lastModified: 0 });

/** Readers that read two pieces and hand over these parts; what was said to whom. */
function staged(parts: DrivePart[], breaks = false): { said: string[]; readers: FileReaders; making: Making } {
  const said: string[] = [];
  let pieces = 2;
  const reader: ReaderDoor = {
    begin: (files) => said.push(`read ${files.map((f) => f.name).join()}`),
    begin_examination: (files) => said.push(`examine ${files.map((f) => f.name).join()}`),
    examination: () => [{ columns: [] }, [], [], [0, [], []]] as unknown as [...Examined, Thinned],
    read_some: (): Progress => {
      if (breaks) throw new WebAssembly.RuntimeError('unreachable');
      return { done: --pieces === 0, fraction: 0.5, stage: 'reading', rows: 7 };
    },
    head: () => HEAD,
    next_part: () => parts.shift(),
    offer: () => undefined,
    cancel: () => said.push('reader cancelled'),
  };
  const door = {
    begin_parts: (name: string) => said.push(`begin ${name}`),
    add_part: (name: string) => said.push(`add ${name}`),
    end_parts: () => said.push('open'),
    cancel_parts: () => said.push('parts cancelled'),
  };
  const readers = new FileReaders({ role, reader: () => reader, tryMapping: () => [[], []], reset: () => said.push('memory given back') }, new Shelf((f) => f), 1e9);
  return { said, readers, making: new Making(readers, (budget) => readers.read_some(budget), door as unknown as Door) };
}

test('memory is given back before the core puts the drive in place, and when reading is given up', () => {
  const { said, readers, making } = staged([PART('imu'), PART('truth')]);
  readers.begin([file('a.csv')], undefined);
  while (!making.some(30).done);
  expect(said).toEqual(['read a.csv', 'begin a.csv', 'add imu', 'add truth', 'memory given back', 'open']);
  readers.begin([file('b.csv')], undefined);
  making.cancel();
  expect(said.slice(-3)).toEqual(['read b.csv', 'memory given back', 'parts cancelled']);
});

test('an examination reads the files once more, hands over what was found and gives the memory back', () => {
  const { said, readers } = staged([]);
  readers.beginExamination([file('a.csv')], undefined);
  while (!readers.read_some(30).done);
  expect(readers.examination()).toHaveLength(4);
  expect(said).toEqual(['examine a.csv', 'memory given back']);
  expect(readers.examination()).toBeNull();
});

/** Catches an examination that is lost with the reader's memory, and one that is taken for that of the next log. */
test('what was found at the opening outlives the reader, for this log alone', () => {
  const { readers, making } = staged([PART('imu')]);
  readers.begin([file('a.csv')], undefined);
  while (!making.some(30).done);
  expect(readers.examination()).toHaveLength(4);
  readers.begin([file('b.csv')], undefined);
  readers.cancel();
  expect(readers.examination()).toBeNull();
});

/** Catches a threshold or an identity that has a log read twice, and what was found about another log. */
test('what was found is that of the files that are open, whose copies are known again', () => {
  const found = [{ columns: [] }, [], [], [0, [], []]] as unknown as [...Examined, Thinned];
  const asked = (name: string, keep?: Keep) => examined({ files: [file(name)], mapping: null, ...(keep ? { keep } : {}) });
  keep({ files: [file('a.csv')] }, found);
  expect(asked('a.csv')).toHaveLength(3);
  expect(asked('b.csv')).toBeNull();
  expect(asked('a.csv', { every: 2 })).toBeNull();
  // Read anew with another mapping, a large log is not examined again.
  keep({ files: [file('a.csv')] }, null);
  expect(asked('a.csv')).toHaveLength(3);
  keep({ files: [file('b.csv')] }, null);
  keep({ files: [file('a.csv')] }, null);
  expect(asked('a.csv')).toBeNull();
});

test('a database alone is read with the bus log before it, by the mapping that was asked for', () => {
  const shelf = new Shelf((f) => f);
  shelf.take([file('a.blf')], 'before', role);
  expect(shelf.take([file('a.dbc')], undefined, role).mapping).toBe('before');
  expect(shelf.take([file('a.dbc')], 'edited', role).mapping).toBe('edited');
});

test('readers that break are a sentence with the file and no broken core', () => {
  const { said, readers, making } = staged([], true);
  readers.begin([file('a.csv')], undefined);
  let thrown: unknown;
  try {
    making.some(30);
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
  expect(shelf.take([newer], undefined, role)).toEqual({ files: [expect.objectContaining({ name: 'x.blf' }), expect.objectContaining({ name: 'b.dbc' }), newer], mapping: 'map' });
  // What comes with a log takes the place of those.
  expect(names([file('y.blf'), file('c.dbc')])).toEqual(['y.blf', 'c.dbc']);
  expect(names([file('z.blf')])).toEqual(['z.blf', 'c.dbc']);
});

test('a log without frames takes no database, and one that follows it waits for a bus log', () => {
  const shelf = new Shelf((f) => f);
  const names = (files: File[]): string[] => shelf.take(files, undefined, role).files.map((f) => f.name);
  names([file('x.blf'), file('a.dbc')]);
  expect(names([file('log.csv')])).toEqual(['log.csv']);
  expect(() => names([file('b.dbc')])).toThrow('kept for this session');
});
