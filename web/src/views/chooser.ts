/** The button that names the open drive and leads to the built-in ones. */

import '../style/chooser.css';
import { h } from '../dom';
import { t } from '../messages';
import type { Store } from '../state';

export function driveChooser(store: Store, show: () => void): HTMLButtonElement {
  const label = h('span.drive-label', {}, '…');
  const button = h('button.drive-chooser', { type: 'button', 'aria-haspopup': 'dialog', title: t.drives.title, onclick: show }, label, h('span.caret', { 'aria-hidden': 'true' }));
  const name = (): void => {
    const { value: report } = store.report;
    const { value: builtIn } = store.builtIn;
    const entry = store.catalogue.value?.drives.find((d) => d.name === builtIn?.name);
    const title = report?.kind === 'file' ? t.header.chosenFile(report.name) : (entry?.title ?? report?.name ?? '…');
    label.textContent = builtIn?.seed == null ? title : t.drives.withSeed(title, String(builtIn.seed));
    button.dataset['drive'] = builtIn?.name ?? '';
    button.setAttribute('aria-label', `${t.header.drive}: ${label.textContent}`);
  };
  store.catalogue.on(name);
  store.report.on(name);
  store.builtIn.on(name);
  return button;
}
