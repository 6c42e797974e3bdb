/** The doctor's module: loaded once there is a drive whose sensors are to be examined, and given them as they were read. */

import type { Diagnosis } from '../compass/door';
import type { Door, DriveHead, DrivePart } from '../door';
import { files as say } from '../messages/files';
import type { Calibrated, Rest } from '../motion/door';

/** The doctor as the worker sees it (crates/doctor). */
export interface DoctorDoor {
  begin_parts(...head: DriveHead): void;
  add_part(...part: DrivePart): void;
  end_parts(): void;
  compass(year: number, latitude: number, longitude: number, applied: Float64Array, withField: boolean): Diagnosis | null;
  /** Times and columns along the road. */
  field(isCalibrated: boolean): Float64Array[];
  disk_rests(shortest: number): Rest[];
  disk_calibrate(poses: Float64Array): Calibrated;
}

/** The core as the doctor sees it. */
export type Patient = Pick<Door, 'hand_over' | 'next_part' | 'keep_field'>;

export class Surgery {
  #load: () => Promise<DoctorDoor>;
  #loading: Promise<DoctorDoor> | null = null;
  /** Whether the doctor has the drive that is open. */
  #isThere = false;
  /** The numbers of what has been applied to the drive: none or twelve. */
  #applied = new Float64Array(0);

  constructor(load: () => Promise<DoctorDoor>) {
    this.#load = load;
  }

  /** Another drive is open. */
  leave(): void {
    this.#isThere = false;
    this.#applied = new Float64Array(0);
  }

  /** What has been applied: offset and distortion, whether it is planar, yaw of the mount, clock; nothing for none. */
  apply(numbers: ArrayLike<number>): void {
    this.#applied = Float64Array.from(numbers);
  }

  /** The doctor with the open drive's sensors. A failed loading is tried again the next time. */
  async #examine(patient: Patient): Promise<DoctorDoor> {
    this.#loading ??= this.#load().catch((reason: unknown) => {
      this.#loading = null;
      throw new Error(say.doctor(reason instanceof Error ? reason.message : String(reason)));
    });
    const doctor = await this.#loading;
    if (!this.#isThere) {
      doctor.begin_parts(...patient.hand_over());
      for (let part = patient.next_part(); part; part = patient.next_part()) doctor.add_part(...part);
      doctor.end_parts();
      this.#isThere = true;
    }
    return doctor;
  }

  async compass(patient: Patient, year: number, latitude: number, longitude: number, withField: boolean): Promise<Diagnosis | null> {
    const doctor = await this.#examine(patient);
    return this.#guarded(() => {
      const diagnosis = doctor.compass(year, latitude, longitude, this.#applied, withField);
      if (withField) patient.keep_field(doctor.field(false), doctor.field(true));
      return diagnosis;
    });
  }

  async rests(patient: Patient, shortest: number): Promise<Rest[]> {
    const doctor = await this.#examine(patient);
    return this.#guarded(() => doctor.disk_rests(shortest));
  }

  async calibrate(patient: Patient, poses: Float64Array): Promise<Calibrated> {
    const doctor = await this.#examine(patient);
    return this.#guarded(() => doctor.disk_calibrate(poses));
  }

  /** A doctor that breaks takes nothing else with it: the next examination begins with another. */
  #guarded<T>(action: () => T): T {
    try {
      return action();
    } catch (reason) {
      if (!(reason instanceof WebAssembly.RuntimeError)) throw reason;
      this.#loading = null;
      this.#isThere = false;
      throw new Error(say.doctor(reason.message));
    }
  }
}

export async function loadDoctor(): Promise<DoctorDoor> {
  const { default: init, Doctor } = await import('../generated/drivescope_doctor.js');
  await init();
  return new Doctor() as unknown as DoctorDoor;
}
