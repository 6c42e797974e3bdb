/** The room of navigation: errors with the smoothed run beside them, sensors blinded, the sweep, faults, refused fixes. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { axePath, bendCsv, drop, open, staged } from './support.mjs';

const stage = staged();
const view = (page, name) => page.locator(`[data-view="navigation-${name}"]`);

/** Enter the room and wait until the filter and the smoothed run are drawn. */
async function enter(options = {}, hash = 'room=navigation') {
  const opened = await open(stage.browser, `${stage.url}#${hash}`, options);
  await opened.page.locator('[data-view="navigation-errors"][data-drawn~="gnss_ins@smooth"]').waitFor({ timeout: 90_000 });
  await idle(opened.page);
  return opened;
}

const idle = (page) => page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });

/** Drag over a row of the brush, from one share of the shown time to another. */
async function brush(page, row, from, to) {
  await page.locator('.brush').scrollIntoViewIfNeeded();
  const box = await page.locator('.brush canvas').boundingBox();
  const at = (share) => [box.x + 54 + share * (box.width - 74), box.y + 26 * row + 13];
  await page.mouse.move(...at(from));
  await page.mouse.down();
  await page.mouse.move(...at((from + to) / 2), { steps: 3 });
  await page.mouse.move(...at(to), { steps: 3 });
  await page.mouse.up();
}

const drifts = (page, count) => page.locator(`[data-view="navigation-outages"][data-drifts="${count}"]`).waitFor({ timeout: 60_000 });
const rows = (page) => page.locator('.drift-table tbody tr').allTextContents();

test('errors of filter and smoother stand beside each other, and the states are one choice away', async () => {
  const { page, context, errors } = await enter();
  await page.locator('.overview').focus();
  await page.keyboard.press('Shift+ArrowRight');
  await page.keyboard.press('Shift+ArrowRight');
  const legend = view(page, 'errors').locator('.lane', { has: page.getByRole('heading', { name: 'North' }) });
  for (const name of ['filter', 'smoothed']) {
    const value = legend.locator('.legend-entry', { hasText: name }).locator('.value');
    await page.waitForFunction((e) => /[0-9] ±[0-9]/.test(e.textContent), await value.elementHandle());
  }
  // A slowly changing state is told to two digits of its error: not 0.00 ±0.01.
  const slow = view(page, 'measurements').locator('.lane', { has: page.getByLabel('Slowly changing state') }).filter({ visible: true }).locator('.legend-entry', { hasText: 'estimate' }).locator('.value');
  await page.waitForFunction((e) => /±0\.0*[1-9][0-9]/.test(e.textContent), await slow.elementHandle());
  await view(page, 'errors').locator('input[value="states"]').check();
  await view(page, 'states').locator('.legend-entry', { hasText: 'truth' }).first().waitFor();
  assert.equal(await view(page, 'errors').isVisible(), false);
  assert.equal(await page.evaluate(() => document.activeElement?.value), 'states', 'the choice keeps the focus');
  assert.equal(await page.locator('.trajectory .legend-entry', { hasText: 'smoothed' }).isVisible(), true);

  await page.getByRole('tab', { name: 'Overview' }).click();
  await page.locator('.trajectory .legend-entry', { hasText: 'smoothed' }).waitFor({ state: 'hidden' });
  assert.deepEqual(errors, []);
  await context.close();
});

test('a drag blinds a sensor, the table tells the drift, windows move, resize, join and go, and all of it can be undone', async () => {
  const { page, context, errors } = await enter();
  await brush(page, 0, 0.4, 0.5);
  await drifts(page, 1);
  const [row] = await rows(page);
  assert.match(row, /^GNSS.* m.*[0-9.]+ m \([0-9.]+ %\)/);
  await page.locator('.trajectory .legend-entry', { hasText: 'blinded' }).waitFor();
  const field = (end) => page.locator(`[data-field="gnss-${end}"]`).inputValue();
  const seconds = (text) => text.split(':').reduce((sum, part) => 60 * sum + Number(part), 0);
  const length = async () => seconds(await field('t1')) - seconds(await field('t0'));
  const [start, before] = [seconds(await field('t0')), await length()];

  const changes = (end, was) => page.waitForFunction(([name, old]) => document.querySelector(`[data-field="gnss-${name}"]`)?.value !== old, [end, was]);
  const first = [await field('t0'), await field('t1')];
  await brush(page, 0, 0.45, 0.5);
  await changes('t0', first[0]);
  const second = await field('t1');
  assert.ok(Math.abs((await length()) - before) < 0.2, 'its middle moves it');
  assert.ok(seconds(await field('t0')) > start + 20);
  await brush(page, 0, 0.55, 0.6);
  await changes('t1', second);
  assert.ok((await length()) > before + 20, 'its end makes it longer');

  await brush(page, 2, 0.5, 0.6);
  await page.waitForFunction(() => document.querySelectorAll('.drift-table tbody tr').length === 2);
  await drifts(page, 2);
  const [blindBoth] = await rows(page);
  assert.match(blindBoth, / m/);
  const undo = page.getByRole('button', { name: 'Undo the last window' });
  for (let i = 0; i < 4; i++) await undo.click();
  await page.waitForFunction(() => document.querySelectorAll('.drift-table tbody tr').length === 0);
  assert.equal(await undo.isDisabled(), true);
  await page.locator('.trajectory .legend-entry', { hasText: 'blinded' }).waitFor({ state: 'hidden' });
  await page.getByRole('button', { name: 'Redo the window' }).click();
  await drifts(page, 1);
  await page.getByRole('button', { name: /^Remove GNSS/ }).click();
  await page.waitForFunction(() => document.querySelectorAll('.drift-table tbody tr').length === 0);
  assert.deepEqual(errors, []);
  await context.close();
});

test('windows are put in and changed from the keyboard', async () => {
  const { page, context, errors } = await enter();
  const form = page.locator('.add-window');
  await form.getByLabel('From', { exact: true }).fill('3:20');
  await form.getByLabel('To', { exact: true }).fill('4:05');
  await form.getByLabel('To', { exact: true }).press('Enter');
  await drifts(page, 1);
  assert.match((await rows(page))[0], /GNSS/);
  const end = page.locator('[data-field="gnss-t1"]');
  assert.equal(await end.inputValue(), '4:05.0');
  await end.fill('4:20');
  await end.press('Tab');
  await page.waitForFunction(() => document.querySelector('[data-field="gnss-t1"]')?.value === '4:20.0');
  await end.fill('soon');
  await end.press('Tab');
  assert.equal(await end.inputValue(), '4:20.0', 'what is no time changes nothing');
  await form.getByLabel('From', { exact: true }).fill('5:00');
  await form.getByLabel('To', { exact: true }).fill('4:00');
  await form.getByRole('button', { name: 'Add' }).click();
  assert.equal((await rows(page)).length, 1, 'no window ends before it begins');
  assert.deepEqual(errors, []);
  await context.close();
});

test('the sweep shows where over the drive it hurts, can be stopped, and its worst window can be looked at', async () => {
  const { page, context, errors } = await enter();
  const sweep = page.locator('.sweep');
  await sweep.getByRole('button', { name: 'Sweep' }).click();
  await sweep.getByRole('button', { name: 'Stop' }).click();
  await sweep.getByText('Stopped.').waitFor();
  await sweep.getByLabel(/Step/).fill('60');
  await sweep.getByRole('button', { name: 'Sweep' }).click();
  await sweep.locator('.sweep-result table').waitFor({ timeout: 60_000 });
  const text = await sweep.locator('tbody').textContent();
  assert.match(text, /10 s.*30 s.*60 s/s);
  const [median, p95, largest] = (await sweep.locator('tbody tr').last().locator('td').allTextContents()).map((cell) => Number.parseFloat(cell));
  assert.ok(median > 0 && median <= p95 && p95 <= largest, `${median} ${p95} ${largest}`);
  await sweep.getByRole('button', { name: /Blind the worst window/ }).click();
  await drifts(page, 1);
  // Several windows share a run of the sweep, which leaves a little of one in the next.
  const cells = (await page.locator('.drift-table tbody tr td').allTextContents()).filter((cell) => cell.includes('%'));
  const end = Number.parseFloat(cells[cells.length - 1]);
  assert.ok(Math.abs(end - largest) < 0.25 * largest, `${end} m at the end of the worst window, ${largest} m in the sweep`);
  assert.deepEqual(errors, []);
  await context.close();
});

test('the sweep over the magnetometer tells how far the yaw goes off, and its worst window can be looked at', async () => {
  const { page, context, errors } = await enter();
  const sweep = page.locator('.sweep');
  await sweep.getByLabel('Sensor to blind').selectOption('mag');
  await sweep.getByLabel(/Step/).fill('100');
  await sweep.getByRole('button', { name: 'Sweep' }).click();
  await sweep.locator('.sweep-result table').waitFor({ timeout: 60_000 });
  assert.match(await sweep.locator('caption').textContent(), /^Magnet\. blind for 60 s.*yaw/);
  const cells = await sweep.locator('tbody tr').last().locator('td').allTextContents();
  for (const cell of cells) assert.match(cell, /^[0-9.]+ °$/);
  const [median, p95, largest] = cells.map((cell) => Number.parseFloat(cell));
  assert.ok(median > 0 && median <= p95 && p95 <= largest, cells.join());
  assert.match(await sweep.locator('.sweep-plot').getAttribute('aria-label'), /^Yaw gone off after 60 s blind, in °/);
  await sweep.getByRole('button', { name: /Blind the worst window/ }).click();
  await drifts(page, 1);
  assert.match((await rows(page))[0], /^Magnet\./);
  assert.deepEqual(errors, []);
  await context.close();
});

test('the statistics of ranges have their interval, which narrows with the satellites', async () => {
  const { page, context, errors } = await enter({}, 'drive=urban&room=navigation&gnss_ins.coupling=tight');
  const measurements = view(page, 'measurements');
  await page.locator('.overview').focus();
  for (let i = 0; i < 3; i++) await page.keyboard.press('Shift+ArrowRight');
  await measurements.locator('.lane-select').first().selectOption('range');
  const edge = async (label) => {
    const value = measurements.locator('.legend-entry', { hasText: label }).filter({ visible: true }).locator('.value');
    await page.waitForFunction((e) => /[0-9]/.test(e.textContent), await value.elementHandle());
    return Number(await value.textContent());
  };
  const [low, high] = [await edge(/^2.5 %/), await edge(/^97.5 %/)];
  // Chi-square over its degrees: 0.21 to 2.41 for 6 satellites, 0.42 to 1.82 for 15.
  assert.ok(low > 0.15 && low < 0.45 && high > 1.75 && high < 2.5, `${low} ${high}`);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a fault is proposed as a step, a place fails by metres, and a clock jump says what it needs', async () => {
  const { page, context, errors } = await enter({}, 'drive=u_drive&room=navigation');
  const faults = view(page, 'faults');
  const form = faults.locator('form');
  const seconds = (text) => text.split(':').reduce((sum, part) => 60 * sum + Number(part), 0);
  const [from, to] = [seconds(await form.getByLabel('from', { exact: true }).inputValue()), seconds(await form.getByLabel('to', { exact: true }).inputValue())];
  assert.ok(from > 10 && Math.abs(to - 2 * from) < 0.3, `${from} to ${to} s is the middle third`);
  assert.equal(await form.locator('option[value="clock_jump"]').isDisabled(), true);
  assert.match(await form.locator('option[value="clock_jump"]').getAttribute('title'), /ranges/);
  await faults.getByText(/A clock jump needs ranges/).waitFor();

  await page.locator('.add-window').getByLabel('From', { exact: true }).fill('0:20');
  await page.locator('.add-window').getByLabel('To', { exact: true }).fill('0:35');
  await page.locator('.add-window').getByRole('button', { name: 'Add' }).click();
  await page.waitForFunction(() => document.querySelector('.fault-form .time-field').value === '0:20.0');

  const amount = form.getByLabel(/Amount/);
  for (const [signal, words] of [['gnss_lat', /gnss_lat 10\.0 m, 0:20\.0 to 0:35\.0/], ['gnss_lon', /gnss_lon 10\.0 m/]]) {
    await form.getByLabel('Signal that fails').selectOption(signal);
    assert.equal(await amount.inputValue(), '10');
    assert.match(await amount.getAttribute('aria-label'), /in m$/);
    await form.getByRole('button', { name: 'Put it in' }).click();
    await faults.locator('li').getByText(words).waitFor();
  }
  await idle(page);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a fault is put in, seen in every room, makes results worse, and can be taken out again', async () => {
  const { page, context, errors } = await enter();
  const rmse = async () => Number(/position RMSE (?:[0-9.]+ → )?([0-9.]+)/.exec(await page.locator('.headline').textContent())[1]);
  const before = await rmse();
  const form = view(page, 'faults').locator('form');
  await form.getByLabel('Kind of fault').selectOption('multipath');
  await form.getByLabel(/Amount/).fill('60');
  await form.getByLabel('from', { exact: true }).fill('2:00');
  await form.getByLabel('to', { exact: true }).fill('5:00');
  await form.getByRole('button', { name: 'Put it in' }).click();
  await page.locator('.fault-sign').waitFor();
  assert.match(await page.locator('.fault-sign').textContent(), /A fault is in this drive/);
  assert.match(await view(page, 'faults').locator('li').textContent(), /Multipath 60.0 m, 2 satellites, 2:00.0 to 5:00.0/);
  await page.waitForFunction((was) => Number(/→ ([0-9.]+)/.exec(document.querySelector('.headline')?.textContent ?? '')?.[1] ?? was) !== was, before, { timeout: 60_000 });
  assert.ok((await rmse()) > before);
  await page.waitForFunction(() => Number(document.querySelector('.trajectory').dataset.rejected) > 3);
  await page.locator('.trajectory .legend-entry', { hasText: 'refused fixes' }).locator('.swatch.cross').waitFor();

  await page.getByRole('tab', { name: 'Overview' }).click();
  await page.locator('.fault-sign').getByRole('button', { name: 'Take all out' }).click();
  await page.locator('.fault-sign').waitFor({ state: 'hidden' });
  await idle(page);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a log without truth shows states, and its drift is that against the run that sees', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#room=navigation`);
  await idle(page);
  await drop(page, [{ name: 'bend.csv', text: bendCsv(90) }]);
  await page.locator('[data-view="navigation-states"][data-drawn~="gnss_ins@smooth"]').waitFor({ timeout: 60_000 });
  assert.equal(await view(page, 'errors').isVisible(), false);
  assert.equal(await view(page, 'states').locator('input[value="errors"]').isDisabled(), true);
  await brush(page, 0, 0.4, 0.7);
  await drifts(page, 1);
  assert.match(await view(page, 'outages').textContent(), /no truth: against the run that sees everything/);
  assert.match((await rows(page))[0], /[0-9.]+ m \([0-9.]+ %\)/);
  await brush(page, 1, 0.4, 0.7);
  await page.waitForFunction(() => document.querySelectorAll('.drift-table tbody tr').length === 2);
  await page.locator('[data-view="navigation-states"][data-drawn~="orientation@blind"]').waitFor({ timeout: 60_000 });
  await drifts(page, 2);
  // The same window of two sensors: each row tells its own drift.
  const [satellites, compass] = await rows(page);
  assert.match(compass, /^Magnet\./);
  assert.doesNotMatch(compass, /%/);
  assert.match(satellites, /%/);
  assert.deepEqual(errors, []);
  await context.close();
});

for (const [name, options] of [['wide and light', { colorScheme: 'light' }], ['a phone, dark', { colorScheme: 'dark', viewport: { width: 390, height: 844 } }]]) {
  test(`${name}: a checker of accessibility finds nothing, with a window and a fault`, async () => {
    const { page, context } = await enter({ bypassCSP: true, ...options });
    await page.locator('.add-window').getByRole('button', { name: 'Add' }).click();
    await drifts(page, 1);
    await view(page, 'faults').locator('form').getByRole('button', { name: 'Put it in' }).click();
    await page.locator('.fault-sign').waitFor();
    await page.addScriptTag({ path: axePath });
    const found = await page.evaluate(async () => (await globalThis.axe.run()).violations.filter((v) => v.impact === 'serious' || v.impact === 'critical').map((v) => `${v.id}: ${v.nodes.map((n) => n.target.join(' ')).join(', ')}`));
    assert.deepEqual(found, []);
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    assert.ok(overflow <= 0, `${overflow} px too wide`);
    await context.close();
  });
}

test('the code of the room is not loaded before it is entered', async () => {
  const { page, context, requests } = await open(stage.browser, stage.url);
  await idle(page);
  assert.deepEqual(requests.filter((url) => /\/room-/.test(url)), []);
  await page.getByRole('tab', { name: 'Navigation' }).click();
  await view(page, 'errors').waitFor();
  assert.ok(requests.some((url) => /\/room-/.test(url)));
  await context.close();
});
