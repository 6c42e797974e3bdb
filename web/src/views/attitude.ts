/** Roll, pitch and yaw with their bands. */

import { h } from '../dom';
import { t } from '../messages';
import type { Session } from '../session';
import { isRunnable, type Store, trouble } from '../state';
import { type CurveSpec, type LaneSpec, STYLES } from './curves';
import { TimeView } from './time-view';

type Choice = 'orientation' | 'gnss_ins' | 'both';

function lane(key: 'roll' | 'pitch' | 'yaw'): LaneSpec {
  const of = (estimator: string, which: 'current' | 'previous'): CurveSpec['source'] => ({ estimator, which });
  const curves: CurveSpec[] = [
    { id: 'truth', label: t.curves.truth, source: 'truth', column: key, style: STYLES.truth, isOn: true },
    { id: 'gnss_ins', label: t.attitudeSource.gnss_ins, source: of('gnss_ins', 'current'), column: key, sigma: `${key}_sigma`, style: STYLES.second, isOn: true },
    { id: 'orientation', label: t.curves.estimate, source: of('orientation', 'current'), column: key, sigma: `${key}_sigma`, style: STYLES.estimate, isOn: true },
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

/** The view with the choice between the two estimators that know the attitude. */
export function attitudeView(store: Store, session: Session): TimeView {
  const choose = h('div.segmented', { role: 'radiogroup', 'aria-label': t.views.source });
  const axes = h('span.axes-note');
  const view = new TimeView(store, session, {
    title: t.views.attitude,
    key: '1',
    lanes: [lane('roll'), lane('pitch'), lane('yaw')],
    controls: [choose, axes],
  });
  store.display.watch((display) => {
    axes.textContent = display.axes === 'sae' ? t.display.sae : t.display.iso;
    axes.title = display.axes === 'sae' ? t.display.saeNote : t.display.isoNote;
  });
  const apply = (choice: Choice): void => {
    for (const l of view.lanes) {
      l.offer((curve) => typeof curve.source !== 'object' || choice === 'both' || curve.source.estimator === choice);
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
  apply('orientation');
  return view;
}
