/** Stretches of time as a strip: colour and height both tell what a stretch is. */

import { h, onResize } from '../dom';
import { perFrame } from '../signal';
import type { Span } from '../state';
import { LEFT, RIGHT } from './axes';
import { axis, shareOf } from './axis';
import { CANVAS_FONT, palette } from './palette';

/** A stretch of one mode, or of another state that has a number. */
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

/** A canvas that follows its element's size and the theme. */
export abstract class Canvas {
  readonly canvas = h('canvas', { 'aria-hidden': 'true' });
  protected width = 0;
  protected height = 0;
  protected get size(): { width: number; height: number } {
    return { width: this.width, height: this.height };
  }

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

/** A row of a strip. */
export interface Row {
  label: string;
  stretches: Stretch[];
}

/** How a stretch is drawn: its colour, and its height as a share of the row's. */
export interface Look {
  colour: string;
  share: number;
}

/** Rows of stretches below one another. */
export abstract class Strip<R extends Row = Row> extends Canvas {
  #rows: R[] = [];
  #window: Span = { t0: 0, t1: 1 };

  setRows(rows: R[]): void {
    this.#rows = rows;
    this.redraw();
  }

  setWindow(window: Span): void {
    this.#window = window;
    this.redraw();
  }

  protected abstract look(row: R, stretch: Stretch): Look;

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
      context.fillText(row.label, LEFT - 5, bottom - full / 2, LEFT - 6);
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, bottom, right - LEFT, 1);
      for (const stretch of row.stretches) {
        const from = Math.max(LEFT, x(stretch.t0));
        const to = Math.min(right, x(stretch.t1));
        if (to <= from) continue;
        const { colour, share } = this.look(row, stretch);
        context.fillStyle = colour;
        context.fillRect(from, bottom - full * share, Math.max(to - from, 0.7), full * share);
      }
    });
  }
}
