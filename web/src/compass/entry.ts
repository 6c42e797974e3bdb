/** What leads to the compass doctor: a button, and a warning that comes without being asked. */

import { h } from '../dom';
import { t } from '../messages';
import type { Doctor } from './doctor';

export class CompassEntry {
  /** Beside the attitude's title. */
  readonly button: HTMLButtonElement;
  /** Says what needs saying without being asked. */
  readonly warning = h('div.compass-warning', { role: 'status', hidden: true });

  constructor(doctor: Doctor, show: () => void) {
    this.button = h('button.compass-button', { type: 'button', hidden: true, 'aria-haspopup': 'dialog', onclick: show }, t.compass.button);
    doctor.diagnosis.watch((diagnosis) => {
      this.button.hidden = !doctor.hasCompass;
      this.button.textContent = diagnosis?.applied ? t.compass.buttonApplied : t.compass.button;
      const text = diagnosis?.warning_now ?? null;
      this.warning.hidden = text === null;
      if (text !== null) this.warning.replaceChildren(h('p', {}, text), h('button', { type: 'button', onclick: show }, t.compass.open_doctor));
    });
  }
}
