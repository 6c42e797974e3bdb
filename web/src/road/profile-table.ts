/** The numbers of the road profile for what is shown. */

import { h } from '../dom';
import { t } from '../messages';
import { road as say } from '../messages/road';
import type { Axis } from '../plot/axis';
import type { Store } from '../state';
import { convert, convertDifference, formatDistance, formatFixed, unitLabel } from '../units';
import type { RpcClient } from '../worker/rpc';

const COLUMNS = ['grade', 'grade_sigma', 'altitude', 'altitude_sigma', 'passes'] as const;
const ROWS = 100;

export async function profileTable(store: Store, rpc: RpcClient, axis: Axis): Promise<HTMLTableElement> {
  const display = store.display.value;
  const [from, to] = [axis.place(store.window.value.t0), axis.place(store.window.value.t1)];
  const places = Array.from({ length: ROWS }, (_, i) => from + ((i + 0.5) / ROWS) * (to - from));
  const flat = await rpc.call('values', { items: COLUMNS.map((column) => ({ source: 'road:profile', column })), times: places });
  const { columns, caption } = say.profile;
  const units = [unitLabel('grade', 'rad', display), unitLabel('grade', 'rad', display), 'm', 'm', ''];
  const head = COLUMNS.map((name, i) => h('th', { scope: 'col' }, columns[name], units[i] ? ` [${units[i]}]` : ''));
  const cell = (index: number, value: number): string => {
    if (index === 0) return formatFixed(convert('grade', value, display), 2);
    if (index === 1) return formatFixed(convertDifference('grade', value, display), 2);
    return formatFixed(value, index === 4 ? 0 : 2);
  };
  const body = places.map((place, row) =>
    h('tr', {}, h('th', { scope: 'row' }, formatFixed(place, 1)), ...COLUMNS.map((_, i) => h('td', {}, cell(i, flat[row * COLUMNS.length + i] ?? Number.NaN)))),
  );
  return h(
    'table',
    {},
    h('caption', {}, caption(formatDistance(from), formatDistance(to), ROWS)),
    h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, `${t.axis.column} [m]`), ...head)),
    h('tbody', {}, ...body),
  );
}
