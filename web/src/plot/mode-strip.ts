/** Motion modes over time as a strip: colour and height both tell the mode. */

import { h, onResize } from '../dom';
import { perFrame } from '../signal';
import type { Span } from '../state';
import { LEFT, RIGHT } from './axes';
import { axis, shareOf } from './axis';
import { CANVAS_FONT, modeColour, palette } from './palette';

/** A stretch of one mode. */
export interface Stretch {
  t0: number;
  t1: number;
  mode: number;
}

/** Runs of equal modes; what is not a number is left out. */
export function stretches(times: ArrayLike<number>, modes: ArrayLike<number>): Stretch[] {
  const out: Stretch[] = [];
  const half = times.length > 1 ? ((times[1] as number) - (times[0] as number)) / 2 : 0;
  for (let i = 0; i < modes.length; i++) {
    const mode = modes[i] as number;
    if (!Number.isFinite(mode)) continue;
    const time = times[i] as number;
    const last = out[out.length - 1];
    if (last && last.mode === mode && time - half - last.t1 < half) last.t1 = time + half;
    else out.push({ t0: time - half, t1: time + half, mode });
  }
  return out;
}

/** A row of the strip. */
export interface StripRow {
  label: string;
  kind: 'mode' | 'outage';
  stretches: Stretch[];
}

/** A canvas that follows its element's size and the theme. */
export abstract class Canvas {
  readonly canvas = h('canvas', { 'aria-hidden': 'true' });
  protected width = 0;
  protected height = 0;
  readonly redraw = perFrame(() => this.#draw());

  constructor(host: HTMLElement) {
    host.append(this.canvas);
    onResize(host, (width, height) => {
      this.width = width;
      this.height = height;
      this.resized();
      this.#draw();
    });
    palette.on(this.redraw);
    axis.on(this.redraw);
  }

  protected resized(): void {}

  protected abstract draw(context: CanvasRenderingContext2D): void;

  #draw(): void {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [Math.round(this.width * ratio), Math.round(this.height * ratio)];
    if (width === 0 || height === 0) return;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    const context = this.canvas.getContext('2d');
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    context.font = CANVAS_FONT;
    this.draw(context);
  }
}

export class ModeStrip extends Canvas {
  #rows: StripRow[] = [];
  #window: Span = { t0: 0, t1: 1 };

  setRows(rows: StripRow[]): void {
    this.#rows = rows;
    this.redraw();
  }

  setWindow(window: Span): void {
    this.#window = window;
    this.redraw();
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const right = this.width - RIGHT;
    const x = (time: number): number => LEFT + shareOf(time, this.#window) * (right - LEFT);
    const tall = this.height / Math.max(1, this.#rows.length);
    this.#rows.forEach((row, index) => {
      const bottom = (index + 1) * tall - 2;
      const full = tall - 4;
      context.fillStyle = palette.value.muted;
      context.textAlign = 'right';
      context.textBaseline = 'middle';
      context.fillText(row.label, LEFT - 5, bottom - full / 2);
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, bottom, right - LEFT, 1);
      for (const stretch of row.stretches) {
        const from = Math.max(LEFT, x(stretch.t0));
        const to = Math.min(right, x(stretch.t1));
        if (to <= from) continue;
        const high = row.kind === 'outage' ? full * 0.5 : full * (0.34 + 0.33 * stretch.mode);
        context.fillStyle = row.kind === 'outage' ? palette.value.outage : modeColour(stretch.mode);
        context.fillRect(from, bottom - high, Math.max(to - from, 0.7), high);
      }
    });
  }
}
