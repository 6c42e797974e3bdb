/** Detectors of rest beside the rules of the motion mode: when each takes the car for standing, and its statistic. */

import { h } from '../dom';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import { ModeStrip, type StripRow } from '../plot/mode-strip';
import { stretches } from '../plot/strip';
import { TimeArea } from '../plot/time-area';
import type { Session } from '../session';
import type { Store } from '../state';
import { type CurveSpec, type LaneSpec, sourceOf, STYLES } from '../views/curves';
import type { TableColumn } from '../views/table';
import { TimeView } from '../views/time-view';
import type { GridItem } from '../worker/rpc';

const ESTIMATOR = 'stationarity';
const DETECTORS = ['glrt', 'ared', 'mv'] as const;
type Detector = (typeof DETECTORS)[number];

const of = (estimator: string, which: 'current' | 'previous' = 'current'): CurveSpec['source'] => ({ estimator, which });

function lane(): LaneSpec {
  const curves = DETECTORS.flatMap((name): CurveSpec[] => [
    { id: name, label: say.rest.about[name], source: of(ESTIMATOR), column: name, style: { colour: 'estimate', width: 1.2 }, isOn: true },
    { id: `${name}-threshold`, label: t.curves.threshold, source: of(ESTIMATOR), column: `${name}_threshold`, style: STYLES.threshold, isOn: true },
    { id: `${name}-ghost`, label: t.curves.ghost, source: of(ESTIMATOR, 'previous'), column: `${name}_threshold`, style: STYLES.ghost, isOn: true },
  ]);
  return { key: 'rest', title: say.rest.statistic, quantity: 'plain', unit: '1', curves, isLog: true, least: 1, weight: 1 };
}

/** What a row of the strip is made of. */
interface RestRow {
  label: string;
  curve: CurveSpec;
  /** From the column's value to whether the car stands. */
  stands: (value: number) => number;
}

function row(label: string, source: CurveSpec['source'], column: string, stands: RestRow['stands']): RestRow {
  return { label, stands, curve: { id: column, label, source, column, style: STYLES.estimate, isOn: true } };
}

const isOne = (value: number): number => value;
const isRest = (mode: number): number => (Number.isFinite(mode) ? Number(mode === 0) : Number.NaN);
const ROWS: RestRow[] = [
  ...DETECTORS.map((name) => row(say.rest.names[name], of(ESTIMATOR), `${name}_stationary`, isOne)),
  row(say.rest.rules, of('motion_mode'), 'mode', isRest),
  row(t.curves.truth, 'truth', 'mode', isRest),
];

export class RestView extends TimeView {
  #strip: ModeStrip;
  #host = h('div.strip', { role: 'img', 'aria-label': say.rest.strip });

  constructor(store: Store, session: Session) {
    const choose = h('div.segmented', { role: 'radiogroup', 'aria-label': say.rest.choose });
    super(store, session, { title: say.rest.title, key: '5', id: 'motion-rest', lanes: [lane()], controls: [choose] });
    this.body.prepend(h('div.strip-lane', {}, this.#host));
    this.#strip = new ModeStrip(this.#host);
    this.#host.append(new TimeArea(store).element);
    store.window.watch((window) => this.#strip.setWindow(window));
    for (const name of DETECTORS) {
      const input = h('input', { type: 'radio', name: 'detector', value: name, checked: name === 'glrt' });
      input.addEventListener('change', () => this.#choose(name));
      choose.append(h('label', { title: say.rest.about[name] }, input, h('span', {}, say.rest.names[name])));
    }
    this.#choose('glrt');
    // The rows of the rules follow the runs of another estimator.
    store.run('motion_mode').on((now, before) => {
      if (now.reply !== before.reply) this.refresh();
    });
  }

  #choose(detector: Detector): void {
    this.lanes[0]?.offer((curve) => curve.id.split('-')[0] === detector);
    this.changed();
  }

  #present(): (RestRow & { source: string })[] {
    return ROWS.flatMap((r) => {
      const source = sourceOf(this.store, r.curve);
      return source === null ? [] : [{ ...r, source }];
    });
  }

  protected override extraItems(): GridItem[] {
    return this.#present().map(({ source, curve }) => ({ source, column: curve.column, step: true }));
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    const rows = this.#present().map(({ label, stands }, i): StripRow => ({ label, kind: 'on', stretches: stretches(times, (columns[i] ?? new Float64Array()).map(stands)) }));
    this.#host.style.height = `${Math.max(1, rows.length) * 16}px`;
    this.#strip.setRows(rows);
  }

  protected override extraColumns(): TableColumn[] {
    return this.#present().map(({ source, curve, label }) => ({ source, column: curve.column, label, quantity: 'plain', unit: '1' }));
  }
}
