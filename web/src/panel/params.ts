/** A control for every parameter of the chosen estimator. */

import { h, iconButton } from '../dom';
import type { EstimatorInfo, NumberParam, OptionalParam, ParamSpec, ParamValue } from '../door';
import { t } from '../messages';
import type { Session } from '../session';
import { clamp, fromTravel, toTravel, TRAVEL } from '../slider';
import type { Store } from '../state';
import { defaultOf, type History, type Tuning, withParam } from '../tuning';
import { formatSignificant, paramUnit } from '../units';
import { Tooltip } from './tooltip';

/** A name of the core as words. */
export function words(name: string): string {
  return name.replaceAll('_', ' ');
}

interface Row {
  spec: ParamSpec;
  element: HTMLElement;
  show(value: ParamValue): void;
}

export class ParamList {
  readonly element = h('div.params');
  #store: Store;
  #session: Pick<Session, 'beginGesture' | 'endGesture'>;
  #history: History<Tuning>;
  #estimator: EstimatorInfo | null = null;
  #rows: Row[] = [];
  #tooltip = new Tooltip();

  constructor(store: Store, session: Pick<Session, 'beginGesture' | 'endGesture'>, history: History<Tuning>) {
    this.#store = store;
    this.#session = session;
    this.#history = history;
    store.tuning.on(() => this.#showAll());
    store.display.on(() => this.setEstimator(this.#estimator));
  }

  /** Show only the parameters whose name or description holds `text`. */
  filter(text: string): void {
    const wanted = text.trim().toLowerCase();
    for (const { spec, element } of this.#rows) {
      element.hidden = ![words(spec.name), spec.symbol, spec.doc].some((s) => s.toLowerCase().includes(wanted));
    }
  }

  setEstimator(estimator: EstimatorInfo | null): void {
    this.#estimator = estimator;
    this.#rows = (estimator?.params ?? []).map((spec) => this.#row(spec));
    this.element.replaceChildren(...this.#rows.map((r) => r.element), this.#tooltip.element);
    this.#showAll();
  }

  #value(spec: ParamSpec): ParamValue {
    const own = this.#store.tuning.value.params[this.#estimator?.name ?? ''];
    const value = own?.[spec.name];
    return value === undefined ? defaultOf(spec) : value;
  }

  #showAll(): void {
    for (const row of this.#rows) row.show(this.#value(row.spec));
  }

  /** Take a value; while `gesture` lasts it is one step of undo and one comparison. */
  #set(spec: ParamSpec, value: ParamValue, isGesture = false): void {
    const name = this.#estimator?.name;
    if (name === undefined) return;
    const next = withParam(this.#store.tuning.value, name, spec, value);
    this.#history.push(next, isGesture ? `${name}.${spec.name}` : null);
    this.#store.tuning.value = next;
  }

  #row(spec: ParamSpec): Row {
    const label = h('button.param-name', { type: 'button' }, words(spec.name));
    if (spec.symbol) label.append(h('span.symbol', {}, spec.symbol));
    this.#tooltip.attach(label, () => this.#about(spec));
    const control = spec.kind === 'toggle' ? this.#toggle(spec) : spec.kind === 'choice' ? this.#choice(spec) : this.#number(spec);
    const reset = iconButton('reset', t.params.resetOne(words(spec.name)), () => this.#set(spec, defaultOf(spec)));
    reset.classList.add('reset');
    const element = h('div.param', { 'data-kind': spec.kind, 'data-param': spec.name }, label, ...control.elements, reset);
    const show = (value: ParamValue): void => {
      const isChanged = value !== defaultOf(spec);
      element.classList.toggle('changed', isChanged);
      reset.classList.toggle('unused', !isChanged);
      reset.disabled = !isChanged;
      control.show(value);
    };
    return { spec, element, show };
  }

  #about(spec: ParamSpec): HTMLElement[] {
    const { factor, label } = paramUnit(spec.unit, this.#store.display.value);
    const lines = [h('p', {}, spec.doc)];
    if (spec.kind === 'number' || spec.kind === 'optional') {
      const shown = (v: number): string => formatSignificant(v * factor);
      lines.push(h('p', {}, t.params.range(shown(spec.min), shown(spec.max), label)));
      if (spec.kind === 'number') lines.push(h('p', {}, `${t.params.defaultIs(`${shown(spec.default)} ${label}`.trim())} (${spec.source})`));
      else lines.push(h('p', {}, `${t.params.defaultIs(t.params.auto)} (${spec.source})`));
    } else {
      lines.push(h('p', {}, `${t.params.defaultIs(String(spec.default))} (${spec.source})`));
    }
    lines.push(h('p.code', {}, t.params.inFiles(spec.name, String(this.#value(spec) ?? 'none'))));
    return lines;
  }

  #toggle(spec: ParamSpec): { elements: HTMLElement[]; show(value: ParamValue): void } {
    const input = h('input', { type: 'checkbox', role: 'switch', 'aria-label': words(spec.name) });
    const state = h('span.state', { 'aria-hidden': 'true' });
    input.addEventListener('change', () => this.#set(spec, input.checked));
    return {
      elements: [h('label.toggle', {}, input, state)],
      show: (value) => {
        input.checked = value === true;
        state.textContent = value === true ? t.params.on : t.params.off;
      },
    };
  }

  #choice(spec: ParamSpec): { elements: HTMLElement[]; show(value: ParamValue): void } {
    const select = h('select', { 'aria-label': words(spec.name) });
    if (spec.kind === 'choice') select.append(...spec.options.map((o) => h('option', { value: o }, words(o))));
    select.addEventListener('change', () => this.#set(spec, select.value));
    return {
      elements: [select],
      show: (value) => {
        select.value = String(value);
      },
    };
  }

  #number(spec: NumberParam | OptionalParam): { elements: HTMLElement[]; show(value: ParamValue): void } {
    const { factor, label: unit } = paramUnit(spec.unit, this.#store.display.value);
    const name = words(spec.name);
    const slider = h('input', { type: 'range', min: 0, max: TRAVEL, step: 1, 'aria-label': name });
    const field = h('input.number', { type: 'text', inputmode: 'decimal', size: 8, spellcheck: 'false', autocomplete: 'off', 'aria-label': t.params.value(name) });
    const unitText = h('span.unit', { title: unit }, unit);
    const auto = h('input', { type: 'checkbox', 'aria-label': `${name}: ${t.params.auto}` });
    const middle = 'default' in spec ? spec.default : clamp(spec, 0);
    this.#listenSlider(spec, slider);
    field.addEventListener('change', () => {
      const typed = Number(field.value.trim().replace('−', '-').replace(',', '.')) / factor;
      const isGood = field.value.trim() !== '' && typed >= spec.min * (1 - 1e-9) - 1e-300 && typed <= spec.max * (1 + 1e-9);
      field.setAttribute('aria-invalid', String(!isGood));
      field.title = isGood ? '' : t.params.outOfRange(formatSignificant(spec.min * factor), formatSignificant(spec.max * factor));
      if (isGood) this.#set(spec, clamp(spec, typed));
    });
    auto.addEventListener('change', () => this.#set(spec, auto.checked ? null : middle));
    if ('default' in spec) slider.style.setProperty('--default', `${toTravel(spec, spec.default) / (TRAVEL / 100)}%`);
    const autoLabel = h('label.auto', { title: t.params.autoTitle }, auto, t.params.auto);
    const show = (value: ParamValue): void => {
      const isAuto = value === null;
      auto.checked = isAuto;
      slider.disabled = field.disabled = isAuto;
      const number = typeof value === 'number' ? value : middle;
      if (document.activeElement !== slider || fromTravel(spec, Number(slider.value)) !== number) slider.value = String(toTravel(spec, number));
      const text = formatSignificant(number * factor, 4);
      slider.setAttribute('aria-valuetext', `${text} ${unit}`);
      field.value = isAuto ? t.params.auto : text;
      field.removeAttribute('aria-invalid');
    };
    return { elements: [slider, field, unitText, ...(spec.kind === 'optional' ? [autoLabel] : [])], show };
  }

  #listenSlider(spec: NumberParam | OptionalParam, slider: HTMLInputElement): void {
    let isMoving = false;
    slider.addEventListener('input', () => {
      const name = this.#estimator?.name;
      if (name === undefined) return;
      if (!isMoving) this.#session.beginGesture(name);
      isMoving = true;
      this.#set(spec, fromTravel(spec, Number(slider.value)), true);
    });
    slider.addEventListener('change', () => {
      isMoving = false;
      this.#history.endGesture();
      if (this.#estimator) this.#session.endGesture(this.#estimator.name);
    });
  }
}
