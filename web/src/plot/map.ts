/** The trajectory seen from above: north up, equal scales, coloured by motion mode. */

import { formatSignificant } from '../units';
import { t } from '../messages';
import { type Ellipse, readable, traceEllipse } from './ellipse';
import { Canvas } from './strip';
import { type Camera, drawBar, drawGrid } from './ground';
import { modeColour, palette } from './palette';

/** Columns of a path as the core gives it. */
const FIELDS = 5;
/** A blinded run is drawn so long after its windows, s. */
const FINDS_BACK = 5;

/** A path: time, north, east, sigma and mode of each point, flattened. */
export type Path = Float64Array;

export interface Layers {
  estimate: Path;
  previous: Path;
  truth: Path;
  fixes: Path;
  /** Further runs: with smoothing, with sensors blinded. */
  smoothed: Path;
  blinded: Path;
  /** Where the blinded run is drawn. */
  blind: readonly { t0: number; t1: number }[];
  /** Fixes that the filter refused. */
  rejected: Path;
  /** Errors of the estimate, in the order of time. */
  ellipses: readonly Ellipse[];
  outages: { t0: number; t1: number }[];
  window: { t0: number; t1: number };
  isShown: Record<'estimate' | 'previous' | 'truth' | 'fixes' | 'smoothed' | 'blinded' | 'rejected' | 'ellipses', boolean>;
}

/** Where the car is at the cursor. */
export interface Car {
  north: number;
  east: number;
  yaw: number;
  ellipse: Ellipse | null;
}

/** Stretches between fixes that are longer than two seconds (or than a receiver's slower rhythm). */
export function outagesOf(fixes: Path, span: { t0: number; t1: number }): { t0: number; t1: number }[] {
  if (fixes.length === 0) return [];
  const times = Array.from({ length: fixes.length / FIELDS }, (_, i) => fixes[i * FIELDS] as number);
  const steps = times.slice(1).map((time, i) => time - (times[i] as number));
  const usual = [...steps].sort((a, b) => a - b)[Math.floor(steps.length / 2)] ?? 0;
  const least = Math.max(2, 2.5 * usual);
  const ends = [span.t0, ...times, span.t1];
  return ends.slice(1).flatMap((t1, i) => (t1 - (ends[i] as number) > least ? [{ t0: ends[i] as number, t1 }] : []));
}

/** What of a path lies in a stretch of time: first and one past the last point. */
function between(path: Path, t0: number, t1: number): [number, number] {
  const count = path.length / FIELDS;
  const find = (time: number): number => {
    let [low, high] = [0, count];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((path[middle * FIELDS] as number) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  };
  return [find(t0), Math.min(count, find(t1) + 1)];
}

export class MapPlot extends Canvas {
  #layers: Layers | null = null;
  #car: Car | null = null;
  /** East and north of the middle, m, and CSS px per metre; null fits everything. */
  #camera: Camera | null = null;

  setLayers(layers: Layers): void {
    this.#layers = layers;
    this.redraw();
  }

  setCar(car: Car | null): void {
    this.#car = car;
    this.redraw();
  }

  fit(): void {
    this.#camera = null;
    this.redraw();
  }

  pan(dx: number, dy: number): void {
    const camera = this.#view();
    this.#camera = { ...camera, east: camera.east - dx / camera.scale, north: camera.north + dy / camera.scale };
    this.redraw();
  }

  /** Zoom about a point of the canvas, the middle if none is given. */
  zoom(factor: number, x = this.width / 2, y = this.height / 2): void {
    const before = this.#view();
    const scale = Math.min(200, Math.max(1e-3, before.scale * factor));
    const shift = 1 / before.scale - 1 / scale;
    this.#camera = {
      scale,
      east: before.east + (x - this.width / 2) * shift,
      north: before.north - (y - this.height / 2) * shift,
    };
    this.redraw();
  }

  /** The instant at which the drawn path was nearest to a point of the canvas, within 24 px. */
  timeAt(x: number, y: number): number | null {
    const layers = this.#layers;
    if (!layers) return null;
    const path = layers.estimate.length > 0 ? layers.estimate : layers.truth.length > 0 ? layers.truth : layers.fixes;
    let best: number | null = null;
    let nearest = 24 ** 2;
    for (let i = 0; i < path.length; i += FIELDS) {
      const [px, py] = this.#project(path[i + 1] as number, path[i + 2] as number);
      const distance = (px - x) ** 2 + (py - y) ** 2;
      if (distance < nearest) [nearest, best] = [distance, path[i] as number];
    }
    return best;
  }

  #view(): Camera {
    return this.#camera ?? this.#fitted();
  }

  #fitted(): Camera {
    let [south, north, west, east] = [Infinity, -Infinity, Infinity, -Infinity];
    const layers = this.#layers;
    for (const path of layers ? [layers.estimate, layers.truth, layers.fixes] : []) {
      for (let i = 0; i < path.length; i += FIELDS) {
        const [n, e] = [path[i + 1] as number, path[i + 2] as number];
        south = Math.min(south, n);
        north = Math.max(north, n);
        west = Math.min(west, e);
        east = Math.max(east, e);
      }
    }
    if (south > north) return { east: 0, north: 0, scale: 1 };
    const scale = Math.min((this.width - 48) / Math.max(20, east - west), (this.height - 56) / Math.max(20, north - south));
    return { east: (east + west) / 2, north: (north + south) / 2, scale: Math.max(scale, 1e-4) };
  }

  #project(north: number, east: number): [number, number] {
    const { scale, ...middle } = this.#view();
    return [this.width / 2 + (east - middle.east) * scale, this.height / 2 - (north - middle.north) * scale];
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const layers = this.#layers;
    if (!layers) return;
    // The camera is looked up for every point: hold it while drawing.
    const camera = this.#camera;
    this.#camera = this.#view();
    context.lineJoin = 'round';
    context.lineCap = 'round';
    drawGrid(context, this.#view(), this.size);
    if (layers.isShown.fixes) this.#drawFixes(context, layers);
    this.#drawOutages(context, layers);
    if (layers.isShown.ellipses) this.#drawEllipses(context, layers.ellipses);
    if (layers.isShown.truth) this.#line(context, layers.truth, palette.value.truth, 1);
    if (layers.isShown.estimate) this.#drawEstimate(context, layers);
    if (layers.isShown.previous) this.#line(context, layers.previous, palette.value.ghost, 1.2, [4, 5]);
    if (layers.isShown.smoothed) this.#line(context, layers.smoothed, palette.value.second, 1);
    if (layers.isShown.blinded) this.#drawBlinded(context, layers);
    if (layers.isShown.rejected) this.#drawRejected(context, layers);
    if (this.#car) this.#drawCar(context, this.#car);
    this.#drawScale(context);
    this.#drawNorth(context);
    this.#camera = camera;
  }

  #line(context: CanvasRenderingContext2D, path: Path, colour: string, width: number, dash: number[] = []): void {
    context.beginPath();
    for (let i = 0; i < path.length; i += FIELDS) context.lineTo(...this.#project(path[i + 1] as number, path[i + 2] as number));
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  #drawEstimate(context: CanvasRenderingContext2D, { estimate, window }: Layers): void {
    const [first, end] = between(estimate, window.t0, window.t1);
    const isPart = first > 0 || end < estimate.length / FIELDS;
    if (isPart) this.#line(context, estimate, palette.value.hairline, 2.5);
    let start = first;
    for (let i = first + 1; i <= end; i++) {
      if (i < end && estimate[i * FIELDS + 4] === estimate[start * FIELDS + 4]) continue;
      const mode = estimate[start * FIELDS + 4] as number;
      const piece = estimate.subarray(start * FIELDS, Math.min(i + 1, end) * FIELDS);
      this.#line(context, piece, Number.isFinite(mode) ? modeColour(mode) : palette.value.estimate, 3);
      if (mode === 0) this.#drawStop(context, piece);
      start = i;
    }
  }

  /** A standing car is a point: a square shows it. */
  #drawStop(context: CanvasRenderingContext2D, piece: Path): void {
    const [x, y] = this.#project(piece[1] as number, piece[2] as number);
    context.fillStyle = palette.value['mode-0'];
    context.fillRect(x - 4, y - 4, 8, 8);
    context.strokeStyle = palette.value.panel;
    context.lineWidth = 1;
    context.strokeRect(x - 4, y - 4, 8, 8);
  }

  #drawFixes(context: CanvasRenderingContext2D, { fixes, window }: Layers): void {
    const [first, end] = between(fixes, window.t0, window.t1);
    context.fillStyle = palette.value.raw;
    for (let i = first; i < end; i++) {
      const [x, y] = this.#project(fixes[i * FIELDS + 1] as number, fixes[i * FIELDS + 2] as number);
      context.fillRect(x - 1, y - 1, 2, 2);
    }
  }

  /** The blinded run from where it is blind to where it has found back. */
  #drawBlinded(context: CanvasRenderingContext2D, { blinded, blind }: Layers): void {
    for (const window of blind) {
      const [first, end] = between(blinded, window.t0, window.t1 + FINDS_BACK);
      this.#line(context, blinded.subarray(first * FIELDS, end * FIELDS), palette.value.blind, 2);
    }
  }

  /** A cross at each fix that was refused. */
  #drawRejected(context: CanvasRenderingContext2D, { rejected, window }: Layers): void {
    const [first, end] = between(rejected, window.t0, window.t1);
    context.strokeStyle = palette.value.bad;
    context.lineWidth = 1.5;
    context.beginPath();
    for (let i = first; i < Math.min(end, rejected.length / FIELDS); i++) {
      const [x, y] = this.#project(rejected[i * FIELDS + 1] as number, rejected[i * FIELDS + 2] as number);
      context.moveTo(x - 3.5, y - 3.5);
      context.lineTo(x + 3.5, y + 3.5);
      context.moveTo(x - 3.5, y + 3.5);
      context.lineTo(x + 3.5, y - 3.5);
    }
    context.stroke();
  }

  #drawEllipses(context: CanvasRenderingContext2D, ellipses: readonly Ellipse[]): void {
    const { scale } = this.#view();
    context.strokeStyle = palette.value.estimate;
    context.fillStyle = palette.value['estimate-band'];
    context.lineWidth = 0.8;
    for (const ellipse of readable(ellipses, scale)) {
      traceEllipse(context, ellipse, (n, e) => this.#project(n, e), scale);
      context.fill();
      context.stroke();
    }
  }

  #drawOutages(context: CanvasRenderingContext2D, { estimate, truth, outages }: Layers): void {
    const path = estimate.length > 0 ? estimate : truth;
    for (const outage of outages) {
      const [first, end] = between(path, outage.t0, outage.t1);
      if (end - first < 2) continue;
      this.#line(context, path.subarray(first * FIELDS, end * FIELDS), palette.value.outage, 13);
      const middle = (first + end) >> 1;
      const [x, y] = this.#project(path[middle * FIELDS + 1] as number, path[middle * FIELDS + 2] as number);
      const text = t.map.outage(String(Math.round(outage.t1 - outage.t0)));
      this.#label(context, text, Math.min(x + 12, this.width - context.measureText(text).width - 4), y);
    }
  }

  /** Text with a rim in the colour of the ground, legible on lines. */
  #label(context: CanvasRenderingContext2D, text: string, x: number, y: number): void {
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    context.lineWidth = 3;
    context.strokeStyle = palette.value.panel;
    context.strokeText(text, x, y);
    context.fillStyle = palette.value.ink;
    context.fillText(text, x, y);
  }

  #drawCar(context: CanvasRenderingContext2D, car: Car): void {
    const [x, y] = this.#project(car.north, car.east);
    const { scale } = this.#view();
    if (car.ellipse && car.ellipse.long * scale > 6) {
      traceEllipse(context, car.ellipse, (n, e) => this.#project(n, e), scale);
      context.strokeStyle = palette.value.estimate;
      context.fillStyle = palette.value['estimate-band'];
      context.lineWidth = 1;
      context.fill();
      context.stroke();
    }
    context.save();
    context.translate(x, y);
    context.rotate(Number.isFinite(car.yaw) ? car.yaw : 0);
    context.beginPath();
    if (Number.isFinite(car.yaw)) {
      context.moveTo(0, -10);
      context.lineTo(6.5, 8);
      context.lineTo(0, 4.5);
      context.lineTo(-6.5, 8);
      context.closePath();
    } else {
      context.arc(0, 0, 5, 0, 2 * Math.PI);
    }
    context.fillStyle = palette.value.ink;
    context.strokeStyle = palette.value.panel;
    context.lineWidth = 1.5;
    context.fill();
    context.stroke();
    context.restore();
  }

  #drawScale(context: CanvasRenderingContext2D): void {
    const { step, x, y } = drawBar(context, this.#view(), this.size);
    const text = step >= 1000 ? `${formatSignificant(step / 1000, 1)} ${t.units.kilometres}` : `${formatSignificant(step, 1)} ${t.units.metres}`;
    this.#label(context, text, x + 5, y - 9);
  }

  #drawNorth(context: CanvasRenderingContext2D): void {
    const [x, y] = [16, 18];
    context.beginPath();
    context.moveTo(x, y - 10);
    context.lineTo(x + 5, y + 4);
    context.lineTo(x, y + 1);
    context.lineTo(x - 5, y + 4);
    context.closePath();
    context.fillStyle = palette.value.muted;
    context.fill();
    context.textAlign = 'center';
    context.textBaseline = 'top';
    context.fillText(t.map.north, x, y + 6);
  }
}
