/** The page of keys. */

import '../style/help.css';
import { h, iconButton } from '../dom';
import { t } from '../messages';
import { help as say } from '../messages/help';
import type { Store } from '../state';

export class Help {
  readonly element: HTMLDialogElement;

  constructor(store: Store) {
    const rows = say.keys.map(([keys, what]) => h('tr', {}, h('th', { scope: 'row' }, h('kbd', {}, keys)), h('td', {}, what)));
    const version = h('p.note');
    store.catalogue.watch((catalogue) => {
      version.textContent = catalogue ? say.version(catalogue.version) : '';
    });
    this.element = h(
      'dialog.help',
      { 'aria-label': say.title },
      h('header', {}, h('h2', {}, say.title), iconButton('close', t.close, () => this.element.close())),
      h('div.help-body', {}, h('table', {}, h('tbody', {}, ...rows)), h('h3', {}, say.mouse), h('p', {}, say.mouseText), h('p', {}, say.privacy), version),
    );
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
  }

  /** Open the page, or close it where it is open. */
  show(): void {
    if (this.element.open) this.element.close();
    else this.element.showModal();
  }
}
