/** One row of the table of columns: a raw column as one signal. Its controls stay in place while what they show changes. */

import { h, prose } from '../dom';
import { columns as beside } from '../messages/columns';
import { wizard as say } from '../messages/wizard';
import type { Signal } from '../signal';
import { formatSignificant, prettyUnit } from '../units';
import type { Choice, ColumnView, Found, Mapping } from './door';
import { assign, change, CLOCK, differs, inWords, plainUnit, takeColumn, unitOf, unitsOf } from './mapping';
import { sparkline } from './picture';

/** Least and largest value of a picture; the first is not below the second where there is none. */
function ends(picture: Float64Array | undefined): [number, number] {
  const known = [...(picture ?? [])].filter((v) => !Number.isNaN(v));
  return [known.reduce((a, b) => Math.min(a, b), Infinity), known.reduce((a, b) => Math.max(a, b), -Infinity)];
}

function measured(view: ColumnView, picture: Float64Array | undefined): HTMLElement {
  const [low, high] = view.range ?? ends(picture);
  const range = low <= high ? say.range(formatSignificant(low), formatSignificant(high)) : say.noValues;
  const rate = view.rate === null ? '' : say.hertz(formatSignificant(view.rate));
  return h('td.measured', {}, picture && view.values > 0 ? sparkline(picture) : null, h('span', {}, range), h('span.note', {}, [rate, view.held ? say.held : ''].filter(Boolean).join(', ')));
}

/** Units of fields are known in small letters, which people read otherwise. */
const FIELDS: Record<string, string> = { t: 'T', mt: 'mT', ut: 'µT', nt: 'nT', g: 'G', mg: 'mG' };

/** A unit as people write it. */
function unitLabel(unit: string, signal: string): string {
  return (signal.startsWith('mag_') ? FIELDS[plainUnit(unit)] : undefined) ?? prettyUnit(unit);
}

/** Show a number unless it is what stands there: what is being typed is left alone. */
export function showNumber(input: HTMLInputElement, value: number | null): void {
  const text = value === null ? '' : String(Number(value.toPrecision(10)));
  if (input.value === '' ? text !== '' : Number(input.value) !== Number(text) || text === '') input.value = text;
}

/** What rows share. */
export interface Shared {
  readonly draft: Signal<Mapping | null>;
  readonly found: Found;
  readonly choices: Choice[];
}

export class Row {
  readonly element: HTMLTableRowElement;
  #view: ColumnView;
  #signal: string | null;
  #isFirst: boolean;
  #shared: Shared;
  #units: HTMLSelectElement | null;
  #scale: HTMLInputElement | null;
  #offset: HTMLInputElement | null;
  #proposal = h('p.proposal', { hidden: true });

  /** `index` counts the signals of a column; the first row of a column has its picture and what physics proposes. */
  constructor(shared: Shared, view: ColumnView, signal: string | null, index: number, picture: Float64Array | undefined) {
    this.#shared = shared;
    this.#view = view;
    this.#signal = signal;
    this.#isFirst = index === 0;
    const isScaled = signal !== null && signal !== CLOCK;
    const isMeasured = signal !== null && unitsOf(shared.choices, signal).length > 0;
    this.#units = isMeasured ? this.#unitSelect(signal) : null;
    this.#scale = isScaled ? this.#number(say.scaleOf(view.column), (scale) => this.#change({ scale }), (v) => v !== 0) : null;
    this.#offset = signal === null ? null : this.#number(say.offsetOf(view.column), (offset) => this.#change({ offset }), () => true);
    this.element = h(
      'tr',
      { 'data-column': view.column, 'data-signal': signal ?? undefined, 'data-unused': signal === null || undefined },
      h('th', { scope: 'row' }, view.column, view.stated_unit ? h('span.note', {}, say.stated(view.stated_unit)) : null),
      index === 0 ? measured(view, picture) : h('td.measured'),
      h('td', {}, this.#signalSelect()),
      h('td', {}, this.#units),
      h('td.factor', {}, this.#scale, isScaled ? this.#flip(signal) : null),
      h('td', {}, this.#offset),
      this.#why(),
    );
    this.update();
  }

  /** Show the mapping as it stands. */
  update(): void {
    const { draft, found, choices } = this.#shared;
    const mapping = draft.value;
    if (!mapping) return;
    const signal = this.#signal;
    const source = signal === null ? undefined : signal === CLOCK ? { ...mapping.time, scale: 1 } : mapping.signals[signal];
    if (this.#units && signal !== null) this.#showUnit(this.#units, source?.unit ?? unitOf(choices, signal));
    if (this.#scale) showNumber(this.#scale, source?.scale ?? 1);
    if (this.#offset) showNumber(this.#offset, source?.offset ?? 0);
    const isOther = differs(mapping, found, this.#view, choices);
    this.element.toggleAttribute('data-differs', isOther);
    this.#proposal.hidden = !isOther || !this.#isFirst;
  }

  #set(next: (mapping: Mapping) => Mapping): void {
    const { draft } = this.#shared;
    if (draft.value) draft.value = next(draft.value);
  }

  #change(patch: { unit?: string; scale?: number; offset?: number }): void {
    const signal = this.#signal;
    if (signal !== null) this.#set((mapping) => change(mapping, signal, patch, this.#shared.choices));
  }

  #signalSelect(): HTMLElement {
    const [{ choices }, { column }, signal] = [this.#shared, this.#view, this.#signal];
    const option = (value: string, text: string): HTMLElement => h('option', { value, selected: value === (signal ?? '') }, text);
    const groups = [...new Set(choices.map((c) => c.channel))].map((channel) =>
      h('optgroup', { label: beside.channels[channel] ?? channel }, ...choices.filter((c) => c.channel === channel).map((c) => option(c.signal, c.signal))),
    );
    const isFurther = signal !== null && signal !== CLOCK && !choices.some((c) => c.signal === signal);
    const isClock = signal === CLOCK;
    const select = h(
      'select.signal',
      { 'aria-label': say.signalOf(column), disabled: isClock, title: isClock ? say.isClock : undefined },
      option('', say.none),
      option(CLOCK, say.clock),
      isFurther ? option(signal, signal) : null,
      ...groups,
    );
    select.addEventListener('change', () => this.#set((mapping) => assign(mapping, column, signal, select.value === '' ? null : select.value, choices)));
    return select;
  }

  #unitSelect(signal: string): HTMLSelectElement {
    const select = h('select', { 'aria-label': say.unitOf(this.#view.column) }, ...unitsOf(this.#shared.choices, signal).map((unit) => h('option', { value: unit }, unitLabel(unit, signal))));
    select.addEventListener('change', () => this.#change({ unit: select.value }));
    return select;
  }

  /** A unit that is not offered, or is spelled otherwise, becomes an option of its own. */
  #showUnit(select: HTMLSelectElement, unit: string): void {
    const options = [...select.options];
    const same = options.find((o) => o.value === unit) ?? options.find((o) => plainUnit(o.value) === plainUnit(unit));
    if (!same) select.prepend(h('option', { value: unit }, unitLabel(unit, this.#signal ?? '')));
    select.value = same?.value ?? unit;
  }

  #number(label: string, set: (value: number) => void, isRight: (value: number) => boolean): HTMLInputElement {
    const input = h('input', { type: 'number', step: 'any', required: true, 'aria-label': label, title: label });
    input.addEventListener('change', () => {
      if (Number.isFinite(input.valueAsNumber) && isRight(input.valueAsNumber)) set(input.valueAsNumber);
      else {
        input.value = '';
        this.update();
      }
    });
    return input;
  }

  #flip(signal: string): HTMLElement {
    const label = say.flip(this.#view.column);
    const flip = (): void => this.#change({ scale: -(this.#shared.draft.value?.signals[signal]?.scale ?? 1) });
    return h('button.flip', { type: 'button', 'aria-label': label, title: label, onclick: flip }, '±');
  }

  #why(): HTMLElement {
    const [view, { found, choices }] = [this.#view, this.#shared];
    const take = (): void => this.#set((mapping) => takeColumn(mapping, found, view.column));
    this.#proposal.append(
      say.proposed(inWords(found.mapping, view.column, choices)),
      ' ',
      h('button', { type: 'button', 'aria-label': say.takeOf(view.column), onclick: take }, say.take),
    );
    const confidence = view.confidence ? h('span.confidence', { 'data-confidence': view.confidence }, say.confidences[view.confidence]) : null;
    const why = this.#isFirst ? [confidence, confidence ? ': ' : null, ...prose(view.why), view.name_says ? h('span.note', {}, ` ${say.nameSays(view.name_says)}`) : null] : [];
    return h('td.why', {}, this.#proposal, ...why);
  }
}
