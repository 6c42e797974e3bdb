/** Playback: play, pause, speed, and the whole drive at a glance to scrub through. */

import { h, icon, iconButton } from '../dom';
import { t } from '../messages';
import { LEFT, RIGHT } from '../plot/axes';
import { axis, shareOf, timeAt } from '../plot/axis';
import { Canvas, stretches, type Stretch } from '../plot/strip';
import { modeColour, palette } from '../plot/palette';
import type { Session } from '../session';
import type { Store } from '../state';
import { axisSwitch } from './axis-switch';
import { formatDistance, formatTime } from '../units';
import { latest } from '../worker/rpc';

const RATES = [0.5, 1, 2, 5, 10, 20, 60];

/** The drive at a glance: speed as a silhouette, mode as a line under it, what is shown, the cursor. */
class Overview extends Canvas {
  speed: { times: Float64Array; values: Float64Array } | null = null;
  modes: Stretch[] = [];
  #store: Store;

  constructor(host: HTMLElement, store: Store) {
    super(host);
    this.#store = store;
    store.cursor.on(this.redraw);
    store.window.on(this.redraw);
    store.span.on(this.redraw);
    store.faults.on(this.redraw);
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const [left, right] = [LEFT, this.width - RIGHT];
    const x = (time: number): number => left + shareOf(time, this.#store.span.value) * (right - left);
    const floor = this.height - 7;
    this.#silhouette(context, x, floor);
    for (const s of this.modes) {
      context.fillStyle = modeColour(s.mode);
      context.fillRect(x(s.t0), floor + 2, Math.max(0.7, x(s.t1) - x(s.t0)), 4);
    }
    // Faults in the drive, above the silhouette.
    context.fillStyle = palette.value.bad;
    for (const fault of this.#store.faults.value) {
      const [begin, end] = [Math.max(left, x(fault.from)), Math.min(right, x(fault.to))];
      if (end > begin) context.fillRect(begin, 0, Math.max(1, end - begin), 3);
    }
    const shown = this.#store.window.value;
    const [from, to] = [x(shown.t0), x(shown.t1)];
    if (to - from < right - left - 1) {
      context.fillStyle = palette.value.panel;
      context.globalAlpha = 0.7;
      context.fillRect(left, 0, from - left, this.height);
      context.fillRect(to, 0, right - to, this.height);
      context.globalAlpha = 1;
      context.strokeStyle = palette.value.muted;
      context.lineWidth = 1;
      context.strokeRect(Math.round(from) + 0.5, 0.5, Math.max(2, Math.round(to - from) - 1), this.height - 1);
    }
    const cursor = Math.round(x(this.#store.cursor.value));
    context.fillStyle = palette.value.ink;
    context.fillRect(cursor - 1, 0, 2, this.height);
  }

  #silhouette(context: CanvasRenderingContext2D, x: (time: number) => number, floor: number): void {
    if (!this.speed) return;
    const { times, values } = this.speed;
    const highest = values.reduce((most, v) => (v > most ? v : most), 1);
    context.beginPath();
    context.moveTo(x(times[0] ?? 0), floor);
    values.forEach((v, i) => {
      const y = Number.isFinite(v) ? floor - (Math.max(0, v) / highest) * (floor - 3) : floor;
      context.lineTo(x(times[i] as number), y);
    });
    context.lineTo(x(times[times.length - 1] ?? 0), floor);
    context.fillStyle = palette.value.hairline;
    context.fill();
  }
}

export class Transport {
  readonly element: HTMLElement;
  #store: Store;
  #session: Session;
  #play: HTMLButtonElement;
  #time = h('output.time');
  #host = h('div.overview', { role: 'slider', tabindex: '0', 'aria-label': t.transport.scrub });
  #overview: Overview;
  #lastFrame = 0;

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    this.#play = h('button.play', { type: 'button', onclick: () => this.toggle() });
    const rate = h('select', { 'aria-label': t.transport.rate, title: t.transport.rate });
    for (const r of RATES) rate.append(h('option', { value: r, selected: r === store.rate.value }, t.transport.times(String(r))));
    rate.addEventListener('change', () => {
      store.rate.value = Number(rate.value);
    });
    const controls = h('div.transport-controls', {}, this.#play, this.#time, rate, axisSwitch(store, session), h('span.spacer'), this.#wholeButton());
    this.element = h('section.transport', { 'aria-label': t.transport.label }, this.#host, controls);
    this.#overview = new Overview(this.#host, store);
    this.#listen();
    this.#follow();
  }

  #wholeButton(): HTMLButtonElement {
    const store = this.#store;
    const button = iconButton('fit', t.views.resetZoom, () => store.show(store.span.value.t0, store.span.value.t1));
    store.window.watch(({ t0, t1 }) => {
      button.disabled = t0 <= store.span.value.t0 && t1 >= store.span.value.t1;
    });
    return button;
  }

  toggle(): void {
    const store = this.#store;
    if (!store.isPlaying.value && store.cursor.value >= store.span.value.t1) store.moveCursor(store.span.value.t0);
    store.isPlaying.value = !store.isPlaying.value;
  }

  #frame = (now: number): void => {
    const store = this.#store;
    if (!store.isPlaying.value) return;
    const passed = Math.min(0.2, (now - this.#lastFrame) / 1000);
    this.#lastFrame = now;
    store.moveCursor(store.cursor.value + passed * store.rate.value);
    store.follow();
    if (store.cursor.value >= store.span.value.t1) store.isPlaying.value = false;
    else requestAnimationFrame(this.#frame);
  };

  #follow(): void {
    const store = this.#store;
    store.isPlaying.watch((isPlaying) => {
      const label = isPlaying ? t.transport.pause : t.transport.play;
      this.#play.replaceChildren(icon(isPlaying ? 'pause' : 'play'));
      this.#play.title = label;
      this.#play.setAttribute('aria-label', label);
      if (isPlaying) {
        this.#lastFrame = performance.now();
        requestAnimationFrame(this.#frame);
      }
    });
    const say = (): void => {
      const { t0, t1 } = store.span.value;
      const time = store.cursor.value;
      const isWay = axis.value.kind === 'distance';
      this.#time.textContent = isWay ? `${formatTime(store.sinceStart(time))} · ${formatDistance(axis.value.place(time))}` : formatTime(store.sinceStart(time));
      this.#host.setAttribute('aria-valuemin', '0');
      this.#host.setAttribute('aria-valuemax', (t1 - t0).toFixed(1));
      this.#host.setAttribute('aria-valuenow', store.sinceStart(time).toFixed(1));
      this.#host.setAttribute('aria-valuetext', t.transport.position(formatTime(store.sinceStart(time)), formatTime(t1 - t0)));
    };
    store.cursor.watch(say);
    store.span.on(say);
    axis.on(say);
    const load = latest(() => this.#load());
    store.report.on(load);
    for (const name of ['motion_mode', 'slope', 'gnss_ins']) {
      store.run(name).on((now, before) => {
        if (now.reply !== before.reply) load();
      });
    }
  }

  async #load(): Promise<void> {
    const { t0, t1 } = this.#store.span.value;
    const columns = this.#store.report.value?.channels.flatMap((c) => c.columns) ?? [];
    const measured = ['speed', 'gnss_speed', 'wheel_speed_rl'].find((c) => columns.includes(c));
    const speed = measured ? { source: 'drive', column: measured } : { source: 'gnss_ins:current', column: 'speed' };
    const items = [
      { ...speed, step: false },
      { source: 'motion_mode:current', column: 'mode', step: true },
    ];
    const reply = await this.#session.rpc.call('grid', { items, t0, t1, buckets: 700 });
    const [values, modes] = reply.columns;
    this.#overview.speed = values?.length ? { times: reply.times, values } : null;
    this.#overview.modes = modes?.length ? stretches(reply.times, modes) : [];
    this.#overview.redraw();
  }

  #listen(): void {
    const host = this.#host;
    const scrub = (event: PointerEvent): void => {
      const box = host.getBoundingClientRect();
      const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
      this.#store.moveCursor(timeAt(Math.min(1, Math.max(0, share)), this.#store.span.value));
      this.#store.follow();
    };
    host.addEventListener('pointerdown', (event) => {
      host.setPointerCapture(event.pointerId);
      scrub(event);
    });
    host.addEventListener('pointermove', (event) => {
      if (host.hasPointerCapture(event.pointerId)) scrub(event);
    });
  }
}
