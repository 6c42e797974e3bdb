/** Everything works from the keyboard, on a phone, in both themes and without seeing the plots. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { axePath, estimated, open, staged } from './support.mjs';

const stage = staged();

const time = (page) => page.locator('.transport .time').textContent();

test('the keyboard plays, steps, zooms, goes to the views and shows its help', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.keyboard.press('1');
  assert.equal(await page.evaluate(() => document.activeElement.dataset.view), '1');
  const start = await time(page);
  await page.keyboard.press('Space');
  await page.getByRole('button', { name: 'Pause', exact: true }).waitFor();
  await page.waitForFunction((before) => document.querySelector('.transport .time').textContent !== before, start);
  await page.keyboard.press('Space');
  await page.getByRole('button', { name: 'Play', exact: true }).waitFor();
  const paused = await time(page);
  await page.keyboard.press('ArrowRight');
  assert.notEqual(await time(page), paused);
  await page.keyboard.press('ArrowLeft');
  assert.equal(await time(page), paused);
  await page.keyboard.press('End');
  const end = await time(page);
  await page.keyboard.press('Home');
  assert.notEqual(await time(page), end);

  const label = () => page.locator('[data-view="1"] .table-panel caption').textContent();
  await page.locator('[data-view="1"] .view-header').getByRole('button', { name: /Show as table/ }).click();
  await page.locator('[data-view="1"] .table-panel caption').waitFor();
  const whole = await label();
  await page.keyboard.press('3');
  await page.keyboard.press('+');
  await page.waitForFunction((before) => document.querySelector('[data-view="1"] .table-panel caption').textContent !== before, whole);
  await page.keyboard.press('0');
  await page.waitForFunction((before) => document.querySelector('[data-view="1"] .table-panel caption').textContent === before, whole);

  await page.keyboard.press('?');
  const help = page.getByRole('dialog', { name: 'Keyboard' });
  await help.waitFor();
  await page.keyboard.press('Escape');
  await help.waitFor({ state: 'hidden' });
  assert.deepEqual(errors, []);
  await context.close();
});

test('every menu closes by Escape, gives the focus back, and stands inside a phone', async () => {
  for (const viewport of [{ width: 1440, height: 900 }, { width: 390, height: 844 }]) {
    const { page, context } = await open(stage.browser, stage.url);
    await page.setViewportSize(viewport);
    await estimated(page);
    for (const name of ['Export', 'Display', 'Variants']) {
      await page.getByRole('button', { name, exact: true }).click();
      const box = await page.locator(':popover-open').boundingBox();
      assert.ok(box.x >= 0 && box.x + box.width <= viewport.width, `${name} from ${box.x}, ${box.width} wide, of ${viewport.width}`);
      await page.keyboard.press('Escape');
      await page.waitForFunction(() => document.querySelector(':popover-open') === null);
      assert.equal(await page.evaluate(() => document.activeElement.textContent), name);
    }
    await context.close();
  }
});

test('the wheel zooms all plots together, a drag zooms into its stretch, a double click shows everything', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.locator('[data-view="2"] .view-header').getByRole('button', { name: /Show as table/ }).click();
  const caption = page.locator('[data-view="2"] .table-panel caption');
  const whole = await caption.textContent();
  const changes = (from) => page.waitForFunction((before) => document.querySelector('[data-view="2"] .table-panel caption').textContent !== before, from);
  const box = await page.locator('[data-view="1"] .time-area').first().boundingBox();
  const at = (share) => [box.x + share * box.width, box.y + box.height / 2];
  await page.mouse.move(...at(0.5));
  await page.mouse.wheel(0, -300);
  await changes(whole);
  const zoomed = await caption.textContent();
  await page.mouse.move(...at(0.25));
  await page.mouse.down();
  await page.mouse.move(...at(0.5), { steps: 5 });
  await page.mouse.up();
  await changes(zoomed);
  await page.mouse.dblclick(...at(0.5));
  await page.waitForFunction((before) => document.querySelector('[data-view="2"] .table-panel caption').textContent === before, whole);
  await context.close();
});

test('all plots over time begin and end at the same places', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const edges = await page.locator('.time-area:visible').evaluateAll((areas) =>
    areas.map((a) => a.getBoundingClientRect()).map((b) => [Math.round(b.left), Math.round(b.right)]),
  );
  const drawn = await page.locator('.u-over:visible').evaluateAll((areas) =>
    areas.map((a) => a.getBoundingClientRect()).map((b) => [Math.round(b.left), Math.round(b.right)]),
  );
  assert.ok(edges.length >= 7 && drawn.length >= 6);
  for (const edge of [...edges, ...drawn]) assert.deepEqual(edge, edges[0]);
  await context.close();
});

test('every view has a table with the numbers of what is shown', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  for (const view of ['1', '2', '3', '4']) {
    await page.locator(`[data-view="${view}"] .view-header`).getByRole('button', { name: /Show as table/ }).click();
    const rows = page.locator(`[data-view="${view}"] .table-panel tbody tr`);
    await rows.first().waitFor();
    const count = await rows.count();
    assert.ok(count > 50 && count <= 200, `view ${view} has ${count} rows`);
    assert.match(await rows.nth(50).textContent(), /\d/);
  }
  await context.close();
});

for (const colorScheme of ['light', 'dark']) {
  test(`no serious violation of accessibility in the ${colorScheme} theme`, async () => {
    const { page, context } = await open(stage.browser, stage.url, { colorScheme, bypassCSP: true });
    await estimated(page);
    assert.equal(await page.evaluate(() => document.documentElement.dataset.theme), colorScheme);
    await page.addScriptTag({ path: axePath });
    const look = async () => {
      const { violations } = await page.evaluate(() => window.axe.run());
      return violations.filter((v) => v.impact === 'serious' || v.impact === 'critical').map((v) => `${v.id}: ${v.nodes.map((n) => n.html).slice(0, 3).join(' | ')}`);
    };
    assert.deepEqual(await look(), []);
    await page.getByRole('button', { name: 'About this log' }).click();
    await page.locator('[data-view="1"] .view-header').getByRole('button', { name: /Show as table/ }).click();
    await page.getByRole('button', { name: 'Display' }).click();
    assert.deepEqual(await look(), []);
    await context.close();
  });
}

test('at phone width nothing sticks out and the finger moves the cursor', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  await estimated(page);
  assert.equal(await page.evaluate(() => scrollY), 0, 'the page opens at its top');
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 390, `the page is ${width} px wide`);
  await page.locator('[data-view="1"] .time-area').first().tap();
  assert.notEqual(await time(page), '0:00.0');
  const small = await page.locator('button:visible').evaluateAll((buttons) =>
    buttons.filter((b) => b.getBoundingClientRect().height < 24).map((b) => b.outerHTML.slice(0, 80)),
  );
  assert.deepEqual(small, [], 'targets are high enough for a finger');
  assert.deepEqual(errors, []);
  await context.close();
});

test('units and axes change what is shown, not what is estimated', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const pitch = page.locator('.lane', { has: page.getByRole('heading', { name: 'Pitch' }) });
  await page.locator('.overview').focus();
  await page.keyboard.press('Shift+ArrowRight');
  const value = pitch.locator('.legend-entry', { hasText: 'estimate' }).locator('.value');
  const read = async () => Number.parseFloat((await value.textContent()).replace('−', '-'));
  await page.waitForFunction((e) => /\d/.test(e.textContent), await value.elementHandle());
  const degrees = await read();
  await page.getByRole('button', { name: 'Display' }).click();
  await page.getByRole('radio', { name: 'ISO 8855, z up' }).check();
  await page.waitForFunction(([e, before]) => e.textContent.replace('−', '-').startsWith(String(-before).slice(0, 2)) || before === 0, [await value.elementHandle(), degrees]);
  assert.ok(Math.abs((await read()) + degrees) < 0.011);
  await page.getByRole('radio', { name: 'radians' }).check();
  await pitch.locator('.lane-unit', { hasText: 'rad' }).waitFor();
  await context.close();
});
