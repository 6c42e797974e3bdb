/** The table of columns: what physics says of a log, shown, changed by hand, applied. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { axePath, bendCsv, drop, estimated, open, shows, staged } from './support.mjs';

const stage = staged();

/** The open drive's measurements as the page exports them. */
async function exported(page) {
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: /Measurements and truth/ }).click();
  const stream = await (await download).createReadStream();
  return (await stream.toArray()).join('');
}

const KEPT = /^(t|accel_.|gyro_.|mag_.|speed|steer|gnss_(lat|lon|alt|v.))$/;

/** The beginning of an exported drive without its truth, with some columns changed: `{ gyro_z: (value) => -value }`. */
function wrong(csv, changes) {
  const [head, ...lines] = csv.split('\n').filter((line) => line !== '' && !line.startsWith('#'));
  const names = head.split(',');
  const kept = names.map((_, i) => i).filter((i) => KEPT.test(names[i]));
  const number = (text, name) => String(Number((changes[name]?.(Number(text)) ?? Number(text)).toPrecision(10)));
  const rows = lines.filter((line) => Number.parseFloat(line) < 240);
  return [kept.map((i) => names[i]).join(','), ...rows.map((line) => {
    const cells = line.split(',');
    return kept.map((i) => (cells[i] === '' ? '' : number(cells[i], names[i]))).join(',');
  })].join('\n');
}

let text = '';

/** Open the page and drop its own drive on it, read with a wrong sign. */
async function wronglyOpened(options) {
  const opened = await open(stage.browser, stage.url, options);
  const { page } = opened;
  await estimated(page);
  text ||= wrong(await exported(page), { gyro_z: (v) => -v });
  await drop(page, [{ name: 'wrong.csv', text }]);
  await shows(page, 'wrong.csv');
  return opened;
}

const row = (page, column) => page.locator(`.columns tr[data-column="${column}"]`);

test('a sign that contradicts the other sensors is said without being asked, and put right by one button', async () => {
  const { page, context, errors } = await wronglyOpened();
  const notice = page.locator('.columns-notice');
  await notice.waitFor({ timeout: 60_000 });
  assert.match(await notice.textContent(), /gyro_z/);
  await notice.getByRole('button', { name: 'Look at the columns' }).click();
  const dialog = page.getByRole('dialog', { name: 'Columns of this log' });
  await dialog.waitFor();

  const gyro = row(page, 'gyro_z');
  assert.notEqual(await gyro.getAttribute('data-differs'), null);
  assert.match(await gyro.locator('.why').textContent(), /\d/, 'reasons come with numbers');
  assert.match(await gyro.locator('.measured').textContent(), /Hz/);
  assert.ok((await gyro.locator('.sparkline path').getAttribute('d')).length > 100);
  const contradiction = dialog.locator('[data-weight="contradiction"]', { hasText: 'gyro_z' }).first();
  assert.match(await contradiction.textContent(), /opposite sign of the rate at which the course .* turns: correlation -0\.\d+, scale \d/);

  await contradiction.getByRole('button', { name: 'Correct it: gyro_z' }).click();
  assert.equal(await gyro.getByRole('spinbutton', { name: /Factor/ }).inputValue(), '-1');
  assert.equal(await gyro.getAttribute('data-differs'), null);
  await dialog.getByRole('button', { name: 'Apply' }).click();
  await dialog.locator('[role=status]', { hasText: 'The log was read as shown here.' }).waitFor();
  await page.keyboard.press('Escape');
  await estimated(page);
  await page.waitForFunction(() => !document.querySelector('.columns-notice')?.textContent.includes('gyro_z') || document.querySelector('.columns-notice').hidden);
  assert.deepEqual(errors, []);
  await context.close();
});

test('everything can be changed by hand, undone, and put back to how the log was read at first', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(10) }]);
  await shows(page, 'bend.csv');
  await page.getByRole('button', { name: 'Columns…' }).click();
  const dialog = page.getByRole('dialog', { name: 'Columns of this log' });
  await row(page, 'speed').waitFor({ timeout: 60_000 });
  const apply = dialog.getByRole('button', { name: 'Apply' });
  assert.ok(await apply.isDisabled(), 'nothing is changed yet');

  await dialog.getByLabel('Unit of speed', { exact: true }).selectOption('km/h');
  await dialog.getByLabel('What steer is read as').selectOption('');
  await row(page, 'accel_x').getByRole('button', { name: /Turn the sign/ }).click();
  await dialog.getByLabel('Offset of accel_y').fill('0.25');
  await dialog.getByRole('group', { name: 'Magnetometer' }).getByLabel('Yaw').fill('90');
  await dialog.getByLabel(/^Satellites/).fill('0.2');
  await dialog.getByLabel(/^Latitude/).fill('47');
  await dialog.getByLabel(/^Longitude/).fill('8.6');
  await dialog.getByLabel(/^Height/).fill('400');
  await dialog.getByLabel(/^Height/).blur();
  await apply.click();
  await dialog.locator('[role=status]', { hasText: 'The log was read as shown here.' }).waitFor();
  await page.keyboard.press('Escape');

  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Download this mapping' }).click();
  const mapping = JSON.parse(readFileSync(await (await download).path(), 'utf8'));
  assert.deepEqual(mapping.signals.speed, { column: 'speed', unit: 'km/h' });
  assert.equal(mapping.signals.steer, undefined);
  assert.equal(mapping.signals.accel_x.scale, -1);
  assert.equal(mapping.signals.accel_y.offset, 0.25);
  assert.equal(mapping.mounts.mag.yaw_deg, 90);
  assert.equal(mapping.delays.gnss, 0.2);
  assert.deepEqual(mapping.origin, { lat_deg: 47, lon_deg: 8.6, alt: 400 });

  await page.getByRole('button', { name: 'Columns…' }).click();
  await dialog.getByLabel('Unit of speed', { exact: true }).selectOption('mph');
  await dialog.getByRole('button', { name: 'Undo changes' }).click();
  assert.equal(await dialog.getByLabel('Unit of speed', { exact: true }).inputValue(), 'km/h');
  await dialog.getByRole('button', { name: 'Back to the first reading' }).click();
  assert.equal(await dialog.getByLabel('Unit of speed', { exact: true }).inputValue(), 'm/s');
  assert.equal(await dialog.getByLabel('What steer is read as').inputValue(), 'steer');
  await apply.click();
  await dialog.locator('[role=status]', { hasText: 'The log was read as shown here.' }).waitFor();
  assert.deepEqual(errors, []);
  await context.close();
});

test('a reading that is refused is said in the dialog, and what was open stays', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(5) }]);
  await shows(page, 'bend.csv');
  await page.getByRole('button', { name: 'Columns…' }).click();
  const dialog = page.getByRole('dialog', { name: 'Columns of this log' });
  await row(page, 'speed').waitFor({ timeout: 60_000 });
  await dialog.getByLabel('What gyro_x is read as').selectOption('t');
  await dialog.getByRole('button', { name: 'Apply' }).click();
  await dialog.locator('[role=alert]', { hasText: 'bend.csv' }).waitFor();
  await dialog.getByRole('button', { name: 'Undo changes' }).click();
  assert.equal(await row(page, 't').getByRole('combobox').first().inputValue(), 't');
  await context.close();
});

for (const [name, options] of [['a wide dark window', { colorScheme: 'dark' }], ['a phone', { viewport: { width: 390, height: 844 } }]]) {
  test(`the table is accessible and fits ${name}`, async () => {
    const { page, context } = await wronglyOpened(options);
    await page.locator('.columns-notice').waitFor({ timeout: 60_000 });
    await page.getByRole('button', { name: 'Look at the columns' }).click();
    await row(page, 'speed').waitFor();
    await page.addScriptTag({ path: axePath });
    const { violations } = await page.evaluate(() => window.axe.run('.columns'));
    assert.deepEqual(violations.map((v) => [v.id, v.nodes.map((n) => n.html)]), []);
    const overflow = await page.evaluate(() => {
      const body = document.querySelector('.columns-body');
      return body.scrollWidth - body.clientWidth;
    });
    assert.ok(overflow <= 0, `${overflow} pixels are cut off`);
    if (process.env.SHOTS) await page.screenshot({ path: `${process.env.SHOTS}/wizard-${name.replaceAll(' ', '-')}.png` });
    await context.close();
  });
}
