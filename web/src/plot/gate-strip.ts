/** What a filter made of the magnetic field over time, as a strip: colour tells the reason, height whether it was used. */

import type { Span } from '../state';
import { LEFT, RIGHT } from './axes';
import { shareOf } from './axis';
import { Canvas, type Stretch } from './mode-strip';
import { palette } from './palette';

/** Heights of the states of `gateState`, in parts of the row. */
const HEIGHTS = [0.3, 0.55, 1, 1, 1, 0.8, 0.55];

/** One number for the columns `gate` and `gate_reason`: 0 used, 1 less weight, 2 to 5 left out by reason, 6 believed again. */
export function gateState(gate: number, reason: number): number {
  if (gate === 2) return reason >= 1 && reason <= 4 ? 1 + reason : 5;
  return gate === 3 ? 6 : gate;
}

/** The colour of a state. */
export function gateColour(state: number): string {
  const name = `gate-${state}`;
  return (palette.value as Readonly<Record<string, string>>)[name] ?? palette.value.hairline;
}

export interface GateRow {
  label: string;
  stretches: Stretch[];
}

export class GateStrip extends Canvas {
  #rows: GateRow[] = [];
  #window: Span = { t0: 0, t1: 1 };

  setRows(rows: GateRow[]): void {
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
      context.fillText(row.label, LEFT - 4, bottom - full / 2, LEFT - 6);
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, bottom, right - LEFT, 1);
      for (const stretch of row.stretches) {
        const from = Math.max(LEFT, x(stretch.t0));
        const to = Math.min(right, x(stretch.t1));
        if (to <= from) continue;
        const high = full * (HEIGHTS[stretch.mode] ?? 0.3);
        context.fillStyle = gateColour(stretch.mode);
        context.fillRect(from, bottom - high, Math.max(to - from, 0.7), high);
      }
    });
  }
}
