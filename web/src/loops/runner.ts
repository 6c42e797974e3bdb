/** The loop that is set, driven anew whenever it changes, and what it is compared with. */

import type { ParamSpec } from '../door';
import { Signal } from '../signal';
import type { Driven, FromWorker, LoopCatalogue, LoopInfo, Settings, ToWorker, Wanted } from './door';

export type Comparison = 'nothing' | 'before' | 'off';

/** The settings that switch the controllers of a loop off. */
export const OFF: Settings = { yaw_target: 'off', avoidance: false };

/** The groups of parameters that shape each loop most; the others follow. */
const FIRST: Readonly<Record<string, readonly string[]>> = {
  obstacle_course: ['avoidance', 'following'],
  j_turn: ['yaw_moment'],
  corner: ['yaw_moment', 'following'],
  goal: ['following'],
};

/** The parameters of a loop: those of all, what shapes it most in front, with the loop's own values as defaults. */
export function specsOf(catalogue: LoopCatalogue, { name, settings }: LoopInfo): ParamSpec[] {
  const first = FIRST[name] ?? [];
  const rank = (group: string): number => (first.includes(group) ? first.indexOf(group) : first.length);
  const groups = [...catalogue.parameters].sort((a, b) => rank(a.name) - rank(b.name));
  return groups.flatMap(({ specs }) => specs.map((spec) => ({ ...spec, default: settings[spec.name] ?? null }) as ParamSpec));
}

export class Runner {
  readonly catalogue = new Signal<LoopCatalogue | null>(null);
  /** Why nothing can be driven any more. */
  readonly dead = new Signal<string | null>(null);
  readonly failed = new Signal<string | null>(null);
  /** Share of what is wanted that has been driven; null while nothing is. */
  readonly progress = new Signal<number | null>(null);
  readonly driven = new Signal<Driven | null>(null);
  readonly compared = new Signal<Driven | null>(null);
  readonly comparison = new Signal<Comparison>('before');
  #port: Pick<Worker, 'postMessage'>;
  #next = 1;
  /** The wish for the loop as it is set, and for the one without control. */
  #ids: { now: number; off: number } = { now: 0, off: 0 };
  #before: Driven | null = null;
  #off: Driven | null = null;
  #isHeld = false;
  #asked: { name: string; settings: Settings; seed: number } | null = null;

  constructor(port: Pick<Worker, 'postMessage' | 'addEventListener'>) {
    this.#port = port;
    port.addEventListener('message', (event) => this.#receive((event as MessageEvent<FromWorker>).data));
    port.addEventListener('error', () => this.#die(''));
    this.comparison.on(() => {
      this.#show();
      if (this.comparison.value === 'off' && !this.#off && this.#asked) this.#post([this.#wishOff(this.#asked)]);
    });
  }

  /** Drive a loop; what was wanted before and is not there yet is given up. */
  drive(name: string, settings: Settings, seed: number): void {
    if (this.dead.value !== null) return;
    const isOther = this.#asked?.name !== name;
    this.#asked = { name, settings, seed };
    if (isOther) this.#before = null;
    else if (!this.#isHeld && this.driven.value) this.#before = this.driven.value;
    this.#off = null;
    this.#ids.now = this.#next++;
    const wanted: Wanted[] = [{ id: this.#ids.now, name, settings, seed }];
    if (this.comparison.value === 'off') wanted.push(this.#wishOff(this.#asked));
    this.#post(wanted);
  }

  /** While a slider is dragged, the comparison is with what was before the drag. */
  hold(isHeld: boolean): void {
    if (isHeld && !this.#isHeld && this.driven.value) this.#before = this.driven.value;
    this.#isHeld = isHeld;
  }

  #wishOff({ name, settings, seed }: { name: string; settings: Settings; seed: number }): Wanted {
    this.#ids.off = this.#next++;
    return { id: this.#ids.off, name, settings: { ...settings, ...OFF }, seed };
  }

  #post(drive: Wanted[]): void {
    this.progress.value = 0;
    this.failed.value = null;
    this.#port.postMessage({ drive } satisfies ToWorker);
  }

  #die(reason: string): void {
    this.progress.value = null;
    this.dead.value = reason;
  }

  #show(): void {
    const { value } = this.comparison;
    const compared = value === 'before' ? this.#before : value === 'off' ? this.#off : null;
    this.compared.value = compared?.name === this.driven.value?.name ? compared : null;
  }

  #receive(message: FromWorker): void {
    if ('catalogue' in message) this.catalogue.value = message.catalogue;
    else if ('dead' in message) this.#die(message.dead);
    // What was wanted before something newer is past.
    else if (message.id !== this.#ids.now && message.id !== this.#ids.off) return;
    else if ('fraction' in message) this.progress.value = message.fraction;
    else if ('failed' in message) {
      this.progress.value = null;
      this.failed.value = message.failed;
    } else this.#take(message.id, message.driven);
  }

  #take(id: number, driven: Driven): void {
    if (id === this.#ids.now) this.driven.value = driven;
    else this.#off = driven;
    if (this.comparison.value !== 'off' || this.#off) this.progress.value = null;
    this.#show();
  }
}
