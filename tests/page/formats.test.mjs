/** Every format opens in the page; several files are one drive; what does not fit is said. */

import assert from 'node:assert/strict';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { before, test } from 'node:test';
import { bendCsv, drop, estimated, open, openDrive, shows, staged } from './support.mjs';
import { choose, realLogs, samples } from './samples.mjs';

const stage = staged();
let sample;
before(() => {
  sample = samples();
});

const alert = (page) => page.locator('.error-banner [role=alert]');

/** Wait until the report is that of a log of this name; its text. */
async function report(page, name) {
  await shows(page, name);
  return page.locator('.report').textContent();
}

/** The drive as the page exports it: columns by name, blank cells as NaN. */
async function exported(page) {
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Measurements and truth (CSV)' }).click();
  const text = (await (await (await download).createReadStream()).toArray()).join('');
  const [header, ...rows] = text.trimEnd().split('\n').filter((line) => !line.startsWith('#')).map((line) => line.split(','));
  return Object.fromEntries(header.map((name, i) => [name, rows.map((row) => (row[i] === '' ? NaN : Number(row[i])))]));
}

const finite = (column) => (column ?? []).filter(Number.isFinite);
const near = (values, expected, tolerance) => values.every((v, i) => Math.abs(v - expected(i)) <= tolerance);

/** Forty samples each: forward acceleration i/100 m/s^2, latitude 42 deg and i/100,000; see `crates/import/tests/samples`. */
const INERTIAL = ['csv', 'csv.gz', 'npz', 'ulog', 'mcap', 'mcap_zstd', 'mcap_lz4', 'bag', 'bag_lz4', 'blf', 'asc', 'candump', 'mdf_sorted', 'mdf_deflated', 'mdf_transposed', 'mdf_unsorted', 'mdf_unfinished', 'mdf_bus', 'phyphox', 'sensor_logger', 'openxc'];
const FIXES = ['nmea', 'gpx', 'vbo', 'kitti'];

test('a log of every format opens and shows the numbers that were written', async (context) => {
  const { page, context: browserContext, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  for (const name of [...INERTIAL, ...FIXES]) {
    await context.test(name, async () => {
      await choose(page, sample[name]);
      // Where a drive is one row a file, it is named after the first.
      const text = await report(page, name === 'kitti' ? 'd/oxts/data/0000000000.txt' : sample[name].find((f) => !f.name.endsWith('.dbc')).name);
      assert.equal(await page.locator('[role=alert]:visible').count(), 0);
      assert.match(text, /[0-9] Hz/);
      const drive = await exported(page);
      if (FIXES.includes(name)) {
        const latitude = finite(drive.gnss_lat);
        assert.equal(latitude.length, 40);
        assert.ok(near(latitude, (i) => 42 + i * 1e-5, 2e-7), `${latitude}`);
      } else if (name === 'openxc') {
        assert.ok(finite(drive.speed ?? drive.wheel_speed).length > 10, Object.keys(drive).join());
      } else {
        const accel = finite(drive.accel_x);
        // One phone's accelerometer begins 20 ms after its gyroscope, to whose times it is interpolated.
        const [late, tolerance] = name === 'sensor_logger' ? [1, 2.1e-3] : [0, 1e-6];
        assert.equal(accel.length, 40 - late, Object.keys(drive).join());
        assert.ok(near(accel, (i) => (i + late) / 100, tolerance), `${accel}`);
      }
    });
  }
  assert.deepEqual(errors, []);
  await browserContext.close();
});

test('a database that is dropped after its bus log is used, kept for the next log, and named', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const [database] = sample.asc.filter((f) => f.name.endsWith('.dbc'));
  const log = (name) => sample[name].filter((f) => !f.name.endsWith('.dbc'));
  await choose(page, [database]);
  await alert(page).getByText('kept for this session').waitFor();
  await page.reload();
  await estimated(page);
  const before = await openDrive(page);
  await choose(page, log('asc'));
  await alert(page).getByText('no DBC database').waitFor();
  assert.match(await alert(page).textContent(), /asc_bus\.asc: .*open the car's DBC/);
  assert.equal(await openDrive(page), before);
  await choose(page, [database]);
  assert.match(await report(page, 'asc_bus.asc'), /decoded as asc_bus\.dbc says/);
  assert.equal(finite((await exported(page)).accel_x).length, 40);
  for (const name of ['candump', 'blf', 'mdf_bus']) {
    await choose(page, log(name));
    assert.match(await report(page, log(name)[0].name), /decoded as asc_bus\.dbc says/);
  }
  assert.deepEqual(errors, []);
  await context.close();
});

test('files that are dropped together are one drive: parts joined, sensors merged on time, raw ranges and mapping used', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const [csv] = sample.csv;
  const named = (name) => ({ ...csv, name });
  await choose(page, [named('a.csv'), named('b.csv')]);
  assert.match(await report(page, 'a.csv and b.csv'), /taken as its continuation/);
  assert.equal(finite((await exported(page)).accel_x).length, 80);

  await choose(page, [named('imu.csv'), ...sample.gpx]);
  assert.match(await report(page, 'imu.csv'), /unknown start/);
  const drive = await exported(page);
  assert.deepEqual([finite(drive.accel_x).length, finite(drive.gnss_lat).length], [40, 40]);

  const raw = 't,prn,sat_x,sat_y,sat_z,pr\n0,3,1,2,3,7\n1,3,1,2,3,8\n';
  await drop(page, [{ name: 'ranges.csv', text: raw }, { name: 'log.csv', text: bendCsv(5) }]);
  assert.match(await report(page, 'log.csv'), /ranges\.csv: raw ranges of satellites at 2 instants/);

  const mapping = JSON.stringify({ version: 1, time: { column: 't', unit: 's' }, signals: { accel_y: { column: 'ax', unit: 'g' } } });
  await drop(page, [{ name: 'mapped.csv', text: 't,ax\n0,1\n1,2\n2,1\n' }, { name: 'mine.json', text: mapping }]);
  assert.match(await report(page, 'mapped.csv'), /given by the mapping/);
  const mapped = finite((await exported(page)).accel_y);
  assert.ok(near(mapped, (i) => [1, 2, 1][i] * 9.80665, 1e-9), `${mapped}`);
  assert.deepEqual(errors, []);
  await context.close();
});

const PNG = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0, 0, 0, 13];
const NOISE = Array.from({ length: 5000 }, (_, i) => (i * i * 31 + i * 7) % 251);
const day = (n) => `time,ax [g]\n2024-05-0${n}T10:00:00Z,0.1\n2024-05-0${n}T10:00:01Z,0.2\n`;
const MISFITS = [
  { what: 'a picture', files: [{ name: 'photo.png', bytes: PNG }], expects: [/photo\.png: expected a log, found a PNG picture/, /what can be opened: CSV, MDF 4, BLF.*MCAP.*gzip/] },
  { what: 'bytes of no format', files: [{ name: 'dump.bin', bytes: NOISE }], expects: [/dump\.bin/, /unknown format/, /what can be opened: CSV, MDF 4/] },
  { what: 'a picture beside a log', files: [{ name: 'log.csv', text: bendCsv(2) }, { name: 'photo.png', bytes: PNG }], expects: [/photo\.png/] },
  { what: 'drives of two days', files: [{ name: 'a.csv', text: day(1) }, { name: 'b.csv', text: day(5) }], expects: [/b\.csv begins 4\.0 days after the end of a\.csv/] },
  { what: 'two mappings', files: [{ name: 'log.csv', text: bendCsv(2) }, { name: 'a.json', text: '{}' }, { name: 'b.json', text: '{}' }], expects: [/a\.json, b\.json: expected one mapping/] },
  { what: 'a drive to simulate beside a log', files: [{ name: 'log.csv', text: bendCsv(2) }, { name: 'drive.json', text: '{"segments": []}' }], expects: [/drive\.json: a drive to simulate, dropped together with log\.csv/] },
  { what: 'an archive that is cut off', files: [{ name: 'cut.zip', bytes: [0x50, 0x4b, 3, 4, ...NOISE.slice(0, 400)] }], expects: [/cut\.zip/] },
];

test('what cannot be opened, or not together, is refused in one sentence, and the drive that was open stays', async (context) => {
  const { page, context: browserContext, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const name = await openDrive(page);
  for (const { what, files, expects } of MISFITS) {
    await context.test(what, async () => {
      await drop(page, files);
      await alert(page).waitFor({ timeout: 20_000 });
      const sentence = await alert(page).textContent();
      for (const pattern of expects) assert.match(sentence, pattern);
      assert.ok(sentence.length < 400, sentence);
      assert.equal(await openDrive(page), name);
      await page.keyboard.press('Escape');
      await page.locator('.error-banner').waitFor({ state: 'hidden' });
    });
  }
  assert.deepEqual(errors, []);
  await browserContext.close();
});

test('a log that is cut off opens as far as it goes, or says that it is', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  for (const name of ['gpx', 'nmea', 'candump', 'ulog', 'mdf_unfinished', 'csv.gz']) {
    const files = sample[name].map((f) => ({ ...f, name: `cut_${f.name}`, buffer: f.name.endsWith('.dbc') ? f.buffer : f.buffer.subarray(0, Math.floor(f.buffer.length * 0.8)) }));
    await choose(page, files);
    await report(page, files.find((f) => !f.name.endsWith('.dbc')).name);
    const drive = await exported(page);
    const rows = Math.max(finite(drive.accel_x).length, finite(drive.gnss_lat).length);
    assert.ok(rows > 10 && rows < 40, `${name}: ${rows} rows`);
  }
  const [zip] = sample.npz;
  await choose(page, [{ ...zip, name: 'cut.npz', buffer: zip.buffer.subarray(0, zip.buffer.length - 200) }]);
  await alert(page).getByText('cut.npz').waitFor();
  assert.deepEqual(errors, []);
  await context.close();
});

test('reading can be stopped in the middle; the drive that was open stays and the next log opens', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const name = await openDrive(page);
  const stopped = page.evaluate(() => new Promise((resolve) => {
    const status = document.querySelector('.status');
    new MutationObserver((_, observer) => {
      const bar = status.querySelector('progress');
      if (status.dataset.state !== 'busy' || !status.textContent.includes('long.csv') || !(bar?.value > 0.1)) return;
      observer.disconnect();
      resolve(bar.value);
      status.querySelector('button').click();
    }).observe(status, { attributes: true, childList: true, subtree: true, characterData: true });
  }));
  await drop(page, [{ name: 'long.csv', make: () => `t,accel_x,speed\n${Array.from({ length: 1_500_000 }, (_, i) => `${(i / 100).toFixed(2)},${(i % 97) / 100},10.125`).join('\n')}\n` }]);
  const share = await stopped;
  assert.ok(share > 0.1 && share < 1, `stopped at ${share}`);
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached' });
  assert.equal(await openDrive(page), name);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(3) }]);
  await shows(page, 'bend.csv');
  assert.deepEqual(errors, []);
  await context.close();
});

test('a log that does not fit into memory is refused before it is read, and the part that is offered opens', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const name = await openDrive(page);
  // Blank cells take a byte in the file and eight in memory: 220 MB need more than the 1.5 GB that are allowed.
  const make = () => {
    const blank = ','.repeat(100);
    const header = `t,accel_x,${Array.from({ length: 100 }, (_, i) => `c${i}`).join(',')}\n`;
    const piece = (k) => Array.from({ length: 10_000 }, (_, i) => `${((k * 10_000 + i) / 100).toFixed(2)},0.5${blank}\n`).join('');
    return new Blob([header, ...Array.from({ length: 200 }, (_, k) => new Blob([piece(k)]))]);
  };
  await drop(page, [{ name: 'large.csv', make }]);
  await alert(page).getByText('large.csv: expected a log that fits into').waitFor({ timeout: 60_000 });
  assert.equal(await openDrive(page), name);
  assert.equal(await page.getByLabel('Names of columns, with commas between them').count(), 1);
  assert.match(await alert(page).textContent(), /Read its first/);
  await page.getByRole('button', { name: 'Read one row in 2' }).click();
  await page.waitForFunction(() => document.querySelector('.drive-chooser')?.textContent.includes('large.csv'), undefined, { timeout: 120_000 });
  assert.match(await page.locator('.report').textContent(), /only a part was read: one row in 2/);
  assert.equal(await page.locator('.offer:visible').count(), 0);
  assert.deepEqual(errors, []);
  await context.close();
});

/** A KITTI drive in a folder, as its archive holds it. */
function kittiFolder() {
  const folder = mkdtempSync(join(tmpdir(), 'drivescope-kitti-'));
  mkdirSync(join(folder, 'oxts/data'), { recursive: true });
  const row = (i) => [42 + i * 1e-5, 8.4, 116, 0.01, 0.02, 1.5, 1, 2, 3, 0.1, 0.2, i / 100, 0.5, 9.8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0.1, 4, 9, 6, 6, 6].join(' ');
  for (let i = 0; i < 250; i++) writeFileSync(join(folder, `oxts/data/${String(i).padStart(10, '0')}.txt`), row(i));
  const stamp = (i) => `2011-09-26 13:02:${(20 + i / 10).toFixed(9)}`;
  writeFileSync(join(folder, 'oxts/timestamps.txt'), Array.from({ length: 250 }, (_, i) => stamp(i)).join('\n'));
  return folder;
}

test('a folder that is dropped is one drive, its files named by their way from it', async () => {
  const folder = kittiFolder();
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const session = await context.newCDPSession(page);
  const data = { items: [], files: [folder], dragOperationsMask: 1 };
  for (const type of ['dragEnter', 'dragOver', 'drop']) await session.send('Input.dispatchDragEvent', { type, x: 400, y: 400, data });
  await shows(page, basename(folder));
  // Two hundred and fifty: a folder is listed a hundred files at a time.
  assert.equal(finite((await exported(page)).gnss_lat).length, 250);
  assert.deepEqual(errors, []);
  await context.close();
  rmSync(folder, { recursive: true });
});

/** The databases that belong to real logs, by a part of the logs' names. */
const DATABASES = [
  [/rawcan/, ['comma2k19_rav4/toyota_rav4_2019.dbc']],
  [/css_canedge_mf4/, ['css_canedge_mf4/canmod-gps.dbc', 'css_canedge_mf4/gnss.dbc', 'css_canedge_mf4/CSS-Electronics-SAE-J1939-DEMO.dbc']],
];
/** Columns of one drive in a file each. */
const COLUMNS = /comma2k19_rav4\/(processed_log|global_pose)\//;

test('every real log opens', { timeout: 240_000 }, async (context) => {
  const real = realLogs();
  if (!real) return;
  const { page, context: browserContext, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const opens = async (names, files) => {
    await choose(page, files);
    const found = await page.waitForFunction((names) => {
      const said = document.querySelector('.error-banner:not([hidden]) [role=alert]')?.textContent;
      return said || names.some((name) => document.querySelector('.drive-chooser')?.textContent.includes(name));
    }, names, { timeout: 60_000 });
    const said = await found.jsonValue();
    assert.equal(said, true, said);
    assert.match(await page.locator('.report').textContent(), /Hz/);
  };
  for (const path of real.paths.filter((p) => !p.endsWith('.dbc') && !COLUMNS.test(p))) {
    await context.test(path, () => {
      const databases = DATABASES.filter(([of]) => of.test(path)).flatMap(([, dbc]) => dbc);
      return opens([basename(path)], [path, ...databases].map((f) => join(real.folder, f)));
    });
  }
  const columns = real.paths.filter((p) => COLUMNS.test(p) && !p.includes('raw_can'));
  await context.test('columns in a file each', async () => {
    const file = (path) => ({ name: path, mimeType: '', buffer: readFileSync(join(real.folder, path)) });
    await opens(['comma2k19_rav4'], columns.map(file));
  });
  assert.deepEqual(errors, []);
  await browserContext.close();
});
