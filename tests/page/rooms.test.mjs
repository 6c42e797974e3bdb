/** Rooms: one at a time, entered by tab, key and address, each asking only for what it shows. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { estimated, open, staged } from './support.mjs';

const stage = staged();

test('a room is entered by its tab, tunes its own estimators, and is in the address', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.getByRole('tab', { name: 'Road and forces' }).click();
  await page.locator('[data-view="road-forces"][data-drawn~="slope"]').waitFor({ timeout: 20_000 });
  assert.equal(await page.locator('[data-view="1"]').isVisible(), false, 'one room at a time');
  assert.match(await page.locator('.headline').textContent(), /grade RMSE [0-9.]+/);
  await page.locator('.overview').focus();
  await page.keyboard.press('Shift+ArrowRight');
  await page.waitForFunction(() => /[1-9]/.test(document.querySelector('[data-view="road-forces"] .legend-entry .value')?.textContent ?? ''));
  assert.match(page.url(), /room=road/);

  await page.keyboard.press('1');
  assert.equal(await page.evaluate(() => document.activeElement?.dataset.view), 'road-slope', 'the key leads to a view of this room');
  await page.keyboard.press('v');
  while (!(await page.locator('[data-view="1"]').isVisible())) await page.keyboard.press('v');
  assert.doesNotMatch(page.url(), /room=/);
  assert.deepEqual(errors, []);
  await context.close();
});

test('an address leads into its room, and the room left draws again when it is entered anew', async () => {
  const { page, context, errors } = await open(stage.browser, `${stage.url}#room=road`);
  await page.locator('[data-view="road-slope"][data-drawn~="slope"]').waitFor({ timeout: 60_000 });
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
  assert.equal(await page.locator('[data-view="1"]').getAttribute('data-drawn'), null, 'a room that was never entered has drawn nothing');
  await page.getByRole('tab', { name: 'Overview' }).click();
  await estimated(page);
  assert.deepEqual(errors, []);
  await context.close();
});
