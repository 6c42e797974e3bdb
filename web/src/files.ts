/** Files that are dropped or chosen: logs with what belongs to them, or a drive to simulate. */

import { t } from './messages';
import { applySavedDisk, isDisk } from './motion/disk-file';
import { isLabels } from './motion/labels';
import type { Session } from './session';
import type { Store } from './state';

/** Bytes at the beginning of a JSON file that tell a trace, which may be long, from what is one object. */
const HEAD = 65_536;

type Kind = 'mapping' | 'drive' | 'calibration' | 'disk' | 'log';
interface Told {
  file: File;
  kind: Kind;
  text: string;
}

/** What a JSON file is; one object a line is a log. */
async function tell(file: File): Promise<Told> {
  const [line = '', ...more] = (await file.slice(0, HEAD).text()).split('\n');
  try {
    const first: unknown = JSON.parse(line);
    if (typeof first === 'object' && first !== null && more.some((l) => l.trim() !== '')) return { file, kind: 'log', text: '' };
  } catch {
    // No object in the first line alone.
  }
  const text = await file.text();
  const value: unknown = JSON.parse(text);
  const has = (key: string): boolean => typeof value === 'object' && value !== null && key in value;
  return { file, kind: has('segments') ? 'drive' : has('distortion') ? 'calibration' : isDisk(value) ? 'disk' : 'mapping', text };
}

const names = (files: File[]): string => files.map((f) => f.name).join(', ');

/** Labels of the motion mode among dropped files; only small files are looked at. */
export async function labelsAmong(files: File[]): Promise<{ file: File; text: string } | null> {
  for (const file of files.filter((f) => /\.(csv|json)$/i.test(f.name))) {
    if (!isLabels(await file.slice(0, 64).text())) continue;
    return { file, text: await file.text() };
  }
  return null;
}

/** Open what was dropped: a JSON file alone is a drive, beside a log it is its mapping. True for an open log. */
export async function openFiles(store: Store, session: Session, files: File[], first: number, calibrate: (text: string) => Promise<void>): Promise<boolean> {
  if (files.length === 0) return false;
  const refuse = (sentence: string): boolean => {
    store.error.value = sentence;
    return false;
  };
  const told: Told[] = [];
  for (const file of files) {
    if (!/\.json$/i.test(file.name)) told.push({ file, kind: 'log', text: '' });
    else {
      try {
        told.push(await tell(file));
      } catch (reason) {
        return refuse(t.files.mappingJson(file.name, reason instanceof Error ? reason.message : String(reason)));
      }
    }
  }
  const of = (kind: Kind): Told[] => told.filter((f) => f.kind === kind);
  const logs = of('log').map((f) => f.file);
  const [drive, calibration, mapping, disk] = [of('drive')[0], of('calibration')[0], of('mapping')[0], of('disk')[0]];
  const aside = (kind: Kind): string => names(told.filter((f) => f.kind !== kind).map((f) => f.file));
  if (drive) {
    if (of('drive').length > 1) return refuse(t.files.drives(names(files)));
    if (told.length > 1) return refuse(t.files.driveAndLog(drive.file.name, aside('drive')));
    const { name } = drive.file;
    const isOpen = await session.open({ kind: 'simulation', name, seed: null, first, composed: drive.text }, name);
    if (isOpen) void session.runAll();
    return false;
  }
  if (calibration) {
    if (told.length > 1) return refuse(t.files.calibrationAndLog(calibration.file.name, aside('calibration')));
    await calibrate(calibration.text);
    return false;
  }
  if (disk && logs.length === 0) {
    await applySavedDisk(store, session, disk.text);
    return false;
  }
  if (of('mapping').length > 1) return refuse(t.files.mappings(names(of('mapping').map((f) => f.file))));
  if (mapping && logs.length === 0) return refuse(t.files.mappingAlone(mapping.file.name));
  const isOpen = await session.open({ kind: 'files', files: logs, mapping: mapping?.text ?? null }, label(logs));
  if (isOpen && disk) await applySavedDisk(store, session, disk.text);
  if (isOpen) void session.runAll();
  return isOpen;
}

/** A few names; of many files the first and their number. */
function label(files: File[]): string {
  return files.length > 3 ? t.files.more(files[0]?.name ?? '', files.length - 1) : names(files);
}
