/** One lamp per sensor: do its innovations agree with the stated noise, and if not, in which direction? */

import { h, prose } from '../dom';
import type { Column, Consistency } from '../door';
import { t } from '../messages';
import { formatFixed, formatSignificant } from '../units';
import { words } from './params';

/** Why the mean is where it is, as a sentence. */
export function explain(c: Consistency): string {
  const band = `${formatFixed(c.band[0], 2)}–${formatFixed(c.band[1], 2)}`;
  const sensor = sensorOf(c);
  const factor = formatSignificant(c.sigma_factor, 2);
  if (c.verdict === 'cautious') return t.consistency.cautious(sensor, formatSignificant(1 / c.sigma_factor, 2), factor);
  if (c.verdict === 'optimistic') return t.consistency.optimistic(sensor, factor, factor);
  if (c.mean >= c.band[0] && c.mean <= c.band[1]) return t.consistency.within(band);
  return t.consistency.nearly(band, formatSignificant(Math.max(c.sigma_factor, 1 / c.sigma_factor), 3));
}

/** What the core knows of why a sensor's innovations are not as stated: its column's words after the first sentence. */
export function reason({ column }: Consistency, columns: Column[]): string {
  const doc = columns.find((c) => c.name === column)?.doc ?? '';
  const end = doc.indexOf('. ');
  return end < 0 ? '' : doc.slice(end + 2);
}

function sensorOf(c: Consistency): string {
  return words(c.column.replace(/_nis$|^nis_/, ''));
}

/** The lamps of all sensors; null without innovations. */
export function lamps(now: Consistency[], before: Consistency[] | null, columns: Column[]): HTMLElement | null {
  if (now.length === 0) return null;
  const head = [t.consistency.sensor, ...(before ? [t.score.before] : []), t.consistency.mean, t.consistency.inside];
  const rows = now.flatMap((c) => {
    const earlier = before?.find((b) => b.column === c.column);
    const row = h(
      'tr',
      { title: explain(c) },
      h('th', { scope: 'row' }, lamp(c), sensorOf(c)),
      before && h('td.before', {}, earlier ? formatSignificant(earlier.mean) : '–'),
      h('td', {}, formatSignificant(c.mean)),
      h('td', {}, `${formatFixed(100 * c.inside, 0)} %`),
    );
    if (c.verdict === 'consistent') return [row];
    return [row, h('tr.why', {}, h('td', { colspan: head.length }, explain(c), ' ', ...prose(reason(c, columns))))];
  });
  return h(
    'table.numbers.lamps',
    {},
    h('caption', {}, t.consistency.title),
    h('thead', {}, h('tr', {}, ...head.map((text) => h('th', { scope: 'col' }, text)))),
    h('tbody', {}, ...rows),
  );
}

/** The lamps alone, in one row, for a glance. */
export function lampRow(now: Consistency[]): HTMLElement | null {
  if (now.length === 0) return null;
  const entries = now.map((c) =>
    h('li', { title: explain(c) }, lamp(c), sensorOf(c), ' ', h('b', {}, formatSignificant(c.mean, 2))),
  );
  return h('ul.lamp-row', { 'aria-label': t.consistency.title }, ...entries);
}

function lamp(c: Consistency): HTMLElement {
  return h('span.lamp', { 'data-verdict': c.verdict, role: 'img', 'aria-label': t.consistency.verdicts[c.verdict] });
}
