/** The compass doctor: what is wrong with a magnetometer, shown before and after, with one button to put it right. */

import '../style/compass.css';
import { h, iconButton, save } from '../dom';
import { t } from '../messages';
import { compass as say } from '../messages/compass';
import type { Session } from '../session';
import type { Store } from '../state';
import { convert, convertDifference, digitsOf, formatFixed, formatSignificant, unitLabel } from '../units';
import type { Doctor } from './doctor';
import type { AgainstCourse, Diagnosis } from './door';
import { FieldPlots } from './field';
import { ScatterPlot } from './scatter';

const DEGREES = 180 / Math.PI;

export class CompassDialog {
  readonly element: HTMLDialogElement;
  #store: Store;
  #doctor: Doctor;
  #verdict = h('div.verdicts', { role: 'status' });
  #facts = h('dl.facts');
  #table = h('table.sectors');
  #noCourse = h('p.note', {}, say.noCourse);
  #turn = h('input', { type: 'checkbox' });
  #turnText = h('span');
  #clock = h('input', { type: 'checkbox' });
  #clockText = h('span');
  #options = h('div.options');
  #apply = h('button.primary', { type: 'button', onclick: () => this.#applyFound() }, say.apply);
  #undo = h('button', { type: 'button', onclick: () => void this.#doctor.undo() }, say.undo);
  #save = h('button', { type: 'button', onclick: () => this.#saveFound() }, say.save);
  #scatterHost = h('div.scatter', { role: 'img', 'aria-label': say.scatterLabel });
  #scatter: ScatterPlot;
  /** Keys of what only a calibration gives. */
  #fitted: HTMLElement[];
  #field: FieldPlots;

  constructor(store: Store, session: Session, doctor: Doctor) {
    this.#store = store;
    this.#doctor = doctor;
    this.#scatter = new ScatterPlot(this.#scatterHost);
    this.#field = new FieldPlots(store, session);
    const file = h('input', { type: 'file', hidden: true, accept: '.json,application/json', tabindex: '-1', 'aria-label': say.open });
    file.addEventListener('change', () => {
      void file.files?.[0]?.text().then((text) => doctor.applySaved(text));
      file.value = '';
    });
    const open = h('button', { type: 'button', onclick: () => file.click() }, say.open);
    const key = (colour: string, name: string, isDashed = false): HTMLElement => h('span.key', {}, h(colour === 'raw' || colour === 'estimate' ? 'span.dot' : 'span.swatch', { 'data-colour': colour, 'data-dashed': isDashed || undefined }), name);
    this.#fitted = [key('threshold', say.ellipse), key('estimate', say.curves.calibrated)];
    this.#options.append(h('label', {}, this.#turn, this.#turnText), h('label', {}, this.#clock, this.#clockText));
    this.element = h(
      'dialog.compass',
      { 'aria-label': say.title },
      h('header', {}, h('h2', {}, say.title), iconButton('close', t.close, () => this.element.close())),
      h('div.compass-body', {},
        this.#verdict,
        h('div.compass-actions', {}, this.#apply, this.#undo, this.#options, h('span.spacer'), this.#save, open, file),
        h('div.compass-columns', {},
          h('section', {}, h('h3', {}, say.readings), h('div.keys', {}, key('raw', say.curves.raw), ...this.#fitted, key('truth', say.circle, true)), this.#scatterHost),
          h('section', {}, h('h3', {}, say.sectors), this.#noCourse, this.#table, this.#facts)),
        h('section', {}, h('h3', {}, say.along), this.#field.element, h('p.note', {}, say.dipNote))),
    );
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    doctor.diagnosis.watch(() => this.#show());
    store.display.on(() => this.#show());
  }

  /** Open the dialog; the field along the road is computed then. */
  show(): void {
    if (!this.#doctor.hasCompass) return;
    this.element.showModal();
    void this.#doctor.examine(true);
  }

  #applyFound(): void {
    const { mountYaw, clock } = this.#doctor.proposed();
    void this.#doctor.applyFound(this.#turn.checked ? mountYaw : 0, this.#clock.checked ? clock : 0);
  }

  #saveFound(): void {
    const diagnosis = this.#doctor.diagnosis.value;
    const calibration = diagnosis?.applied ?? diagnosis?.calibration;
    if (calibration) save('magnetometer_calibration.json', `${JSON.stringify(calibration, null, 2)}\n`, 'application/json');
  }

  #show(): void {
    const diagnosis = this.#doctor.diagnosis.value;
    this.element.dataset['state'] = diagnosis?.applied ? 'applied' : diagnosis?.calibration ? 'possible' : diagnosis ? 'refused' : '';
    if (!diagnosis) return;
    this.#showVerdict(diagnosis);
    this.#showActions(diagnosis);
    this.#showSectors(diagnosis);
    this.#showFacts(diagnosis);
    this.#scatter.show(diagnosis.scatter);
    for (const key of this.#fitted) key.hidden = diagnosis.scatter.calibrated[0]?.length === 0;
    if (this.element.open) this.#field.load();
  }

  #showVerdict(d: Diagnosis): void {
    const refusal = d.refusal_text ? say.refused(d.refusal_text) : null;
    const lines = d.applied
      ? [h('p.good', {}, say.applied), d.warning_now ? h('p.bad', {}, d.warning_now) : null]
      : [
          h(d.warning_now ? 'p.bad' : 'p.good', {}, d.warning_now ?? say.fine),
          refusal ? h('p.refusal', {}, refusal) : h('p', {}, say.possible(d.quality.kind === 'full' ? say.full : say.planar)),
        ];
    this.#verdict.replaceChildren(...lines.filter((l) => l !== null), ...d.notes.map((note) => h('p.note', {}, say.note(note))));
  }

  #showActions(d: Diagnosis): void {
    const isApplied = d.applied !== null;
    const hadFocus = document.activeElement === this.#apply || document.activeElement === this.#undo;
    this.#apply.hidden = isApplied;
    this.#apply.disabled = d.calibration === null;
    this.#undo.hidden = !isApplied;
    if (hadFocus) (isApplied ? this.#undo : this.#apply).focus();
    this.#save.disabled = (d.applied ?? d.calibration) === null;
    const { mountYaw, clock } = this.#doctor.proposed();
    this.#options.hidden = isApplied || (mountYaw === 0 && clock === 0);
    const offer = (box: HTMLInputElement, text: HTMLElement, value: number, label: string): void => {
      const wasOffered = text.textContent === label;
      if (box.parentElement) box.parentElement.hidden = value === 0;
      text.textContent = label;
      if (!wasOffered) box.checked = value !== 0;
    };
    offer(this.#turn, this.#turnText, mountYaw, say.turn(formatFixed(mountYaw * DEGREES, 0)));
    offer(this.#clock, this.#clockText, clock, say.clock(formatFixed(clock, 1)));
  }

  /** The heading after: by what is applied, else by the calibration found. */
  #after(d: Diagnosis): AgainstCourse | null {
    return d.now ?? d.after;
  }

  #showSectors(d: Diagnosis): void {
    const after = this.#after(d);
    const { before } = d;
    const display = this.#store.display.value;
    const [unit, digits] = [unitLabel('angle', 'rad', display), digitsOf('angle', display) - 1];
    this.#noCourse.hidden = before !== null;
    this.#table.hidden = before === null;
    if (!before) return;
    const largest = Math.max(...[...before.sectors, ...(after?.sectors ?? [])].map((s) => (s.points > 0 ? s.rms : 0)), 1e-6);
    const cell = (rms: number | undefined, colour: string): HTMLElement => {
      const isThere = rms !== undefined && Number.isFinite(rms);
      const bar = h('span.amount', { 'data-colour': colour });
      bar.style.width = `${isThere ? (60 * rms) / largest : 0}%`;
      return h('td', {}, bar, isThere ? formatFixed(convertDifference('angle', rms, display), digits) : '–');
    };
    const rows = before.sectors.map((sector, i) => {
      const from = Math.round(sector.begins * DEGREES);
      return h('tr', {}, h('th', { scope: 'row' }, say.sector(from, from + 30)), h('td.points', {}, String(sector.points)), cell(sector.points > 0 ? sector.rms : undefined, 'raw'), cell(after?.sectors[i]?.rms, 'estimate'));
    });
    const total = h('tr.total', {}, h('th', { scope: 'row' }, say.all), h('td.points', {}, String(before.consistency.points)), cell(before.rms, 'raw'), cell(after?.rms, 'estimate'));
    const head = [say.course, say.points, say.before(unit), say.after(unit)].map((text) => h('th', { scope: 'col' }, text));
    this.#table.replaceChildren(h('caption', {}, say.caption), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows, total));
  }

  #showFacts(d: Diagnosis): void {
    const [north, east, down] = d.earth;
    const display = this.#store.display.value;
    const unit = unitLabel('angle', 'rad', display);
    const angle = (value: number): string => `${formatFixed(convert('angle', value, display), digitsOf('angle', display) - 1)}${unit === '°' ? '°' : ` ${unit}`}`;
    const horizontal = Math.hypot(north, east);
    const after = this.#after(d);
    const pairs: [string, string][] = [
      [say.facts.earth, say.facts.earthValue(formatFixed(Math.hypot(horizontal, down), 1), angle(Math.atan2(down, horizontal)), angle(Math.atan2(east, north)))],
      [say.facts.readings, say.facts.readingsValue(d.quality.samples.toLocaleString('en'), d.quality.used.toLocaleString('en'), d.quality.sectors)],
    ];
    const applied = d.applied ?? d.calibration;
    if (applied) pairs.push([say.facts.offset, say.facts.offsetValue(applied.offset.map((v) => formatFixed(v, 1)).join(', '), d.calibration ? formatSignificant(d.quality.offset_sigma, 2) : '–')]);
    if (d.calibration) pairs.push([say.facts.left, say.facts.leftValue(formatFixed(d.quality.residual, 1), formatFixed(100 * d.quality.residual_relative, 0))]);
    if (d.before) pairs.push([say.facts.consistency, say.facts.agreement([d.before, ...(after ? [after] : [])].map((a) => formatFixed(a.consistency.balanced, 2)).join(' → '), d.before.consistency.sectors)]);
    if (after) pairs.push([say.facts.mount, angle(after.mount_yaw)]);
    if (d.clock) pairs.push([say.facts.clock, say.facts.clockValue(formatFixed(d.clock.offset, 2), formatSignificant(d.clock.sigma, 2))]);
    this.#facts.replaceChildren(...pairs.flatMap(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));
  }
}
