/**
 * What a person waits for, in a real browser: `npm run measure` in `web`, after `cargo xtask build`.
 * Prints medians with range of five openings, of sliders, and of an hour of CSV made from the built-in drive.
 */

import { estimated, launch, open, serve } from './support.mjs';

const ROUNDS = Number(process.argv[2] ?? 5);
const VIEWS = [['1', 'orientation'], ['2', 'slope'], ['3', 'motion_mode'], ['4', 'gnss_ins']];
const results = {};

function note(name, milliseconds) {
  (results[name] ??= []).push(milliseconds);
}

/** Milliseconds since the page was asked for at which every view has drawn its estimator for the first time. */
function firstViews(page) {
  return page.evaluate(async (views) => {
    for (;;) {
      if (views.every(([view, name]) => document.querySelector(`[data-view="${view}"][data-drawn~="${name}"]`))) return performance.now();
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
  }, VIEWS);
}

/** Press a key on the first slider of a tab; milliseconds until the result says what changed and is drawn. */
async function slide(page, tab) {
  await page.locator(`#tab-${tab}`).click();
  const sliders = page.locator('.param input[type=range]:enabled');
  await sliders.first().focus();
  return page.evaluate(async () => {
    const headline = document.querySelector('.headline');
    const slider = document.activeElement;
    const before = headline.textContent;
    const begin = performance.now();
    slider.stepUp(40);
    slider.dispatchEvent(new Event('input', { bubbles: true }));
    slider.dispatchEvent(new Event('change', { bubbles: true }));
    while (headline.textContent === before || document.querySelector('.status').dataset.state !== 'idle') {
      await new Promise((resolve) => setTimeout(resolve, 1));
      if (performance.now() - begin > 5000) throw new Error('the slider changed nothing');
    }
    await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    return performance.now() - begin;
  });
}

/** The built-in drive as CSV without its truth: header, and rows as [time, other cells]. */
async function measurements(page) {
  await page.getByRole('button', { name: 'Export' }).click();
  const download = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Measurements and truth (CSV)' }).click();
  const text = (await (await (await download).createReadStream()).toArray()).join('');
  const lines = text.trimEnd().split('\n').filter((line) => !line.startsWith('#'));
  const keep = lines[0].split(',').findIndex((name) => name.startsWith('truth_'));
  return lines.map((line) => line.split(',').slice(0, keep).join(',')).join('\n');
}

/** 360,000 rows of 20 columns of noise with five decimals or fewer: what readers of CSV are compared with, 62 MB. */
function noise(page) {
  return page.evaluate(() => {
    let seed = 1;
    const random = () => (seed = (seed * 48271) % 2147483647) / 2147483647 - 0.5;
    const digits = (i) => (10 ** (i % 3) * 4 * random()).toFixed(5 - (i % 3 >> 1));
    const known = ['accel_x', 'accel_y', 'accel_z', 'gyro_x', 'gyro_y', 'gyro_z'];
    const header = ['t', ...known, ...Array.from({ length: 13 }, (_, i) => `c${i + 1}`)].join(',');
    const rows = Array.from({ length: 360_000 }, (_, k) => `${(k / 100).toFixed(2)},${Array.from({ length: 19 }, (_, i) => digits(i))}\n`);
    window.measured = [`${header}\n`, ...rows];
  });
}

/** Six times these measurements in a row. */
function hour(page, ten) {
  return page.evaluate((text) => {
    const [header, ...lines] = text.split('\n');
    const rows = lines.map((line) => [Number(line.slice(0, line.indexOf(','))), line.slice(line.indexOf(','))]);
    const period = rows.at(-1)[0] + 0.01;
    const copies = Array.from({ length: 6 }, (_, copy) => rows.map(([t, rest]) => `${(t + copy * period).toFixed(3)}${rest}\n`).join(''));
    window.measured = [`${header}\n`, ...copies];
  }, ten);
}

/**
 * What was made, dropped under this name: megabytes a second until only the mapping is left to do, milliseconds to open, and
 * until all have estimated it.
 */
async function drop(page, name) {
  return page.evaluate(async (name) => {
    const file = new File(window.measured, name);
    const transfer = new DataTransfer();
    transfer.items.add(file);
    const status = document.querySelector('.status');
    let read = NaN;
    const observer = new MutationObserver(() => {
      if (Number.isNaN(read) && status.textContent.includes('finding the signals')) read = performance.now() - begin;
    });
    observer.observe(status, { childList: true, subtree: true, characterData: true });
    const begin = performance.now();
    for (const type of ['dragover', 'drop']) {
      document.body.dispatchEvent(new DragEvent(type, { bubbles: true, cancelable: true, dataTransfer: transfer }));
    }
    const until = async (condition) => {
      while (!condition()) await new Promise((resolve) => setTimeout(resolve, 2));
      return performance.now() - begin;
    };
    const opened = await until(() => document.querySelector('.drive-chooser')?.textContent.includes(name));
    const done = await until(() => document.querySelector('.status').dataset.state === 'idle');
    observer.disconnect();
    return { megabytes: file.size / 1e6, rate: file.size / 1e3 / read, opened, done };
  }, name);
}

const server = await serve();
const browser = await launch();
try {
  for (let round = 0; round < ROUNDS; round++) {
    const { page, context } = await open(browser, server.url);
    note('first estimated views, ms', await firstViews(page));
    await estimated(page);
    note('whole built-in drive estimated, ms', await page.evaluate(() => performance.now()));
    for (const [, tab] of VIEWS) note(`slider to redrawn curve, ${tab}, ms`, await slide(page, tab));
    if (round < 3) {
      const ten = await measurements(page);
      await hour(page, ten);
      const { megabytes, rate, opened, done } = await drop(page, 'hour.csv');
      note('an hour of CSV read in the tab for the first time, MB/s', rate);
      note('size of an hour of CSV, MB', megabytes);
      note('an hour of CSV opened, ms', opened);
      note('an hour of CSV opened and estimated by all, ms', done);
      for (const again of ['a.csv', 'b.csv', 'c.csv']) note('an hour of CSV read in the tab again, MB/s', (await drop(page, again)).rate);
      await noise(page);
      const again = 'noise of 360,000 rows and 20 columns read in the tab, MB/s';
      for (const name of ['d.csv', 'e.csv', 'f.csv']) note(again, (await drop(page, name)).rate);
    }
    await context.close();
  }
} finally {
  await browser.close();
  server.close();
}
for (const [name, values] of Object.entries(results)) {
  values.sort((a, b) => a - b);
  const show = (v) => v.toFixed(0);
  console.log(`${name}: ${show(values[values.length >> 1])} (${show(values[0])}..${show(values.at(-1))})`);
}
