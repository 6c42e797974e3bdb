/** Small logs of every format, written by the readers' own tests, and the real ones that may lie beside the project. */

import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';

const root = fileURLToPath(new URL('../../', import.meta.url));

/** Every file below a folder, by its way from there, sorted. */
export function filesBelow(folder, from = folder) {
  const entries = readdirSync(folder, { withFileTypes: true });
  const inside = (e) => (e.isDirectory() ? filesBelow(join(folder, e.name), from) : [relative(from, join(folder, e.name))]);
  return entries.flatMap(inside).sort();
}

/** The samples by name: `{ csv: [{ name, mimeType, buffer }], .. }`. */
export function samples() {
  const folder = mkdtempSync(join(tmpdir(), 'drivescope-samples-'));
  try {
    const example = ['run', '--quiet', '--profile', 'fast', '--package', 'drivescope-import', '--example', 'samples', '--', folder];
    execFileSync('cargo', example, { cwd: root, stdio: ['ignore', 'ignore', 'inherit'] });
    const found = {};
    for (const path of filesBelow(folder)) {
      const [sample, name] = path.split('/');
      (found[sample] ??= []).push({ name: `${sample}_${name}`, mimeType: '', buffer: readFileSync(join(folder, path)) });
    }
    return found;
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** Real logs by their way from the folder that holds them; null, with a line that says so, where there are none. */
export function realLogs() {
  const folder = join(root, '../shared/data');
  if (!existsSync(folder)) {
    console.log('SKIPPED: real logs, shared/data is not here');
    return null;
  }
  const isLog = (path) => !/LICENSE|\.md$/.test(path) && statSync(join(folder, path)).size > 0;
  return { folder, paths: filesBelow(folder).filter(isLog) };
}

/** Choose files in the dialog: paths, or `{ name, mimeType, buffer }`. */
export function choose(page, files) {
  return page.locator('input[type=file]').first().setInputFiles(files);
}
