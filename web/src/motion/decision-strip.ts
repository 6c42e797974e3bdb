/** Under the timeline: at each decision the rule that fired and the statistic against its threshold, where there is room. */

import { motion as say } from '../messages/motion';
import { LEFT, RIGHT } from '../plot/axes';
import { axis, shareOf } from '../plot/axis';
import { modeColour, palette } from '../plot/palette';
import { Canvas } from '../plot/strip';
import type { Span } from '../state';
import { DEFAULT_DISPLAY, type Display } from '../units';
import { type Decision, deciding, figures } from './explain';

/** Room that a text needs at least, px. */
const LEAST = 22;

export class DecisionStrip extends Canvas {
  #decisions: readonly Decision[] = [];
  #window: Span = { t0: 0, t1: 1 };
  #display: Display = DEFAULT_DISPLAY;

  show(decisions: readonly Decision[], window: Span, display: Display): void {
    this.#decisions = decisions;
    this.#window = window;
    this.#display = display;
    this.redraw();
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const { t0, t1 } = this.#window;
    const right = this.width - RIGHT;
    const x = (time: number): number => LEFT + shareOf(time, this.#window, axis.value) * (right - LEFT);
    context.fillStyle = palette.value.muted;
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    context.fillText(say.rows.rule, LEFT - 5, this.height / 4, LEFT - 6);
    context.textAlign = 'left';
    const middle = this.height / 2;
    this.#decisions.forEach((decision, i) => {
      const at = Math.max(LEFT, x(decision.time));
      const end = Math.min(right, x(this.#decisions[i + 1]?.time ?? t1));
      if (end < LEFT || x(decision.time) > right) return;
      if (decision.time >= t0) {
        context.fillStyle = modeColour(decision.to);
        context.fillRect(at, 0, 2, this.height);
      }
      const room = end - at - 7;
      if (room < LEAST) return;
      const fitting = (texts: string[]): string => texts.find((text) => context.measureText(text).width <= room) ?? '';
      const codes = deciding(decision.rule).map((s) => s.toUpperCase()).join(' ');
      context.fillStyle = palette.value.ink;
      context.fillText(fitting([say.rules[decision.rule] ?? '', codes]), at + 5, middle / 2);
      context.fillStyle = palette.value.muted;
      const pairs = figures(decision, this.#display).split(', ');
      context.fillText(fitting([pairs.join(', '), pairs[0] ?? '', (pairs[0] ?? '').replace(/ [^ ]+$/, '')]), at + 5, middle + middle / 2);
    });
  }
}
