/** The closed loops: driven in the page, compared, tuned, and the page stays accessible. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { axePath, estimated, open, staged } from './support.mjs';

const stage = staged();

/** The number of a figure in the table of results. */
function figure(page, name, column = 0) {
  return page.locator('.loops .figures tr', { has: page.getByRole('rowheader', { name }) }).locator('td').nth(column).textContent().then(Number);
}

test('a J-turn is driven with and without control, a slider drives it again, and undo brings it back', async () => {
  const { page, context, errors, requests } = await open(stage.browser, stage.url);
  await estimated(page);
  assert.ok(!requests.some((url) => url.includes('gallery')), 'nothing of the loops is loaded before they are opened');
  await page.getByRole('button', { name: 'Control', exact: true }).click();
  const dialog = page.getByRole('dialog', { name: 'Closed loops' });
  await dialog.getByLabel('Closed loop', { exact: true }).selectOption('j_turn');
  await page.locator('.loops[data-driven="j_turn"]').waitFor({ timeout: 30_000 });
  await dialog.getByRole('radio', { name: 'Control off' }).check({ force: true });
  await dialog.getByRole('columnheader', { name: 'compared' }).waitFor();
  // Figure 7 of Yun and Yu: the controller holds 0.15 g where the car alone reaches 0.2 g.
  assert.ok(Math.abs((await figure(page, /Largest lateral acceleration/)) - 0.15) < 0.002);
  assert.ok(Math.abs((await figure(page, /Largest lateral acceleration/, 1)) - 0.2) < 0.003);
  assert.ok(await dialog.locator('[data-trace="brakes"]').isVisible(), 'brakes are at work');
  // No ring, no path, no obstacle; the place is known exactly.
  assert.deepEqual(await dialog.locator('.loop-keys .key').allTextContents(), ['driven', 'compared']);

  await dialog.getByRole('slider', { name: 'lateral limit' }).focus();
  for (let i = 0; i < 5; i++) await page.keyboard.press('PageDown');
  await page.waitForFunction(() => Number([...document.querySelectorAll('.loops .figures tr')].find((r) => /Largest lateral/.test(r.textContent))?.querySelector('td').textContent) < 0.13);
  for (let i = 0; i < 5; i++) await page.keyboard.press('Control+z');
  await page.waitForFunction(() => Math.abs(Number([...document.querySelectorAll('.loops .figures tr')].find((r) => /Largest lateral/.test(r.textContent))?.querySelector('td').textContent) - 0.15) < 0.002);
  assert.deepEqual(errors, []);
  await context.close();
});

test('the obstacle course passes the post, says so at the instant, and has no serious violation of accessibility', async () => {
  for (const colorScheme of ['light', 'dark']) {
    const { page, context, errors } = await open(stage.browser, stage.url, { colorScheme, bypassCSP: true });
    await estimated(page);
    await page.locator('.overview').focus();
    await page.keyboard.press('c');
    await page.locator('.loops[data-driven="obstacle_course"]').waitFor({ timeout: 30_000 });
    assert.ok((await figure(page, /Least distance to an obstacle/)) > 0.5);
    await page.getByRole('slider', { name: 'Time', exact: true }).fill('190');
    assert.equal(await page.locator('.loops .map-readout').textContent(), 'round an obstacle');
    const keys = await page.locator('.loop-keys .key').allTextContents();
    for (const key of ['as known', 'path', 'obstacle', 'ultrasonic ring', 'chosen direction']) assert.ok(keys.includes(key), `${key} of ${keys}`);
    await page.addScriptTag({ path: axePath });
    const { violations } = await page.evaluate(() => globalThis.axe.run('dialog.loops'));
    const serious = violations.filter((v) => ['serious', 'critical'].includes(v.impact));
    assert.deepEqual(serious.map((v) => [v.id, v.nodes.map((n) => n.html.slice(0, 100))]), []);
    assert.deepEqual(errors, []);
    await context.close();
  }
});
