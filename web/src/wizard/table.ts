/** The table of raw columns: what each measured, what it is read as, and why. */

import { h, prose } from '../dom';
import { t } from '../messages';
import type { Signal } from '../signal';
import { formatSignificant } from '../units';
import type { Choice, ColumnView, Examined, Found, Mapping } from './door';
import { assign, change, CLOCK, differs, plainUnit, signalsOf, takeColumn, unitOf, unitsOf } from './mapping';
import { sparkline } from './picture';

/** How a column is read, in a few words: `gyro_z, deg/s, x -1`. */
export function inWords(mapping: Mapping, column: string, choices: Choice[]): string {
  const words = signalsOf(mapping, column).map((signal) => {
    const source = signal === CLOCK ? { ...mapping.time, scale: 1 } : mapping.signals[signal];
    const scale = source?.scale ?? 1;
    const offset = source?.offset ?? 0;
    return [signal, source?.unit ?? unitOf(choices, signal), scale === 1 ? '' : `× ${formatSignificant(scale)}`, offset === 0 ? '' : `+ ${formatSignificant(offset)}`].filter(Boolean).join(', ');
  });
  return words.length > 0 ? words.join('; ') : t.columns.unused;
}

function measured(view: ColumnView, picture: Float64Array | undefined): HTMLElement {
  const range = view.range ? t.columns.range(formatSignificant(view.range[0]), formatSignificant(view.range[1])) : t.columns.noValues;
  const rate = view.rate === null ? '' : t.columns.hertz(formatSignificant(view.rate));
  return h('td.measured', {}, picture && view.values > 0 ? sparkline(picture) : null, h('span', {}, range), h('span.note', {}, [rate, view.held ? t.columns.held : ''].filter(Boolean).join(', ')));
}

export class ColumnTable {
  readonly element = h('div.scroll', { tabindex: '0', role: 'region', 'aria-label': t.columns.table });
  #draft: Signal<Mapping | null>;
  #examined: Examined | null = null;

  constructor(draft: Signal<Mapping | null>) {
    this.#draft = draft;
    draft.on(() => this.#show());
  }

  show(examined: Examined | null): void {
    this.#examined = examined;
    this.#show();
  }

  #show(): void {
    const mapping = this.#draft.value;
    if (!mapping || !this.#examined) {
      this.element.replaceChildren();
      return;
    }
    const [found, pictures] = this.#examined;
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset['key'] : undefined;
    const head = Object.values(t.columns.head).map((text) => h('th', { scope: 'col' }, text));
    const rows = found.columns.flatMap((view, i) => this.#rows(mapping, found, view, pictures[i]));
    this.element.replaceChildren(h('table.report-table.columns-table', {}, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...rows)));
    if (focused !== undefined) this.element.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }

  #rows(mapping: Mapping, found: Found, view: ColumnView, picture: Float64Array | undefined): HTMLElement[] {
    const signals: (string | null)[] = signalsOf(mapping, view.column);
    return (signals.length > 0 ? signals : [null]).map((signal, i) => this.#row(mapping, found, view, signal, i === 0 ? picture : undefined, i));
  }

  #row(mapping: Mapping, found: Found, view: ColumnView, signal: string | null, picture: Float64Array | undefined, index: number): HTMLElement {
    const choices = this.#examined?.[2] ?? [];
    const isOther = differs(mapping, found, view, choices);
    const name = h('th', { scope: 'row' }, view.column, view.stated_unit ? h('span.note', {}, t.columns.stated(view.stated_unit)) : null);
    return h(
      'tr',
      { 'data-column': view.column, 'data-signal': signal ?? undefined, 'data-differs': isOther || undefined, 'data-unused': signal === null || undefined },
      name,
      index === 0 ? measured(view, picture) : h('td.measured'),
      h('td', {}, this.#signalSelect(mapping, view, signal, choices, index)),
      h('td', {}, signal === null ? null : this.#unitSelect(mapping, view, signal, choices)),
      h('td.factor', {}, signal === null || signal === CLOCK ? null : this.#factor(mapping, view, signal, choices)),
      h('td', {}, signal === null ? null : this.#offset(mapping, view, signal, choices)),
      this.#why(found, view, choices, isOther && index === 0),
    );
  }

  #set(mapping: Mapping): void {
    this.#draft.value = mapping;
  }

  #signalSelect(mapping: Mapping, view: ColumnView, signal: string | null, choices: Choice[], index: number): HTMLElement {
    const option = (value: string, text: string): HTMLElement => h('option', { value, selected: value === (signal ?? '') }, text);
    const groups = [...new Set(choices.map((c) => c.channel))].map((channel) =>
      h('optgroup', { label: t.columns.channels[channel] ?? channel }, ...choices.filter((c) => c.channel === channel).map((c) => option(c.signal, c.signal))),
    );
    const isFurther = signal !== null && signal !== CLOCK && !choices.some((c) => c.signal === signal);
    const select = h(
      'select',
      { 'aria-label': t.columns.signalOf(view.column), 'data-key': `signal ${index} ${view.column}`, disabled: signal === CLOCK, title: signal === CLOCK ? t.columns.isClock : undefined },
      option('', t.columns.none),
      option(CLOCK, t.columns.clock),
      isFurther ? option(signal, signal) : null,
      ...groups,
    );
    select.addEventListener('change', () => this.#set(assign(mapping, view.column, signal, select.value === '' ? null : select.value, choices)));
    return select;
  }

  #unitSelect(mapping: Mapping, view: ColumnView, signal: string, choices: Choice[]): HTMLElement {
    const stated = (signal === CLOCK ? mapping.time.unit : mapping.signals[signal]?.unit) ?? unitOf(choices, signal);
    const units = unitsOf(choices, signal);
    const same = units.find((unit) => plainUnit(unit) === plainUnit(stated));
    const select = h(
      'select',
      { 'aria-label': t.columns.unitOf(view.column), 'data-key': `unit ${signal} ${view.column}` },
      ...(same === undefined ? [stated, ...units] : units).map((unit) => h('option', { value: unit, selected: unit === (same ?? stated) }, unit)),
    );
    select.addEventListener('change', () => this.#set(change(mapping, signal, { unit: select.value }, choices)));
    return select;
  }

  #number(value: number, label: string, key: string, set: (value: number) => void, isRight: (value: number) => boolean): HTMLInputElement {
    const input = h('input', { type: 'number', step: 'any', required: true, value: Number(value.toPrecision(9)), 'aria-label': label, 'data-key': key });
    input.addEventListener('change', () => {
      if (Number.isFinite(input.valueAsNumber) && isRight(input.valueAsNumber)) set(input.valueAsNumber);
      else input.value = String(value);
    });
    return input;
  }

  #factor(mapping: Mapping, view: ColumnView, signal: string, choices: Choice[]): HTMLElement[] {
    const scale = mapping.signals[signal]?.scale ?? 1;
    const set = (value: number): void => this.#set(change(mapping, signal, { scale: value }, choices));
    const label = t.columns.flip(view.column);
    return [
      this.#number(scale, t.columns.scaleOf(view.column), `scale ${signal} ${view.column}`, set, (v) => v !== 0),
      h('button.flip', { type: 'button', 'aria-label': label, title: label, 'data-key': `flip ${signal} ${view.column}`, onclick: () => set(-scale) }, '±'),
    ];
  }

  #offset(mapping: Mapping, view: ColumnView, signal: string, choices: Choice[]): HTMLElement {
    const offset = (signal === CLOCK ? mapping.time.offset : mapping.signals[signal]?.offset) ?? 0;
    const set = (value: number): void => this.#set(change(mapping, signal, { offset: value }, choices));
    return this.#number(offset, t.columns.offsetOf(view.column), `offset ${signal} ${view.column}`, set, () => true);
  }

  #why(found: Found, view: ColumnView, choices: Choice[], isOther: boolean): HTMLElement {
    const take = (): void => {
      if (this.#draft.value) this.#set(takeColumn(this.#draft.value, found, view.column));
    };
    const proposal = isOther
      ? h('p.proposal', {}, t.columns.proposed(inWords(found.mapping, view.column, choices)), ' ', h('button', { type: 'button', 'aria-label': t.columns.takeOf(view.column), onclick: take }, t.columns.take))
      : null;
    const confidence = view.confidence ? h('span.confidence', { 'data-confidence': view.confidence }, t.columns.confidences[view.confidence]) : null;
    return h('td.why', {}, proposal, confidence, confidence ? ': ' : null, ...prose(view.why), view.name_says ? h('span.note', {}, ` ${t.columns.nameSays(view.name_says)}`) : null);
  }
}
