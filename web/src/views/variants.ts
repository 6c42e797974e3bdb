/** Which variant of orientation is the estimate, and which others are drawn with it. */

import { h } from '../dom';
import type { ChoiceParam } from '../door';
import { t } from '../messages';
import { words } from '../panel/params';
import type { CurveStyle } from '../plot/time-plot';
import { OVERLAID, overlayRun, type Store } from '../state';
import { defaultOf, type History, type Tuning, withParam } from '../tuning';
import { convertDifference, formatSignificant, unitLabel } from '../units';
import { menu } from './header';

/** Width of the menu, px. */
const WIDTH = 560;

const ANGLES = ['roll', 'pitch', 'yaw'] as const;

/** How the curve of a variant is drawn: by a colour and a dash of its own, wherever it stands in the list. */
const CURVES = {
  switch: { colour: 'v-switch', width: 1.4 },
  triad: { colour: 'v-triad', width: 1.4, dash: [2, 3] },
  ekf_model: { colour: 'v-ekf_model', width: 1.4, dash: [9, 3] },
  ekf_nomodel: { colour: 'v-ekf_nomodel', width: 1.4, dash: [5, 3] },
  model: { colour: 'v-model', width: 1.4, dash: [9, 3, 2, 3] },
  road: { colour: 'v-road', width: 1.4, dash: [6, 2] },
  robust: { colour: 'v-robust', width: 1.4 },
  robust_ax: { colour: 'v-robust_ax', width: 1.4, dash: [3, 2] },
} as const satisfies Readonly<Record<string, CurveStyle>>;

/** Every variant that can be drawn, with its style. */
export const VARIANT_CURVES: readonly (readonly [string, CurveStyle])[] = Object.entries(CURVES).map(([name, style]) => [name, { ...style, dash: 'dash' in style ? [...style.dash] : [] }]);

function choice(store: Store): ChoiceParam | null {
  const spec = store.catalogue.value?.estimators.find((e) => e.name === OVERLAID)?.params.find((p) => p.name === 'variant');
  return spec?.kind === 'choice' ? spec : null;
}

/** The variant that is the estimate. */
export function mainVariant(store: Store): string | null {
  const spec = choice(store);
  return spec && String(store.tuning.value.params[OVERLAID]?.['variant'] ?? defaultOf(spec));
}

/** The variants that are drawn beside the estimate. */
export function drawnVariants(store: Store): string[] {
  const main = mainVariant(store);
  return store.overlays.value.filter((variant) => variant !== main);
}

/** The menu of variants, with the errors of those that have run. */
export function variantMenu(store: Store, history: History<Tuning>): HTMLElement {
  const body = h('tbody');
  const head = h('th', { scope: 'colgroup', colspan: ANGLES.length });
  const table = h(
    'table',
    {},
    h('thead', {},
      h('tr', {}, h('th', { scope: 'col', rowspan: 2 }, t.variants.main), h('th', { scope: 'col', rowspan: 2 }, t.variants.overlay), h('th', { scope: 'col', rowspan: 2 }, t.variants.name), head),
      h('tr', {}, ...ANGLES.map((angle) => h('th', { scope: 'col' }, t.lanes[angle])))),
    body,
  );
  const content = h('div.variant-menu', { role: 'group', 'aria-label': t.variants.title }, h('p.note', {}, t.variants.hint), h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': t.variants.title }, table));
  const choose = (variant: string): void => {
    const spec = choice(store);
    if (!spec) return;
    const next = withParam(store.tuning.value, OVERLAID, spec, variant);
    history.push(next);
    store.tuning.value = next;
  };
  const overlay = (variant: string, isOn: boolean): void => {
    const others = store.overlays.value.filter((v) => v !== variant);
    store.overlays.value = isOn ? [...others, variant] : others;
  };
  const rows = new Map<string, { radio: HTMLInputElement; box: HTMLInputElement; cells: HTMLElement[] }>();
  const fill = (): void => {
    rows.clear();
    body.replaceChildren(...(choice(store)?.options ?? []).map((variant) => {
      const name = words(variant);
      const radio = h('input', { type: 'radio', name: 'main-variant', 'aria-label': t.variants.makeMain(name) });
      const box = h('input', { type: 'checkbox', 'aria-label': t.variants.addOverlay(name) });
      radio.addEventListener('change', () => choose(variant));
      box.addEventListener('change', () => overlay(variant, box.checked));
      const cells = ANGLES.map(() => h('td.number'));
      rows.set(variant, { radio, box, cells });
      const swatch = h('span.swatch', { 'data-colour': `v-${variant}`, 'data-dashed': VARIANT_CURVES.some(([v, style]) => v === variant && style.dash?.length) || undefined });
      return h('tr', { 'data-variant': variant }, h('td', {}, radio), h('td', {}, box), h('th', { scope: 'row' }, swatch, h('span', {}, h('strong', {}, name), h('small', {}, t.variants.docs[variant] ?? ''))), ...cells);
    }));
    show();
  };
  const show = (): void => {
    const main = mainVariant(store);
    const { value: display } = store.display;
    head.textContent = t.variants.rmse(unitLabel('angle', 'rad', display));
    for (const [variant, { radio, box, cells }] of rows) {
      const isMain = variant === main;
      radio.checked = isMain;
      box.checked = isMain || store.overlays.value.includes(variant);
      box.disabled = isMain;
      const { reply, running, error } = store.run(isMain ? OVERLAID : overlayRun(variant)).value;
      const isAsked = isMain || store.overlays.value.includes(variant);
      cells.forEach((cell, i) => {
        const metric = isAsked ? reply?.current.score.metrics.find((m) => m.column === ANGLES[i]) : undefined;
        cell.textContent = metric ? formatSignificant(convertDifference('angle', metric.rmse, display)) : i > 0 || !isAsked ? '' : running ? t.variants.running : error ? t.variants.failed : '–';
      });
    }
  };
  store.catalogue.watch(fill);
  store.overlays.on(show);
  store.tuning.on(show);
  store.display.on(show);
  store.run(OVERLAID).on(show);
  for (const [variant] of VARIANT_CURVES) store.run(overlayRun(variant)).on(show);
  return menu(t.variants.button, content, WIDTH);
}
