/** Variants drawn at once, the magnetic gate, and the compass doctor. */

import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { bendCsv, choose, drop, estimated, open, shows, staged } from './support.mjs';

const stage = staged();

/** A drive of four circles in a car with hard and soft iron, as a description to simulate. */
function ironCircles(iron = { hard: [22, -15, 9], soft: [[1.08, 0.03, 0], [0.03, 0.93, 0], [0, 0, 1]] }) {
  const circle = (turn_deg) => ({ length: 75, turn_deg, speed_kmh: 15, blend: 8 });
  const both = [circle(360), { length: 30, speed_kmh: 15 }, circle(-360)];
  const segments = [{ length: 60, speed_kmh: 20 }, ...both, ...both, { length: 60, speed_kmh: 20, stop: 5 }];
  return JSON.stringify({ name: 'iron_circles', description: 'Circles', seed: 7, car: 'saloon', sensors: 'automotive', iron, segments });
}

/** Degrees that a row of the table of sectors shows, raw and calibrated. */
async function sectorRow(page, row) {
  const cells = await page.locator(`.sectors tr.${row} td:not(.points)`).allTextContents();
  return cells.map(Number);
}

/** The yaw's error as the card of results shows it, degrees: before (if there is one) and now. */
async function yawErrors(page) {
  const text = await page.getByRole('region', { name: 'Result' }).textContent();
  return /yaw \[°\]\s*([0-9.]+)(?: → ([0-9.]+))?/.exec(text)?.slice(1).filter(Boolean).map(Number) ?? [];
}

/** Wait until the canvases in an element show at least a hundred pixels of each named colour of the palette. */
function inked(page, selector, names) {
  const isInked = ([selector, names]) => {
    const style = getComputedStyle(document.documentElement);
    const probe = document.createElement('canvas').getContext('2d');
    const wanted = names.map((name) => {
      probe.fillStyle = style.getPropertyValue(`--${name}`).trim();
      probe.fillRect(0, 0, 1, 1);
      return probe.getImageData(0, 0, 1, 1).data;
    });
    const counts = names.map(() => 0);
    for (const canvas of document.querySelectorAll(`${selector} canvas`)) {
      const { data } = canvas.width > 0 ? canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height) : { data: [] };
      for (let i = 0; i < data.length; i += 4) {
        wanted.forEach((colour, k) => {
          if ([0, 1, 2, 3].every((c) => Math.abs(data[i + c] - colour[c]) < 24)) counts[k] += 1;
        });
      }
    }
    return counts.every((count) => count >= 100);
  };
  return page.waitForFunction(isInked, [selector, names]);
}

const idle = (page) => page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });

test('several variants are drawn at once, named in the legend, with their errors, and can be taken away', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.getByRole('button', { name: 'Variants' }).click();
  await page.getByLabel('Draw triad too').check();
  await page.getByLabel('Draw ekf model too').check();
  await page.locator('[data-view="1"][data-drawn~="orientation@triad"][data-drawn~="orientation@ekf_model"]').waitFor({ state: 'attached', timeout: 60_000 });
  const legend = page.locator('.lane', { has: page.getByRole('heading', { name: 'Roll' }) }).locator('.legend-entry:visible');
  const names = (await legend.allTextContents()).join('|');
  for (const name of ['estimate, robust', 'triad', 'ekf model']) assert.ok(names.includes(name), `${name} in ${names}`);
  const error = async (variant) => Number(await page.locator(`.variant-menu [data-variant="${variant}"] td.number`).first().textContent());
  const rolls = await Promise.all(['robust', 'triad', 'ekf_model'].map(error));
  assert.ok(rolls.every((e) => e > 0) && new Set(rolls).size === 3, `each variant has an error of its own: ${rolls}`);
  await page.getByLabel('Draw triad too').uncheck();
  await page.waitForFunction(() => !document.querySelector('[data-view="1"]').dataset.drawn.includes('triad'));
  assert.ok(!(await legend.allTextContents()).join('|').includes('triad'));
  await page.getByLabel('Take ekf model as the estimate').check();
  await idle(page);
  const alone = (await legend.allTextContents()).join('|');
  assert.ok(!/robust|ekf model/.test(alone), `a variant that has become the estimate is not drawn twice: ${alone}`);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a variant with a gate shows under the attitude what it made of the field, and why at the cursor', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await choose(page, 'truss_bridge');
  await shows(page, 'Truss');
  await idle(page);
  const lane = page.locator('.gate-lane');
  await lane.waitFor({ timeout: 60_000 });
  for (const [variant, hasGate] of [['switch', false], ['robust', true]]) {
    await page.getByRole('button', { name: 'Variants' }).click();
    await page.getByLabel(`Take ${variant} as the estimate`, { exact: true }).check();
    await page.keyboard.press('Escape');
    await lane.waitFor({ state: hasGate ? 'visible' : 'hidden', timeout: 60_000 });
    await idle(page);
  }
  const box = await page.locator('.gate-lane .time-area').boundingBox();
  // Before the bridge, and in the tunnel.
  for (const [share, said] of [[0.03, /^used/], [0.58, /^left out: strength, [+−]\d/]]) {
    await page.mouse.move(box.x + box.width * share, box.y + 5);
    const now = await lane.locator('.now').evaluateHandle((element) => element);
    await page.waitForFunction(([element, pattern]) => new RegExp(pattern).test(element.textContent), [now, said.source]);
  }
  assert.equal(await page.locator('[data-view="1"] .view-note:visible').count(), 0, 'a gate at work is no trouble');
  assert.deepEqual(errors, []);
  await context.close();
});

test('iron in the car is said unasked, calibrated with one button, and undone', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'iron_circles.json', text: ironCircles() }]);
  const warning = page.locator('.compass-warning');
  await warning.waitFor({ timeout: 60_000 });
  assert.match(await warning.textContent(), /needs calibrating/);
  await idle(page);
  const [raw] = await yawErrors(page);
  await warning.getByRole('button').click();
  const dialog = page.getByRole('dialog', { name: 'Compass doctor' });
  await page.locator('.compass[data-state="possible"]').waitFor();
  const [before, after] = await sectorRow(page, 'total');
  // What is left: the car leans in its circles, and the receiver's clock is known to 0.16 s, in which it turns by 2 deg.
  assert.ok(before > 20 && after < 5, `heading error ${before} to ${after} deg`);
  assert.equal(await page.locator('.sectors tbody tr').count(), 13);
  // Raw and calibrated readings, the Earth's field and the ellipse; strength and dip over the drive, beside the model's.
  await inked(page, '.compass .scatter', ['raw', 'estimate', 'truth', 'threshold']);
  for (const lane of [1, 2]) await inked(page, `.compass .field-plots .plot:nth-of-type(${2 * lane})`, ['raw', 'estimate', 'truth']);
  await dialog.getByRole('button', { name: 'Apply the calibration' }).click();
  await page.locator('.compass[data-state="applied"]').waitFor();
  await idle(page);
  assert.equal(await dialog.getByRole('button', { name: 'Undo the calibration' }).evaluate((e) => e === document.activeElement), true);
  await page.keyboard.press('Escape');
  assert.equal(await warning.isVisible(), false);
  const [was, now] = await yawErrors(page);
  assert.ok(raw > 10 && was === raw && now < 1, `yaw error ${raw}, then ${was} to ${now} deg`);
  await page.locator('.compass-button').click();
  await dialog.getByRole('button', { name: 'Undo the calibration' }).click();
  await page.locator('.compass[data-state="possible"]').waitFor();
  await idle(page);
  const again = await yawErrors(page);
  assert.equal(again[1], raw, 'undo brings the readings back exactly');
  assert.equal(await warning.isVisible(), true);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a saved calibration can be opened on another drive of the car', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'iron_circles.json', text: ironCircles() }]);
  await page.locator('.compass-warning').getByRole('button').click();
  await page.locator('.compass[data-state="possible"]').waitFor();
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Save it' }).click()]);
  const text = readFileSync(await download.path(), 'utf8');
  assert.equal(JSON.parse(text).offset.length, 3);
  await page.keyboard.press('Escape');
  await drop(page, [{ name: 'other_circles.json', text: ironCircles().replace('iron_circles', 'other_circles') }]);
  await shows(page, 'other_circles');
  await idle(page);
  await page.locator('.compass-warning').waitFor();
  await drop(page, [{ name: 'calibration.json', text }]);
  await page.locator('.compass[data-state="applied"]').waitFor({ state: 'attached' });
  await page.locator('.compass-warning').waitFor({ state: 'hidden' });
  await drop(page, [{ name: 'calibration.json', text: text.replace('"version": 1', '"version": 9') }]);
  await page.locator('.error-banner').getByText('version').waitFor();
  assert.equal(await page.locator('.compass').getAttribute('data-state'), 'applied', 'one that cannot be read damages nothing');
  assert.deepEqual(errors, []);
  await context.close();
});

test('a drive that hardly turns is refused with the reason', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv() }]);
  await shows(page, 'bend.csv');
  await idle(page);
  await page.locator('.compass-button').click();
  await page.locator('.compass[data-state="refused"]').waitFor();
  assert.match(await page.locator('.compass .refusal').textContent(), /cannot be calibrated from this drive: .* of 12 sectors/);
  assert.equal(await page.getByRole('button', { name: 'Apply the calibration' }).isDisabled(), true);
  assert.deepEqual(errors, []);
  await context.close();
});

const CIRCLES = fileURLToPath(new URL('../../../shared/data/vn100_circles/', import.meta.url));

/** The first car's two files as one: the rows of both, of the columns that are used. */
function firstCar() {
  const columns = ['t', 'gyro_x', 'gyro_y', 'gyro_z', 'acc_x', 'acc_y', 'acc_z', 'mag_x', 'mag_y', 'mag_z', 'latitude', 'longitude', 'altitude'];
  const rows = ['circle_data_0_imu.csv', 'circle_data_0_gps.csv'].flatMap((name) => {
    const [head, ...lines] = readFileSync(CIRCLES + name, 'utf8').split('\n');
    const names = head.trim().split(',');
    return lines.filter((line) => /^\d/.test(line)).map((line) => {
      const cells = line.split(',');
      return columns.map((c) => (names.includes(c) ? cells[names.indexOf(c)] : ''));
    });
  });
  rows.sort((a, b) => Number(a[0]) - Number(b[0]));
  return [columns, ...rows].map((row) => row.join(',')).join('\n');
}

test('a real car in circles: its sensor looks backwards, and its heading follows the course once calibrated', async () => {
  if (!existsSync(CIRCLES)) {
    console.log('SKIPPED: the recorded circles are not on this machine');
    return;
  }
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'circles.csv', text: firstCar() }]);
  await page.locator('.compass-warning').getByRole('button').click();
  await page.locator('.compass[data-state="possible"]').waitFor();
  const [before, after] = await sectorRow(page, 'total');
  assert.ok(before > 40 && after < 6, `heading error ${before} to ${after} deg`);
  assert.match(await page.locator('.compass .options').textContent(), /turn the sensor by its mount’s 17\d°/);
  await page.getByRole('button', { name: 'Apply the calibration' }).click();
  await page.locator('.compass[data-state="applied"]').waitFor();
  await page.locator('.compass-warning').waitFor({ state: 'hidden' });
  assert.match(await page.locator('.compass .facts').textContent(), /Mount’s yaw−?0\.\d°/);
  assert.deepEqual(errors, []);
  await context.close();
});
