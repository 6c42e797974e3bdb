/** The compass doctor's knowledge: what the open drive's magnetometer is like, and what has been applied to it. */

import { t } from '../messages';
import { Signal } from '../signal';
import { OVERLAID, type Store } from '../state';
import type { Session } from '../session';
import { type Calibration, type Diagnosis, readCalibration } from './door';
import { type Kept, keep, stillHolds } from './kept';

/** A mount's yaw from which turning the sensor is proposed, rad. */
const TURNED = 0.35;
/** A clock offset from which setting it right is proposed, s, and how well it must be known. */
const LATE = 0.3;
const TIGHT = 0.5;

const PLACE = ['field_year', 'field_latitude', 'field_longitude'] as const;

export class Doctor {
  readonly diagnosis = new Signal<Diagnosis | null>(null);
  /** Whether an examination is under way. */
  readonly isBusy = new Signal(false);
  #store: Store;
  #session: Session;
  #kept: Kept | null = null;

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    store.report.on((report) => {
      this.diagnosis.value = null;
      if (!report || report.is_partial) return;
      const kept = stillHolds(this.#kept, report);
      this.#kept = kept;
      void (kept ? this.apply(kept.calibration, kept.mountYaw, kept.clock) : this.examine(false));
    });
    store.tuning.on((now, before) => {
      const of = (tuning: typeof now): unknown[] => PLACE.map((name) => tuning.params[OVERLAID]?.[name]);
      if (this.hasCompass && of(now).some((value, i) => !Object.is(value, of(before)[i]))) void this.examine(false);
    });
  }

  get hasCompass(): boolean {
    return this.#store.report.value?.channels.some((c) => c.columns.includes('mag_x')) ?? false;
  }

  /** Examine the magnetometer; `withField` also computes the field along the road. */
  async examine(withField: boolean): Promise<void> {
    if (!this.hasCompass) return;
    const report = this.#store.report.value;
    const own = this.#store.tuning.value.params[OVERLAID];
    const [year, latitude, longitude] = PLACE.map((name) => (typeof own?.[name] === 'number' ? (own[name] as number) : Number.NaN)) as [number, number, number];
    this.isBusy.value = true;
    try {
      const diagnosis = await this.#session.rpc.call('compass', { year, latitude, longitude, withField });
      if (this.#store.report.value === report) this.diagnosis.value = diagnosis;
    } catch (reason) {
      this.#fail(reason);
    } finally {
      this.isBusy.value = false;
    }
  }

  /** What is proposed to be set right besides: the mount's yaw and the receiver's clock; 0 is nothing. */
  proposed(): { mountYaw: number; clock: number } {
    const { value } = this.diagnosis;
    const mount = value?.after?.mount_yaw ?? 0;
    const { clock } = value ?? {};
    return {
      mountYaw: value?.calibration && Math.abs(mount) > TURNED ? mount : 0,
      clock: clock && clock.sigma <= TIGHT && Math.abs(clock.offset) > LATE ? clock.offset : 0,
    };
  }

  /** Apply the calibration found. */
  async applyFound(mountYaw: number, clock: number): Promise<void> {
    const { value } = this.diagnosis;
    if (value?.calibration) await this.apply(value.calibration, mountYaw, clock);
  }

  /** Apply a saved calibration. */
  async applySaved(text: string): Promise<void> {
    try {
      await this.apply(readCalibration(text, t.compass.unreadable));
    } catch (reason) {
      this.#fail(reason);
    }
  }

  /** Apply a calibration to the readings as they were, and estimate anew; the results before stay for comparison. */
  async apply(calibration: Calibration, mountYaw = 0, clock = 0): Promise<void> {
    if (!this.hasCompass) {
      this.#store.error.value = t.compass.nothing;
      return;
    }
    try {
      const report = this.#store.report.value;
      await this.#session.rpc.call('compass_apply', { calibration, mountYaw, clock });
      this.#kept = keep(report, calibration, mountYaw, clock);
      this.#session.rerun();
      await this.examine(true);
    } catch (reason) {
      this.#fail(reason);
    }
  }

  /** Take back what has been applied, and estimate anew. */
  async undo(): Promise<void> {
    await this.#session.rpc.call('compass_undo', {});
    this.#kept = null;
    this.#session.rerun();
    await this.examine(true);
  }

  #fail(reason: unknown): void {
    this.#store.error.value = reason instanceof Error ? reason.message : String(reason);
  }
}
