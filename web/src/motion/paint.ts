/** Labels painted by hand: brushes and buttons, and the layer over the strip that takes the brush. */

import { h, save } from '../dom';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import { LEFT, RIGHT } from '../plot/axes';
import { axis, shareOf, timeAt } from '../plot/axis';
import type { Session } from '../session';
import type { Store } from '../state';
import { formatTime } from '../units';
import type { Decision } from './explain';
import { fromText, type Labels, labelsOf, NO_LABELS, stretchesOf, toCsv, toJson } from './labels';

/** Labels of a file, told as an error where they cannot be read. */
export function takeLabels(store: Store, text: string, name: string): void {
  try {
    if (!store.report.value) throw new Error(say.labels.noDrive);
    store.labels.value = fromText(text, name);
  } catch (reason) {
    store.error.value = reason instanceof Error ? reason.message : String(reason);
  }
}

export class Painter {
  /** Turns painting on and off. */
  readonly button = h('button', { type: 'button', 'aria-pressed': 'false' }, say.labels.paint);
  readonly toolbar = h('div.paint-bar', { role: 'group', 'aria-label': say.labels.group, hidden: true });
  /** Over the strip. */
  readonly layer = h('div.paint-area', { hidden: true });
  #store: Store;
  #session: Session;
  #decisions: () => readonly Decision[];
  #past: Labels[] = [];
  #mode = 0;
  #start: number | null = null;
  #band = h('div.selection', { hidden: true });
  #undo = h('button', { type: 'button', onclick: () => this.#back() }, say.labels.undo);
  #startButton = h('button', { type: 'button', onclick: () => this.#setStart(this.#store.cursor.value) }, say.labels.startHere);
  #paintButton = h('button', { type: 'button', onclick: () => this.#paintToCursor() }, say.labels.paintTo);
  #count = h('span.hint', { role: 'status' });
  #saves: HTMLButtonElement[];

  constructor(store: Store, session: Session, decisions: () => readonly Decision[]) {
    this.#store = store;
    this.#session = session;
    this.#decisions = decisions;
    this.button.addEventListener('click', () => this.#toggle());
    this.layer.append(this.#band);
    this.layer.style.left = `${LEFT}px`;
    this.layer.style.right = `${RIGHT}px`;
    const saver = (label: string, name: string, text: (labels: Labels) => string, type: string): HTMLButtonElement =>
      h('button', { type: 'button', onclick: () => save(name, text(store.labels.value), type) }, label);
    this.#saves = [saver(say.labels.saveCsv, 'labels.csv', toCsv, 'text/csv'), saver(say.labels.saveJson, 'labels.json', toJson, 'application/json')];
    this.toolbar.append(...this.#brushes(), this.#startButton, this.#paintButton, this.#undo, ...this.#fills(), ...this.#saves, ...this.#opener(), this.#count, h('p.note', {}, say.labels.hint));
    this.#listen();
    store.labels.watch(() => this.#show());
    store.report.on(() => {
      this.#past = [];
      this.#setStart(null);
      this.#show();
    });
  }

  #brushes(): HTMLElement[] {
    const group = h('div.segmented', { role: 'radiogroup', 'aria-label': say.labels.brush });
    [...t.modes, say.labels.wipe].forEach((name, mode) => {
      const input = h('input', { type: 'radio', name: 'brush', value: mode, checked: mode === 0 });
      input.addEventListener('change', () => {
        this.#mode = mode < t.modes.length ? mode : Number.NaN;
      });
      group.append(h('label', {}, input, h('span', {}, name)));
    });
    return [group];
  }

  #fills(): HTMLElement[] {
    const fromDecided = (): void => this.#put(labelsOf(this.#decisions(), this.#store.span.value.t1));
    return [
      h('button', { type: 'button', onclick: fromDecided }, say.labels.fromDecided),
      h('button', { type: 'button', onclick: () => this.#put(NO_LABELS) }, say.labels.wipeAll),
    ];
  }

  #opener(): HTMLElement[] {
    const file = h('input', { type: 'file', hidden: true, accept: '.csv,.json', tabindex: '-1', 'aria-label': say.labels.open });
    file.addEventListener('change', () => {
      const [chosen] = file.files ?? [];
      void chosen?.text().then((text) => takeLabels(this.#store, text, chosen.name));
      file.value = '';
    });
    return [h('button', { type: 'button', onclick: () => file.click() }, say.labels.open), file];
  }

  #toggle(): void {
    const isOn = this.toolbar.hidden === true;
    this.toolbar.hidden = this.layer.hidden = !isOn;
    this.button.setAttribute('aria-pressed', String(isOn));
    if (!isOn) this.#setStart(null);
  }

  #time(clientX: number): number {
    const box = this.layer.getBoundingClientRect();
    return timeAt(Math.min(1, Math.max(0, (clientX - box.left) / Math.max(1, box.width))), this.#store.window.value, axis.value);
  }

  #listen(): void {
    const { layer } = this;
    let from: number | null = null;
    layer.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      layer.setPointerCapture(event.pointerId);
      from = this.#time(event.clientX);
    });
    layer.addEventListener('pointermove', (event) => {
      const time = this.#time(event.clientX);
      this.#store.moveCursor(time);
      if (from !== null) this.#showBand(from, time);
    });
    layer.addEventListener('pointerup', (event) => {
      const to = this.#time(event.clientX);
      if (from !== null && from !== to) void this.#paint(Math.min(from, to), Math.max(from, to));
      from = null;
      this.#showBand(0, 0);
    });
    layer.addEventListener('pointercancel', () => {
      from = null;
      this.#showBand(0, 0);
    });
    this.#store.cursor.on((time) => this.#start !== null && from === null && this.#showBand(this.#start, time));
  }

  #showBand(a: number, b: number): void {
    const share = (time: number): number => Math.min(1, Math.max(0, shareOf(time, this.#store.window.value, axis.value)));
    this.#band.hidden = a === b;
    this.#band.style.left = `${100 * share(Math.min(a, b))}%`;
    this.#band.style.width = `${100 * Math.abs(share(b) - share(a))}%`;
  }

  #setStart(time: number | null): void {
    this.#start = time;
    this.#startButton.textContent = time === null ? say.labels.startHere : say.labels.startAt(formatTime(this.#store.sinceStart(time), 2));
    this.#paintButton.disabled = time === null;
    if (time === null) this.#showBand(0, 0);
  }

  #paintToCursor(): void {
    const [from, to] = [this.#start, this.#store.cursor.value];
    if (from === null || from === to) return;
    // The next stretch begins where this one ends.
    void this.#paint(Math.min(from, to), Math.max(from, to)).then(() => this.#setStart(to));
  }

  async #paint(from: number, to: number): Promise<void> {
    const labels = await this.#session.rpc.call('labels_paint', { labels: this.#store.labels.value, from, to, mode: this.#mode });
    this.#put(labels);
  }

  #put(labels: Labels): void {
    this.#past.push(this.#store.labels.value);
    this.#store.labels.value = labels;
  }

  #back(): void {
    const before = this.#past.pop();
    if (before) this.#store.labels.value = before;
  }

  #show(): void {
    const count = stretchesOf(this.#store.labels.value, this.#store.span.value.t1).length;
    this.#count.textContent = say.labels.count(count);
    this.#undo.disabled = this.#past.length === 0;
    for (const button of this.#saves) button.disabled = count === 0;
  }
}
