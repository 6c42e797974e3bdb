/** Road and forces: three angles in one plot, what can be known, corrections, figures, the road's profile, and plots over distance. */

import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { axePath, bendCsv, drop, open, shows, staged } from './support.mjs';

const stage = staged();

const RAV4 = fileURLToPath(new URL('../../../shared/data/comma2k19_rav4/canonical.csv', import.meta.url));

/** The road room has drawn its estimates and nothing is under way. */
async function drawn(page) {
  await page.locator('[data-view="road-slope"][data-drawn~="slope"]').waitFor({ state: 'attached', timeout: 60_000 });
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
  await page.locator('[data-view="road-profile"][data-drawn~="slope"]').waitFor({ state: 'attached', timeout: 60_000 });
}

/** The correlation and the two RMS, deg, that stand with the plot. */
async function score(page) {
  const text = (await page.locator('.grade-score').textContent()).replaceAll('−', '-');
  return text.match(/[0-9.]+/g).map(Number);
}

/** Laps of a circle of 60 m radius at 12 m/s with hills; the wheels come late and the forward accelerometer is off. */
function hillsCsv(late = 0.05, offset = -0.5) {
  const rate = 50;
  const [lat0, lon0, radius] = [0.82, 0.15, 60];
  const net = (t) => 1.2 * Math.sin(0.7 * t) + 0.8 * Math.sin(1.9 * t + 1);
  const speed = (t) => 12 - (1.2 / 0.7) * Math.cos(0.7 * t) - (0.8 / 1.9) * Math.cos(1.9 * t + 1);
  const rows = ['t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,speed,gnss_lat,gnss_lon,gnss_alt,truth_grade'];
  let [along, height] = [0, 100];
  for (let i = 0; i <= 120 * rate; i++) {
    const t = i / rate;
    const grade = 0.04 * Math.sin(along / radius);
    const v = speed(t);
    const noise = 0.03 * Math.sin(i * 1.7 + (i % 13));
    const cells = [t, net(t) + 9.80665 * Math.sin(grade) + offset + noise, (v * v) / radius, -9.80665, 0, 0, v / radius, speed(t - late)];
    const [north, east] = [radius * Math.sin(along / radius), radius * (1 - Math.cos(along / radius))];
    const fix = i % 10 === 0
      ? [((lat0 + north / 6.37e6) * 180) / Math.PI, ((lon0 + east / (6.37e6 * Math.cos(lat0))) * 180) / Math.PI, height]
      : ['', '', ''];
    rows.push([...cells.map((c) => c.toFixed(6)), ...fix.map((c) => (c === '' ? '' : c.toFixed(9))), grade.toFixed(6)].join(','));
    along += v / rate;
    height += (v * Math.sin(grade)) / rate;
  }
  return `${rows.join('\n')}\n`;
}

test('slope, grade and body pitch share one plot, whose unit is per cent or degrees', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=slope_speedbump&room=road`);
  await drawn(page);
  const view = page.locator('[data-view="road-slope"]');
  assert.equal(await view.locator('.lane').count(), 1);
  for (const name of ['road grade', 'slope of the body', 'body pitch']) {
    await view.locator('.legend-entry', { hasText: new RegExp(`^${name}.*±`) }).waitFor();
  }
  assert.equal(await view.locator('.lane-unit').textContent(), '%');
  await page.getByRole('button', { name: 'Display' }).click();
  await page.getByRole('radio', { name: 'as an angle' }).check();
  assert.equal(await view.locator('.lane-unit').textContent(), '°');
  assert.match(await page.locator('[data-view="road-forces"] .lane-note').textContent(), /not a tyre’s force/);
  assert.deepEqual(errors, []);
  await context.close();
});

test('the figures of table 3 are those of what is shown, or of the whole drive', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=slope_speedbump&room=road`);
  await drawn(page);
  const rows = async () => {
    const texts = await page.locator('.figures tbody tr:not(.paper)').evaluateAll((all) => all.map((row) => [...row.cells].map((c) => c.textContent.replace('−', '-'))));
    return Object.fromEntries(texts.map(([name, ...cells]) => [name, cells.map(Number)]));
  };
  await page.waitForFunction(() => document.querySelectorAll('.figures tbody tr').length === 5);
  const whole = await rows();
  // The paper's order: the estimate has less noise than the sensor, and smaller extremes.
  assert.ok(whole.estimated[0] < whole.measured[0] && whole.estimated[1] > whole.measured[1] && whole.estimated[2] < whole.measured[2], JSON.stringify(whole));
  assert.match(await page.locator('.figures .paper').first().textContent(), /0\.772−2\.1002\.340/);
  await page.keyboard.press('+');
  await page.waitForFunction(() => !document.querySelector('.figures caption').textContent.includes('whole'));
  assert.notDeepEqual(await rows(), whole);
  await page.getByLabel('of the whole drive').check();
  await page.waitForFunction(() => document.querySelector('.figures caption').textContent.includes('whole'));
  assert.deepEqual(await rows(), whole);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a lamp goes out where a standing car cannot tell the grade, and says why', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=city_hills&room=road`);
  await drawn(page);
  const lamp = (name) => page.locator('.known', { hasText: name });
  await page.locator('.known[data-state="out"]', { hasText: 'road grade' }).waitFor();
  assert.match(await page.locator('.lamp-why').textContent(), /road grade, accelerometer bias; a standing car cannot tell/);
  assert.equal(await lamp('altitude').getAttribute('data-state'), 'lit');
  // Under way it is lit.
  await page.locator('[data-view="road-slope"] .time-area').first().click({ position: { x: 60, y: 20 } });
  await page.locator('.known[data-state="lit"]', { hasText: 'road grade' }).waitFor();
  assert.equal(await page.locator('.lamp-why').textContent(), '');
  assert.deepEqual(errors, []);
  await context.close();
});

test('late wheels and an offset are found, offered, corrected by one button, and taken back by undo', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=slope_speedbump&room=road`);
  await drawn(page);
  await drop(page, [{ name: 'hills.csv', text: hillsCsv() }]);
  await shows(page, 'hills.csv');
  await drawn(page);
  const panel = page.locator('.offers');
  await panel.getByText(/comes \d+ ms/).waitFor();
  const delay = Number(/comes (\d+) ms/.exec(await panel.textContent())[1]);
  assert.ok(Math.abs(delay - 50) <= 10, `${delay} ms`);
  const before = await score(page);
  await panel.getByRole('button', { name: 'Apply all' }).click();
  await page.waitForFunction(() => location.hash.includes('slope.two_way=true'));
  const applied = new URLSearchParams(new URL(page.url()).hash.slice(1));
  assert.ok(Math.abs(Number(applied.get('slope.wheel_latency')) - 0.05) <= 0.01, page.url());
  assert.ok(Math.abs(Number(applied.get('slope.accel_offset')) + 0.5) <= 0.05, page.url());
  await page.waitForFunction((old) => document.querySelector('.grade-score').textContent !== old, await page.locator('.grade-score').textContent()).catch(() => undefined);
  await drawn(page);
  const after = await score(page);
  assert.ok(after[0] > before[0] && after[2] < 0.5 * before[2], `${before} then ${after}`);
  await page.keyboard.press('Control+z');
  await page.waitForFunction(() => !location.hash.includes('slope.'));
  assert.deepEqual(errors, []);
  await context.close();
});

test('the profile merges the laps of one drive and the passes of two, and is saved for tables and maps', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=slope_speedbump&room=road`);
  await drawn(page);
  const note = page.locator('.profile-note');
  const saved = async (name) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name, exact: true }).click()]);
    return { name: download.suggestedFilename(), text: readFileSync(await download.path(), 'utf8') };
  };
  await drop(page, [{ name: 'hills.csv', text: hillsCsv(0, 0) }]);
  await shows(page, 'hills.csv');
  await drawn(page);
  // 120 s at 12 m/s round 377 m.
  await note.getByText(/1\.4\d km, in 4 laps, merged from up to 4 passes/).waitFor();

  for (const [name, seconds] of [['first.csv', 40], ['second.csv', 40]]) {
    await drop(page, [{ name, text: bendCsv(seconds) }]);
    await shows(page, name);
    await drawn(page);
    if (name === 'first.csv') {
      await note.getByText('one pass').waitFor();
      await page.getByRole('button', { name: 'Keep this pass' }).click();
      await note.getByText('This pass is kept.').waitFor();
    }
  }
  await note.getByText(/merged from up to 2 passes.*Merged with first\.csv/).waitFor();
  const csv = await saved('CSV');
  const [head, ...lines] = csv.text.trim().split('\n');
  assert.equal(head, 'distance,grade,grade_sigma,altitude,altitude_sigma,passes,gnss_lat,gnss_lon');
  assert.equal(csv.name, 'second_profile.csv');
  assert.ok(lines.length > 80 && lines.some((line) => line.split(',')[5] === '2'), `${lines.length} points`);
  const map = await saved('GeoJSON');
  assert.equal(map.name, 'second_profile.geojson');
  const json = JSON.parse(map.text);
  assert.equal(json.type, 'FeatureCollection');
  assert.equal(json.features[0].properties.passes, 2);

  await page.locator('[data-view="road-profile"]').getByRole('button', { name: /Show as table/ }).click();
  await page.locator('[data-view="road-profile"] .table-panel caption', { hasText: '100 rows' }).waitFor();
  await page.getByRole('button', { name: 'Forget passes' }).click();
  await note.getByText('one pass').waitFor();
  assert.deepEqual(errors, []);
  await context.close();
});

test('plots stand over distance: cursor, zoom and table go along, standing breaks nothing, the address keeps it', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=city_hills&room=road`);
  await drawn(page);
  const readout = () => page.locator('.transport .time').textContent();
  const kilometres = async () => Number(/([0-9.]+) km/.exec(await readout())[1]);
  await page.keyboard.press('x');
  await page.waitForFunction(() => /\d m$/.test(document.querySelector('.transport .time').textContent));
  assert.match(page.url(), /over=distance/);
  assert.equal(await page.getByLabel('What plots are drawn over').inputValue(), 'distance');
  await page.keyboard.press('End');
  const whole = await kilometres();
  const endTime = await readout();
  const area = page.locator('[data-view="road-slope"] .time-area').first();
  const box = await area.boundingBox();
  await page.mouse.click(box.x + box.width / 2, box.y + 20);
  assert.ok(Math.abs((await kilometres()) - whole / 2) < 0.02 * whole, `${await readout()} of ${endTime}`);

  // What is dragged over is a stretch of the way: a quarter of it.
  await page.mouse.move(box.x + 0.5 * box.width, box.y + 20);
  await page.mouse.down();
  await page.mouse.move(box.x + 0.75 * box.width, box.y + 20, { steps: 4 });
  await page.mouse.up();
  const view = page.locator('[data-view="road-slope"]');
  await view.getByRole('button', { name: /Show as table/ }).click();
  await view.locator('.table-panel thead', { hasText: 'Distance [m]' }).waitFor();
  const places = await view.locator('.table-panel tbody tr td:nth-child(2)').allTextContents();
  const metres = places.map((text) => Number(text.replace('−', '-')));
  assert.ok(metres.every((m, i) => i === 0 || m > metres[i - 1]));
  const [first, last] = [metres[0] / 1000 / whole, metres[metres.length - 1] / 1000 / whole];
  assert.ok(Math.abs(first - 0.5) < 0.02 && Math.abs(last - 0.75) < 0.02, `${first} to ${last}`);

  await page.keyboard.press('0');
  await page.keyboard.press('x');
  await page.waitForFunction(() => !document.querySelector('.transport .time').textContent.includes('km'));
  assert.doesNotMatch(page.url(), /over=/);
  assert.deepEqual(errors, []);
  await context.close();
});

test('the room passes the accessibility checks on a phone and on a wide screen', async () => {
  for (const viewport of [{ width: 390, height: 844 }, { width: 1440, height: 900 }]) {
    const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=city_hills&room=road`, { viewport, bypassCSP: true });
    await drawn(page);
    await page.locator('.offers summary').click();
    await page.addScriptTag({ path: axePath });
    const found = await page.evaluate(() => globalThis.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa'] }));
    assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.target.join(' ')).join(', ')}`), []);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), true, 'nothing sticks out');
    assert.deepEqual(errors, []);
    await context.close();
  }
});

test('a real drive reaches its grade by what it offers itself', { skip: !existsSync(RAV4) && 'SKIPPED: no recorded drives here' }, async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#drive=slope_speedbump&room=road`);
  await drawn(page);
  await drop(page, [{ name: 'rav4.csv', text: readFileSync(RAV4, 'utf8') }]);
  await shows(page, 'rav4.csv');
  await drawn(page);
  const button = page.getByRole('button', { name: 'Apply all' });
  await button.waitFor();
  const shown = await page.locator('.grade-score').textContent();
  await button.click();
  await page.waitForFunction((old) => document.querySelector('.grade-score').textContent !== old, shown);
  const [correlation, centred, rms] = await score(page);
  assert.ok(correlation >= 0.97 && centred <= 0.45 && rms <= 0.45, `${correlation}, ${centred} deg, ${rms} deg`);
  assert.deepEqual(errors, []);
  await context.close();
});
