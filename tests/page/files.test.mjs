/** Logs that are dropped: good ones open, bad ones say why in one sentence and leave everything as it was. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { bendCsv, drop, estimated, open, openDrive, shows, staged } from './support.mjs';

const stage = staged();

test('a dropped log opens, is estimated, and the page says how it was read', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv() }]);
  await shows(page, 'bend.csv');
  await estimated(page);
  const report = await page.locator('.report').textContent();
  for (const part of ['accel_x', 'gnss_lat', 'inertial', 'No truth in this log']) assert.ok(report.includes(part), part);
  assert.match(await page.locator('.headline').textContent(), /no truth|NIS/i);
  assert.equal(await page.locator('[role=alert]:visible').count(), 0);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a log without a magnetometer or positions says which estimators cannot run and why', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const rows = Array.from({ length: 500 }, (_, i) => `${(i * 0.02).toFixed(2)},0.1,0.0,-9.81,0,0,0.01,10`);
  await drop(page, [{ name: 'small.csv', text: `t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed\n${rows.join('\n')}\n` }]);
  await shows(page, 'small.csv');
  await page.locator('.report .verdict.worse').first().waitFor();
  assert.match(await page.locator('[data-view="4"] .view-note').textContent(), /cannot run on this log: no .*GNSS/);
  await context.close();
});

const HEADER = 't,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed';
const ROW = (i) => `${(i * 0.01).toFixed(2)},0,0,-9.8,0,0,0,1`;
const good = Array.from({ length: 50 }, (_, i) => ROW(i));
const BAD = [
  { what: 'an empty file', file: { name: 'empty.csv', text: '' }, expects: [/empty/i] },
  { what: 'a binary file', file: { name: 'binary.csv', bytes: Array.from({ length: 4096 }, (_, i) => (i * 37 + (i >> 3)) % 256) }, expects: [/binary|text/i] },
  { what: 'a log without time', file: { name: 'notime.csv', text: `a,b\n1,2\n2,3\n3,1\n` }, expects: [/time/i] },
  { what: 'time that runs backwards', file: { name: 'backwards.csv', text: [HEADER, ...good.slice(0, 9), ROW(2), ...good.slice(9)].join('\n') }, expects: [/(row|line) 11/i, /t\b/] },
  { what: 'a ragged row', file: { name: 'ragged.csv', text: [HEADER, ...good.slice(0, 4), '0.04,1,2', ...good.slice(5)].join('\n') }, expects: [/(row|line) 6/i, /3/, /8/] },
  { what: 'text in a column of numbers', file: { name: 'text.csv', text: [HEADER, ...good.slice(0, 4), '0.04,0,0,hello,0,0,0,1', ...good.slice(5)].join('\n') }, expects: [/(row|line) 6/i, /accel_z/, /hello/] },
  { what: 'a single row', file: { name: 'one.csv', text: `${HEADER}\n${ROW(0)}\n` }, expects: [/row/i] },
  { what: 'a million columns', file: { name: 'wide.csv', make: () => `${Array.from({ length: 1_000_000 }, (_, i) => `c${i}`).join(',')}\n` }, expects: [/columns/i] },
];

test('each bad input gets one sentence with the file, and the drive that was open stays', async (context) => {
  const { page, context: browserContext, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const name = await openDrive(page);
  const headline = await page.locator('.headline').textContent();
  for (const { what, file, expects } of BAD) {
    await context.test(what, async () => {
      await drop(page, [file]);
      const alert = page.locator('.error-banner [role=alert]');
      await alert.getByText(file.name).waitFor({ timeout: 20_000 });
      const sentence = await alert.textContent();
      for (const pattern of expects) assert.match(sentence, pattern);
      assert.ok(sentence.length < 400, sentence);
      assert.equal(await openDrive(page), name);
      assert.equal(await page.locator('.headline').textContent(), headline);
      await page.keyboard.press('Escape');
      await page.locator('.error-banner').waitFor({ state: 'hidden' });
    });
  }
  assert.deepEqual(errors, []);
  await browserContext.close();
});

test('a mapping dropped with its log is used, and one that is not JSON is refused', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(5) }, { name: 'map.json', text: '{"signals": ' }]);
  await page.locator('[role=alert]').getByText('map.json').waitFor();
  await drop(page, [{ name: 'map.json', text: '{}' }]);
  await page.locator('[role=alert]').getByText('a mapping alone opens nothing').waitFor();

  await drop(page, [{ name: 'bend.csv', text: bendCsv(5) }]);
  await page.locator('.report').getByText('How columns were read').waitFor();
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Download this mapping' }).click();
  const stream = await (await download).createReadStream();
  const text = (await stream.toArray()).join('');
  await drop(page, [{ name: 'again.csv', text: bendCsv(6) }, { name: 'map.json', text }]);
  await shows(page, 'again.csv');
  assert.equal(await page.locator('[role=alert]:visible').count(), 0);
  await context.close();
});

test('results can be saved as CSV with the names of the core', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: /estimates \(CSV\)/ }).first().click();
  const stream = await (await download).createReadStream();
  const text = (await stream.toArray()).join('');
  assert.match(text.split('\n')[0], /^t,.*roll/);
  assert.ok(text.split('\n').length > 1000);
  await context.close();
});

const READERS = /readers/;

test('what reads files is loaded after the first estimates, and then a log opens without a network', async () => {
  const { page, context, requests, errors } = await open(stage.browser, stage.url);
  const readers = () => requests.filter((r) => READERS.test(r));
  await page.locator('[data-view="1"][data-drawn~="orientation"]').waitFor({ state: 'attached', timeout: 60_000 });
  assert.deepEqual(readers(), [], 'the opening does not wait for it');
  await estimated(page);
  while (!readers().some((r) => r.endsWith('.wasm'))) await page.waitForTimeout(50);
  await page.waitForTimeout(1000);
  await context.setOffline(true);
  const before = requests.length;
  await drop(page, [{ name: 'bend.csv', text: bendCsv(5) }]);
  await shows(page, 'bend.csv');
  assert.deepEqual(requests.slice(before).filter((r) => !r.endsWith('icon.svg')), []);
  assert.deepEqual(errors, []);
  await context.close();
});

test('where what reads files cannot be loaded the page says so, keeps its drive, and opens the log once it can', async () => {
  const { page, context } = await open(stage.browser, stage.url, {
    prepare: (context) => context.route(READERS, (route) => route.abort()),
  });
  await estimated(page);
  const name = await openDrive(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(5) }]);
  const alert = page.locator('.error-banner [role=alert]');
  await alert.getByText('bend.csv').waitFor();
  assert.match(await alert.textContent(), /could not be loaded/);
  assert.equal(await openDrive(page), name);
  await context.unroute(READERS);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(5) }]);
  await shows(page, 'bend.csv');
  assert.equal(await page.locator('[role=alert]:visible').count(), 0);
  await context.close();
});
