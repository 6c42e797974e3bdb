/** Moving a parameter runs its estimator again and says what changed. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { estimated, open, staged } from './support.mjs';

const stage = staged();

/** The numbers of the headline. */
async function numbers(page) {
  const text = await page.locator('.headline').textContent();
  return [...text.replaceAll('−', '-').matchAll(/-?\d+(\.\d+)?/g)].map((m) => Number(m[0]));
}

/** Move sliders of the open tab one after another until the headline says that something changed. */
async function moveSomething(page) {
  const sliders = page.locator('.param input[type=range]:enabled');
  for (let i = 0; i < (await sliders.count()); i++) {
    await sliders.nth(i).focus();
    await page.keyboard.press('PageUp');
    await page.keyboard.press('PageUp');
    await page.locator('.headline', { hasText: '→' }).waitFor();
    await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached' });
    if (!(await page.locator('.headline').textContent()).includes('no difference')) return;
  }
  assert.fail('no slider changes the result');
}

for (const [tab, view, lane] of [['orientation', '1', 'Roll'], ['slope', '2', 'Grade'], ['gnss_ins', '4', null], ['motion_mode', '3', 'Statistic']]) {
  test(`moving a slider of ${tab} changes the printed number, keeps the old curve and can be undone`, async () => {
    const { page, context, errors } = await open(stage.browser, stage.url);
    await estimated(page);
    await page.locator(`#tab-${tab}`).click();
    const [first] = await numbers(page);
    assert.ok(Number.isFinite(first));
    await moveSomething(page);
    const all = await numbers(page);
    assert.ok(all.length >= 3 && all.every(Number.isFinite), `before, after and difference: ${all}`);
    assert.match(await page.locator('.headline').textContent(), /better|worse/);
    const legend = lane
      ? page.locator(`[data-view="${view}"] .lane`, { has: page.getByRole('heading', { name: lane }) })
      : page.locator(`[data-view="${view}"]`);
    await legend.locator('.legend-entry:visible', { hasText: 'before' }).first().waitFor();

    const changed = await page.locator('.param.changed').count();
    assert.ok(changed >= 1);
    for (let i = 0; i < 2 * changed + 2 && (await page.locator('.param.changed').count()) > 0; i++) {
      await page.keyboard.press('Control+z');
    }
    assert.equal(await page.locator('.param.changed').count(), 0);
    await page.waitForFunction(
      (expected) => {
        const shown = document.querySelector('.headline').textContent.match(/\d+(\.\d+)?/g) ?? [];
        return shown.length >= 2 && Number(shown[1]) === expected;
      },
      first,
    );
    await page.keyboard.press('Control+Shift+Z');
    await page.locator('.param.changed').first().waitFor();
    assert.deepEqual(errors, []);
    await context.close();
  });
}

test('the curve before can be kept over several changes and cleared', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.locator('#tab-slope').click();
  await moveSomething(page);
  const [before] = await numbers(page);
  await page.getByLabel('Keep the curve before').check();
  const slider = page.locator('.param input[type=range]:enabled').first();
  for (const key of ['PageUp', 'PageUp', 'PageDown']) {
    await slider.press(key);
    await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached' });
  }
  assert.equal((await numbers(page))[0], before, 'what it is compared with stays');
  await page.getByRole('button', { name: 'Clear it' }).click();
  await page.getByLabel('Keep the curve before').waitFor({ state: 'detached' });
  assert.equal(await page.locator('[data-view="2"] .legend-entry:visible', { hasText: 'before' }).count(), 0);
  await context.close();
});

test('a number out of range is refused where it was typed', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const field = page.locator('.param input.number:enabled').first();
  const before = await page.locator('.param.changed').count();
  await field.fill('1e30');
  await field.press('Enter');
  assert.equal(await field.getAttribute('aria-invalid'), 'true');
  assert.equal(await page.locator('.param.changed').count(), before);
  await context.close();
});
