/** What is dropped on the page. */

import { h } from './dom';
import { t } from './messages';

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
