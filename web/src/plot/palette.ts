/** Colours of canvases, read from the style sheet so that both follow the theme. */

import { Signal } from '../signal';
import type { Store } from '../state';

const NAMES = [
  'ink', 'muted', 'hairline', 'panel', 'estimate', 'estimate-band', 'second', 'second-band', 'third', 'third-band', 'truth', 'ghost', 'raw',
  'threshold', 'blind', 'blind-band', 'good', 'bad', 'mode-0', 'mode-1', 'mode-2', 'outage', 'grid',
  'v-switch', 'v-triad', 'v-ekf_model', 'v-ekf_nomodel', 'v-model', 'v-road', 'v-robust', 'v-robust_ax',
  'gate-0', 'gate-1', 'gate-2', 'gate-3', 'gate-4', 'gate-5', 'gate-6',
] as const;
export type ColourName = (typeof NAMES)[number];
export type Palette = Record<ColourName, string>;

function read(): Palette {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()])) as Palette;
}

export const palette = new Signal<Palette>({} as Palette);

/** The colour of a motion mode; what is not known has the colour of hairlines. */
export function modeColour(mode: number): string {
  if (mode === 0 || mode === 1 || mode === 2) return palette.value[`mode-${mode}`];
  return palette.value.hairline;
}

/** Follow the chosen theme, or the system's. */
export function followTheme(store: Store): void {
  const system = matchMedia('(prefers-color-scheme: dark)');
  const apply = (): void => {
    const { value } = store.theme;
    const isDark = value === 'dark' || (value === 'auto' && system.matches);
    document.documentElement.dataset['theme'] = isDark ? 'dark' : 'light';
    palette.value = read();
  };
  system.addEventListener('change', apply);
  store.theme.watch(apply);
}

/** The font of canvases. */
export const CANVAS_FONT = '11px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif';
