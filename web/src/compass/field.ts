/** Strength and dip of the measured field along the road, beside those of the model. */

import { h, onResize } from '../dom';
import { compass as say } from '../messages/compass';
import { withGaps } from '../plot/gaps';
import { type CurveStyle, TimePlot } from '../plot/time-plot';
import type { Session } from '../session';
import type { Store } from '../state';
import { STYLES } from '../views/curves';
import { convert, unitLabel } from '../units';
import { latest } from '../worker/rpc';

const CURVES: { id: 'raw' | 'calibrated' | 'model'; style: CurveStyle }[] = [
  { id: 'raw', style: STYLES.raw },
  { id: 'calibrated', style: { colour: 'estimate', width: 1.5 } },
  { id: 'model', style: { colour: 'truth', width: 1.2, dash: [5, 4] } },
];
const LANES = [
  { column: 'field_norm', quantity: 'plain', least: 2 },
  { column: 'dip', quantity: 'angle', least: 0.03 },
] as const;

export class FieldPlots {
  readonly element = h('div.field-plots');
  #store: Store;
  #session: Session;
  #plots: { host: HTMLElement; plot: TimePlot; title: HTMLElement }[] = [];
  readonly load = latest(() => this.#load());

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const keys = CURVES.map(({ id, style }) => h('span.key', {}, h('span.swatch', { 'data-colour': style.colour, 'data-dashed': style.dash ? true : undefined }), say.curves[id]));
    LANES.forEach((lane, i) => {
      const host = h('div.plot', { role: 'img', 'aria-label': say.fieldLabel(say.lanes[lane.column]) });
      const title = h('h4', {}, say.lanes[lane.column]);
      this.element.append(h('div.field-legend', {}, title, ...(i === 0 ? keys : [])), host);
      const plot = new TimePlot(host, { styles: CURVES.map((c) => c.style), isLog: false, hasTimeAxis: i === LANES.length - 1 });
      this.#plots.push({ host, plot, title });
      onResize(host, (width, height) => plot.setSize(width, height));
    });
    store.display.on(this.load);
  }

  async #load(): Promise<void> {
    const { t0, t1 } = this.#store.span.value;
    const source = (id: string, column: string): { source: string; column: string; step: boolean } => ({
      source: id === 'calibrated' ? 'compass:calibrated' : 'compass:raw',
      column: id === 'model' ? `${column}_model` : column,
      step: false,
    });
    const items = LANES.flatMap((lane) => CURVES.map(({ id }) => source(id, lane.column)));
    const reply = await this.#session.rpc.call('grid', { items, t0, t1, buckets: 700 });
    const times = reply.times.map((time) => time - t0);
    const display = this.#store.display.value;
    LANES.forEach(({ quantity, column, least }, k) => {
      const entry = this.#plots[k];
      if (!entry) return;
      entry.title.textContent = `${say.lanes[column]} [${unitLabel(quantity, 'uT', display)}]`;
      entry.plot.setWindow(0, t1 - t0);
      const curves = CURVES.map((_, i) => {
        const values = reply.columns[k * CURVES.length + i] ?? new Float64Array();
        const line = values.length > 0 ? withGaps(values, (v) => convert(quantity, v, display)) : [];
        return { line, isShown: line.length > 0, isBandShown: false };
      });
      entry.plot.setData(times, curves, convert(quantity, least, display));
    });
  }
}
