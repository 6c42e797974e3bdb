import { expect, test } from 'vitest';
import type { EstimatorInfo, NumberParam, RunReport } from '../src/door';
import { errorsOf } from '../src/motion/aids';
import { type Decision, decisionAt, decisionsOf, explain, figures, type Moment, RULES, type Settings } from '../src/motion/explain';
import { fromText, isLabels, labelsOf, NO_LABELS, stretchesOf, toCsv, toJson } from '../src/motion/labels';
import { leaning, nearestPose, POSES } from '../src/motion/poses';
import { moved } from '../src/motion/threshold';
import { UNTUNED } from '../src/tuning';
import { DEFAULT_DISPLAY } from '../src/units';

const SI = { ...DEFAULT_DISPLAY, angle: 'rad' as const };
const SETTINGS: Settings = { yawOn: 0.05, yawOff: 0.035, escapeTime: 0.3 };

/** Time, from, to, rule, indicator, then each statistic with its threshold. */
const row = (time: number, from: number, to: number, rule: number): number[] => [time, from, to, rule, 1, 0.02, 0.075, 0.003, 0.008, 0.31, 0.16, -0.06, 0.05];
const decisions = (...rows: number[][]): Decision[] => decisionsOf(Float64Array.from(rows.flat()));
const moment = (time: number, rule = 0, jd = 0.02): Moment => ({
  time, rule,
  statistics: { jd: { value: jd, threshold: 0.075 }, td: { value: 0.003, threshold: 0.008 }, fd: { value: 0.1, threshold: 0.16 }, yd: { value: 0, threshold: 0.05 } },
});

test('the decision that holds is the last one at or before the instant', () => {
  const list = decisions(row(0, Number.NaN, 0, RULES.learning), row(5, 0, 1, RULES.force), row(9, 1, 2, RULES.cornerBegins));
  expect([-1, 0, 4.9, 5, 8.99, 9, 100].map((time) => decisionAt(list, time))).toEqual([-1, 0, 0, 1, 1, 2, 2]);
});

test('a decision names the statistics that its rule compares, without the sign of a left turn', () => {
  const [launch, corner, wheels, settled] = decisions(row(5, 0, 1, RULES.force), row(9, 1, 2, RULES.cornerBegins), row(12, 1, 0, RULES.wheelsStand), row(15, 1, 0, RULES.settled));
  expect(figures(launch as Decision, SI)).toBe('FD 0.310 > 0.160 m/s²');
  expect(figures(corner as Decision, SI)).toBe('|YD| 0.0600 > 0.0500 rad/s');
  expect(figures(corner as Decision, DEFAULT_DISPLAY)).toBe('|YD| 3.44 > 2.86 °/s');
  expect(figures(wheels as Decision, SI)).toBe('');
  expect(figures(settled as Decision, SI)).toMatch(/^JD 0\.0200 ≤ 0\.0750 m\/s², FD 0\.310/);
});

test('the sentence says since when, why, and what would end it', () => {
  const [rest, straight] = decisions(row(5, 1, 0, RULES.stop), row(9, 0, 1, RULES.force));
  const label = (time: number): string => `${time} s`;
  const standing = explain(rest as Decision, moment(7), SETTINGS, SI, label).join(' ');
  expect(standing).toMatch(/^Stationary since 5 s \(2\.0 s\): .*tables 1 and 2\): JD 0\.0200 ≤ 0\.0750 m\/s², TD 0\.00300 ≤/);
  expect(standing).toMatch(/Rest ends when FD exceeds 0\.160 m\/s², or JD and TD both stay above theirs for 0\.30 s, or the car gains speed or turns\.$/);
  const [shaken] = decisions(row(5, 1, 0, RULES.fixesStay));
  expect(explain(shaken as Decision, moment(7), SETTINGS, SI, label).join(' ')).toMatch(/: satellite fixes stay in their place, .* car\. Rest ends when the car gains speed or turns, or when it is shaken/);
  const driving = (m: Moment): string => explain(straight as Decision, m, SETTINGS, SI, label).join(' ');
  expect(driving(moment(10, 0, 0.2))).toMatch(/A corner begins when \|YD\| exceeds 0\.0500 rad\/s\. .*JD is above now\.$/);
  expect(driving(moment(10))).toMatch(/none is above now\.$/);
  expect(driving(moment(10, RULES.wheelsTurn))).toMatch(/the speed says that the car moves: no rest\.$/);
  expect(driving(moment(10, RULES.speedGained))).toMatch(/Everything is quiet, but the forward force has gained speed since the last rest: no rest\.$/);
  expect(explain(null, moment(0), SETTINGS, SI, label)).toEqual(['Nothing has been decided yet.']);
});

test('labels survive both kinds of file and end where nothing is said', () => {
  const labels = labelsOf([{ time: 0, to: 0 }, { time: 2.5, to: 1 }], 9);
  expect(toCsv(labels)).toBe('t,truth_mode\n0,0\n2.5,1\n9,\n');
  expect(fromText(toCsv(labels), 'a')).toEqual(labels);
  expect(fromText(`\uFEFF${toJson(labels)}`, 'a')).toEqual(labels);
  expect(stretchesOf(labels, 20)).toEqual([{ t0: 0, t1: 2.5, mode: 0 }, { t0: 2.5, t1: 9, mode: 1 }]);
  expect(stretchesOf(Float64Array.of(3, 2), 20)).toEqual([{ t0: 3, t1: 20, mode: 2 }]);
  expect(labelsOf([], 9)).toBe(NO_LABELS);
});

test('what is no label is named by its row', () => {
  const refused = (text: string): string => {
    try {
      fromText(text, 'x.csv');
    } catch (reason) {
      return (reason as Error).message;
    }
    return '';
  };
  expect(refused('t,truth_mode\n0,1\n1,3\n')).toMatch(/x\.csv: row 3:/);
  expect(refused('t,truth_mode\n0,1\n0,2\n')).toMatch(/row 3: its time/);
  expect(refused('t,truth_mode\nx,1\n')).toMatch(/row 2/);
  expect(refused('[{"time": 0, "mode": 5}]')).toMatch(/row 1/);
  expect(refused('[{"time": 0, "mode": ')).toMatch(/row 1/);
});

test('labels are told from logs and mappings by their first characters', () => {
  expect(['t,truth_mode\n0,1', '[{"time": 0, "mode": 1}]', '[\n  {"mode":1,"time":0}'].every(isLabels)).toBe(true);
  expect(['t,truth_mode,accel_x\n0,1,2', '{"version": 1}', '[1, 2]', 't,accel_x\n'].some(isLabels)).toBe(false);
});

const number = (name: string, value: number): NumberParam => ({ kind: 'number', name, default: value, min: value / 10, max: value * 10, scale: 'log', symbol: '', unit: '', doc: '', source: '' });
const INFO: EstimatorInfo = {
  name: 'motion_mode', title: '', doc: '', vehicle: '', needs: [], columns: [],
  params: [number('jd_threshold', 0.075), number('td_threshold', 0.008), number('fd_threshold', 0.16), number('yaw_on', 0.05), { kind: 'toggle', name: 'adaptive', default: true, symbol: '', unit: '', doc: '', source: '' }],
};
const LINES = { jd: 0.03, td: 0.0041234, fd: 0.15 };

test('a line that is dragged stops following the noise floor, and so do the others, where they lie', () => {
  expect(moved(UNTUNED, INFO, 'jd', 0.05, LINES).params['motion_mode']).toEqual({ adaptive: false, jd_threshold: 0.05, td_threshold: 0.00412, fd_threshold: 0.15 });
  const fixed = { ...UNTUNED, params: { motion_mode: { adaptive: false } } };
  expect(moved(fixed, INFO, 'fd', 99, LINES).params['motion_mode']).toEqual({ adaptive: false, fd_threshold: 1.6 });
  expect(moved(UNTUNED, INFO, 'yaw_on', 0.1, LINES).params['motion_mode']).toEqual({ yaw_on: 0.1 });
});

test('a rest is taken for the nearest pose, and an axis leans by its angle to the drawing', () => {
  expect(POSES.map((pose) => nearestPose(pose.map((v) => 0.9 * v + 0.5) as [number, number, number]))).toEqual([0, 1, 2, 3, 4, 5]);
  expect(leaning([0, 0, 1.02], 3)).toBeCloseTo(0, 12);
  expect(leaning([0, 1, 0.0175], 0)).toBeCloseTo(1.0, 1);
});

test('errors of a run are those of position, the velocity vector and the mean of the angles', () => {
  const metric = (column: string, rmse: number): object => ({ column, rmse });
  const metrics = [metric('v_north', 3), metric('v_east', 4), metric('v_down', 0), metric('roll', 0.01), metric('pitch', 0.02), metric('yaw', 0.06)];
  const report = { score: { metrics, consistency: [], position: { rmse_horizontal: 7 }, mode: null } } as unknown as RunReport;
  expect(errorsOf(report)).toEqual({ position: 7, velocity: 5, attitude: 0.03 });
  expect(errorsOf({ score: { metrics: [], consistency: [], position: null, mode: null } } as unknown as RunReport)).toEqual({ position: null, velocity: null, attitude: null });
});
