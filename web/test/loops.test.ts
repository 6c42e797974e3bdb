import { beforeEach, expect, test } from 'vitest';
import type { Driven, FromWorker, LoopCatalogue, ToWorker, Wanted } from '../src/loops/door';
import { Runner, specsOf } from '../src/loops/runner';
import { carSize, keysOf } from '../src/loops/stage';

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

/** A loop with one row and what a test adds to it. */
function drivenLoop(more: Partial<Driven>): Driven {
  const rows = (columns: Record<string, number[]>): Driven['car'] => ({ time: Float64Array.of(0), columns: Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, Float64Array.from(values)])) });
  const car = rows({ north: [1], known_north: [1], brake_fl: [0], brake_fr: [0], brake_rl: [0], brake_rr: [0] });
  return { name: 'j_turn', settings: {}, summary: {}, hasFailed: false, car, guidance: rows({}), magnitudes: new Float64Array(), blocked: new Uint8Array(), path: new Float64Array(), obstacles: new Float64Array(), size: Float64Array.of(0.4, -0.4, 0.8), ...more };
}

test('the legend names what is drawn and nothing else', () => {
  const turn = drivenLoop({});
  expect(keysOf(turn, null).map(([key]) => key)).toEqual(['way']);
  expect(keysOf(turn, turn).map(([key]) => key)).toEqual(['way', 'compared']);
  const columns = { target_north: Float64Array.of(3), chosen_direction: Float64Array.of(0.1), range_1: Float64Array.of(Number.NaN), range_2: Float64Array.of(4) };
  const guidance = { time: Float64Array.of(0), columns };
  const course = { guidance, path: Float64Array.of(0, 0, 1, 0), obstacles: Float64Array.of(5, 0, 0.2), car: { time: Float64Array.of(0), columns: { north: Float64Array.of(1), known_north: Float64Array.of(1.1) } } };
  // A range of 4 m is that of an axis without an echo.
  expect(keysOf(drivenLoop(course), null).map(([key]) => key)).toEqual(['way', 'known', 'path', 'obstacle', 'chosen', 'target']);
  columns.range_2[0] = 2;
  expect(keysOf(drivenLoop({ ...course, blocked: Uint8Array.of(0, 1) }), null).map(([key]) => key)).toEqual(['way', 'known', 'path', 'obstacle', 'ring', 'blocked', 'chosen', 'target']);
});

test('a small vehicle is drawn small, a saloon as a saloon, and both can be seen from afar', () => {
  const [small, saloon] = [Float64Array.of(0.8, 0, 0.8), Float64Array.of(1.1562, -1.42272, 1.39)];
  expect(carSize(small, 40).length).toBeCloseTo(1.28, 6);
  // A BMW 320i of those years is 4.2 to 4.4 m long and 1.65 m wide.
  expect(carSize(saloon, 40)).toMatchObject({ length: expect.closeTo(4.13, 1), width: expect.closeTo(1.67, 1), scale: 40 });
  const far = carSize(small, 2);
  expect(far.length * far.scale).toBeCloseTo(20, 6);
});
