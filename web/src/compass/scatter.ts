/** Readings of the magnetometer seen from above, in the sensor's axes: forward up, right to the right, uT. */

import { compass as say } from '../messages/compass';
import { Canvas } from '../plot/strip';
import { palette } from '../plot/palette';
import { formatFixed } from '../units';
import type { Diagnosis } from './door';

const EDGE = { left: 40, right: 10, top: 10, bottom: 30 };

/** A round spacing that gives about `count` lines over `length`. */
export function spacing(length: number, count: number): number {
  const rough = length / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= rough) ?? 10 * power;
}

export class ScatterPlot extends Canvas {
  #scatter: Diagnosis['scatter'] | null = null;

  show(scatter: Diagnosis['scatter']): void {
    this.#scatter = scatter;
    this.redraw();
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const scatter = this.#scatter;
    if (!scatter) return;
    const colours = palette.value;
    const [rawX = [], rawY = []] = scatter.raw;
    const [calX = [], calY = []] = scatter.calibrated;
    const [ringX = [], ringY = []] = scatter.ellipse;
    const { radius } = scatter;
    const forward = [...rawX, ...calX, ...ringX, -radius, radius].filter(Number.isFinite);
    const right = [...rawY, ...calY, ...ringY, -radius, radius].filter(Number.isFinite);
    const range = (v: number[]): [number, number] => v.reduce<[number, number]>(([a, b], x) => [Math.min(a, x), Math.max(b, x)], [0, 0]);
    const [f0, f1] = range(forward);
    const [r0, r1] = range(right);
    const [wide, high] = [this.width - EDGE.left - EDGE.right, this.height - EDGE.top - EDGE.bottom];
    const scale = 0.96 * Math.min(wide / (r1 - r0), high / (f1 - f0));
    const [midX, midY] = [EDGE.left + wide / 2, EDGE.top + high / 2];
    const x = (value: number): number => midX + (value - (r0 + r1) / 2) * scale;
    const y = (value: number): number => midY - (value - (f0 + f1) / 2) * scale;

    const step = spacing(Math.min(wide, high) / scale, 5);
    context.lineWidth = 1;
    context.fillStyle = colours.muted;
    const lines = (low: number, length: number): number[] => {
      const out: number[] = [];
      for (let v = Math.ceil(low / step) * step; v <= low + length; v += step) out.push(v);
      return out;
    };
    context.textAlign = 'center';
    context.textBaseline = 'top';
    for (const v of lines((r0 + r1) / 2 - wide / 2 / scale, wide / scale)) {
      context.strokeStyle = v === 0 ? colours.hairline : colours.grid;
      context.strokeRect(Math.round(x(v)) + 0.5, EDGE.top, 0, high);
      context.fillText(formatFixed(v, 0), x(v), EDGE.top + high + 3);
    }
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    for (const v of lines((f0 + f1) / 2 - high / 2 / scale, high / scale)) {
      context.strokeStyle = v === 0 ? colours.hairline : colours.grid;
      context.strokeRect(EDGE.left, Math.round(y(v)) + 0.5, wide, 0);
      context.fillText(formatFixed(v, 0), EDGE.left - 4, y(v));
    }
    context.textAlign = 'right';
    context.textBaseline = 'bottom';
    context.fillText(say.rightAxis, EDGE.left + wide, this.height);
    context.textAlign = 'left';
    context.fillText(say.forwardAxis, 2, this.height);

    const dots = (xs: number[], ys: number[], colour: string): void => {
      context.fillStyle = colour;
      for (let i = 0; i < xs.length; i++) context.fillRect(x(ys[i] ?? Number.NaN) - 1.2, y(xs[i] ?? Number.NaN) - 1.2, 2.4, 2.4);
    };
    dots(rawX, rawY, colours.raw);
    dots(calX, calY, colours.estimate);
    context.lineWidth = 1.5;
    context.setLineDash([]);
    if (ringX.length > 0) {
      context.strokeStyle = colours.threshold;
      context.beginPath();
      ringX.forEach((v, i) => context.lineTo(x(ringY[i] ?? Number.NaN), y(v)));
      context.stroke();
    }
    context.strokeStyle = colours.truth;
    context.setLineDash([5, 4]);
    context.beginPath();
    context.arc(x(0), y(0), radius * scale, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
  }
}
