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
  assert.match(await contradiction.textContent(), /gyro_z.* opposite sign of d\(course\)\/dt of .*: correlation -0\.\d+, scale \d/);

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

/** The transform of the filled car in a picture: `above`, `side`, `behind`. */
const carAt = (page, index) => page.locator('.preview figure').nth(index).locator('g.sensed').getAttribute('transform');

test('the car moves with the log, and turns the other way at once when a sign is turned', async () => {
  const { page, context, errors } = await wronglyOpened();
  await page.locator('.columns-notice').waitFor({ timeout: 60_000 });
  await page.getByRole('button', { name: 'Look at the columns' }).click();
  const preview = page.getByRole('region', { name: 'The car as it is read' });
  await preview.waitFor();
  // In its sharpest turn the car of the wrong sign leaves the way by places.
  await preview.getByRole('button', { name: 'Sharpest turn' }).click();
  const turning = preview.locator('tr[data-row="turn"]');
  await page.waitForFunction(() => document.querySelector('tr[data-row="turn"]')?.hasAttribute('data-differs'));
  const numbers = async () => (await turning.locator('td').allTextContents()).slice(0, 2).map((text) => Number.parseFloat(text.replace('−', '-')));
  const [wrongRate, byCourse] = await numbers();
  assert.ok(wrongRate * byCourse < 0 && Math.abs(byCourse) > 3, `${wrongRate} against ${byCourse} deg/s`);
  assert.match(await turning.textContent(), /°\/s/);
  const before = await carAt(page, 0);

  await row(page, 'gyro_z').getByRole('button', { name: /Turn the sign/ }).click();
  await page.waitForFunction(() => !document.querySelector('tr[data-row="turn"]').hasAttribute('data-differs'));
  assert.ok((await numbers())[0] * byCourse > 0);
  assert.notEqual(await carAt(page, 0), before);
  assert.match(await preview.getByRole('img').first().getAttribute('aria-label'), byCourse > 0 ? /right/ : /left/);

  // A mount pitches the car.
  const level = await carAt(page, 1);
  const pitch = page.getByRole('group', { name: 'Inertial sensor' }).getByLabel(/^Pitch/);
  await pitch.fill('10');
  await pitch.blur();
  await page.waitForFunction((was) => document.querySelectorAll('.preview figure g.sensed')[1].getAttribute('transform') !== was, level);
  const angle = (text) => Number.parseFloat(/-?[\d.]+/.exec(text)[0]);
  assert.ok(angle(await carAt(page, 1)) - angle(level) > 20, 'a housing that looks up and reads level sits in a car that looks down; drawn three times as steep');

  // By keyboard through the log, and by itself over a short piece.
  const slider = preview.getByRole('slider', { name: 'Time in the log' });
  const at = Number(await slider.inputValue());
  await slider.focus();
  await page.keyboard.press('ArrowRight');
  assert.ok(Math.abs(Number(await slider.inputValue()) - at - 0.1) < 0.02);
  await preview.getByRole('button', { name: /^Play/ }).click();
  await preview.getByRole('button', { name: 'Stop' }).waitFor();
  const began = Number(await slider.inputValue());
  await page.waitForFunction((from) => Number(document.querySelector('.preview input[type=range]').value) > from + 1, began);
  await preview.getByRole('button', { name: 'Stop' }).click();
  assert.deepEqual(errors, []);
  await context.close();
});

test('a mapping is saved under a name, recognised by the names of the columns, exported, imported, and dropped', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'monday.csv', text: bendCsv(10) }]);
  await shows(page, 'monday.csv');
  await page.getByRole('button', { name: 'Columns…' }).click();
  const dialog = page.getByRole('dialog', { name: 'Columns of this log' });
  await row(page, 'speed').waitFor({ timeout: 60_000 });
  await dialog.getByLabel('Unit of speed', { exact: true }).selectOption('km/h');
  await dialog.getByLabel('Name', { exact: true }).fill('Monday\'s logger');
  await page.keyboard.press('Enter');
  await dialog.getByText('Saved as “Monday\'s logger”').waitFor();
  const download = page.waitForEvent('download');
  await dialog.getByRole('button', { name: 'Export “Monday\'s logger” as JSON' }).click();
  const path = await (await download).path();
  assert.equal(JSON.parse(readFileSync(path, 'utf8')).signals.speed.unit, 'km/h');
  await page.keyboard.press('Escape');

  // Another page of the same browser, another file of the same logger.
  const second = await context.newPage();
  await second.goto(stage.url);
  await estimated(second);
  await drop(second, [{ name: 'tuesday.csv', text: bendCsv(12) }]);
  await shows(second, 'tuesday.csv');
  const notice = second.locator('.columns-notice');
  await notice.getByText('Read with your mapping “Monday\'s logger”, recognised by the names of its 18 columns.').waitFor({ timeout: 60_000 });
  await second.getByRole('button', { name: 'Columns…' }).click();
  await row(second, 'speed').waitFor({ timeout: 60_000 });
  assert.equal(await second.getByLabel('Unit of speed', { exact: true }).inputValue(), 'km/h');
  await second.keyboard.press('Escape');
  await notice.getByRole('button', { name: 'Read it as proposed instead' }).click();
  await notice.getByText('recognised').waitFor({ state: 'detached' });
  await second.getByRole('button', { name: 'Columns…' }).click();
  assert.equal(await second.getByLabel('Unit of speed', { exact: true }).inputValue(), 'm/s');

  // What was exported is imported; a file that is none is refused with a sentence.
  const there = second.getByRole('dialog', { name: 'Columns of this log' });
  await there.locator('input[type=file]').setInputFiles({ name: 'none.json', mimeType: 'application/json', buffer: Buffer.from('{"version":1}') });
  await there.getByText(/none\.json is no mapping of this log/).waitFor();
  await there.locator('input[type=file]').setInputFiles({ name: 'shared.json', mimeType: 'application/json', buffer: readFileSync(path) });
  await there.getByText('“shared” is shown in the table.').waitFor();
  assert.equal(await second.getByLabel('Unit of speed', { exact: true }).inputValue(), 'km/h');
  await there.getByRole('button', { name: 'Delete “Monday\'s logger”' }).click();
  assert.equal(await second.evaluate(() => localStorage.getItem('drivescope.mappings')), '[]');
  assert.deepEqual(errors, []);
  await context.close();
});

test('the keyboard alone changes a sign, undoes it and leaves', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(10) }]);
  await shows(page, 'bend.csv');
  const button = page.getByRole('button', { name: 'Columns…' });
  await button.focus();
  await page.keyboard.press('Enter');
  await row(page, 'gyro_z').waitFor({ timeout: 60_000 });
  const factor = row(page, 'gyro_z').getByRole('spinbutton', { name: /Factor/ });
  await factor.focus();
  await page.keyboard.press('Tab');
  await page.keyboard.press('Enter');
  assert.equal(await factor.inputValue(), '-1');
  const focused = () => page.evaluate(() => document.activeElement?.getAttribute('aria-label'));
  assert.equal(await focused(), 'Turn the sign of gyro_z round', 'the keyboard stays where it was');
  await page.keyboard.press('Enter');
  assert.equal(await factor.inputValue(), '1');
  // A column that becomes another signal keeps the keyboard.
  await row(page, 'steer').getByLabel('What steer is read as').focus();
  await page.keyboard.press('Home');
  await page.waitForFunction(() => document.querySelector('tr[data-column="steer"]').hasAttribute('data-unused'));
  assert.equal(await focused(), 'What steer is read as');
  await page.getByRole('button', { name: 'Undo changes' }).focus();
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => document.querySelector('tr[data-column="steer"]').dataset.signal === 'steer');
  assert.ok(await page.evaluate(() => document.activeElement?.closest('dialog.columns')), 'the keyboard stays in the dialog');
  await page.keyboard.press('Escape');
  await page.locator('dialog.columns').waitFor({ state: 'hidden' });
  await context.close();
});

for (const [name, options] of [['a wide dark window', { colorScheme: 'dark' }], ['a phone', { viewport: { width: 390, height: 844 } }]]) {
  test(`the table is accessible and fits ${name}`, async () => {
    const { page, context } = await wronglyOpened({ bypassCSP: true, ...options });
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
