/** The canvases of a view as one picture. */

import { palette } from './plot/palette';

/** Put canvases under one another on the panel's colour. */
export function picture(canvases: HTMLCanvasElement[]): HTMLCanvasElement {
  const out = document.createElement('canvas');
  out.width = Math.max(1, ...canvases.map((c) => c.width));
  out.height = Math.max(1, canvases.reduce((sum, c) => sum + c.height, 0));
  const context = out.getContext('2d');
  if (!context) return out;
  context.fillStyle = palette.value.panel;
  context.fillRect(0, 0, out.width, out.height);
  let top = 0;
  for (const canvas of canvases) {
    if (canvas.width > 0 && canvas.height > 0) context.drawImage(canvas, 0, top);
    top += canvas.height;
  }
  return out;
}
