/** Calibrating the six-accelerometer sensor: finds the rests of the log, names their poses, shows what follows and what does not. */

import { h, iconButton, save } from '../dom';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import type { Session } from '../session';
import type { Store } from '../state';
import { formatFixed, formatSignificant, formatTime } from '../units';
import { latest } from '../worker/rpc';
import { applyDisk, applySavedDisk } from './disk-file';
import type { Calibrated, Calibration, Rest, Triple } from './door';
import { leaning, nearestPose, POSES, scaleOf } from './poses';

const AXES = ['x', 'y', 'z'] as const;

export class DiskDialog {
  readonly element: HTMLDialogElement;
  #store: Store;
  #session: Session;
  #rests: Rest[] = [];
  /** For each rest the index of its pose, or -1. */
  #poses: number[] = [];
  #found: Calibrated | null = null;
  #refusal = '';
  #shortest = h('input.number', { type: 'number', min: 0.5, max: 60, step: 0.5, value: 2, 'aria-label': say.disk.shortest });
  #count = h('p', { role: 'status' });
  #table = h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': say.disk.caption });
  #verdict = h('p', { role: 'status' });
  #result = h('div.disk-result');
  #apply = h('button.primary', { type: 'button', onclick: () => void this.#use(this.#found?.[0].disk ?? null) }, say.disk.apply);
  #undo = h('button', { type: 'button', onclick: () => void this.#use(null) }, say.disk.undo);
  #save = h('button', { type: 'button', onclick: () => this.#saveFound() }, say.disk.save);
  readonly #search = latest(() => this.#find());
  readonly #calibrate = latest(() => this.#solve());

  constructor(store: Store, session: Session) {
    this.#store = store;
    this.#session = session;
    const file = h('input', { type: 'file', hidden: true, accept: '.json,application/json', tabindex: '-1', 'aria-label': say.disk.open });
    file.addEventListener('change', () => {
      void file.files?.[0]?.text().then((text) => applySavedDisk(store, session, text));
      file.value = '';
    });
    const open = h('button', { type: 'button', onclick: () => file.click() }, say.disk.open);
    this.#shortest.addEventListener('change', this.#search);
    this.element = h(
      'dialog.compass.disk-dialog',
      { 'aria-label': say.disk.calibration },
      h('header', {}, h('h2', {}, say.disk.calibration), iconButton('close', t.close, () => this.element.close())),
      h('div.compass-body', {},
        h('p', {}, say.disk.intro),
        h('label.shortest', {}, say.disk.shortest, ' ', this.#shortest, ' ', t.units.seconds),
        this.#count, this.#table, this.#verdict, this.#result,
        h('div.compass-actions', {}, this.#apply, this.#undo, h('span.spacer'), this.#save, open, file),
        h('p.note', {}, say.disk.saveNote)),
    );
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    store.disk.on(() => this.#showVerdict());
  }

  show(): void {
    this.element.showModal();
    this.#search();
  }

  async #find(): Promise<void> {
    const shortest = Math.min(60, Math.max(0.5, Number(this.#shortest.value) || 2));
    this.#rests = await this.#session.rpc.call('disk_rests', { shortest });
    this.#poses = this.#rests.map((rest) => nearestPose(rest.pose));
    this.#count.textContent = say.disk.rests(this.#rests.length);
    this.#showRests();
    this.#calibrate();
  }

  async #solve(): Promise<void> {
    const poses = this.#used().flatMap(({ force, mean }) => [...force, ...mean]);
    this.#found = null;
    this.#refusal = '';
    try {
      this.#found = await this.#session.rpc.call('disk_calibrate', { poses: Float64Array.from(poses) });
    } catch (reason) {
      this.#refusal = reason instanceof Error ? reason.message : String(reason);
    }
    this.#showVerdict();
    this.#showResult();
  }

  /** The rests that count, with the specific force of the pose chosen for each. */
  #used(): (Rest & { force: Triple })[] {
    return this.#rests.flatMap((rest, i) => {
      const force = POSES[this.#poses[i] ?? -1];
      return force ? [{ ...rest, force }] : [];
    });
  }

  #showRests(): void {
    const { from, length, shown, pose, unused, poses, caption, goTo } = say.disk;
    const rows = this.#rests.map((rest, i) => {
      const at = formatTime(this.#store.sinceStart(rest.span[0]), 1);
      const select = h('select', { 'aria-label': `${pose}, ${at}` }, ...poses.map((name, k) => h('option', { value: k, selected: k === this.#poses[i] }, name)), h('option', { value: -1, selected: this.#poses[i] === -1 }, unused));
      select.addEventListener('change', () => {
        this.#poses[i] = Number(select.value);
        this.#calibrate();
      });
      const go = h('button.quiet', { type: 'button', title: goTo, 'aria-label': `${goTo}: ${at}`, onclick: () => this.#store.show(rest.span[0] - 2, rest.span[1] + 2) }, at);
      const seconds = formatFixed(rest.span[1] - rest.span[0], 1);
      return h('tr', {}, h('th', { scope: 'row' }, go), h('td', {}, seconds), h('td', {}, rest.force.map((v) => formatFixed(v, 2)).join(', ')), h('td.text', {}, select));
    });
    const head = [from, length, shown, pose].map((name, i) => h(i < 3 ? 'th' : 'th.text', { scope: 'col' }, name));
    const table = h('table.numbers', {}, h('caption', {}, caption), h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows));
    this.#table.replaceChildren(...(rows.length > 0 ? [table] : []));
    this.#table.hidden = rows.length === 0;
  }

  #showVerdict(): void {
    const isApplied = this.#store.disk.value !== null;
    const found = this.#found ? say.disk.found(this.#used().length) : say.disk.refused(this.#refusal);
    this.#verdict.className = this.#found ? 'good' : 'bad';
    this.#verdict.textContent = `${found} ${isApplied ? say.disk.applied : say.disk.drawn}`;
    this.#apply.disabled = this.#found === null;
    this.#undo.hidden = !isApplied;
    this.#save.disabled = this.#found === null && !isApplied;
  }

  #showResult(): void {
    if (!this.#found) {
      this.#result.replaceChildren();
      return;
    }
    const [calibration, , cannot] = this.#found;
    const { residual } = calibration;
    this.#result.replaceChildren(
      h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': say.disk.result }, this.#sensors(calibration)),
      h('p.note', {}, this.#sigma(calibration)),
      h('p.note', {}, residual ? say.disk.residualNote : say.disk.noResidual),
      h('h3', {}, say.disk.cannot),
      h('ul', {}, ...cannot.map((sentence) => h('li', {}, sentence))),
    );
  }

  #sensors({ disk, residual }: Calibration): HTMLElement {
    const texts = say.disk;
    const head = [texts.sensor, texts.axis, texts.scale, texts.leaning, texts.bias, ...(residual ? [texts.residual] : [])];
    const rows = disk.sensors.map((sensor, i) =>
      h('tr', {},
        h('th', { scope: 'row' }, `${i + 1}, ${i < 3 ? texts.tangential : texts.axial}`),
        h('td', {}, AXES.map((_, k) => formatFixed(sensor.axis[k], 4)).join(', ')),
        h('td', {}, formatFixed(scaleOf(sensor.axis), 4)),
        h('td', {}, formatFixed(leaning(sensor.axis, i), 2)),
        h('td', {}, formatFixed(sensor.bias, 4)),
        ...(residual ? [h('td', {}, formatFixed(residual[i], 4))] : [])),
    );
    return h('table.numbers', {}, h('caption', {}, texts.result), h('thead', {}, h('tr', {}, ...head.map((name) => h('th', { scope: 'col' }, name)))), h('tbody', {}, ...rows));
  }

  #sigma({ axis_sigma, bias_sigma }: Calibration): string {
    const rate = this.#store.report.value?.channels.find((c) => c.columns.includes('acc6_1'))?.rate_hz ?? 1;
    const means = this.#used().map(({ span, spread }) => spread / Math.sqrt(Math.max(1, (span[1] - span[0]) * rate)));
    const worst = Math.max(...means, 0);
    return say.disk.sigma(formatSignificant(Math.max(...axis_sigma) * worst, 2), formatSignificant(bias_sigma * worst, 2));
  }

  async #use(disk: Calibration['disk'] | null): Promise<void> {
    await applyDisk(this.#store, this.#session, disk);
    if (disk) this.#undo.focus();
    else this.#apply.focus();
  }

  #saveFound(): void {
    const disk = this.#store.disk.value ?? this.#found?.[0].disk;
    if (disk) save('disk.json', `${JSON.stringify(disk, null, 2)}\n`, 'application/json');
  }
}
