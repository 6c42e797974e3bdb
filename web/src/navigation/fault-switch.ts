/** Faults put into the open drive and taken out again, and the sign that says so. */

import { h } from '../dom';
import { t } from '../messages';
import type { Session } from '../session';
import type { Store } from '../state';
import type { Fault } from './door';

export class FaultSwitch {
  /** Seen in every room while a fault is in. */
  readonly sign: HTMLElement;
  readonly #store: Store;
  readonly #session: Session;

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const text = h('span');
    const show = h('button.quiet', { type: 'button', onclick: () => this.#show() }, t.faultSign.show);
    const remove = h('button.quiet', { type: 'button', onclick: () => void this.set([]) }, t.faultSign.removeAll);
    this.sign = h('div.fault-sign', { role: 'status', hidden: true }, text, show, remove);
    store.faults.on((faults) => {
      this.sign.hidden = faults.length === 0;
      text.textContent = t.faultSign.text(faults.length);
    });
    store.report.on((report, before) => {
      const faults = store.faults.value;
      const isRest = before?.is_partial === true && report?.name === before.name && report.kind === before.kind;
      store.faults.value = [];
      // The rest of a drive has come: what was put into its beginning goes in again.
      if (isRest && faults.length > 0) void this.set(faults);
    });
  }

  /** Put these faults in place of those that are in; true if the drive can have them. */
  async set(faults: readonly Fault[]): Promise<boolean> {
    const store = this.#store;
    const drive = store.report.value;
    try {
      await this.#session.rpc.call('set_faults', { faults });
    } catch (reason) {
      store.error.value = reason instanceof Error ? reason.message : String(reason);
      return false;
    }
    if (store.report.value !== drive) return false;
    store.faults.value = faults;
    this.#session.rerun();
    return true;
  }

  #show(): void {
    this.#store.room.value = 'navigation';
    // The room's code may have to be loaded first.
    let frames = 300;
    const go = (): void => {
      const panel = document.querySelector<HTMLElement>('[data-view="navigation-faults"]');
      if (panel?.checkVisibility()) {
        panel.focus();
        panel.scrollIntoView({ block: 'nearest' });
      } else if (frames-- > 0) requestAnimationFrame(go);
    };
    go();
  }
}
