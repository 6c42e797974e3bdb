/** A closed loop seen from above: path, obstacles, the way driven, and at one instant the car with its ring and sectors. */

import { Canvas } from '../plot/strip';
import { type Camera, drawBar, drawGrid } from '../plot/ground';
import { palette } from '../plot/palette';
import { formatSignificant } from '../units';
import { t } from '../messages';
import type { Driven, Rows } from './door';

/** Directions of the ring's axes from the heading, rad, from left to right; their number; what is no echo, m. */
const AXES = 12;
const FIRST_AXIS = (-82.5 * Math.PI) / 180;
const BETWEEN_AXES = (15 * Math.PI) / 180;
const NO_ECHO = 4;
const SECTORS = 72;
/** Radius at which sectors are drawn, m. */
const SECTORS_AT = 2.6;
/** Body and wheels of the drawn car: lengths as shares of the wheelbase, widths of the track. */
const CAR = { length: 1.6, width: 1.2, wheel: 0.25, tyre: 0.17 };
/** Least length at which the car is drawn, pixels. */
const SEEN = 20;
/** Height of what is seen while the car is followed, m. */
const FOLLOWED = 16;

/** The last row at or before an instant. */
export function rowAt(time: Float64Array, instant: number): number {
  let [low, high] = [0, time.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((time[middle] as number) <= instant) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}

/** Length and width of a car's body and its wheelbase, m, and pixels per metre: however far away, it can be seen. */
export function carSize(size: Driven['size'], pixels: number): { length: number; width: number; wheelbase: number; scale: number } {
  const [front, rear, track] = size as unknown as [number, number, number];
  const wheelbase = front - rear;
  const length = CAR.length * wheelbase;
  return { length, width: CAR.width * track, wheelbase, scale: Math.max(pixels, SEEN / length) };
}

/** What can be seen of a loop, with the colour of each. */
const KEYS = { way: 'estimate', known: 'second', compared: 'ghost', path: 'muted', obstacle: 'threshold', ring: 'threshold', blocked: 'outage', chosen: 'mode-1', target: 'mode-1' } as const;
export type Key = keyof typeof KEYS;

/** What is drawn of a loop, and in which colour. */
export function keysOf(driven: Driven, compared: Driven | null): [Key, string][] {
  const has = (rows: Rows, pattern: RegExp, isThere: (value: number) => boolean = Number.isFinite): boolean =>
    Object.entries(rows.columns).some(([name, values]) => pattern.test(name) && values.some(isThere));
  const { car, guidance, path, obstacles, blocked } = driven;
  const { known_north: known, north } = car.columns;
  const isThere: Record<Key, boolean> = {
    way: true,
    known: known?.some((value, i) => value !== north?.[i]) ?? false,
    compared: compared !== null,
    path: path.length > 0,
    obstacle: obstacles.length > 0,
    ring: has(guidance, /^range_/, (range) => range < NO_ECHO),
    blocked: blocked.includes(1),
    chosen: has(guidance, /^chosen_direction$/),
    target: has(guidance, /^target_north$/),
  };
  return (Object.entries(KEYS) as [Key, string][]).filter(([key]) => isThere[key]);
}

export class Stage extends Canvas {
  #driven: Driven | null = null;
  #compared: Driven | null = null;
  #time = 0;
  #isFollowing = true;

  show(driven: Driven | null, compared: Driven | null): void {
    this.#driven = driven;
    this.#compared = compared;
    this.redraw();
  }

  setTime(time: number): void {
    this.#time = time;
    this.redraw();
  }

  follow(isFollowing: boolean): void {
    this.#isFollowing = isFollowing;
    this.redraw();
  }

  #value(rows: Rows, name: string, row: number): number {
    return rows.columns[name]?.[row] ?? Number.NaN;
  }

  #view(driven: Driven, row: number): Camera {
    if (this.#isFollowing) {
      return { north: this.#value(driven.car, 'north', row), east: this.#value(driven.car, 'east', row), scale: this.height / FOLLOWED };
    }
    let [south, north, west, east] = [Infinity, -Infinity, Infinity, -Infinity];
    const include = (n: number, e: number): void => {
      [south, north, west, east] = [Math.min(south, n), Math.max(north, n), Math.min(west, e), Math.max(east, e)];
    };
    for (const { car } of [driven, ...(this.#compared ? [this.#compared] : [])]) {
      const [n, e] = [car.columns['north'], car.columns['east']];
      n?.forEach((value, i) => include(value, e?.[i] ?? 0));
    }
    for (let i = 0; i < driven.obstacles.length; i += 3) include(driven.obstacles[i] as number, driven.obstacles[i + 1] as number);
    const scale = Math.min((this.width - 60) / Math.max(8, east - west), (this.height - 60) / Math.max(8, north - south));
    return { north: (south + north) / 2, east: (west + east) / 2, scale };
  }

  protected override draw(context: CanvasRenderingContext2D): void {
    const driven = this.#driven;
    if (!driven || driven.car.time.length === 0) return;
    const row = rowAt(driven.car.time, this.#time);
    const view = this.#view(driven, row);
    const at = (north: number, east: number): [number, number] => [this.width / 2 + (east - view.east) * view.scale, this.height / 2 - (north - view.north) * view.scale];
    const line = (norths: ArrayLike<number>, easts: ArrayLike<number>, colour: string, width: number, dash: number[] = []): void => {
      context.beginPath();
      for (let i = 0; i < norths.length; i++) context.lineTo(...at(norths[i] as number, easts[i] as number));
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.setLineDash(dash);
      context.stroke();
      context.setLineDash([]);
    };
    drawGrid(context, view, this.size);
    const even = driven.path.filter((_, i) => i % 2 === 0);
    const odd = driven.path.filter((_, i) => i % 2 === 1);
    line(even, odd, palette.value.muted, 1, [6, 5]);
    this.#drawObstacles(context, driven, view, at);
    if (this.#compared) line(this.#compared.car.columns['north'] ?? [], this.#compared.car.columns['east'] ?? [], palette.value.ghost, 1.5, [4, 5]);
    const { columns } = driven.car;
    line(columns['known_north'] ?? [], columns['known_east'] ?? [], palette.value.second, 1);
    line(columns['north'] ?? [], columns['east'] ?? [], palette.value.estimate, 2);
    if (driven.guidance.time.length > 0) this.#drawGuidance(context, driven, row, view, at);
    if (this.#compared) this.#drawCar(context, this.#compared, rowAt(this.#compared.car.time, this.#time), view, at, palette.value.ghost);
    this.#drawCar(context, driven, row, view, at, palette.value.ink);
    this.#drawScale(context, view);
  }

  #drawObstacles(context: CanvasRenderingContext2D, { obstacles }: Driven, view: Camera, at: (n: number, e: number) => [number, number]): void {
    for (let i = 0; i < obstacles.length; i += 3) {
      context.beginPath();
      context.arc(...at(obstacles[i] as number, obstacles[i + 1] as number), Math.max(3, (obstacles[i + 2] as number) * view.scale), 0, 2 * Math.PI);
      context.fillStyle = palette.value.threshold;
      context.fill();
    }
  }

  /** What guidance saw and chose at the last decision before the instant. */
  #drawGuidance(context: CanvasRenderingContext2D, driven: Driven, row: number, view: Camera, at: (n: number, e: number) => [number, number]): void {
    const { guidance, car } = driven;
    const decision = rowAt(guidance.time, this.#time);
    const [north, east, yaw] = ['north', 'east', 'yaw'].map((name) => this.#value(car, name, row)) as [number, number, number];
    const [x, y] = at(north, east);
    this.#drawSectors(context, driven, decision, x, y, view.scale);
    for (let axis = 0; axis < AXES; axis++) {
      const range = this.#value(guidance, `range_${axis + 1}`, decision);
      if (!Number.isFinite(range)) continue;
      const direction = yaw + FIRST_AXIS + BETWEEN_AXES * axis;
      const end = at(north + range * Math.cos(direction), east + range * Math.sin(direction));
      const isEcho = range < NO_ECHO;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(...end);
      context.strokeStyle = isEcho ? palette.value.threshold : palette.value.hairline;
      context.lineWidth = isEcho ? 1.6 : 1;
      context.stroke();
      if (isEcho) {
        context.beginPath();
        context.arc(...end, 3, 0, 2 * Math.PI);
        context.fillStyle = palette.value.threshold;
        context.fill();
      }
    }
    const target = at(this.#value(guidance, 'target_north', decision), this.#value(guidance, 'target_east', decision));
    context.beginPath();
    context.arc(...target, 4, 0, 2 * Math.PI);
    context.strokeStyle = palette.value['mode-1'];
    context.lineWidth = 2;
    context.stroke();
    const chosen = this.#value(guidance, 'chosen_direction', decision);
    if (Number.isFinite(chosen)) this.#drawArrow(context, x, y, chosen, (SECTORS_AT + 0.9) * view.scale);
  }

  #drawSectors(context: CanvasRenderingContext2D, driven: Driven, decision: number, x: number, y: number, scale: number): void {
    const half = Math.PI / SECTORS;
    for (let i = 0; i < SECTORS; i++) {
      const magnitude = driven.magnitudes[decision * SECTORS + i] ?? 0;
      const isBlocked = driven.blocked[decision * SECTORS + i] === 1;
      if (!(magnitude > 0) && !isBlocked) continue;
      // From north clockwise to the canvas's from east clockwise.
      const middle = (2 * Math.PI * i) / SECTORS - Math.PI / 2;
      const length = scale * Math.min(1, 0.2 + magnitude / 40);
      context.beginPath();
      context.arc(x, y, SECTORS_AT * scale, middle - half, middle + half);
      context.arc(x, y, SECTORS_AT * scale + length, middle + half, middle - half, true);
      context.closePath();
      context.fillStyle = isBlocked ? palette.value.outage : palette.value['estimate-band'];
      context.fill();
    }
  }

  #drawArrow(context: CanvasRenderingContext2D, x: number, y: number, direction: number, length: number): void {
    context.save();
    context.translate(x, y);
    context.rotate(direction);
    context.beginPath();
    context.moveTo(0, 0);
    context.lineTo(0, -length);
    context.moveTo(-5, -length + 8);
    context.lineTo(0, -length);
    context.lineTo(5, -length + 8);
    context.strokeStyle = palette.value['mode-1'];
    context.lineWidth = 2;
    context.stroke();
    context.restore();
  }

  #drawCar(context: CanvasRenderingContext2D, driven: Driven, row: number, view: Camera, at: (n: number, e: number) => [number, number], colour: string): void {
    const [north, east, yaw, steer] = ['north', 'east', 'yaw', 'steer'].map((name) => this.#value(driven.car, name, row)) as [number, number, number, number];
    const [front, rear, track] = driven.size as unknown as [number, number, number];
    const { scale, length, width, wheelbase } = carSize(driven.size, view.scale);
    context.save();
    context.translate(...at(north, east));
    context.rotate(yaw);
    const box = (forward: number, right: number, length: number, width: number, turn: number): void => {
      context.save();
      context.translate(right * scale, -forward * scale);
      context.rotate(turn);
      context.beginPath();
      context.roundRect((-width / 2) * scale, (-length / 2) * scale, width * scale, length * scale, Math.min(width, length) * scale * 0.25);
      context.restore();
    };
    context.lineWidth = 1.5;
    context.strokeStyle = colour;
    box((front + rear) / 2, 0, length, width, 0);
    context.stroke();
    for (const right of [-track / 2, track / 2]) {
      for (const [forward, turn, name] of [[front, steer, right < 0 ? 'brake_fl' : 'brake_fr'], [rear, 0, right < 0 ? 'brake_rl' : 'brake_rr']] as const) {
        box(forward, right, CAR.wheel * wheelbase, CAR.tyre * track, Number.isFinite(turn) ? turn : 0);
        // A wheel that brakes has another colour.
        context.fillStyle = Math.abs(this.#value(driven.car, name, row)) > 20 ? palette.value.threshold : colour;
        context.fill();
      }
    }
    context.restore();
  }

  #drawScale(context: CanvasRenderingContext2D, view: Camera): void {
    const { step, x, y } = drawBar(context, view, this.size);
    context.fillStyle = palette.value.ink;
    context.textAlign = 'left';
    context.textBaseline = 'bottom';
    context.fillText(`${formatSignificant(step, 1)} ${t.units.metres}`, x + 5, y - 3);
  }
}
