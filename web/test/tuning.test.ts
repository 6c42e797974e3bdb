import { expect, test } from 'vitest';
import type { Catalogue, ParamSpec } from '../src/door';
import { fromHash, History, sameFor, toHash, UNTUNED, withParam } from '../src/tuning';

const common = { symbol: '', unit: '1', doc: '', source: '' };
const walk: ParamSpec = { ...common, name: 'walk', kind: 'number', default: 1, min: 0, max: 10, scale: 'linear' };
const yaw: ParamSpec = { ...common, name: 'yaw', kind: 'optional', min: -7, max: 7 };
const aid: ParamSpec = { ...common, name: 'aid', kind: 'toggle', default: true };
const variant: ParamSpec = { ...common, name: 'variant', kind: 'choice', default: 'a', options: ['a', 'b'] };
const catalogue: Catalogue = {
  version: '0',
  estimators: [
    { name: 'slope', title: '', doc: '', vehicle: '', needs: [], params: [walk, yaw, aid, variant], columns: [] },
    { name: 'orientation', title: '', doc: '', vehicle: '', needs: [], params: [variant], columns: [] },
  ],
  drives: [{ name: 'hills', title: '', doc: '', duration: 1 }],
  vehicles: [{ name: 'saloon', doc: '' }],
};

test('a value equal to the default is forgotten', () => {
  const tuned = withParam(UNTUNED, 'slope', walk, 2);
  expect(tuned.params['slope']).toEqual({ walk: 2 });
  expect(withParam(tuned, 'slope', walk, 1).params['slope']).toEqual({});
  expect(withParam(withParam(tuned, 'slope', yaw, 0), 'slope', yaw, null).params['slope']).toEqual({ walk: 2 });
});

test('an estimator is run again only for what concerns it', () => {
  const tuned = withParam(UNTUNED, 'slope', walk, 2);
  expect(sameFor('orientation', UNTUNED, tuned)).toBe(true);
  expect(sameFor('slope', UNTUNED, tuned)).toBe(false);
  expect(sameFor('orientation', UNTUNED, { ...tuned, vehicle: 'saloon' })).toBe(false);
  expect(sameFor('slope', UNTUNED, withParam(tuned, 'slope', walk, 1))).toBe(true);
});

test('a drag is undone as a whole, the drag after it by itself', () => {
  const history = new History(0);
  [1, 2, 3].forEach((v) => history.push(v, 'drag'));
  history.endGesture();
  [4, 5].forEach((v) => history.push(v, 'drag'));
  expect(history.undo() && history.now).toBe(3);
  expect(history.undo() && history.now).toBe(0);
  expect(history.undo()).toBe(false);
  expect(history.redo() && history.now).toBe(3);
  expect(history.redo() && history.now).toBe(5);
});

test('a change after an undo forgets what was undone', () => {
  const history = new History(0);
  history.push(1);
  history.undo();
  history.push(2);
  expect(history.canRedo).toBe(false);
  expect(history.now).toBe(2);
});

test('an address brings back drive, seed, room, car, variants drawn beside and every kind of parameter', () => {
  let tuning = withParam(UNTUNED, 'slope', walk, 2.5);
  tuning = withParam(tuning, 'slope', yaw, -1);
  tuning = withParam(tuning, 'slope', aid, false);
  tuning = { ...withParam(tuning, 'slope', variant, 'b'), vehicle: 'saloon' };
  const address = { drive: 'hills', seed: 7, room: 'road' as const, overlays: ['a', 'b'], tuning };
  expect(fromHash(`#${toHash(address)}`, catalogue)).toEqual(address);
});

test('an address from elsewhere cannot bring in what does not exist or is out of range', () => {
  const hash = '#drive=moon&seed=-1&vehicle=tank&slope.walk=99&slope.yaw=x&slope.aid=maybe&slope.variant=c&other.thing=1&room=cellar&overlays=c';
  expect(fromHash(hash, catalogue)).toEqual({ drive: null, seed: null, room: 'overview', overlays: [], tuning: { params: {}, vehicle: null } });
});
