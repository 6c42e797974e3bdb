/** Logs that are dropped or chosen, perhaps with a mapping. */

import { h } from './dom';
import { t } from './messages';
import { applySavedDisk, isDisk } from './motion/disk-file';
import { isLabels } from './motion/labels';
import type { Session } from './session';
import type { Store } from './state';

/** Whether a JSON text describes a drive to simulate rather than a mapping. */
function isDrive(text: string): boolean {
  const value: unknown = JSON.parse(text);
  return typeof value === 'object' && value !== null && 'segments' in value;
}

/** Whether a JSON text is a magnetometer's calibration. */
function isCalibration(text: string): boolean {
  const value: unknown = JSON.parse(text);
  return typeof value === 'object' && value !== null && 'distortion' in value;
}

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
  const mappings = files.filter((f) => /\.json$/i.test(f.name));
  const logs = files.filter((f) => !mappings.includes(f));
  const [mappingFile] = mappings;
  let mapping: string | null = null;
  let disk: string | null = null;
  if (mappingFile) {
    try {
      mapping = await mappingFile.text();
      if (isDrive(mapping) && logs.length === 0) {
        const { name } = mappingFile;
        const isOpen = await session.open({ kind: 'simulation', name, seed: null, first, composed: mapping }, name);
        if (isOpen) void session.runAll();
        return false;
      }
      if (isDisk(JSON.parse(mapping))) [disk, mapping] = [mapping, null];
      if (disk !== null && logs.length === 0) {
        await applySavedDisk(store, session, disk);
        return false;
      }
      if (mapping !== null && isCalibration(mapping) && logs.length === 0) {
        await calibrate(mapping);
        return false;
      }
    } catch (reason) {
      store.error.value = t.errors.mappingJson(mappingFile.name, reason instanceof Error ? reason.message : String(reason));
      return false;
    }
    if (logs.length === 0) {
      store.error.value = t.errors.mappingAlone(mappingFile.name);
      return false;
    }
  }
  const isOpen = await session.open({ kind: 'files', files: logs, mapping }, logs.map((f) => f.name).join(', '));
  if (isOpen && disk !== null) await applySavedDisk(store, session, disk);
  if (isOpen) void session.runAll();
  return isOpen;
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
    if (!holdsFiles(event)) return;
    event.preventDefault();
    open([...(event.dataTransfer?.files ?? [])]);
  });
  return overlay;
}
