/** The room of motion: decisions explained, thresholds dragged, labels painted, aids switched, the disk calibrated. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { axePath, bendCsv, drop, open, shows, staged } from './support.mjs';

const stage = staged();

const idle = (page) => page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
const view = (page, name) => page.locator(`[data-view="motion-${name}"]`);
const explained = (page) => page.locator('.explained').textContent();

/** Enter the room with a built-in drive, and wait for its first results. */
async function enter(drive, options = {}) {
  const opened = await open(stage.browser, `${stage.url}#drive=${drive}&room=motion`, options);
  await opened.page.locator('[data-view="motion-mode"][data-drawn~="motion_mode"]').waitFor({ timeout: 60_000 });
  await opened.page.locator('.decisions tbody tr').first().waitFor();
  await idle(opened.page);
  return opened;
}

/** The share of right rows that the side panel prints, per cent. */
async function accuracy(page) {
  await idle(page);
  const text = await page.locator('.headline').textContent();
  return Number(text.match(/([\d.]+) %/)[1]);
}

test('each decision has its rule and its numbers, and the cursor a sentence', async () => {
  const { page, context, errors } = await enter('u_drive');
  const rows = page.locator('.decisions tbody tr');
  const texts = await rows.allTextContents();
  assert.ok(texts.some((row) => /stationary → straight.*launch by force.*FD [\d.]+ > [\d.]+/.test(row)), texts.join('\n'));
  assert.ok(texts.some((row) => /straight → cornering.*corner begins.*\|YD\| [\d.]+ > [\d.]+/.test(row)));
  await rows.filter({ hasText: 'corner begins' }).first().getByRole('button').click();
  await page.waitForFunction(() => /^Cornering since .*the mean yaw rate rose/.test(document.querySelector('.explained').textContent));
  assert.match(await explained(page), /The corner ends when \|YD\| comes down to [\d.]+ °\/s/);
  assert.equal(await page.locator('.decisions tr[data-now]').count(), 1);
  await page.keyboard.press('Home');
  await page.waitForFunction(() => /learned/.test(document.querySelector('.explained').textContent));
  assert.deepEqual(errors, []);
  await context.close();
});

test('a threshold line is dragged on its plot and by the keys, the timeline follows, and one undo takes it back', async () => {
  const { page, context, errors } = await enter('u_drive');
  const before = await accuracy(page);
  const grip = page.locator('.grip[data-line="yaw_on"]');
  const box = await grip.boundingBox();
  // The line itself, well left of its handle.
  const [x, y] = [box.x - 300, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.locator('.near-threshold').waitFor();
  await page.mouse.down();
  for (let i = 1; i <= 6; i++) await page.mouse.move(x + i, y - 2 * i);
  await page.mouse.up();
  await page.locator('.param.changed[data-param="yaw_on"]').waitFor();
  await page.locator('.headline', { hasText: '→' }).waitFor();
  assert.notEqual(Number(await grip.getAttribute('aria-valuenow')).toFixed(4), '0.0500');
  assert.match(await page.locator('.headline').textContent(), /worse|better/);
  await page.keyboard.press('Control+z');
  assert.equal(await page.locator('.param.changed').count(), 0, 'a drag is one step of undo');
  await idle(page);

  // Thresholds that follow the noise floor: the dragged one leaves it, the others stay where they lie.
  const jd = page.locator('.grip[data-line="jd"]');
  const td = page.locator('.grip[data-line="td"]');
  const tdBefore = Number(await td.getAttribute('aria-valuenow'));
  await jd.focus();
  for (let i = 0; i < 4; i++) await page.keyboard.press('PageUp');
  await page.locator('.param.changed[data-param="adaptive"]').waitFor();
  await page.locator('.param.changed[data-param="jd_threshold"]').waitFor();
  await idle(page);
  assert.ok(Math.abs(Number(await td.getAttribute('aria-valuenow')) / tdBefore - 1) < 0.01);
  for (let i = 0; i < 4; i++) await page.keyboard.press('Control+z');
  assert.equal(await page.locator('.param.changed').count(), 0);
  await page.waitForFunction((b) => Number(document.querySelector('.headline').textContent.match(/→ ([\d.]+)|mode ([\d.]+)/)?.slice(1).find(Boolean)) === b, before);
  assert.deepEqual(errors, []);
  await context.close();
});

test('labels are painted with the mouse and with the keys, held against, saved and loaded again', async () => {
  const { page, context, errors } = await enter('u_drive');
  const truth = await page.locator('.against').textContent();
  assert.match(truth, /Held against the truth/);
  await page.getByRole('button', { name: 'Label by hand' }).click();
  const area = await page.locator('.paint-area').boundingBox();
  const at = (share) => [area.x + share * area.width, area.y + area.height / 2];
  await page.mouse.move(...at(0.02));
  await page.mouse.down();
  await page.mouse.move(...at(0.1), { steps: 4 });
  await page.mouse.up();
  await page.locator('.paint-bar', { hasText: '1 stretch' }).waitFor();

  await page.locator('.paint-bar').getByRole('radio', { name: 'straight' }).check();
  await page.getByRole('button', { name: 'Start here' }).focus();
  await page.keyboard.press('Enter');
  for (let i = 0; i < 3; i++) await page.keyboard.press('Shift+ArrowRight');
  await page.getByRole('button', { name: 'Paint to here' }).focus();
  await page.keyboard.press('Enter');
  await page.locator('.paint-bar', { hasText: '2 stretches' }).waitFor();
  await page.getByLabel('Held against').selectOption('labels');
  await page.waitForFunction((before) => document.querySelector('.against').textContent !== before, truth);
  assert.match(await page.locator('.confusion').textContent(), /stationary/);

  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Save as CSV' }).click()]);
  const csv = readFileSync(await download.path(), 'utf8');
  assert.match(csv, /^t,truth_mode\n[\d.]+,0\n[\d.]+,1\n/);
  const scored = await page.locator('.confusion tbody').textContent();
  await page.getByRole('button', { name: 'Wipe all' }).click();
  await page.locator('.paint-bar', { hasText: 'no labels' }).waitFor();
  await page.locator('.paint-bar').getByRole('button', { name: 'Undo' }).click();
  await page.locator('.paint-bar', { hasText: '2 stretches' }).waitFor();
  await page.getByRole('button', { name: 'Wipe all' }).click();
  await drop(page, [{ name: 'labels.csv', text: csv }]);
  await page.locator('.paint-bar', { hasText: '2 stretches' }).waitFor();
  await page.waitForFunction((before) => document.querySelector('.confusion tbody').textContent === before, scored);
  await shows(page, 'U-shaped');
  await drop(page, [{ name: 'labels.json', text: '[{"time": 3, "mode": 7}]' }]);
  await page.locator('.error-banner', { hasText: 'labels.json: row 1' }).waitFor();
  assert.deepEqual(errors, []);
  await context.close();
});

test('aids are a strip, each is tried switched, and a switch of the table is the parameter', async () => {
  const { page, context, errors } = await enter('u_drive');
  const aids = view(page, 'aids');
  await aids.scrollIntoViewIfNeeded();
  await page.locator('[data-view="motion-aids"][data-drawn~="land_ins"]').waitFor();
  // On a slow machine it is tried only when asked for.
  await page.waitForFunction(() => {
    document.querySelector('.aid-table button:enabled')?.click();
    return [...document.querySelectorAll('.aid-table tbody tr')].every((tr) => [...tr.querySelectorAll('td')].slice(-3).every((td) => /\d/.test(td.textContent)));
  }, null, { polling: 500, timeout: 30_000 });
  const cell = (aid) => aids.locator(`tr[data-aid="${aid}"] td`).nth(2).textContent();
  const present = Number(await aids.locator('tr.present td').nth(2).textContent());
  assert.ok(Number.parseFloat(await cell('nhc')) > 2 * present, 'without the constraint sideways the position runs away');
  await page.keyboard.press('End');
  await aids.locator('.now', { hasText: 'held by ZUPT, ZARU' }).waitFor();
  await aids.getByRole('switch', { name: 'Use NHC' }).uncheck();
  await page.locator('.param.changed[data-param="nhc"]').waitFor();
  await page.waitForFunction((p) => Number.parseFloat(document.querySelectorAll('.aid-table tr.present td')[2].textContent) > 2 * p, present);
  await aids.locator('tr[data-aid="nhc"]', { hasText: 'with NHC' }).waitFor();
  await page.keyboard.press('Control+z');
  await aids.locator('tr[data-aid="nhc"]', { hasText: 'without NHC' }).waitFor();
  assert.deepEqual(errors, []);
  await context.close();
});

/** A hand that turns a disk with leaning axes from pose to pose: level, nose down, left side down, upside down. */
function poses() {
  const g = 9.80665;
  const forces = [[0, 0, -g], [-g, 0, 0], [0, g, 0], [0, 0, g]];
  const sin = [0, Math.sqrt(3) / 2, -Math.sqrt(3) / 2];
  const cos = [1, -0.5, -0.5];
  const axes = [0, 1, 2].map((i) => [-sin[i], cos[i], 0]).concat([[0, 0, 1], [0, 0, 1], [0, 0, 1]]).map((u, i) => u.map((v, k) => v + 0.01 * Math.cos(5 * i + k)));
  const rows = ['t,acc6_1,acc6_2,acc6_3,acc6_4,acc6_5,acc6_6,gyro_z'];
  for (let k = 0; k < 3200; k++) {
    const place = Math.floor(k / 800);
    const turning = k % 800 > 600;
    const share = turning ? ((k % 800) - 600) / 200 : 0;
    const wave = turning ? Math.sin(0.3 * k) : 0.01 * Math.sin(1.7 * k);
    const from = forces[place];
    const to = forces[(place + 1) % 4];
    const f = from.map((v, i) => v + share * (to[i] - v) + wave);
    rows.push([k / 100, ...axes.map((u, i) => u[0] * f[0] + u[1] * f[1] + u[2] * f[2] + 0.05 * Math.sin(i)), 0].map((v) => v.toFixed(6)).join(','));
  }
  return `${rows.join('\n')}\n`;
}

test('the sensor is calibrated from a log with four rests, used, taken back and saved', async () => {
  const { page, context, errors } = await enter('u_drive_disk');
  const disk = view(page, 'disk');
  await page.locator('[data-view="motion-disk"][data-drawn~="gyro_free"]').waitFor();
  await disk.getByRole('button', { name: 'Calibrate the sensor' }).click();
  const dialog = page.getByRole('dialog', { name: 'Calibration from rests' });
  await dialog.locator('p.bad', { hasText: 'four that do not lie in one plane are needed' }).waitFor();
  await page.keyboard.press('Escape');

  await drop(page, [{ name: 'poses.csv', make: poses }]);
  await shows(page, 'poses.csv');
  await page.getByRole('tab', { name: 'Motion' }).click();
  await idle(page);
  await disk.getByRole('button', { name: 'Calibrate the sensor' }).click();
  await dialog.getByText('4 rests were found.').waitFor();
  const chosen = await dialog.locator('select').evaluateAll((all) => all.map((s) => s.selectedOptions[0].textContent));
  assert.deepEqual(chosen, ['level', 'nose down', 'left side down', 'upside down']);
  const found = dialog.locator('.disk-result tbody tr');
  assert.equal(await found.count(), 6);
  const [first] = await found.allTextContents();
  assert.match(first, /0\.0100, 1\.0054/, 'the axis that leans is found');
  assert.match(await dialog.textContent(), /where the sensors sit/);
  await dialog.locator('select').first().selectOption('not used');
  await dialog.locator('p.bad').waitFor();
  await dialog.locator('select').first().selectOption('level');
  await dialog.getByRole('button', { name: 'Use this calibration' }).click();
  await dialog.getByText('A calibration is in use').waitFor();
  const [download] = await Promise.all([page.waitForEvent('download'), dialog.getByRole('button', { name: 'Save the disk' }).click()]);
  const saved = readFileSync(await download.path(), 'utf8');
  assert.equal(JSON.parse(saved).sensors.length, 6);
  await dialog.getByRole('button', { name: 'Take it back' }).click();
  await dialog.getByText('The disk is read as drawn').waitFor();
  await page.keyboard.press('Escape');
  await drop(page, [{ name: 'disk.json', text: saved }]);
  await disk.getByRole('button', { name: 'Sensor calibrated' }).waitFor();

  await drop(page, [{ name: 'again.csv', make: poses }, { name: 'disk.json', text: saved }]);
  await shows(page, 'again.csv');
  await disk.getByRole('button', { name: 'Sensor calibrated' }).waitFor();

  // In a mapping it comes with the log, and the core reads the disk with it.
  const drifted = async () => {
    await idle(page);
    await page.locator('[data-view="motion-disk"][data-drawn~="gyro_free"]').waitFor();
    await page.keyboard.press('End');
    const value = disk.locator('.lane').nth(2).locator('.legend-entry', { hasText: 'integrated only' }).locator('.value');
    await value.filter({ hasText: /\d/ }).waitFor();
    return value.textContent();
  };
  const calibrated = await drifted();
  await drop(page, [{ name: 'drawn.csv', make: poses }]);
  await shows(page, 'drawn.csv');
  await disk.getByRole('button', { name: 'Calibrate the sensor' }).waitFor();
  assert.notEqual(await drifted(), calibrated);
  const names = ['acc6_1', 'acc6_2', 'acc6_3', 'acc6_4', 'acc6_5', 'acc6_6', 'gyro_z'];
  const mapping = { version: 1, time: { column: 't' }, signals: Object.fromEntries(names.map((column) => [column, { column }])), disk: JSON.parse(saved) };
  await drop(page, [{ name: 'mapped.csv', make: poses }, { name: 'mapping.json', text: JSON.stringify(mapping) }]);
  await shows(page, 'mapped.csv');
  await disk.getByRole('button', { name: 'Sensor calibrated' }).waitFor();
  assert.equal(await drifted(), calibrated);
  assert.deepEqual(errors, []);
  await context.close();
});

test('what cannot run on a log says so in its view', async () => {
  const { page, context, errors } = await enter('u_drive');
  await drop(page, [{ name: 'bend.csv', text: bendCsv(30) }]);
  await shows(page, 'bend.csv');
  await idle(page);
  await view(page, 'disk').locator('.view-note', { hasText: 'cannot run on this log' }).waitFor();
  await page.locator('.against', { hasText: 'says nothing of the true modes' }).waitFor();
  await view(page, 'aids').locator('.aid-table', { hasText: 'no truth' }).waitFor();
  assert.equal(await view(page, 'disk').getByRole('button', { name: /Calibrate/ }).isVisible(), false);
  assert.deepEqual(errors, []);
  await context.close();
});

for (const options of [{ colorScheme: 'light' }, { colorScheme: 'dark', viewport: { width: 390, height: 844 } }]) {
  test(`nothing in the room is out of reach, ${options.colorScheme}`, async () => {
    const { page, context, errors } = await enter('u_drive_disk', { bypassCSP: true, ...options });
    await page.getByRole('button', { name: 'Label by hand' }).click();
    const judge = async () => {
      await page.addScriptTag({ path: axePath });
      const { violations } = await page.evaluate(() => window.axe.run());
      const bad = violations.filter((v) => v.impact === 'serious' || v.impact === 'critical');
      assert.deepEqual(bad.map((v) => `${v.id}: ${v.nodes.map((n) => n.target.join(' ')).join(', ')}`), []);
    };
    await judge();
    await page.getByRole('button', { name: 'Calibrate the sensor' }).click();
    await page.getByRole('dialog', { name: 'Calibration from rests' }).waitFor();
    await judge();
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    assert.ok(overflow <= 0, 'no sideways scrolling');
    assert.deepEqual(errors, []);
    await context.close();
  });
}
