/** Decisions of the motion mode in words: which rule fired, and which statistic against which threshold. */

import { t } from '../messages';
import { motion as say } from '../messages/motion';
import { type Display, formatSignificant, paramUnit } from '../units';

export type Statistic = 'jd' | 'td' | 'fd' | 'yd';
export const STATISTICS: readonly Statistic[] = ['jd', 'td', 'fd', 'yd'];

/** SI units of the statistics and their thresholds. */
export const UNITS: Record<Statistic, string> = { jd: 'm/s^2', td: 'rad/s', fd: 'm/s^2', yd: 'rad/s' };

/** Codes of the column `rule`. */
export const RULES = { keep: 0, force: 1, activity: 2, stop: 3, cornerBegins: 4, cornerEnds: 5, wheelsTurn: 6, learning: 7, filling: 8, wheelsStand: 9, settled: 10, speedGained: 11, turns: 12, fixesStay: 13 } as const;

/** A statistic and what it was compared with. */
export interface Pair {
  value: number;
  threshold: number;
}

/** A change of mode, or the first row. */
export interface Decision {
  time: number;
  /** NaN at the first row. */
  from: number;
  to: number;
  rule: number;
  statistics: Record<Statistic, Pair>;
}

const FIELDS = 13;

/** The decisions as the core gives them: time, from, to, rule, indicator, then each statistic with its threshold. */
export function decisionsOf(flat: Float64Array): Decision[] {
  return Array.from({ length: Math.floor(flat.length / FIELDS) }, (_, i) => {
    const at = (k: number): number => flat[i * FIELDS + k] ?? Number.NaN;
    const pair = (k: number): Pair => ({ value: at(5 + 2 * k), threshold: at(6 + 2 * k) });
    return { time: at(0), from: at(1), to: at(2), rule: at(3), statistics: { jd: pair(0), td: pair(1), fd: pair(2), yd: pair(3) } };
  });
}

/** Index of the decision that holds at an instant; -1 before the first. */
export function decisionAt(decisions: readonly Decision[], time: number): number {
  let [low, high] = [0, decisions.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((decisions[middle] as Decision).time <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** The statistics that a rule compares; empty for one that compares none. */
export function deciding(rule: number): readonly Statistic[] {
  switch (rule) {
    case RULES.force:
      return ['fd'];
    case RULES.activity:
      return ['jd', 'td'];
    case RULES.stop:
      return ['jd', 'td', 'fd'];
    case RULES.settled:
      return ['jd', 'fd'];
    case RULES.turns:
    case RULES.cornerBegins:
    case RULES.cornerEnds:
      return ['yd'];
    default:
      return [];
  }
}

/** A statistic as displayed, with its unit. */
export function shown(statistic: Statistic, value: number, display: Display): string {
  const { factor, label } = paramUnit(UNITS[statistic], display);
  return `${formatSignificant(value * factor)} ${label}`;
}

function name(statistic: Statistic): string {
  return statistic === 'yd' ? '|YD|' : statistic.toUpperCase();
}

/** A statistic against its threshold: `FD 0.31 > 0.16 m/s²`. */
export function comparison(statistic: Statistic, { value, threshold }: Pair, display: Display): string {
  const magnitude = Math.abs(value);
  const { factor } = paramUnit(UNITS[statistic], display);
  return `${name(statistic)} ${formatSignificant(magnitude * factor)} ${magnitude > threshold ? '>' : '≤'} ${shown(statistic, threshold, display)}`;
}

/** What a decision compared: `JD 0.04 ≤ 0.075 m/s², TD …`; empty where its rule compares nothing. */
export function figures({ rule, statistics }: Decision, display: Display): string {
  return deciding(rule).map((statistic) => comparison(statistic, statistics[statistic], display)).join(', ');
}

/** `stationary → straight`, or where a run begins, the mode. */
export function change({ from, to }: Decision): string {
  const mode = (code: number): string => t.modes[code] ?? '–';
  return Number.isFinite(from) ? `${mode(from)} → ${mode(to)}` : mode(to);
}

/** Where a run stands at an instant. */
export interface Moment {
  time: number;
  /** Code of the column `rule` at the instant itself. */
  rule: number;
  statistics: Record<Statistic, Pair>;
}

/** What the rules compare with besides the thresholds of the moment. */
export interface Settings {
  yawOn: number;
  yawOff: number;
  escapeTime: number;
}

/** What holds at an instant, why, and what would end it: sentences. `label` names an instant. */
export function explain(decision: Decision | null, now: Moment, settings: Settings, display: Display, label: (time: number) => string): string[] {
  if (!decision) return [say.explain.none];
  const mode = t.modes[decision.to] ?? '–';
  const name = `${mode.charAt(0).toUpperCase()}${mode.slice(1)}`;
  const lasted = Math.max(0, now.time - decision.time).toFixed(1);
  const why = say.because[decision.rule] ?? '';
  const what = figures(decision, display);
  const head = Number.isFinite(decision.from) || decision.rule !== RULES.keep ? say.explain.since(name, label(decision.time), lasted, why) : say.explain.start(name, lasted);
  return [`${head}${what === '' ? '.' : say.explain.figures(what)}`, ...whatNext(decision, now, settings, display)];
}

function whatNext({ to: mode, rule: told }: Decision, now: Moment, settings: Settings, display: Display): string[] {
  const { explain: texts } = say;
  const { statistics, rule } = now;
  if (rule === RULES.learning) return [texts.learning];
  if (mode === 0 && told === RULES.fixesStay) return [texts.restByFixes];
  if (mode === 0) {
    const fd = shown('fd', statistics.fd.threshold, display);
    return [settings.escapeTime > 0 ? texts.rest(fd, formatSignificant(settings.escapeTime, 2)) : texts.restPaper(fd)];
  }
  const yaw = mode === 2 ? texts.corner(shown('yd', settings.yawOff, display)) : texts.straight(shown('yd', settings.yawOn, display));
  if (rule === RULES.wheelsTurn || rule === RULES.speedGained || rule === RULES.turns) return [yaw, texts.vetoed(say.because[rule] ?? '')];
  if (rule === RULES.filling) return [yaw, texts.filling];
  const above = (['jd', 'td', 'fd'] as const).filter((s) => statistics[s].value > statistics[s].threshold).map((s) => s.toUpperCase());
  return [yaw, texts.moving(above.length > 0 ? texts.above(above.join(' and ')) : texts.quiet)];
}
