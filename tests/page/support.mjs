/** What every test of the page needs: the built page behind a server of its own, and a browser. */

import { execFileSync } from 'node:child_process';
import { createReadStream, existsSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { after, before } from 'node:test';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const web = new URL('../../web/', import.meta.url);
const require = createRequire(new URL('package.json', web));
const { chromium } = require('playwright-core');

/** The source of axe-core, to be put into a page. */
export const axePath = require.resolve('axe-core/axe.min.js');

const dist = fileURLToPath(new URL('dist/', web));
const TYPES = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.svg': 'image/svg+xml',
  '.wasm': 'application/wasm',
};

/** Serve `web/dist` below a sub-path, at a port of the system's choice. */
export async function serve() {
  const server = createServer((request, response) => {
    const path = decodeURIComponent(new URL(request.url ?? '/', 'http://localhost').pathname);
    const inside = path.startsWith('/some/where/') ? path.slice('/some/where/'.length) : null;
    const file = inside === null ? '' : join(dist, normalize(inside === '' ? 'index.html' : inside));
    if (!file.startsWith(dist) || !existsSync(file) || !statSync(file).isFile()) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream' });
    createReadStream(file).pipe(response);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}/some/where/`, close: () => server.close() };
}

/** The system's Chromium: the one that `CHROMIUM` names, else the one in the path. */
export function launch() {
  const executablePath = process.env.CHROMIUM || execFileSync('which', ['chromium']).toString().trim();
  const args = ['--no-sandbox', '--disable-gpu', '--disable-background-networking', '--disable-component-update', '--disable-sync'];
  return chromium.launch({ executablePath, args });
}

/** The page's address and a browser, there from a file's first test to its last. */
export function staged() {
  const stage = {};
  let server;
  before(async () => {
    server = await serve();
    stage.url = server.url;
    stage.browser = await launch();
  });
  after(async () => {
    await stage.browser?.close();
    server?.close();
  });
  return stage;
}

/**
 * Open the page and note what it does: errors on the console, requests.
 * @param {import('playwright-core').Browser} browser
 * @param {string} url
 * @param {object} [options] of the browser's context, and `prepare`, which is done with it before the page is asked for
 */
export async function open(browser, url, { prepare, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, reducedMotion: 'reduce', ...options });
  await prepare?.(context);
  const page = await context.newPage();
  const errors = [];
  const requests = [];
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  page.on('pageerror', (error) => errors.push(String(error)));
  context.on('request', (request) => requests.push(request.url()));
  await page.goto(url);
  return { page, context, errors, requests };
}

/** Wait until all four views show estimates. */
export async function estimated(page) {
  for (const [view, name] of [['1', 'orientation'], ['2', 'slope'], ['3', 'motion_mode'], ['4', 'gnss_ins']]) {
    await page.locator(`[data-view="${view}"][data-drawn~="${name}"]`).waitFor({ state: 'attached', timeout: 60_000 });
  }
  await page.locator('.status[data-state="idle"]').waitFor({ state: 'attached', timeout: 60_000 });
}

/** Drop files on the page: `[{ name, text }]`, or `{ name, make }` with the source of a function that returns the text. */
export async function drop(page, files) {
  await page.evaluate((specs) => {
    const transfer = new DataTransfer();
    for (const { name, text, bytes, make } of specs) {
      const content = make ? new Function(`return (${make})()`)() : (text ?? Uint8Array.from(bytes));
      transfer.items.add(new File([content], name));
    }
    for (const type of ['dragover', 'drop']) {
      document.body.dispatchEvent(new DragEvent(type, { bubbles: true, cancelable: true, dataTransfer: transfer }));
    }
  }, files.map((f) => ({ ...f, make: f.make?.toString() })));
}

/** A drive of `seconds` along a gentle bend, as a CSV of canonical names: 50 Hz, GNSS once a second. */
export function bendCsv(seconds = 20) {
  const rate = 50;
  const [speed, yawRate, lat0, lon0] = [12, 0.03, 0.82, 0.15];
  const rows = ['t,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,mag_x,mag_y,mag_z,speed,steer,gnss_lat,gnss_lon,gnss_alt,gnss_vn,gnss_ve,gnss_vd'];
  let [north, east] = [0, 0];
  for (let i = 0; i <= seconds * rate; i++) {
    const t = i / rate;
    const yaw = 0.4 + yawRate * t;
    const wave = (k) => 0.02 * Math.sin(k * 1.7 * i + k);
    const field = [20 * Math.cos(yaw), -20 * Math.sin(yaw), 43];
    const cells = [t, wave(1), speed * yawRate + wave(2), -9.80665 + wave(3), wave(4) / 9, wave(5) / 9, yawRate + wave(6) / 9, ...field, speed, 0.0065];
    const gnss = i % rate === 0
      ? [((lat0 + north / 6.37e6) * 180) / Math.PI, ((lon0 + east / (6.37e6 * Math.cos(lat0))) * 180) / Math.PI, 100, speed * Math.cos(yaw), speed * Math.sin(yaw), 0]
      : ['', '', '', '', '', ''];
    rows.push([...cells.map((c) => c.toFixed(6)), ...gnss.map((g) => (g === '' ? '' : g.toFixed(9)))].join(','));
    north += (speed * Math.cos(yaw)) / rate;
    east += (speed * Math.sin(yaw)) / rate;
  }
  return `${rows.join('\n')}\n`;
}

/** The name of the drive that is open, as the page shows it. */
export function openDrive(page) {
  return page.locator('.drive-chooser').textContent();
}

/** Wait until the drive of this name is the open one. */
export function shows(page, name) {
  return page.waitForFunction((part) => document.querySelector('.drive-chooser')?.textContent.includes(part), name);
}

/** Choose a built-in drive by its name on the command line. */
export async function choose(page, name) {
  await page.locator('.drive-chooser').click();
  await page.locator(`.drive-card[data-name="${name}"]`).click();
}
