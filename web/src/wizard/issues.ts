/** What speaks against a mapping, each as one sentence with numbers, and with what corrects it. */

import { columns as say } from '../messages/columns';
import { formatFixed } from '../units';
import type { Clash, Correction, Examined, Found, Mapping, Trial } from './door';
import { change, doubts, inWords, setDelay, setMount, signalsOf, takeAll, takeColumn } from './mapping';

export interface Issue {
  /** What it is about, for the name of its button. */
  what: string;
  text: string;
  columns: string[];
  /** The mapping put right; null where nothing simple does that. */
  fix: ((mapping: Mapping) => Mapping) | null;
}

export interface Against {
  mapping: Mapping;
  /** What the mapping makes of the log. */
  trial: Trial | null;
  examined: Examined;
  /** Where what physics proposes contradicts itself. */
  weak: Clash[];
  /** What the log was read with at first. */
  first: Mapping;
}

function corrected(mapping: Mapping, corrections: Correction[], { 2: choices }: Examined): Mapping {
  return corrections.reduce((m, { signal, unit, scale }) => change(m, signal, { unit, scale }, choices), mapping);
}

/** How a few columns are read, as text. */
function readingOf(mapping: Mapping, columns: string[]): string {
  return JSON.stringify(columns.map((column) => signalsOf(mapping, column).map((signal) => [signal, mapping.signals[signal] ?? mapping.time])));
}

/** Everything that speaks against a mapping, what is measured before what is only proposed. */
export function issuesOf(against: Against): Issue[] {
  const { mapping, trial, examined, weak, first } = against;
  const [found, , choices] = examined;
  const doubt = doubts(mapping, found, choices);
  const doubtful = new Set(doubt.columns);
  const isWeak = new Set(weak.flatMap((c) => c.columns));
  const take = (columns: string[]): Issue['fix'] => {
    const those = columns.filter((c) => doubtful.has(c) && !isWeak.has(c));
    return those.length > 0 ? (m) => those.reduce((now, column) => takeColumn(now, found, column), m) : null;
  };
  const clashes = (trial?.clashes ?? []).map((clash): Issue => ({
    what: clash.columns.join(', '),
    text: clash.text,
    columns: clash.columns,
    fix: clash.corrections.length > 0 ? (m) => corrected(m, clash.corrections, examined) : take(clash.columns),
  }));
  const told = new Set(clashes.flatMap((c) => c.columns));
  const views = found.columns.filter((c) => doubtful.has(c.column) && !told.has(c.column) && !isWeak.has(c.column));
  const otherwise = views.map(({ column, why }): Issue => ({
    what: column,
    text: say.otherwise(column, inWords(mapping, column, choices), inWords(found.mapping, column, choices), why),
    columns: [column],
    fix: take([column]),
  }));
  // What the file says of itself stays said; it is no issue any more where the reading was changed and agrees with the rest.
  const isFirst = JSON.stringify(mapping) === JSON.stringify(first);
  const stands = (columns: string[]): boolean => (columns.length === 0 ? isFirst : readingOf(mapping, columns) === readingOf(first, columns));
  const said = found.findings.filter((f) => f.weight === 'contradiction' && stands(f.columns) && !f.columns.some((c) => told.has(c)));
  const stated = said.map((f): Issue => ({
    what: f.columns.join(', ') || say.names,
    text: f.text,
    columns: f.columns,
    fix: f.columns.length === 0 && !found.names_believed ? (m) => takeAll(m, found) : take(f.columns),
  }));
  const placed = doubt.channels.flatMap((channel) => placing(channel, mapping, found));
  return [...clashes, ...stated, ...otherwise.filter((o) => !stated.some((s) => s.fix && s.columns.includes(o.what))), ...placed];
}

/** A housing that leans, a sensor that is late. */
function placing(channel: string, mapping: Mapping, found: Found): Issue[] {
  const name = say.channels[channel] ?? channel;
  const [mount, late] = [found.mounts.find((m) => m.channel === channel && m.applied), found.delays.find((d) => d.channel === channel && d.applied)];
  const issues: Issue[] = [];
  if (mount && !mapping.mounts?.[channel]) {
    const [roll, pitch, yaw] = [mount.mount.roll_deg, mount.mount.pitch_deg, mount.mount.yaw_deg].map((v) => formatFixed(v, 1)) as [string, string, string];
    const text = say.leans(name, roll, pitch, yaw, formatFixed(mount.sigma_deg, 1), mount.why);
    issues.push({ what: say.leanOf(name), text, columns: [], fix: (m) => setMount(m, channel, mount.mount) });
  }
  if (late && mapping.delays?.[channel] === undefined) {
    const text = say.isLate(name, formatFixed(late.late, 3), formatFixed(late.sigma, 3), late.why);
    issues.push({ what: say.lateOf(name), text, columns: [], fix: (m) => setDelay(m, channel, late.late) });
  }
  return issues;
}
