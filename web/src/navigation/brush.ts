/** The brush: one row for each sensor; what is dragged over a row is a window in which that sensor sees nothing. */

import { h } from '../dom';
import { navigation as say } from '../messages/navigation';
import { LEFT, RIGHT } from '../plot/axes';
import { axis, shareOf, timeAt } from '../plot/axis';
import { Canvas } from '../plot/strip';
import { palette } from '../plot/palette';
import type { Span, Store } from '../state';
import type { Blind, Sensor } from './door';
import { dragged, type Part, SENSORS, windowAt, windowOf } from './windows';

/** Height of a row, CSS px: enough for a finger. */
const ROW = 26;
/** An end is taken hold of from this near, CSS px. */
const REACH = 7;

/** What the rows show beneath the windows. */
export interface BrushRow {
  sensor: Sensor;
  /** Whether the drive has the sensor. */
  isThere: boolean;
}

class BrushPlot extends Canvas {
  rows: BrushRow[] = [];
  windows: readonly Blind[] = [];
  gaps: readonly Span[] = [];
  chosen: Blind | null = null;
  view: Span = { t0: 0, t1: 1 };

  x(time: number): number {
    return LEFT + shareOf(time, this.view) * (this.width - RIGHT - LEFT);
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const right = this.width - RIGHT;
    this.rows.forEach(({ sensor, isThere }, index) => {
      const top = index * ROW;
      context.fillStyle = palette.value.muted;
      context.textAlign = 'right';
      context.textBaseline = 'middle';
      context.globalAlpha = isThere ? 1 : 0.5;
      context.fillText(say.rows[sensor], LEFT - 4, top + ROW / 2, LEFT - 4);
      context.globalAlpha = 1;
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, top + 3, right - LEFT, ROW - 6);
      if (!isThere) {
        context.fillStyle = palette.value.muted;
        context.textAlign = 'left';
        context.fillText(say.notThere, LEFT + 6, top + ROW / 2);
      }
      context.save();
      context.beginPath();
      context.rect(LEFT, top, right - LEFT, ROW);
      context.clip();
      if (sensor === 'gnss') for (const gap of this.gaps) this.#gap(context, gap, top);
      for (const window of this.windows) if (window.sensor === sensor) this.#window(context, window, top);
      context.restore();
    });
  }

  /** A stretch in which the receiver itself had nothing. */
  #gap(context: CanvasRenderingContext2D, gap: Span, top: number): void {
    context.fillStyle = palette.value.outage;
    context.fillRect(this.x(gap.t0), top + ROW - 8, Math.max(1, this.x(gap.t1) - this.x(gap.t0)), 5);
  }

  #window(context: CanvasRenderingContext2D, window: Blind, top: number): void {
    const [from, to] = [this.x(window.t0), this.x(window.t1)];
    const wide = Math.max(2, to - from);
    const isChosen = window === this.chosen;
    context.fillStyle = palette.value.blind;
    context.globalAlpha = isChosen ? 0.5 : 0.3;
    context.fillRect(from, top + 3, wide, ROW - 6);
    context.globalAlpha = 1;
    context.fillRect(from, top + 3, 2, ROW - 6);
    context.fillRect(from + wide - 2, top + 3, 2, ROW - 6);
    const text = say.seconds((window.t1 - window.t0).toFixed(window.t1 - window.t0 < 10 ? 1 : 0));
    if (context.measureText(text).width < wide - 10) {
      context.fillStyle = palette.value.ink;
      context.textAlign = 'center';
      context.textBaseline = 'middle';
      context.fillText(text, from + wide / 2, top + ROW / 2);
    }
  }
}

export class Brush {
  readonly element = h('div.brush', { role: 'img', 'aria-label': say.brushLabel });
  /** `isDone` is false while something is being dragged. */
  onChange: (windows: readonly Blind[], isDone: boolean) => void = () => {};
  onChoose: (window: Blind | null) => void = () => {};
  readonly #plot: BrushPlot;
  readonly #store: Store;
  readonly #line = h('div.cursor-line');
  #drag: { sensor: Sensor; from: number; x: number; index: number | null; part: Part; before: readonly Blind[]; isMoved: boolean } | null = null;

  constructor(store: Store) {
    this.#store = store;
    this.element.style.height = `${SENSORS.length * ROW}px`;
    this.#plot = new BrushPlot(this.element);
    this.element.append(this.#line);
    store.window.watch((view) => {
      this.#plot.view = view;
      this.#plot.redraw();
      this.#place();
    });
    store.cursor.on(() => this.#place());
    axis.on(() => this.#place());
    const canvas = this.#plot.canvas;
    canvas.addEventListener('pointerdown', (event) => this.#down(event));
    canvas.addEventListener('pointermove', (event) => this.#move(event));
    canvas.addEventListener('pointerup', (event) => this.#up(event));
    canvas.addEventListener('pointercancel', () => this.#cancel());
    canvas.addEventListener('keydown', (event) => event.key === 'Escape' && this.#cancel());
  }

  set({ rows, windows, gaps, chosen }: { rows: BrushRow[]; windows: readonly Blind[]; gaps: readonly Span[]; chosen: Blind | null }): void {
    Object.assign(this.#plot, { rows, gaps, chosen });
    if (!this.#drag) this.#plot.windows = windows;
    this.#plot.redraw();
  }

  #place(): void {
    const share = shareOf(this.#store.cursor.value, this.#store.window.value);
    this.#line.hidden = share < 0 || share > 1;
    this.#line.style.left = `calc(${LEFT}px + ${share} * (100% - ${LEFT + RIGHT}px))`;
  }

  #time(event: PointerEvent): number {
    return this.#timeAt(event.clientX);
  }

  #timeAt(clientX: number): number {
    const box = this.element.getBoundingClientRect();
    return timeAt((clientX - box.left - LEFT) / Math.max(1, box.width - LEFT - RIGHT), this.#store.window.value);
  }

  #row(event: PointerEvent): BrushRow | undefined {
    const box = this.element.getBoundingClientRect();
    return this.#plot.rows[Math.floor((event.clientY - box.top) / ROW)];
  }

  #found(event: PointerEvent, sensor: Sensor): { index: number; part: Part } | null {
    const pixels = REACH * (event.pointerType === 'touch' ? 2 : 1);
    const reach = Math.abs(this.#timeAt(event.clientX + pixels) - this.#time(event));
    return windowAt(this.#plot.windows, sensor, this.#time(event), reach);
  }

  #down(event: PointerEvent): void {
    const row = this.#row(event);
    if (!row?.isThere || event.button !== 0) return;
    this.#plot.canvas.setPointerCapture(event.pointerId);
    const found = this.#found(event, row.sensor);
    this.#drag = { sensor: row.sensor, from: this.#time(event), x: event.clientX, index: found?.index ?? null, part: found?.part ?? 'end', before: this.#plot.windows, isMoved: false };
    this.onChoose(found ? (this.#plot.windows[found.index] ?? null) : null);
  }

  #move(event: PointerEvent): void {
    const drag = this.#drag;
    if (!drag) {
      this.#hover(event);
      return;
    }
    const span = this.#store.span.value;
    const time = this.#time(event);
    if (!drag.isMoved && Math.abs(event.clientX - drag.x) < 3) return;
    drag.isMoved = true;
    const old = drag.index === null ? undefined : drag.before[drag.index];
    const next = old ? dragged(old, drag.part, time - drag.from, span) : windowOf(drag.sensor, drag.from, time, span);
    const windows = old ? drag.before.map((w) => (w === old ? next : w)) : [...drag.before, next];
    this.#plot.windows = windows;
    this.#plot.chosen = next;
    this.#plot.redraw();
    this.onChange(windows, false);
  }

  #hover(event: PointerEvent): void {
    const row = this.#row(event);
    const found = row?.isThere ? this.#found(event, row.sensor) : null;
    this.#plot.canvas.style.cursor = !row?.isThere ? 'default' : !found ? 'crosshair' : found.part === 'whole' ? 'grab' : 'ew-resize';
    if (!this.#store.isPlaying.value && event.pointerType === 'mouse') this.#store.moveCursor(this.#time(event));
  }

  #up(event: PointerEvent): void {
    const drag = this.#drag;
    this.#drag = null;
    if (!drag) return;
    if (drag.isMoved) this.onChange(this.#plot.windows, true);
    else if (drag.index === null) this.#store.moveCursor(this.#time(event));
  }

  #cancel(): void {
    const drag = this.#drag;
    this.#drag = null;
    if (drag?.isMoved) this.onChange(drag.before, true);
  }

  canvas(): HTMLCanvasElement {
    return this.#plot.canvas;
  }
}
