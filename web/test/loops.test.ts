import { beforeEach, expect, test } from 'vitest';
import type { Driven, FromWorker, LoopCatalogue, ToWorker, Wanted } from '../src/loops/door';
import { Runner, specsOf } from '../src/loops/runner';

/** A worker whose answers the test gives. */
class FakeWorker {
  sent: ToWorker[] = [];
  #listener: (event: MessageEvent) => void = () => {};
  postMessage(message: ToWorker): void {
    this.sent.push(message);
  }
  addEventListener(type: string, listener: (event: MessageEvent) => void): void {
    if (type === 'message') this.#listener = listener;
  }
  give(message: FromWorker): void {
    this.#listener({ data: message } as MessageEvent);
  }
  wanted(): Wanted[] {
    return this.sent.at(-1)?.drive ?? [];
  }
}

let worker: FakeWorker;
let runner: Runner;

/** Answer a wish with a loop whose seed tells it apart. */
function answer(wish: Wanted | undefined): void {
  if (wish) worker.give({ id: wish.id, driven: { name: wish.name, settings: wish.settings } as Driven });
}

beforeEach(() => {
  worker = new FakeWorker();
  runner = new Runner(worker as unknown as Worker);
  runner.drive('j_turn', {}, 1);
  answer(worker.wanted()[0]);
});

test('what was wanted before something newer is not shown', () => {
  runner.drive('j_turn', { eta: 1 }, 1);
  const old = worker.wanted()[0];
  runner.drive('j_turn', { eta: 2 }, 1);
  answer(old);
  expect(runner.driven.value?.settings).toEqual({});
  answer(worker.wanted()[0]);
  expect(runner.driven.value?.settings).toEqual({ eta: 2 });
});

test('during a drag the comparison is with what was before it, and another loop is compared with nothing', () => {
  runner.hold(true);
  for (const eta of [1, 2, 3]) {
    runner.drive('j_turn', { eta }, 1);
    answer(worker.wanted()[0]);
  }
  expect([runner.driven.value?.settings, runner.compared.value?.settings]).toEqual([{ eta: 3 }, {}]);
  runner.hold(false);
  runner.drive('corner', {}, 1);
  answer(worker.wanted()[0]);
  expect(runner.compared.value).toBeNull();
});

test('without control the same settings are driven with both controllers off', () => {
  runner.drive('j_turn', { eta: 1 }, 7);
  answer(worker.wanted()[0]);
  runner.comparison.value = 'off';
  const [wish] = worker.wanted();
  expect(wish).toMatchObject({ settings: { eta: 1, yaw_target: 'off', avoidance: false }, seed: 7 });
  answer(wish);
  expect(runner.compared.value?.settings['yaw_target']).toBe('off');
  expect(runner.progress.value).toBeNull();
});

test('parameters begin with what shapes the loop, at the loop\'s own values', () => {
  const spec = (name: string) => ({ kind: 'number', name, default: 0, min: 0, max: 9, scale: 'linear', symbol: '', unit: '', doc: '', source: '' }) as const;
  const catalogue: LoopCatalogue = {
    loops: [], car_columns: [], guidance_columns: [],
    parameters: [{ name: 'course', specs: [spec('speed')] }, { name: 'yaw_moment', specs: [spec('eta')] }],
  };
  const specs = specsOf(catalogue, { name: 'j_turn', title: '', doc: '', settings: { speed: 5, eta: 1 } });
  expect(specs.map((s) => [s.name, 'default' in s ? s.default : null])).toEqual([['eta', 1], ['speed', 5]]);
});
