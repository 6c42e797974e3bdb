/** The figures of the paper's table 3 for what is shown: standard deviation, least and greatest of three accelerations. */

import { h } from '../dom';
import { road as say } from '../messages/road';
import type { Session } from '../session';
import { isRunnable, type Store } from '../state';
import { formatFixed, formatTime } from '../units';
import { latest } from '../worker/rpc';

const ROWS = [
  { name: 'measured', source: 'drive', column: 'accel_x' },
  { name: 'estimated', source: 'slope:current', column: 'accel_x_estimated' },
  { name: 'net', source: 'slope:current', column: 'accel_x_net' },
] as const;
/** The paper's table 3. */
const PAPER = [
  { name: 'paperMeasured', values: [0.77166, -2.1, 2.34] },
  { name: 'paperEstimated', values: [0.73598, -1.63, 1.89] },
] as const;

export class AccelerationFigures {
  readonly element = h('div.figures', { hidden: true });
  #store: Store;
  #session: Session;
  #isWhole = false;
  #body = h('tbody');
  #caption = h('caption');
  readonly refresh = latest(() => this.#load());

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const whole = h('input', { type: 'checkbox' });
    whole.addEventListener('change', () => {
      this.#isWhole = whole.checked;
      this.refresh();
    });
    const f = say.figures;
    const head = [f.deviation, f.min, f.max].map((name) => h('th', { scope: 'col' }, name));
    const table = h('table', {}, this.#caption, h('thead', {}, h('tr', {}, h('th', { scope: 'col' }, f.unit), ...head)), this.#body);
    this.element.append(table, h('label.whole', {}, whole, f.whole));
    store.window.on(() => {
      if (!this.#isWhole) this.refresh();
    });
    store.report.on(this.refresh);
    store.run('slope').on((now, before) => {
      if (now.reply !== before.reply) this.refresh();
    });
  }

  async #load(): Promise<void> {
    const store = this.#store;
    this.element.hidden = !isRunnable(store.report.value, 'slope');
    if (this.element.hidden || !this.element.checkVisibility()) return;
    const { t0, t1 } = this.#isWhole ? store.span.value : store.window.value;
    const spreads = await this.#session.rpc.call('spread', { items: ROWS.map(({ source, column }) => ({ source, column })), t0, t1 });
    const isWhole = t0 <= store.span.value.t0 && t1 >= store.span.value.t1;
    const { caption, names, paperTitle } = say.figures;
    this.#caption.textContent = caption(isWhole ? null : [formatTime(store.sinceStart(t0)), formatTime(store.sinceStart(t1))]);
    const row = (name: string, values: readonly (number | undefined)[], title?: string): HTMLElement =>
      h('tr', title === undefined ? {} : { title, class: 'paper' }, h('th', { scope: 'row' }, name), ...values.map((value) => h('td', {}, formatFixed(value, 3))));
    this.#body.replaceChildren(
      ...ROWS.map(({ name }, i) => row(names[name], [2, 3, 4].map((k) => spreads[i]?.[k]))),
      ...PAPER.map(({ name, values }) => row(names[name], values, paperTitle)),
    );
  }
}
