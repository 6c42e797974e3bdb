/** The built-in drives: chosen by eye or from the keyboard, with a seed; long ones are of use while they grow. */

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { axePath, bendCsv, choose, drop, estimated, open, shows, staged } from './support.mjs';

const stage = staged();

const dialog = (page) => page.getByRole('dialog', { name: 'Built-in drives' });
const drawn = (page) => page.waitForFunction(() => document.querySelectorAll('.drive-card .sketch').length === document.querySelectorAll('.drive-card').length);

test('every drive is listed with one line and a picture that is drawn, none outside its box', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.keyboard.press('d');
  await dialog(page).waitFor();
  await drawn(page);
  const cards = await page.locator('.drive-card').evaluateAll((all) =>
    all.map((card) => {
      const svg = card.querySelector('svg');
      const [room, inside] = [svg.viewBox.baseVal, svg.getBBox()];
      return {
        name: card.dataset.name,
        doc: card.querySelector('.doc').textContent,
        facts: card.querySelector('.facts').textContent,
        fits: inside.x >= 0 && inside.y >= 0 && inside.x + inside.width <= room.width && inside.y + inside.height <= room.height,
        ink: inside.width > 0.8 * room.width && inside.height > 0.7 * room.height,
      };
    }),
  );
  assert.ok(cards.length >= 22);
  for (const { name, doc, facts, fits, ink } of cards) {
    assert.ok(doc.length > 20 && doc.length < 140 && !doc.includes('\n'), `${name}: ${doc}`);
    assert.match(facts, /^\d+:\d\d(:\d\d)? · [\d.]+ k?m · up to \d+ km\/h$/, name);
    assert.ok(fits && ink, `the picture of ${name} fills its box and no more`);
  }
  assert.deepEqual(errors, []);
  await context.close();
});

test('the keyboard finds a drive, opens it, and Escape leaves everything as it was', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const focused = () => page.evaluate(() => document.activeElement.dataset.name ?? document.activeElement.className);
  await page.keyboard.press('d');
  assert.equal(await focused(), 'city_hills', 'the open drive has the focus');
  await page.keyboard.press('ArrowRight');
  const second = await focused();
  await page.keyboard.press('ArrowDown');
  const below = await focused();
  assert.ok(new Set(['city_hills', second, below]).size === 3);
  await page.keyboard.press('ArrowUp');
  assert.equal(await focused(), second, 'down and up again is where one was');
  await page.keyboard.press('Escape');
  await dialog(page).waitFor({ state: 'hidden' });
  assert.equal(await page.locator('.drive-chooser').getAttribute('data-drive'), 'city_hills');
  await page.keyboard.press('d');
  await page.keyboard.type('gear');
  assert.equal(await page.locator('.drive-card:visible').count(), 1, 'typing searches');
  await page.keyboard.type('xyz');
  await page.getByText('No drive is called or described so.').waitFor();
  for (let i = 0; i < 3; i++) await page.keyboard.press('Backspace');
  await page.keyboard.press('Enter');
  await shows(page, 'gear shift');
  assert.match(page.url(), /drive=uphill15_gearshift/);
  await context.close();
});

test('a seed changes the noise, is part of the address, and brings the same numbers back', async () => {
  const { page, context } = await open(stage.browser, `${stage.url}#drive=u_drive`);
  await shows(page, 'U-shaped');
  // The whole card: one number of three digits may be the same by chance.
  const card = page.locator('section.score').first();
  const done = () => page.locator('.status[data-state="idle"]').waitFor({ state: 'attached' });
  await page.waitForFunction(() => /RMSE/.test(document.querySelector('.headline').textContent));
  await done();
  const own = await card.textContent();
  await page.keyboard.press('d');
  await page.getByLabel('Seed', { exact: true }).fill('7');
  await page.keyboard.press('Enter');
  await shows(page, 'seed 7');
  await page.waitForFunction((before) => /RMSE/.test(document.querySelector('.headline').textContent) && document.querySelector('section.score').textContent !== before, own);
  await done();
  const seventh = await card.textContent();
  const address = page.url();
  assert.match(address, /seed=7/);
  await page.keyboard.press('d');
  await page.getByLabel('Seed', { exact: true }).fill('-1');
  await page.keyboard.press('Enter');
  assert.ok(await dialog(page).isVisible(), 'a negative seed is not taken');
  await context.close();
  const again = await open(stage.browser, address);
  await again.page.waitForFunction((want) => document.querySelector('section.score').textContent === want, seventh);
  await again.context.close();
});

test('an address that is changed opens its drive, keeps saying so while it opens, and a name that is none is told', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await page.waitForFunction(() => document.querySelector('.drive-chooser')?.dataset.drive === 'city_hills');
  // While one drive is being opened the address is that of this one: a reload then opened the drive before.
  const after = await page.evaluate(async () => {
    location.hash = '#drive=motorway_bank&seed=7&room=road';
    await new Promise((resolve) => addEventListener('hashchange', () => setTimeout(resolve, 0), { once: true }));
    return [location.hash, document.querySelector('.drive-chooser').dataset.drive];
  });
  assert.deepEqual(after, ['#drive=motorway_bank&seed=7&room=road', 'city_hills']);
  await page.reload();
  await page.waitForFunction(() => document.querySelector('.drive-chooser')?.dataset.drive === 'motorway_bank');
  assert.match(page.url(), /#drive=motorway_bank&seed=7&room=road$/);

  // There and back before the first has opened: the last word counts.
  await page.evaluate(async () => {
    for (const hash of ['#drive=u_drive', '#drive=motorway_bank&seed=7']) {
      location.hash = hash;
      await new Promise((resolve) => addEventListener('hashchange', () => setTimeout(resolve, 0), { once: true }));
    }
  });
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
  assert.equal(await page.locator('.drive-chooser').getAttribute('data-drive'), 'motorway_bank');

  await page.evaluate(() => {
    location.hash = '#drive=nowhere';
  });
  await page.getByText('“nowhere”').waitFor();
  const other = await open(stage.browser, `${stage.url}#drive=nowhere`);
  await estimated(other.page);
  assert.ok(await other.page.getByText('“nowhere”').isVisible(), 'what is wrong with an address is told until it is read');
  assert.deepEqual([...errors, ...other.errors], []);
  await other.context.close();
  await context.close();
});

test('an hour is looked at and tuned while it grows, says how far it has come, and can be stopped', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await page.evaluate(() => {
    window.seen = [];
    const status = document.querySelector('.status');
    new MutationObserver(() => status.textContent.includes('driving') && window.seen.push(status.querySelector('progress').value)).observe(status, { subtree: true, childList: true, characterData: true, attributes: true });
  });
  await choose(page, 'motorway_hour');
  // Its first minutes are open and estimated while the rest is still being driven.
  await page.waitForFunction(() => document.querySelector('.drive-chooser').dataset.drive === 'motorway_hour');
  await page.waitForFunction(() => {
    const isDriving = document.querySelector('.status').textContent.includes('driving');
    const isEstimated = document.querySelector('[data-view="1"]').dataset.drawn?.includes('orientation');
    return isDriving && isEstimated;
  }, undefined, { polling: 20 });
  const before = await page.locator('.headline').textContent();
  const slider = page.locator('.param input[type=range]:enabled').first();
  await slider.focus();
  for (let i = 0; i < 3; i++) await page.keyboard.press('PageUp');
  const during = await page.waitForFunction((text) => {
    const now = document.querySelector('.headline').textContent;
    return now !== text && /→|RMSE/.test(now) ? document.querySelector('.status').textContent : false;
  }, before, { polling: 20 });
  assert.match(await during.jsonValue(), /driving|Estimating/);
  await page.keyboard.press('1');
  await page.keyboard.press('+');
  await page.keyboard.press('+');
  await page.evaluate(() => {
    const status = document.querySelector('.status');
    const stop = () => status.textContent.includes('driving') && status.querySelector('button').click();
    new MutationObserver(stop).observe(status, { subtree: true, childList: true, characterData: true, attributes: true });
    stop();
  });
  await page.locator('.status[data-state="stopped"]').waitFor({ timeout: 30_000 });
  assert.match(await page.locator('.status').textContent(), /the rest of the drive/);
  const shares = await page.evaluate(() => window.seen);
  assert.ok(shares.length > 3 && shares.every((v, i) => i === 0 || v >= shares[i - 1] - 1e-9), 'progress only grows');
  assert.deepEqual(errors, []);
  await context.close();
});

const COMPOSED = '{ "name": "mine", "description": "A straight and a corner", "segments": [ { "length": 200, "speed_kmh": 50 }, { "length": 18, "turn_deg": 90, "speed_kmh": 25, "stop": 3 } ] }';

test('a drive of one’s own is dropped and driven; a wrong one says where', async () => {
  const { page, context, errors } = await open(stage.browser, stage.url);
  await estimated(page);
  await drop(page, [{ name: 'mine.json', text: COMPOSED }]);
  await shows(page, 'mine');
  await page.locator('.report', { hasText: 'simulated with truth' }).waitFor({ state: 'attached' });
  await drop(page, [{ name: 'wrong.json', text: COMPOSED.replace('"turn_deg": 90', '"turn_deg": 9000') }]);
  await page.locator('.error-banner [role=alert]').getByText('wrong.json: segments[1].turn_deg = 9000 is outside').waitFor();
  assert.match(await page.locator('.drive-chooser').textContent(), /mine/);
  assert.deepEqual(errors, []);
  await context.close();
});

test('raw ranges dropped with their log become a sensor of the drive', async () => {
  const { page, context } = await open(stage.browser, stage.url);
  await estimated(page);
  const rows = Array.from({ length: 20 }, (_, t) => `${t},3,1e7,2e7,1e7,10,20,30,2.2e7,-40\n${t},9,2e7,1e7,1e7,10,20,30,2.3e7,-50`);
  const raw = `t,prn,sat_x,sat_y,sat_z,sat_vx,sat_vy,sat_vz,pr,prr\n${rows.join('\n')}\n`;
  await drop(page, [{ name: 'raw.csv', text: raw }, { name: 'bend.csv', text: bendCsv() }]);
  await shows(page, 'bend.csv');
  await page.locator('.report tr', { hasText: 'raw gnss' }).getByText('20', { exact: true }).waitFor();
  await context.close();
});

for (const colorScheme of ['light', 'dark']) {
  test(`the list of drives has no serious violation of accessibility in the ${colorScheme} theme, nor at phone width`, async () => {
    for (const more of [{}, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true }]) {
      const { page, context } = await open(stage.browser, stage.url, { colorScheme, bypassCSP: true, ...more });
      await estimated(page);
      await page.locator('.drive-chooser').click();
      await drawn(page);
      await page.addScriptTag({ path: axePath });
      const { violations } = await page.evaluate(() => window.axe.run());
      const serious = violations.filter((v) => v.impact === 'serious' || v.impact === 'critical');
      assert.deepEqual(serious.map((v) => `${v.id}: ${v.nodes.map((n) => n.html).slice(0, 3).join(' | ')}`), []);
      const width = await page.evaluate(() => Math.max(document.documentElement.scrollWidth, document.querySelector('.drives').scrollWidth) - innerWidth);
      assert.ok(width <= 0, `something sticks out by ${width} px`);
      await context.close();
    }
  });
}
