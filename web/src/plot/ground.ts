/** The ground of what is seen from above: a grid of round lengths, and a bar that tells them. */

import { palette } from './palette';

/** East and north of the middle, m, and CSS px per metre. */
export interface Camera {
  east: number;
  north: number;
  scale: number;
}

/** Width and height of a canvas, CSS px. */
export interface Size {
  width: number;
  height: number;
}

/** A round length near a fifth of the width. */
export function gridStep({ scale }: Camera, width: number): number {
  const wanted = width / 5 / scale;
  const power = 10 ** Math.floor(Math.log10(wanted));
  return power * ([1, 2, 5, 10].find((m) => m * power >= wanted * 0.7) ?? 10);
}

export function drawGrid(context: CanvasRenderingContext2D, { scale, east, north }: Camera, { width, height }: Size): void {
  const step = gridStep({ scale, east, north }, width);
  context.strokeStyle = palette.value.grid;
  context.lineWidth = 1;
  context.beginPath();
  const [halfX, halfY] = [width / 2 / scale, height / 2 / scale];
  for (let e = Math.ceil((east - halfX) / step) * step; e <= east + halfX; e += step) {
    const x = Math.round(width / 2 + (e - east) * scale) + 0.5;
    context.moveTo(x, 0);
    context.lineTo(x, height);
  }
  for (let n = Math.ceil((north - halfY) / step) * step; n <= north + halfY; n += step) {
    const y = Math.round(height / 2 - (n - north) * scale) + 0.5;
    context.moveTo(0, y);
    context.lineTo(width, y);
  }
  context.stroke();
}

/** A bar as long as a step of the grid; gives that length, m, and where the bar begins. */
export function drawBar(context: CanvasRenderingContext2D, camera: Camera, { width, height }: Size): { step: number; x: number; y: number } {
  const step = gridStep(camera, width);
  const [x, y, length] = [10, height - 10, step * camera.scale];
  context.strokeStyle = palette.value.ink;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y);
  context.lineTo(x + length, y);
  context.lineTo(x + length, y - 4);
  context.stroke();
  return { step, x, y };
}
