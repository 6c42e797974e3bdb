/** The page opens with an estimated drive, talks to nobody else, and can be stopped. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { bendCsv, choose, drop, estimated, open, shows, staged } from './support.mjs';

const stage = staged();

test('the page opens with the built-in drive estimated in all four views, without an error', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  for (const lane of ['Roll', 'Pitch', 'Yaw', 'Grade', 'Speed']) {
    const estimate = page.locator('.lane', { has: page.getByRole('heading', { name: lane }) }).locator('.legend-entry', { hasText: 'estimate' });
    await assert.doesNotReject(estimate.waitFor({ timeout: 5000 }), `${lane} has an estimate in its legend`);
  }
  await page.locator('.overview').focus();
  await page.keyboard.press('Shift+ArrowRight');
  await page.waitForFunction(() => /[0-9]/.test(document.querySelector('.lane .legend-entry .value')?.textContent ?? ''));
  assert.match(await page.locator('.headline').textContent(), /RMSE [0-9.]+/);
  const inked = await page.locator('.map canvas').evaluate((canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((value, i) => i % 4 === 3 && value > 0).length;
  });
  assert.ok(inked > 500, 'the trajectory is drawn');
  assert.deepEqual(errors, []);
  await context.close();
});

test('no request leaves for another host, and the policy forbids it to any script', async () => {
  const { page, context, requests } = await open(stage.browser, stage.url);
  await estimated(page);
  const host = new URL(stage.url).host;
  assert.ok(requests.length > 3);
  const foreign = requests.filter((url) => !/^(data|blob):/.test(url) && new URL(url).host !== host);
  assert.deepEqual(foreign, []);
  const refused = await page.evaluate(async () => {
    const violation = new Promise((resolve) => {
      document.addEventListener('securitypolicyviolation', (event) => resolve(event.effectiveDirective), { once: true });
    });
    await fetch('https://elsewhere.invalid/').catch(() => undefined);
    return Promise.race([violation, new Promise((resolve) => setTimeout(() => resolve('nothing'), 3000))]);
  });
  assert.equal(refused, 'connect-src');
  await context.close();
});

test('estimating can be stopped and taken up again', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  // From inside the page, as often as it takes: a fast machine leaves little time between a run's start and its end.
  await page.waitForFunction(() => {
    const status = document.querySelector('.status');
    if (status?.dataset.state === 'stopped') return true;
    if (status?.textContent.startsWith('Estimating')) status.querySelector('button').click();
    return false;
  }, undefined, { polling: 'raf' });
  const status = page.locator('.status[data-state="stopped"]');
  await status.waitFor();
  assert.match(await status.textContent(), /Stopped: /);
  await status.getByRole('button').click();
  await estimated(page);
  assert.deepEqual(errors, []);
  await context.close();
});

test('opening can be stopped and the drive that was open stays', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const before = await page.locator('.headline').textContent();
  await page.evaluate(() => {
    // Stop as soon as there is something to stop.
    const status = document.querySelector('.status');
    new MutationObserver(() => {
      if (status.dataset.state !== 'busy') return;
      window.stopped = true;
      status.querySelector('button').click();
    }).observe(status, { attributes: true });
  });
  await choose(page, 'motorway_hour');
  await page.waitForFunction(() => window.stopped);
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached' });
  assert.equal(await page.locator('.headline').textContent(), before);
  assert.equal(await page.locator('.drive-chooser').getAttribute('data-drive'), 'city_hills');
  await context.close();
});

test('an address brings back the parameters that were tuned', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const slider = page.locator('.param input[type=range]:enabled').first();
  await slider.focus();
  await page.keyboard.press('PageUp');
  await page.waitForFunction(() => location.hash.includes('orientation.'));
  const address = page.url();
  const value = await slider.inputValue();
  await context.close();
  const again = await open(stage.browser, address);
  await estimated(again.page);
  assert.equal(await again.page.locator('.param input[type=range]:enabled').first().inputValue(), value);
  assert.equal(await again.page.locator('.param.changed').count(), 1);
  await again.context.close();
});

test('a log that is dropped while the rest of a drive is being made stays open', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await page.locator('[data-view="1"][data-drawn~="orientation"]').waitFor({ state: 'attached', timeout: 60_000 });
  await page.locator('.status', { hasText: 'Opening City and hills' }).waitFor({ timeout: 60_000 });
  await drop(page, [{ name: 'bend.csv', text: bendCsv(10) }]);
  await shows(page, 'bend.csv');
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
  await page.waitForTimeout(500);
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
  await shows(page, 'bend.csv');
  assert.doesNotMatch(await page.locator('.drive-chooser').textContent(), /City and hills/);
  assert.deepEqual(errors, []);
  await context.close();
});
