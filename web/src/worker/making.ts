/** A drive on its way from the module that makes it, by reading or by simulating, into the core. */

import type { Door, DriveHead, DrivePart, Progress } from '../door';

/** A module that makes drives, as the worker sees it. */
export interface Maker {
  head(): DriveHead;
  next_part(): DrivePart | undefined;
  cancel(): void;
}

export class Making {
  #maker: Maker;
  #make: (budget: number) => Progress;
  #door: Door;
  /** How far making came to be done; null before. */
  #made: Progress | null = null;

  /** `make` does some of the work; once that is done, the maker has a drive to hand over. */
  constructor(maker: Maker, make: (budget: number) => Progress, door: Door) {
    this.#maker = maker;
    this.#make = make;
    this.#door = door;
  }

  /** Some of the work: making, or handing over; done when the core has put the drive in place. */
  some(budget: number): Progress {
    if (!this.#made) {
      const progress = this.#make(budget);
      if (!progress.done) return progress;
      this.#made = progress;
      this.#door.begin_parts(...this.#maker.head());
    }
    return { ...this.#made, done: this.#handOver(performance.now() + budget) };
  }

  #handOver(deadline: number): boolean {
    do {
      const part = this.#maker.next_part();
      if (!part) {
        this.#door.end_parts();
        return true;
      }
      this.#door.add_part(...part);
    } while (performance.now() < deadline);
    return false;
  }

  cancel(): void {
    this.#maker.cancel();
    this.#door.cancel_parts();
  }
}
