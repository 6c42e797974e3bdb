/** The views over time of the room: errors or states, and what each measurement was worth. */

import { h } from '../dom';
import { t } from '../messages';
import { navigation as say } from '../messages/navigation';
import type { Session } from '../session';
import type { Store } from '../state';
import { type LaneSpec, sourceOf, STYLES } from '../views/curves';
import { Lane } from '../views/lane';
import type { TableColumn } from '../views/table';
import { TimeView } from '../views/time-view';
import { TimeArea } from '../plot/time-area';
import type { GridItem } from '../worker/rpc';
import { BASE, errorLanes, type Measurement, MEASUREMENTS, satelliteLane, SLOW, stateLanes, statisticLane } from './curves';
import { verdicts, VerdictStrip } from './verdict-strip';

/** Drawn beside the navigation filter where the drive has what they need. */
const QUIET = ['gnss', 'attitude'];

type Shown = 'errors' | 'states';

/** Errors against the truth and states in one place, of which one is looked at; without truth there are states only. */
export class ErrorViews {
  readonly views: Record<Shown, TimeView>;
  readonly elements: HTMLElement[];
  readonly #inputs: Record<Shown, HTMLInputElement>[] = [];
  readonly #store: Store;

  constructor(store: Store, session: Session, note: (where: Shown) => HTMLElement) {
    this.#store = store;
    const texts = say;
    this.views = {
      errors: new TimeView(store, session, { title: texts.errors, key: '1', id: 'navigation-errors', lanes: errorLanes(), quiet: QUIET, controls: [this.#choice('errors'), note('errors')] }),
      states: new TimeView(store, session, { title: texts.states, key: '1', id: 'navigation-states', lanes: stateLanes(), quiet: QUIET, controls: [this.#choice('states'), note('states')] }),
    };
    this.elements = [this.views.errors.element, this.views.states.element];
    store.report.watch(() => this.#show(this.#hasTruth() ? 'errors' : 'states'));
  }

  #hasTruth(): boolean {
    return this.#store.report.value?.truth.includes('n') ?? false;
  }

  #choice(where: Shown): HTMLElement {
    const input = (value: Shown): HTMLInputElement => {
      const made = h('input', { type: 'radio', name: `navigation-${where}`, value });
      made.addEventListener('change', () => {
        this.#show(value);
        this.#inputs.find((i) => i[value].checkVisibility())?.[value].focus();
      });
      return made;
    };
    const inputs = { errors: input('errors'), states: input('states') };
    this.#inputs.push(inputs);
    return h('div.segmented', { role: 'radiogroup', 'aria-label': say.choose }, h('label', {}, inputs.errors, h('span', {}, say.errorsShort)), h('label', {}, inputs.states, h('span', {}, say.statesShort)));
  }

  #show(shown: Shown): void {
    for (const inputs of this.#inputs) {
      inputs[shown].checked = true;
      inputs.errors.disabled = !this.#hasTruth();
    }
    for (const name of ['errors', 'states'] as const) this.views[name].element.hidden = name !== shown;
    this.views[shown].changed();
  }

  get shown(): TimeView {
    return this.views.errors.element.hidden ? this.views.states : this.views.errors;
  }
}

/** A lane of the slow states, of which one is looked at: each has its unit, so each has its lane. */
function slowLanes(): LaneSpec[] {
  const of = (which: 'current' | 'previous'): { estimator: string; which: 'current' | 'previous' } => ({ estimator: BASE, which });
  return SLOW.map(([column, unit]) => ({
    key: column, title: say.slow[column] ?? column, quantity: unit === 'rad/s' ? 'rate' : 'plain', unit, hasTimeAxis: true, least: unit === '1' ? 0.01 : unit === 'rad/s' ? 2e-4 : 0.02, weight: 1,
    curves: [
      { id: 'truth', label: t.curves.truth, source: 'truth', column, style: STYLES.truth, isOn: true },
      { id: 'now', label: t.curves.estimate, source: of('current'), column, sigma: `${column}_sigma`, style: STYLES.estimate, isOn: true },
      { id: 'ghost', label: t.curves.ghost, source: of('previous'), column, style: STYLES.ghost, isOn: true },
    ],
  }));
}

/** Innovations of each sensor, refusals, satellites, and a slowly changing state of one's choice. */
export class MeasurementView extends TimeView {
  readonly #strip: VerdictStrip;
  readonly #host = h('div.strip', { role: 'img', 'aria-label': say.verdictLabel });
  readonly #count = h('span.now');
  readonly #select = h('select.lane-select', { 'aria-label': say.chooseMeasurement });
  #chosen: Measurement = 'position';

  constructor(store: Store, session: Session) {
    const lanes = [statisticLane(), satelliteLane(), ...slowLanes()];
    super(store, session, { title: say.measurements, key: '3', id: 'navigation-measurements', lanes });
    const key = (kind: string, label: string): HTMLElement => h('span.mode-key', {}, h('span.verdict-swatch', { 'data-kind': kind }), label);
    const legend = h('div.legend', {}, h('h3.lane-title', {}, say.verdicts), key('used', say.used), key('refused', say.refused), this.#count);
    this.body.prepend(h('div.strip-lane', {}, legend, this.#host));
    this.#strip = new VerdictStrip(this.#host);
    this.#host.append(new TimeArea(store).element);
    store.window.watch((window) => this.#strip.setWindow(window));
    store.report.on(() => this.#fill());
    store.run(BASE).on((now, before) => {
      if (now.reply !== before.reply) this.#fill();
    });
    this.#select.addEventListener('change', () => this.#choose(this.#select.value as Measurement));
    this.lanes[0]?.element.querySelector('.lane-title')?.after(this.#select);
    this.#chooseSlow();
    this.#fill();
    this.#choose('position');
  }

  /** The measurements that the drive has and the filter takes. */
  #present(): (typeof MEASUREMENTS)[number][] {
    const inside = this.store.run(BASE).value.reply?.current.score.consistency ?? [];
    const found = MEASUREMENTS.filter(([name]) => inside.some((c) => c.column === `${name}_nis`));
    return found.length > 0 ? found : [MEASUREMENTS[0]];
  }

  #fill(): void {
    const present = this.#present();
    this.#select.replaceChildren(...present.map(([name]) => h('option', { value: name, selected: name === this.#chosen }, say.sensors[name] ?? name)));
    if (!present.some(([name]) => name === this.#chosen)) this.#choose(present[0]?.[0] ?? 'position');
    this.#host.style.height = `${present.length * 14}px`;
  }

  #choose(name: Measurement): void {
    this.#chosen = name;
    this.lanes[0]?.offer((curve) => curve.id.split(':')[0] === name);
    this.changed();
  }

  #chooseSlow(): void {
    const slow = this.lanes.slice(2);
    const selects: HTMLSelectElement[] = [];
    const apply = (column: string, isMoved: boolean): void => {
      slow.forEach((lane: Lane, i) => {
        const isShown = lane.spec.key === column;
        lane.element.hidden = !isShown;
        lane.offer(() => isShown);
        const select = selects[i];
        if (select) select.value = column;
        if (select && isShown && isMoved) select.focus();
      });
      this.changed();
    };
    for (const lane of slow) {
      const select = h('select.lane-select', { 'aria-label': say.chooseSlow }, ...SLOW.map(([column]) => h('option', { value: column }, say.slow[column] ?? column)));
      select.addEventListener('change', () => apply(select.value, true));
      lane.element.querySelector('.lane-title')?.replaceWith(select);
      selects.push(select);
    }
    apply(SLOW[0][0], false);
  }

  #source(): string | null {
    return sourceOf(this.store, { id: '', label: '', source: { estimator: BASE, which: 'current' }, column: 'position_accepted', style: STYLES.estimate, isOn: true });
  }

  protected override extraItems(): GridItem[] {
    const source = this.#source();
    return source === null ? [] : this.#present().map(([name]) => ({ source, column: `${name}_accepted`, step: true }));
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    const rows = this.#present().map(([name], i) => {
      const values = columns[i] ?? new Float64Array();
      return { label: say.sensors[name] ?? name, stretches: verdicts(times, values) };
    });
    this.#strip.setRows(rows);
  }

  protected override extraColumns(): TableColumn[] {
    const source = this.#source();
    return source === null ? [] : this.#present().map(([name]) => ({ source, column: `${name}_accepted`, label: say.acceptedColumn(say.sensors[name] ?? name), quantity: 'plain', unit: '1' }));
  }
}
