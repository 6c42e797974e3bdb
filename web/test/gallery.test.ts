import { describe, expect, it } from 'vitest';
import { holds, limitsText } from '../src/gallery/claim';
import type { Figure, Finding, FromWorker, ToWorker } from '../src/gallery/door';
import { Runner } from '../src/gallery/runner';

/** A worker that remembers what it was asked and says what it is told to. */
function fake() {
  const asked: ToWorker[] = [];
  const listeners = new Map<string, (event: unknown) => void>();
  const port = {
    postMessage: (message: ToWorker) => void asked.push(message),
    addEventListener: (type: string, listener: (event: unknown) => void) => void listeners.set(type, listener),
  };
  const runner = new Runner(port as unknown as Worker);
  const say = (data: FromWorker): void => listeners.get('message')?.({ data });
  return { runner, asked, say };
}

const finding = (id: string): Finding => ({ id, figures: [], verdict: 'supported' });
const figure = (value: number, limits: Figure['limits']): Figure => ({ name: 'a', unit: 'm', value, claimed: null, limits });

describe('the runner of claims', () => {
  it('tries one after the other and asks for none twice', () => {
    const { runner, asked, say } = fake();
    runner.run(['a', 'b']);
    runner.run(['a', 'b']);
    expect(asked).toEqual([{ run: 'a' }]);
    expect(runner.claim('b').value.kind).toBe('waiting');
    say({ running: 'a', fraction: 0.5, stage: 'bank' });
    expect(runner.claim('a').value).toEqual({ kind: 'running', fraction: 0.5, stage: 'bank' });
    say({ finding: finding('a'), seconds: 1 });
    expect(runner.claim('a').value.kind).toBe('tried');
    expect(asked).toEqual([{ run: 'a' }, { run: 'b' }]);
    say({ failed: 'b', message: 'no such drive' });
    expect(runner.claim('b').value).toEqual({ kind: 'failed', message: 'no such drive' });
    expect(runner.current.value).toBeNull();
  });

  it('takes nothing from a claim that has been stopped, and goes on with what waits', () => {
    const { runner, asked, say } = fake();
    runner.run(['a', 'b']);
    runner.stop('a');
    expect(asked).toEqual([{ run: 'a' }, { stop: true }, { run: 'b' }]);
    say({ running: 'a', fraction: 0.9, stage: '' });
    say({ finding: finding('a'), seconds: 1 });
    expect(runner.claim('a').value.kind).toBe('stopped');
    expect(runner.current.value).toBe('b');
    runner.stopAll();
    expect(runner.claim('b').value.kind).toBe('stopped');
    expect(runner.current.value).toBeNull();
  });

  it('asks for nothing more once the module cannot go on', () => {
    const { runner, asked, say } = fake();
    runner.run(['a', 'b']);
    say({ dead: 'unreachable' });
    expect(runner.dead.value).toBe('unreachable');
    expect(runner.current.value).toBeNull();
    const before = asked.length;
    runner.run(['b']);
    expect(asked.length).toBe(before);
  });
});

describe('a figure', () => {
  it('says its limits in words, a computed one with three digits', () => {
    expect(limitsText(figure(1, [-Infinity, 0.123456]))).toBe('at most 0.123');
    expect(limitsText(figure(1, [-15, Infinity]))).toBe('at least −15');
    expect(limitsText(figure(1, [28, 34]))).toBe('28 to 34');
    expect(limitsText(figure(1, null))).toBe('for information');
  });

  it('holds at its limits, never without a value, and is not judged without limits', () => {
    expect(holds(figure(34, [28, 34]))).toBe(true);
    expect(holds(figure(Number.NaN, [-Infinity, 1]))).toBe(false);
    expect(holds(figure(1, null))).toBeNull();
  });
});
