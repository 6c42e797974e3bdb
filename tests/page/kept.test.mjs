/** What outlives the page it was made in: variants in a shared link, and a calibration when its log is read anew. */

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { drop, estimated, open, openDrive, shows, staged } from './support.mjs';

const stage = staged();

const idle = (page) => page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
const drawn = (page, variant) => page.locator(`[data-view="1"][data-drawn~="orientation@${variant}"]`).waitFor({ state: 'attached', timeout: 60_000 });
const box = (page, name) => page.getByLabel(`Draw ${name} too`);
/** The legend of roll, without what the estimate was before it was chosen. */
const legend = async (page) => {
  const entries = await page.locator('.lane', { has: page.getByRole('heading', { name: 'Roll' }) }).locator('.legend-entry:visible').allTextContents();
  return entries.filter((entry) => !entry.startsWith('before'));
};
/** The printed errors of a variant: roll, pitch, yaw. */
const rmse = (page, variant) => page.locator(`.variant-menu [data-variant="${variant}"] td.number`).allTextContents();

test('a link brings back the variants that are drawn beside the estimate, with their errors, for whoever opens it', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.getByRole('button', { name: 'Variants' }).click();
  await page.getByLabel('Take road as the estimate').check();
  await box(page, 'triad').check();
  await box(page, 'robust ax').check();
  await drawn(page, 'triad');
  await drawn(page, 'robust_ax');
  await idle(page);
  const address = page.url();
  const [names, errorsThen] = [await legend(page), [await rmse(page, 'road'), await rmse(page, 'triad'), await rmse(page, 'robust_ax')]];
  assert.ok(errorsThen.flat().length === 9 && errorsThen.flat().every((e) => Number(e) > 0), `${errorsThen}`);
  await context.close();

  const again = await open(stage.browser, address);
  await estimated(again.page);
  await drawn(again.page, 'triad');
  await drawn(again.page, 'robust_ax');
  await idle(again.page);
  assert.deepEqual(await legend(again.page), names);
  await again.page.getByRole('button', { name: 'Variants' }).click();
  assert.equal(await again.page.getByLabel('Take road as the estimate').isChecked(), true);
  for (const [name, isDrawn] of [['triad', true], ['robust ax', true], ['switch', false]]) assert.equal(await box(again.page, name).isChecked(), isDrawn, name);
  assert.deepEqual([await rmse(again.page, 'road'), await rmse(again.page, 'triad'), await rmse(again.page, 'robust_ax')], errorsThen, 'the same curves, to the digit');

  // One that is taken away leaves the link too, and a link typed in by hand draws what it names, unknown ones left out.
  await box(again.page, 'triad').uncheck();
  await again.page.waitForFunction(() => location.hash.includes('overlays=robust_ax'));
  await again.page.evaluate(() => {
    location.hash = 'overlays=ekf_model+no_such_variant';
  });
  await drawn(again.page, 'ekf_model');
  await again.page.waitForFunction(() => !document.querySelector('[data-view="1"]').dataset.drawn.includes('robust_ax'));
  await again.page.waitForFunction(() => location.hash.endsWith('overlays=ekf_model'));
  assert.deepEqual([...errors, ...again.errors], []);
  await again.context.close();
});

/** Four circles and two straights on the level, 50 Hz, with an offset in the magnetometer; GNSS five times a second. */
function circlesCsv() {
  const [rate, lat0, lon0, deg] = [50, 0.82, 0.15, 180 / Math.PI];
  const rows = ['t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,mag_x,mag_y,mag_z,speed,steer,gnss_lat,gnss_lon,gnss_alt,gnss_vn,gnss_ve,gnss_vd'];
  let [north, east, yaw, speed] = [0, 0, 0.4, 4];
  for (let i = 0; i < 130 * rate; i++) {
    const t = i / rate;
    const turn = t < 12 || t > 122 ? 0 : t < 66 ? 0.25 : -0.25;
    const wave = (k) => 0.02 * Math.sin(k * 1.7 * i + k);
    const field = [21.4 * Math.cos(yaw) + 12, -21.4 * Math.sin(yaw) - 8, 43.3 + 5].map((f, k) => f + 10 * wave(7 + k));
    const cells = [t, wave(1), speed * turn + wave(2), -9.80665 + wave(3), wave(4) / 9, wave(5) / 9, turn + wave(6) / 9, ...field, speed, 2.6 * turn / speed];
    const fix = [(lat0 + north / 6.37e6) * deg, (lon0 + east / (6.37e6 * Math.cos(lat0))) * deg, 100, speed * Math.cos(yaw), speed * Math.sin(yaw), 0];
    rows.push([...cells.map((c) => c.toFixed(6)), ...(i % 10 === 0 ? fix.map((f) => f.toFixed(9)) : fix.map(() => ''))].join(','));
    north += (speed * Math.cos(yaw)) / rate;
    east += (speed * Math.sin(yaw)) / rate;
    yaw += turn / rate;
  }
  return `${rows.join('\n')}\n`;
}

/** What a menu's or dialog's button saves, as text. */
async function saved(page, click) {
  const [download] = await Promise.all([page.waitForEvent('download'), click()]);
  return readFileSync(await download.path(), 'utf8');
}

/** The estimates of orientation, as the page saves them. */
async function estimates(page) {
  await page.getByRole('button', { name: 'Export' }).click();
  return saved(page, () => page.getByRole('button', { name: /Orientation.*estimates \(CSV\)/ }).click());
}

/** Drop the log with a mapping under a name that tells the reading, and wait until it is estimated. */
async function readAnew(page, text, mapping) {
  await drop(page, [{ name: 'circles.csv', text }, { name: 'mapping.json', text: JSON.stringify(mapping) }]);
  await page.locator('.report').getByText('given by the mapping').first().waitFor();
  await page.keyboard.press('Escape');
  await idle(page);
}

test('an applied calibration holds when its log is read anew, and not when its sensor is read otherwise or the log is another', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  const text = circlesCsv();
  await drop(page, [{ name: 'circles.csv', text }]);
  await shows(page, 'circles.csv');
  const mapping = JSON.parse(await saved(page, () => page.getByRole('button', { name: 'Download this mapping' }).click()));
  await page.keyboard.press('Escape');
  const warning = page.locator('.compass-warning');
  await warning.waitFor({ timeout: 60_000 });
  await idle(page);
  const raw = await estimates(page);
  await warning.getByRole('button').click();
  await page.locator('.compass[data-state="possible"]').waitFor();
  await page.getByRole('button', { name: 'Apply the calibration' }).click();
  await page.locator('.compass[data-state="applied"]').waitFor();
  await page.keyboard.press('Escape');
  await idle(page);
  const calibrated = await estimates(page);
  assert.notEqual(calibrated, raw);

  // The steering is no input of orientation: read without it, the calibrated estimates are the same to the last digit.
  const { steer, ...others } = mapping.signals;
  assert.ok(steer);
  await readAnew(page, text, { ...mapping, signals: others });
  await page.locator('.compass[data-state="applied"]').waitFor({ state: 'attached' });
  await idle(page);
  assert.equal(await warning.isVisible(), false);
  assert.equal(await page.locator('.compass-button').textContent(), 'Compass, calibrated');
  assert.ok((await estimates(page)) === calibrated, 'the estimates are those of the calibrated field');

  // Forward and rightward axes of the magnetometer exchanged: what was applied is of another sensor.
  const { mag_x, mag_y } = mapping.signals;
  await readAnew(page, text, { ...mapping, signals: { ...others, mag_x: { ...mag_x, column: 'mag_y' }, mag_y: { ...mag_y, column: 'mag_x' } } });
  await warning.waitFor();
  assert.notEqual(await page.locator('.compass').getAttribute('data-state'), 'applied');

  // Back to the first reading it is not applied by itself: it was given up.
  await readAnew(page, text, mapping);
  await page.locator('.compass[data-state="possible"]').waitFor({ state: 'attached' });
  assert.ok((await estimates(page)) === raw, 'the estimates are those of the raw field');
  assert.equal(await openDrive(page).then((name) => name.includes('circles.csv')), true);
  assert.deepEqual(errors, []);
  await context.close();
});
