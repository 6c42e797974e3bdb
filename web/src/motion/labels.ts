/** Labels of the motion mode, painted by hand or read from a file. A label holds from its instant to the next one. */

import { motion as say } from '../messages/motion';
import type { Stretch } from '../plot/strip';

/** Times (s) and, in the second half, modes; NaN where nothing is said. */
export type Labels = Float64Array;

export const NO_LABELS: Labels = new Float64Array(0);

interface Label {
  time: number;
  mode: number;
}

export function listOf(labels: Labels): Label[] {
  const count = labels.length / 2;
  return Array.from({ length: count }, (_, i) => ({ time: labels[i] ?? Number.NaN, mode: labels[count + i] ?? Number.NaN }));
}

function ofList(list: readonly Label[]): Labels {
  return Float64Array.from([...list.map((l) => l.time), ...list.map((l) => l.mode)]);
}

/** Labels of modes from their instants on. */
export function labelsOf(starts: readonly { time: number; to: number }[], end: number): Labels {
  return starts.length === 0 ? NO_LABELS : ofList([...starts.map(({ time, to }) => ({ time, mode: to })), { time: end, mode: Number.NaN }]);
}

/** The stretches that carry a mode; the last one lasts to `end`. */
export function stretchesOf(labels: Labels, end: number): Stretch[] {
  const list = listOf(labels);
  return list.flatMap(({ time, mode }, i) => (Number.isFinite(mode) ? [{ t0: time, t1: list[i + 1]?.time ?? Math.max(end, time), mode }] : []));
}

const HEADING = 't,truth_mode';

/** Labels as CSV: a row a label, an empty cell where nothing is said. */
export function toCsv(labels: Labels): string {
  return `${[HEADING, ...listOf(labels).map(({ time, mode }) => `${time},${Number.isFinite(mode) ? mode : ''}`)].join('\n')}\n`;
}

/** Labels as JSON. */
export function toJson(labels: Labels): string {
  const list = listOf(labels).map(({ time, mode }) => ({ time, mode: Number.isFinite(mode) ? mode : null }));
  return `[\n${list.map((label) => `  ${JSON.stringify(label)}`).join(',\n')}\n]\n`;
}

/** Whether a text has the look of labels, so that it is not taken for a log or a mapping. */
export function isLabels(text: string): boolean {
  const head = text.replace(/^\uFEFF/, '').trimStart();
  return head.startsWith(HEADING) ? /^t,truth_mode\s*$/m.test(head.slice(0, 40)) : /^\[\s*(\]|\{\s*"(time|mode)")/.test(head);
}

/** Read labels of either form; throws a sentence that names the row. */
export function fromText(text: string, file: string): Labels {
  const plain = text.replace(/^\uFEFF/, '').trim();
  const fail = (row: number, what: string): never => {
    throw new Error(say.labels.bad(file, row, what));
  };
  const list = plain.startsWith('[') ? ofJson(plain, fail) : ofCsv(plain, fail);
  list.forEach(({ time }, i) => {
    if (i > 0 && !(time > (list[i - 1] as Label).time)) fail(i + (plain.startsWith('[') ? 1 : 2), say.labels.order);
  });
  return ofList(list);
}

function isMode(value: unknown): value is 0 | 1 | 2 {
  return value === 0 || value === 1 || value === 2;
}

function ofJson(text: string, fail: (row: number, what: string) => never): Label[] {
  let rows: unknown;
  try {
    rows = JSON.parse(text);
  } catch {
    return fail(1, say.labels.json);
  }
  return (rows as unknown[]).map((row, i) => {
    const { time, mode } = (row ?? {}) as { time?: unknown; mode?: unknown };
    if (typeof time !== 'number' || !Number.isFinite(time) || (mode !== null && !isMode(mode))) return fail(i + 1, say.labels.json);
    return { time, mode: mode ?? Number.NaN };
  });
}

function ofCsv(text: string, fail: (row: number, what: string) => never): Label[] {
  const [heading, ...lines] = text.split(/\r?\n/);
  if (heading?.trim() !== HEADING) fail(1, say.labels.heading(heading ?? ''));
  return lines.flatMap((line, i) => {
    if (line.trim() === '') return [];
    const [first = '', second, ...rest] = line.split(',').map((cell) => cell.trim());
    const time = first === '' ? Number.NaN : Number(first);
    const mode = second === '' || second === 'nan' ? Number.NaN : Number(second);
    if (second === undefined || rest.length > 0 || !Number.isFinite(time) || !(Number.isNaN(mode) ? second === '' || second === 'nan' : isMode(mode))) return fail(i + 2, say.labels.cells(line));
    return [{ time, mode }];
  });
}
