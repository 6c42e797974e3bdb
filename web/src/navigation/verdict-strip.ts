/** Which measurements were used and which refused, over time: one row for each sensor; refused ones are tall. */

import { LEFT, RIGHT } from '../plot/axes';
import { Canvas, type Stretch } from '../plot/strip';
import { palette } from '../plot/palette';
import type { Span } from '../state';

/** A row; `mode` of a stretch is 0 where refused, 1 where used in part, 2 where used. */
export interface VerdictRow {
  label: string;
  stretches: Stretch[];
}

export class VerdictStrip extends Canvas {
  #rows: VerdictRow[] = [];
  #window: Span = { t0: 0, t1: 1 };

  setRows(rows: VerdictRow[]): void {
    this.#rows = rows;
    this.redraw();
  }

  setWindow(window: Span): void {
    this.#window = window;
    this.redraw();
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const tall = this.height / Math.max(1, this.#rows.length);
    const { t0, t1 } = this.#window;
    const right = this.width - RIGHT;
    const scale = (right - LEFT) / (t1 - t0);
    const colours = [palette.value.bad, palette.value.threshold, palette.value.good];
    this.#rows.forEach((row, index) => {
      const bottom = (index + 1) * tall - 1;
      context.fillStyle = palette.value.muted;
      context.textAlign = 'right';
      context.textBaseline = 'middle';
      context.fillText(row.label, LEFT - 5, bottom - tall / 2 + 1, LEFT - 7);
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, bottom, right - LEFT, 1);
      // Refused ones last: they are what is looked for.
      for (const kind of [2, 1, 0]) {
        context.fillStyle = colours[kind] ?? palette.value.muted;
        const high = kind === 2 ? 3 : kind === 1 ? 6 : tall - 3;
        for (const stretch of row.stretches) {
          if (stretch.mode !== kind) continue;
          const from = Math.max(LEFT, LEFT + (stretch.t0 - t0) * scale);
          const to = Math.min(right, LEFT + (stretch.t1 - t0) * scale);
          if (to > from) context.fillRect(from, bottom - high, Math.max(to - from, kind === 2 ? 0.7 : 2), high);
        }
      }
    });
  }
}
