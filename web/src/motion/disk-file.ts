/** A six-accelerometer disk as a file and as numbers, and putting it to use. */

import { motion as say } from '../messages/motion';
import type { Session } from '../session';
import type { Store } from '../state';
import type { DiskSensor, Triple } from './door';

export interface Disk {
  sensors: DiskSensor[];
}

/** Whether a JSON text is a disk rather than a mapping. */
export function isDisk(value: unknown): boolean {
  return typeof value === 'object' && value !== null && 'sensors' in value;
}

function isTriple(value: unknown): value is Triple {
  return Array.isArray(value) && value.length === 3 && value.every((v) => typeof v === 'number' && Number.isFinite(v));
}

/** Read a saved disk; throws a sentence. */
export function readDisk(text: string): Disk {
  const { sensors } = JSON.parse(text) as Partial<Disk>;
  const isSensor = (s: DiskSensor): boolean => isTriple(s?.position) && isTriple(s?.axis) && Number.isFinite(s?.bias);
  if (!Array.isArray(sensors) || sensors.length !== 6 || !sensors.every(isSensor)) throw new Error(say.disk.sensors);
  return { sensors };
}

/** Its 42 numbers: position, axis and bias of sensor after sensor. */
export function numbersOf({ sensors }: Disk): Float64Array {
  return Float64Array.from(sensors.flatMap((s) => [...s.position, ...s.axis, s.bias]));
}

/** Read the open log's disk as this one, null for the drawing, and estimate anew. */
export async function applyDisk(store: Store, session: Session, disk: Disk | null): Promise<void> {
  if (!store.report.value?.channels.some((c) => c.columns.includes('acc6_1'))) {
    store.error.value = say.disk.noDisk;
    return;
  }
  await session.rpc.call('disk_apply', { numbers: disk ? numbersOf(disk) : new Float64Array(0) });
  store.disk.value = disk;
  session.rerun();
}

/** The same for a file's text. */
export async function applySavedDisk(store: Store, session: Session, text: string): Promise<void> {
  try {
    await applyDisk(store, session, readDisk(text));
  } catch (reason) {
    store.error.value = say.disk.unreadable(reason instanceof Error ? reason.message : String(reason));
  }
}
