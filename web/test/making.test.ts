import { beforeEach, expect, test } from 'vitest';
import type { Door, DriveHead, DrivePart, Progress } from '../src/door';
import { type Maker, Making } from '../src/worker/making';

const HEAD: DriveHead = ['a', undefined, -1.5, undefined, undefined, undefined];
const PARTS: DrivePart[] = ['imu', 'wheels', 'truth'].map((name) => [name, [], new Float64Array(), []]);

let said: string[];
let parts: DrivePart[];
let steps: Progress[];
let making: Making;

beforeEach(() => {
  said = [];
  parts = [...PARTS];
  steps = [false, true].map((done) => ({ done, fraction: 0.3, stage: 'simulating', rows: 7 }));
  const maker: Maker = { head: () => HEAD, next_part: () => parts.shift(), cancel: () => said.push('maker cancelled') };
  const door = {
    begin_parts: (...head: DriveHead) => said.push(`begin ${head[0]} ${head[2]}`),
    add_part: (...part: DrivePart) => said.push(part[0]),
    end_parts: () => said.push('end'),
    cancel_parts: () => said.push('door cancelled'),
  };
  making = new Making(maker, () => steps.shift() as Progress, door as unknown as Door);
});

test('a drive is handed over once it is made, and is there when its last part is', () => {
  expect(making.some(1000)).toMatchObject({ done: false, rows: 7 });
  expect(said).toEqual([]);
  expect(making.some(1000)).toEqual({ done: true, fraction: 0.3, stage: 'simulating', rows: 7 });
  expect(said).toEqual(['begin a -1.5', 'imu', 'wheels', 'truth', 'end']);
});

test('handing over comes in pieces, so that it can be given up in between', () => {
  making.some(0);
  expect(making.some(0).done).toBe(false);
  expect(said).toEqual(['begin a -1.5', 'imu']);
  expect(making.some(0).done).toBe(false);
  expect(said.at(-1)).toBe('wheels');
  making.cancel();
  expect(said.slice(-2)).toEqual(['maker cancelled', 'door cancelled']);
  expect(said).not.toContain('end');
});
