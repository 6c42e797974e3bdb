/** Roll, pitch and yaw with their bands. */

import { h } from '../dom';
import { t } from '../messages';
import { words } from '../panel/params';
import type { Session } from '../session';
import { estimatorOf, isRunnable, OVERLAID, overlayRun, type Store, trouble } from '../state';
import type { History, Tuning } from '../tuning';
import type { GridItem } from '../worker/rpc';
import { type CurveSpec, type LaneSpec, STYLES } from './curves';
import { GateLane } from './gate';
import type { TableColumn } from './table';
import { TimeView, type TimeViewOptions } from './time-view';
import { drawnVariants, mainVariant, VARIANT_CURVES, variantMenu } from './variants';

type Choice = 'orientation' | 'gnss_ins' | 'both';

/** The estimate's name in the legend: with its variant, once others are drawn beside it. */
function mainName(store: Store): string {
  return drawnVariants(store).length > 0 ? `${t.curves.estimate}, ${words(mainVariant(store) ?? '')}` : t.curves.estimate;
}

function lane(key: 'roll' | 'pitch' | 'yaw'): LaneSpec {
  const of = (estimator: string, which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator, which });
  const curves: CurveSpec[] = [
    { id: 'truth', label: t.curves.truth, source: 'truth', column: key, style: STYLES.truth, isOn: true },
    { id: 'gnss_ins', label: t.attitudeSource.gnss_ins, source: of('gnss_ins', 'current'), column: key, sigma: `${key}_sigma`, style: STYLES.second, isOn: true },
    ...VARIANT_CURVES.map(([variant, style]): CurveSpec => ({ id: variant, label: words(variant), source: of(overlayRun(variant), 'current'), column: key, style, isOn: true })),
    { id: 'orientation', label: t.curves.estimate, name: mainName, source: of('orientation', 'current'), column: key, sigma: `${key}_sigma`, style: STYLES.estimate, isOn: true },
    { id: 'ghost', label: t.curves.ghost, source: of('orientation', 'previous'), column: key, style: STYLES.ghost, isOn: true },
    { id: 'ghost2', label: t.curves.ghost, source: of('gnss_ins', 'previous'), column: key, style: STYLES.ghost, isOn: true },
  ];
  if (key === 'yaw') {
    curves.unshift({ id: 'course', label: t.curves.course, source: 'drive', column: 'course', style: STYLES.raw, isOn: false });
  }
  return {
    key,
    title: t.lanes[key],
    quantity: 'angle',
    unit: 'rad',
    curves,
    isCircular: key === 'yaw',
    least: key === 'yaw' ? 0.1 : 0.035,
    weight: 1,
  };
}

class AttitudeView extends TimeView {
  #gate: GateLane;

  constructor(store: Store, session: Session, options: TimeViewOptions) {
    super(store, session, options);
    this.#gate = new GateLane(store, session);
    this.lanes[this.lanes.length - 1]?.element.after(this.#gate.element);
  }

  protected override extraItems(): GridItem[] {
    return this.#gate?.items() ?? [];
  }

  protected override takeExtra(times: Float64Array, columns: Float64Array[]): void {
    this.#gate.take(times, columns);
  }

  protected override extraColumns(): TableColumn[] {
    return this.#gate?.tableColumns() ?? [];
  }
}

/** The view with the choice between the two estimators that know the attitude, and between variants of one. */
export function attitudeView(store: Store, session: Session, history: History<Tuning>, compass: { button: HTMLElement; warning: HTMLElement }): TimeView {
  const choose = h('div.segmented', { role: 'radiogroup', 'aria-label': t.views.source });
  const axes = h('span.axes-note');
  const view = new AttitudeView(store, session, {
    title: t.views.attitude,
    key: '1',
    lanes: [lane('roll'), lane('pitch'), lane('yaw')],
    controls: [choose, variantMenu(store, history), compass.button, axes],
  });
  view.body.prepend(compass.warning);
  store.display.watch((display) => {
    axes.textContent = display.axes === 'sae' ? t.display.sae : t.display.iso;
    axes.title = display.axes === 'sae' ? t.display.saeNote : t.display.isoNote;
  });
  let chosen: Choice = 'orientation';
  const apply = (choice: Choice): void => {
    chosen = choice;
    const drawn = drawnVariants(store);
    for (const l of view.lanes) {
      l.offer(({ id, source }) => {
        if (typeof source !== 'object') return true;
        const isFurther = estimatorOf(source.estimator) !== source.estimator;
        return (choice === 'both' || estimatorOf(source.estimator) === choice) && (!isFurther || drawn.includes(id));
      });
    }
    view.changed();
  };
  const inputs = (['orientation', 'gnss_ins', 'both'] as const).map((choice) => {
    const input = h('input', { type: 'radio', name: 'attitude-source', value: choice, checked: choice === 'orientation' });
    input.addEventListener('change', () => {
      isChosen = true;
      apply(choice);
    });
    choose.append(h('label', {}, input, h('span', {}, t.attitudeSource[choice])));
    return { choice, input };
  });
  let isChosen = false;
  /** Until someone chooses: the orientation filter, or the other one where that cannot run or is not to be believed. */
  const propose = (): void => {
    const run = store.run('orientation').value;
    const isHopeless = !isRunnable(store.report.value, 'orientation') || run.error !== null || trouble(run) !== null;
    const proposed = isHopeless && isRunnable(store.report.value, 'gnss_ins') ? 'gnss_ins' : 'orientation';
    const entry = inputs.find(({ choice }) => choice === proposed);
    if (isChosen || !entry || entry.input.checked) return;
    entry.input.checked = true;
    apply(proposed);
  };
  store.report.on(() => {
    isChosen = false;
    propose();
  });
  store.run('orientation').on(propose);
  /** Someone who asks for a variant wants to see it. */
  const showVariants = (): void => {
    const entry = inputs[0];
    if (chosen !== 'gnss_ins' || !entry) return apply(chosen);
    isChosen = true;
    entry.input.checked = true;
    apply('orientation');
  };
  store.overlays.on((now, before) => (now.length > before.length ? showVariants() : apply(chosen)));
  store.tuning.on((now, before) => {
    const [own, was] = [now.params[OVERLAID], before.params[OVERLAID]];
    if (own?.['variant'] !== was?.['variant']) showVariants();
    // Someone who tunes what is shown goes on seeing it, however bad it gets.
    else if (own !== was && chosen !== 'gnss_ins') isChosen = true;
  });
  apply('orientation');
  return view;
}
