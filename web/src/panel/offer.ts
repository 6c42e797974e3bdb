/** What can be read of a log that does not fit into memory: offered below the sentence that refuses it. */

import { h } from '../dom';
import { t } from '../messages';
import type { Store } from '../state';
import { formatTime } from '../units';
import type { Keep, OpenRequest } from '../worker/rpc';

/** Put the offer into the banner that says why nothing was opened; `open` opens a part of the log. */
export function offerIn(banner: HTMLElement, store: Store, open: (request: OpenRequest, label: string) => void): HTMLElement {
  const form = h('form.offer', { hidden: true });
  banner.firstElementChild?.append(form);
  store.offer.watch((offer) => {
    form.hidden = offer === null;
    form.replaceChildren();
    if (!offer) return;
    const read = (keep: Keep): void => open({ ...offer.request, keep }, offer.label);
    const button = (text: string, keep: Keep): HTMLElement => h('button', { type: 'button', onclick: () => read(keep) }, text);
    const { seconds, every, columns } = offer;
    form.append(button(t.files.part.every(every), { every }));
    if (seconds !== null && seconds >= 1) form.append(button(t.files.part.first(formatTime(seconds)), { to: seconds }));
    if (columns < 1) return;
    const names = h('input', { type: 'text', required: true, placeholder: t.files.part.columns, 'aria-label': t.files.part.columns });
    form.append(names, h('button', { type: 'submit' }, t.files.part.only));
    form.onsubmit = (event) => {
      event.preventDefault();
      read({ columns: names.value.split(',').map((name) => name.trim()).filter(Boolean) });
    };
  });
  // The sentence is gone: so is what it offers.
  store.error.on((error) => {
    if (error === null) store.offer.value = null;
  });
  return banner;
}
