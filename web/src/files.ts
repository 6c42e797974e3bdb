/** Files that are dropped or chosen: logs with what belongs to them, or a drive to simulate. */

import { h } from './dom';
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

/** Every file below what was dropped; those in a folder are named by their way from it. */
async function below(entry: FileSystemEntry, path: string): Promise<File[]> {
  if (entry.name.startsWith('.')) return [];
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    return [path === '' ? file : new File([file], path + file.name)];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const inside: FileSystemEntry[] = [];
  // A folder is listed a hundred entries at a time.
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) break;
    inside.push(...some);
  }
  inside.sort((a, b) => (a.name < b.name ? -1 : 1));
  const files: File[] = [];
  for (const one of inside) files.push(...(await below(one, `${path}${entry.name}/`)));
  return files;
}

/** The files of a drop, those in folders with them. What was dropped can only be asked for at once. */
function dropped(transfer: DataTransfer): Promise<File[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const files = [...transfer.files];
  if (!entries.some((entry) => entry?.isDirectory)) return Promise.resolve(files);
  return Promise.all(entries.map((entry) => (entry ? below(entry, '') : []))).then((all) => all.flat());
}

/** The whole page takes files; while one is dragged over it, it says so. */
export function dropTarget(open: (files: File[]) => void): HTMLElement {
  const overlay = h('div.drop-overlay', { hidden: true }, h('p', {}, h('strong', {}, t.drop.title), t.drop.hint));
  const holdsFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes('Files') ?? false;
  addEventListener('dragover', (event) => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    overlay.hidden = false;
  });
  addEventListener('dragleave', (event) => {
    if (event.relatedTarget === null) overlay.hidden = true;
  });
  addEventListener('drop', (event) => {
    overlay.hidden = true;
    if (!holdsFiles(event) || !event.dataTransfer) return;
    event.preventDefault();
    void dropped(event.dataTransfer).then(open);
  });
  return overlay;
}
