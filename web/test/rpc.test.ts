import { expect, test } from 'vitest';
import { Cancelled, type FromWorker, latest, RpcClient, type ToWorker, Unloaded } from '../src/worker/rpc';

/** A worker that only remembers what it was told. */
function fakePort(): { client: RpcClient; sent: ToWorker[]; receive(message: FromWorker): void } {
  const sent: ToWorker[] = [];
  let listener: (event: MessageEvent) => void = () => {};
  const port = {
    postMessage: (message: ToWorker) => sent.push(message),
    addEventListener: (_type: string, handler: unknown) => {
      listener = handler as typeof listener;
    },
  };
  const client = new RpcClient(port as unknown as Worker);
  return { client, sent, receive: (data) => listener({ data } as MessageEvent) };
}

test('answers find their question whatever their order', async () => {
  const { client, receive } = fakePort();
  const first = client.call('csv', { source: 'drive' });
  const second = client.call('csv', { source: 'drive' });
  receive({ id: 2, ok: true, value: 'b' });
  receive({ id: 1, ok: true, value: 'a' });
  expect(await first).toBe('a');
  expect(await second).toBe('b');
});

test('progress reaches the asker and an error is its sentence', async () => {
  const { client, receive } = fakePort();
  const seen: number[] = [];
  const pending = client.start('run', { estimator: 'slope', params: {}, vehicle: null }, (p) => seen.push(p.rows));
  receive({ id: 1, progress: { done: false, fraction: 0.5, stage: 'estimating', rows: 7 } });
  receive({ id: 1, ok: false, message: 'row 3: expected a number, found `x`', cancelled: false });
  await expect(pending.answer).rejects.toThrow('row 3: expected a number, found `x`');
  expect(seen).toEqual([7]);
});

test('that the readers could not be loaded is no sentence of the core but a kind of its own', async () => {
  const { client, receive } = fakePort();
  const pending = client.start('open', { kind: 'files', files: [], mapping: null });
  receive({ id: 1, ok: false, message: '', cancelled: false, isUnloaded: true });
  await expect(pending.answer).rejects.toBeInstanceOf(Unloaded);
});

test('cancelling tells the worker, and only the worker says that it is over', async () => {
  const { client, sent, receive } = fakePort();
  const pending = client.start('run', { estimator: 'slope', params: {}, vehicle: null });
  pending.cancel();
  expect(sent[1]).toEqual({ cancel: 1 });
  receive({ id: 1, ok: false, message: '', cancelled: true });
  await expect(pending.answer).rejects.toBeInstanceOf(Cancelled);
});

test('a dead worker leaves nobody waiting', async () => {
  const { client, receive } = fakePort();
  let reason = '';
  client.onDead = (message) => {
    reason = message;
  };
  const waiting = client.call('csv', { source: 'drive' });
  receive({ dead: 'unreachable' });
  await expect(waiting).rejects.toBeInstanceOf(Cancelled);
  expect(reason).toBe('unreachable');
});

test('many requests while one is under way lead to exactly one more', async () => {
  let runs = 0;
  let release: () => void = () => {};
  const request = latest(
    () =>
      new Promise<void>((resolve) => {
        runs += 1;
        release = resolve;
      }),
  );
  for (let i = 0; i < 5; i++) request();
  expect(runs).toBe(1);
  release();
  await new Promise((resolve) => setTimeout(resolve));
  expect(runs).toBe(2);
  release();
  await new Promise((resolve) => setTimeout(resolve));
  expect(runs).toBe(2);
});
