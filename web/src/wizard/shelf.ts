/** Mappings saved under a name in this browser, and recognised by the names of a file's columns. */

import type { OpenReport } from '../door';
import type { Mapping } from './door';

const KEY = 'drivescope.mappings';
/** Files of which this share of the columns is the same are of one kind: loggers add a column now and then. */
const ALIKE = 0.8;

export interface Shelved {
  name: string;
  /** Names of the columns of the file that it was saved with. */
  columns: string[];
  mapping: Mapping;
}

/** The columns of a file, used or not. */
export function columnsOf(report: OpenReport): string[] {
  return [...new Set([...report.used.map((u) => u.column), ...report.unused.map((u) => u.column)])].sort();
}

/** The columns that a mapping cannot do without. */
function needed(mapping: Mapping): string[] {
  const { time, signals } = mapping;
  return [time.column, ...(time.fraction ? [time.fraction.column] : []), ...Object.values(signals).map((s) => s.column)];
}

/** All saved mappings by name; none where the browser keeps nothing. */
export function saved(): Shelved[] {
  try {
    const list = JSON.parse(localStorage.getItem(KEY) ?? '[]') as Shelved[];
    return list.filter((s) => typeof s?.name === 'string' && Array.isArray(s.columns) && typeof s.mapping?.signals === 'object' && typeof s.mapping.time?.column === 'string');
  } catch {
    return [];
  }
}

/** Keep a mapping in place of one of the same name. False where the browser keeps nothing. */
export function keep(entry: Shelved): boolean {
  return store([...saved().filter((s) => s.name !== entry.name), entry]);
}

/** Forget a mapping. */
export function forget(name: string): boolean {
  return store(saved().filter((s) => s.name !== name));
}

function store(list: Shelved[]): boolean {
  try {
    localStorage.setItem(KEY, JSON.stringify(list.sort((a, b) => a.name.localeCompare(b.name))));
    return true;
  } catch {
    return false;
  }
}

/** The saved mapping of a file with these columns: it has all that the mapping needs, and hardly any other. */
export function recognise(columns: string[], shelf: Shelved[]): Shelved | null {
  const here = new Set(columns);
  const likeness = ({ columns: there, mapping }: Shelved): number => {
    if (!needed(mapping).every((c) => here.has(c))) return 0;
    const shared = there.filter((c) => here.has(c)).length;
    return shared / (here.size + there.length - shared);
  };
  const best = shelf.map((s) => ({ s, share: likeness(s) })).sort((a, b) => b.share - a.share)[0];
  return best && best.share >= ALIKE ? best.s : null;
}
