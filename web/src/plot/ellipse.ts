/** Error ellipses on a map. */

/** The ellipse of a position's errors: half axes in m and the bearing of the longer one, rad clockwise from north. */
export interface Ellipse {
  north: number;
  east: number;
  long: number;
  short: number;
  bearing: number;
}

/** `reach` sigmas about a place, from the sigmas to the north and east and their correlation; null if something is unknown. */
export function ellipseOf(north: number, east: number, sigmaNorth: number, sigmaEast: number, correlation: number, reach = 3): Ellipse | null {
  const [nn, ee] = [sigmaNorth ** 2, sigmaEast ** 2];
  // Without a correlation the axes lie to the north and the east.
  const ne = (Number.isFinite(correlation) ? correlation : 0) * sigmaNorth * sigmaEast;
  const middle = (nn + ee) / 2;
  const spread = Math.hypot((nn - ee) / 2, ne);
  const [long, short] = [Math.sqrt(middle + spread), Math.sqrt(Math.max(0, middle - spread))];
  if (![north, east, long].every(Number.isFinite)) return null;
  return { north, east, long: reach * long, short: reach * short, bearing: 0.5 * Math.atan2(2 * ne, nn - ee) };
}

/** Those of a row of ellipses that are `apart` px from the one before and larger than `least` px, at `scale` px per metre. */
export function readable(ellipses: readonly Ellipse[], scale: number, apart = 34, least = 2.5): Ellipse[] {
  const out: Ellipse[] = [];
  for (const ellipse of ellipses) {
    if (ellipse.long * scale < least) continue;
    const last = out[out.length - 1];
    // Large ones are further apart, so that they can be told from one another.
    const distance = last ? Math.hypot(ellipse.north - last.north, ellipse.east - last.east) * scale : Infinity;
    if (distance >= Math.max(apart, 0.7 * ellipse.long * scale)) out.push(ellipse);
  }
  return out;
}

/** Draw the outline of an ellipse; `project` gives the place on the canvas. */
export function traceEllipse(context: CanvasRenderingContext2D, ellipse: Ellipse, project: (north: number, east: number) => [number, number], scale: number): void {
  const [x, y] = project(ellipse.north, ellipse.east);
  context.beginPath();
  // The canvas turns clockwise from the right, a bearing from the top.
  context.ellipse(x, y, ellipse.long * scale, Math.max(0.5, ellipse.short * scale), ellipse.bearing - Math.PI / 2, 0, 2 * Math.PI);
}
