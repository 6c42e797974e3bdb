/** Which claims have been tried, are being tried and wait for it; one is tried at a time. */

import { Signal } from '../signal';
import type { Finding, FromWorker, Paper, ToWorker } from './door';

export type ClaimState =
  | { readonly kind: 'untried' | 'waiting' | 'stopped' }
  | { readonly kind: 'running'; readonly fraction: number; readonly stage: string }
  | { readonly kind: 'tried'; readonly finding: Finding; readonly seconds: number }
  | { readonly kind: 'failed'; readonly message: string };

const UNTRIED: ClaimState = { kind: 'untried' };

export class Runner {
  readonly papers = new Signal<Paper[] | null>(null);
  /** Why nothing can be tried any more. */
  readonly dead = new Signal<string | null>(null);
  /** The claim that is being tried. */
  readonly current = new Signal<string | null>(null);
  #port: Pick<Worker, 'postMessage'>;
  #claims = new Map<string, Signal<ClaimState>>();
  #waiting: string[] = [];

  constructor(port: Pick<Worker, 'postMessage' | 'addEventListener'>) {
    this.#port = port;
    port.addEventListener('message', (event) => this.#receive((event as MessageEvent<FromWorker>).data));
    port.addEventListener('error', () => this.#die(''));
  }

  /** Where a claim stands. */
  claim(id: string): Signal<ClaimState> {
    let claim = this.#claims.get(id);
    if (!claim) {
      claim = new Signal(UNTRIED);
      this.#claims.set(id, claim);
    }
    return claim;
  }

  /** Try claims one after the other, after those that wait already. */
  run(ids: string[]): void {
    if (this.dead.value !== null) return;
    for (const id of ids) {
      if (id === this.current.value || this.#waiting.includes(id)) continue;
      this.#waiting.push(id);
      this.claim(id).value = { kind: 'waiting' };
    }
    if (this.current.value === null) this.#next();
  }

  /** Give up one claim, whether it is being tried or waits for it. */
  stop(id: string): void {
    this.#waiting = this.#waiting.filter((other) => other !== id);
    this.claim(id).value = { kind: 'stopped' };
    if (this.current.value !== id) return;
    this.#post({ stop: true });
    this.#next();
  }

  /** Give up everything. */
  stopAll(): void {
    for (const id of this.#waiting.splice(0)) this.claim(id).value = { kind: 'stopped' };
    if (this.current.value !== null) this.stop(this.current.value);
  }

  #post(message: ToWorker): void {
    this.#port.postMessage(message);
  }

  #next(): void {
    const id = this.#waiting.shift() ?? null;
    this.current.value = id;
    if (id === null) return;
    this.claim(id).value = { kind: 'running', fraction: 0, stage: '' };
    this.#post({ run: id });
  }

  #die(reason: string): void {
    this.stopAll();
    this.dead.value = reason;
  }

  #receive(message: FromWorker): void {
    const current = this.current.value;
    if ('papers' in message) this.papers.value = message.papers;
    else if ('dead' in message) this.#die(message.dead);
    // What comes from a claim that has been stopped in the meantime is past.
    else if ('running' in message) {
      if (message.running === current) this.claim(current).value = { kind: 'running', fraction: message.fraction, stage: message.stage };
    } else if ('finding' in message) {
      if (message.finding.id === current) this.#end({ kind: 'tried', finding: message.finding, seconds: message.seconds });
    } else if (message.failed === current) this.#end({ kind: 'failed', message: message.message });
  }

  #end(state: ClaimState): void {
    if (this.current.value !== null) this.claim(this.current.value).value = state;
    this.#next();
  }
}
