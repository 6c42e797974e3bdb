/** Poses of the six-accelerometer disk and what a calibrated axis looks like beside the drawing. */

import type { Triple } from './door';

const G = 9.80665;

/** Specific force of each pose, body axes, m/s^2, in the order of their names. */
export const POSES: readonly Triple[] = [
  [0, 0, -G],
  [0, 0, G],
  [-G, 0, 0],
  [G, 0, 0],
  [0, G, 0],
  [0, -G, 0],
];

/** The pose whose specific force is nearest. */
export function nearestPose(force: Triple): number {
  const distance = (pose: Triple): number => Math.hypot(...pose.map((v, k) => v - (force[k] ?? 0)));
  return POSES.reduce((best, pose, i) => (distance(pose) < distance(POSES[best] as Triple) ? i : best), 0);
}

/** The axis of a sensor as drawn: 1 to 3 tangential at 0, 120 and 240 degrees, 4 to 6 along z. */
function drawnAxis(sensor: number): Triple {
  const azimuth = ((sensor % 3) * 2 * Math.PI) / 3;
  return sensor < 3 ? [-Math.sin(azimuth), Math.cos(azimuth), 0] : [0, 0, 1];
}

/** Scale of an axis: its length. */
export function scaleOf(axis: Triple): number {
  return Math.hypot(...axis);
}

/** Angle between a sensor's axis and the drawing's, degrees. */
export function leaning(axis: Triple, sensor: number): number {
  const [x, y, z] = drawnAxis(sensor);
  const cross = Math.hypot(axis[1] * z - axis[2] * y, axis[2] * x - axis[0] * z, axis[0] * y - axis[1] * x);
  return (Math.atan2(cross, axis[0] * x + axis[1] * y + axis[2] * z) * 180) / Math.PI;
}
