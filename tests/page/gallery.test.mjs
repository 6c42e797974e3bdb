/** The gallery of papers: loaded when it is opened, claims tried in the page, no verdict before it was obtained. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { axePath, estimated, open, shows, staged } from './support.mjs';

const stage = staged();

const QUICK = 'control/moment_to_zero';
const LONG = 'orientation/model_steadies_yaw';
const dialog = (page) => page.getByRole('dialog', { name: 'Papers' });
const claim = (page, id) => page.locator(`.claim[data-claim="${id}"]`);
const state = (page, id, kind) => page.locator(`.claim[data-claim="${id}"][data-state="${kind}"]`).waitFor({ timeout: 60_000 });

async function opened(page) {
  await page.getByRole('button', { name: 'Papers', exact: true }).click();
  await dialog(page).waitFor();
  await page.locator('.claim').first().waitFor();
}

async function tried(page, id) {
  await claim(page, id).getByRole('button', { name: 'Run it here' }).click();
  await state(page, id, 'tried');
}

test('nothing of the gallery is loaded before it is opened, and no verdict is shown before it was obtained', async () => {
  const { page, context, errors, requests } = await open(stage.browser, stage.url);
  await estimated(page);
  const ours = () => requests.filter((r) => r.includes('gallery'));
  assert.deepEqual(ours(), []);
  const before = requests.length;
  await opened(page);
  assert.ok(ours().some((r) => r.endsWith('.wasm')), 'its module is loaded now');
  // The readers come whenever the page is idle.
  const others = requests.slice(before).filter((r) => !r.includes('gallery') && !r.includes('readers'));
  assert.deepEqual(others, [], 'what it loads is called so, and weighed so');
  const claims = await page.locator('.claim').count();
  assert.ok(claims >= 17, `${claims} claims`);
  assert.equal(await page.locator('.verdict-line[data-verdict=""]').count(), claims);
  assert.equal(await page.locator('.figures').count(), 0);
  for (const text of await page.locator('.tally').allTextContents()) assert.match(text, /^\d+ not run yet$/);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a claim is run to its verdict, with figures, limits and remark; running it again gives the same', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await opened(page);
  await tried(page, QUICK);
  const card = claim(page, QUICK);
  const verdict = await card.locator('.verdict-line').textContent();
  assert.match(verdict, /^(not supported|supported|partly supported)$/);
  const rows = await card.locator('.figures tbody tr').allTextContents();
  assert.ok(rows.length > 0 && rows.some((r) => /\d.*(at most|at least|\d to) /.test(r)), rows.join('\n'));
  const judged = await card.locator('.figures :is(.holds, .fails)').allTextContents();
  const expected = judged.every((m) => m === 'yes') ? 'supported' : judged.includes('yes') ? 'partly supported' : 'not supported';
  assert.equal(verdict, expected, 'the verdict is that of the figures shown');
  assert.ok((await card.locator('.remark').textContent()).length > 20);
  await card.getByRole('button', { name: 'Run again' }).click();
  await state(page, QUICK, 'tried');
  assert.deepEqual(await card.locator('.figures tbody tr').allTextContents(), rows);
  assert.deepEqual(errors, []);
  await context.close();
});

/** Press the button of this name once the claim has come some way; the answer is what the cards said at that instant. */
function pressUnderWay(page, id, name) {
  return page.evaluate(([id, name]) => new Promise((resolve) => {
    const card = document.querySelector(`.claim[data-claim="${id}"]`);
    const press = () => {
      if (card.dataset.state !== 'running' || !(card.querySelector('progress').value > 0)) return;
      observer.disconnect();
      const said = [...document.querySelectorAll('.claim')].map((c) => [c.dataset.claim, c.querySelector('.verdict-line').textContent]);
      [...document.querySelectorAll('.gallery button')].find((b) => b.textContent === name && (card.contains(b) || b.matches('.run-all'))).click();
      resolve(Object.fromEntries(said));
    };
    const observer = new MutationObserver(press);
    observer.observe(card, { subtree: true, attributes: true, childList: true });
    press();
  }), [id, name]);
}

test('a claim says how far it has come and can be stopped; what waits for it goes on', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await opened(page);
  const stopped = pressUnderWay(page, LONG, 'Stop');
  await page.evaluate((ids) => ids.forEach((id) => document.querySelector(`.claim[data-claim="${id}"] .claim-run button`).click()), [LONG, QUICK]);
  const said = await stopped;
  assert.match(said[LONG], /^running: (lane change|bank|mountain)/);
  assert.equal(said[QUICK], 'waiting');
  await state(page, QUICK, 'tried');
  assert.equal(await claim(page, LONG).getAttribute('data-state'), 'stopped');
  assert.equal(await claim(page, LONG).locator('.figures').count(), 0);

  const all = pressUnderWay(page, LONG, 'Stop all');
  await page.getByRole('button', { name: 'Run all' }).click();
  assert.ok(Object.values(await all).filter((words) => words === 'waiting').length > 10);
  await page.getByRole('button', { name: 'Run all' }).waitFor();
  assert.equal(await page.locator('.claim:is([data-state="running"], [data-state="waiting"])').count(), 0);
  assert.equal(await claim(page, LONG).locator('.figures').count(), 0);

  await page.getByRole('button', { name: 'Run all' }).click();
  await page.waitForFunction(() => document.querySelectorAll('.claim:not([data-state="tried"])').length === 0, undefined, { timeout: 120_000 });
  assert.doesNotMatch((await page.locator('.tally').allTextContents()).join(' '), /not run yet/);
  assert.deepEqual(errors, []);
  await context.close();
});

test('a trial is opened in the page with its drive and its tuning; the keyboard opens and leaves the gallery', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.keyboard.press('g');
  await page.locator('.claim').first().waitFor();
  await page.keyboard.press('Escape');
  await dialog(page).waitFor({ state: 'hidden' });
  await page.keyboard.press('g');
  const card = claim(page, 'orientation/static_vectors');
  await card.locator('summary').click();
  await card.getByRole('button', { name: 'Open this drive with this estimator: bank' }).click();
  await dialog(page).waitFor({ state: 'hidden' });
  await page.waitForFunction(() => document.querySelector('.drive-chooser').dataset.drive === 'bank20_80');
  assert.match(page.url(), /drive=bank20_80/);
  assert.match(page.url(), /orientation\.variant=triad/);
  // A drive that the claim changes is opened changed.
  await page.keyboard.press('g');
  const changed = claim(page, 'orientation/local_field');
  await changed.locator('summary').click();
  await changed.getByRole('button', { name: 'Open this drive with this estimator: no steel, switch' }).click();
  await shows(page, 'truss_bridge');
  assert.match(page.url(), /orientation\.variant=switch/, 'the variant of this trial, not of the one before');
  assert.deepEqual(errors, []);
  await context.close();
});

for (const colorScheme of ['light', 'dark']) {
  test(`the gallery has no serious violation of accessibility in the ${colorScheme} theme, nor does anything stick out at phone width`, async () => {
    for (const more of [{}, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true }]) {
      const { page, context } = await open(stage.browser, stage.url, { colorScheme, bypassCSP: true, ...more });
      await estimated(page);
      await opened(page);
      await tried(page, QUICK);
      await claim(page, LONG).locator('summary').click();
      await page.addScriptTag({ path: axePath });
      const { violations } = await page.evaluate(() => window.axe.run());
      const serious = violations.filter((v) => v.impact === 'serious' || v.impact === 'critical');
      assert.deepEqual(serious.map((v) => `${v.id}: ${v.nodes.map((n) => n.html).slice(0, 3).join(' | ')}`), []);
      const over = await page.evaluate(() => {
        const body = document.querySelector('.gallery-body');
        const tables = [...document.querySelectorAll('.gallery .scroll')].map((t) => t.scrollWidth - t.clientWidth);
        return Math.max(document.documentElement.scrollWidth - innerWidth, body.scrollWidth - body.clientWidth, ...tables);
      });
      assert.ok(over <= 0, `something sticks out by ${over} px`);
      await context.close();
    }
  });
}
