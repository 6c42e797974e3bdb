/** The panel of faults: what is in the drive, over time and as a list, and one more to be put in. */

import { h, iconButton } from '../dom';
import { t } from '../messages';
import { navigation as say } from '../messages/navigation';
import { LEFT, RIGHT } from '../plot/axes';
import { shareOf } from '../plot/axis';
import { Canvas } from '../plot/strip';
import { palette } from '../plot/palette';
import { TimeArea } from '../plot/time-area';
import { isRunnable, type Span, type Store } from '../state';
import { formatSignificant, formatTime, paramUnit } from '../units';
import type { RpcClient } from '../worker/rpc';
import type { Fault } from './door';
import { type Channels, type FaultKind, isPossible, KINDS, makeFault, metresPer, proposedSpan, signalsFor, signalUnit, usualAmount } from './fault-kinds';
import type { FaultSwitch } from './fault-switch';
import { parseTime } from './windows';

const ROW = 16;

/** One row for each fault. */
class FaultStrip extends Canvas {
  faults: readonly Fault[] = [];
  view: Span = { t0: 0, t1: 1 };

  protected override draw(context: CanvasRenderingContext2D): void {
    const right = this.width - RIGHT;
    const x = (time: number): number => Math.min(right, Math.max(LEFT, LEFT + shareOf(time, this.view) * (right - LEFT)));
    this.faults.forEach((fault, i) => {
      const top = i * ROW;
      context.fillStyle = palette.value.muted;
      context.textAlign = 'right';
      context.textBaseline = 'middle';
      context.fillText(String(i + 1), LEFT - 5, top + ROW / 2);
      context.fillStyle = palette.value.grid;
      context.fillRect(LEFT, top + ROW - 1, right - LEFT, 1);
      const [from, to] = [x(fault.from), x(fault.to)];
      if (to <= from) return;
      context.fillStyle = palette.value.bad;
      context.globalAlpha = 0.35;
      context.fillRect(from, top + 2, to - from, ROW - 5);
      context.globalAlpha = 1;
      context.fillRect(from, top + 2, 1.5, ROW - 5);
      context.fillRect(to - 1.5, top + 2, 1.5, ROW - 5);
    });
  }
}

export class FaultView {
  readonly element: HTMLElement;
  readonly #store: Store;
  readonly #faults: FaultSwitch;
  readonly #host = h('div.strip', { role: 'img', 'aria-label': say.faults.stripLabel });
  readonly #strip: FaultStrip;
  readonly #list = h('div.fault-list');
  readonly #removeAll = h('button.quiet', { type: 'button' }, say.faults.removeAll);
  readonly #kind = h('select', { 'aria-label': say.faults.kind });
  readonly #signal = h('select', { 'aria-label': say.faults.signal });
  readonly #amount = h('input.number', { type: 'number', step: 'any', required: true });
  readonly #unit = h('span');
  readonly #satellites = h('input.number', { type: 'number', min: 1, max: 12, step: 1, value: 2, 'aria-label': say.faults.satellites });
  readonly #satelliteLabel = h('label', {}, say.faults.satellites, this.#satellites);
  readonly #from = h('input.time-field', { type: 'text', inputmode: 'decimal', 'aria-label': say.faults.from });
  readonly #to = h('input.time-field', { type: 'text', inputmode: 'decimal', 'aria-label': say.faults.to });
  readonly #needsRanges = h('p.note', {}, say.faults.needsRanges);
  readonly #rpc: RpcClient;
  /** Where the drive is, rad, once that is known: what a metre of longitude is. */
  #latitude = 0;
  #located = Promise.resolve();
  #isTyped = false;

  constructor(store: Store, faults: FaultSwitch, rpc: RpcClient) {
    this.#store = store;
    this.#rpc = rpc;
    this.#faults = faults;
    const texts = say.faults;
    this.#kind.append(...KINDS.map((kind) => h('option', { value: kind }, texts.kinds[kind] ?? kind)));
    this.#removeAll.addEventListener('click', () => void faults.set([]));
    this.#strip = new FaultStrip(this.#host);
    this.#host.append(new TimeArea(store).element);
    const header = h('header.view-header', {}, h('h2', { title: t.views.focus(texts.title, '') }, texts.title), h('span.spacer'), this.#removeAll);
    header.querySelector('h2')?.removeAttribute('title');
    this.element = h('section.view', { tabindex: '-1', 'aria-label': texts.title, 'data-view': 'navigation-faults' }, header, this.#host, h('div.fault-body', {}, this.#form(), this.#needsRanges, this.#list, h('p.note', {}, texts.note)));
    this.#kind.addEventListener('change', () => this.#offer());
    this.#signal.addEventListener('change', () => this.#offerAmount());
    for (const input of [this.#from, this.#to]) input.addEventListener('input', () => (this.#isTyped = true));
    store.window.watch((view) => {
      this.#strip.view = view;
      this.#strip.redraw();
      this.#propose();
    });
    store.blind.on(() => this.#propose());
    store.report.watch(() => {
      this.#located = this.#locate();
      this.#isTyped = false;
      this.#offer();
      this.#propose();
    });
    store.display.on(() => this.#offerAmount());
    store.faults.watch(() => this.#show());
  }

  #form(): HTMLElement {
    const texts = say.faults;
    const form = h('form.fault-form', {},
      this.#kind, this.#signal, this.#amount, this.#unit, this.#satelliteLabel,
      h('span', {}, texts.from), this.#from, h('span', {}, texts.to), this.#to,
      h('button', { type: 'submit' }, texts.add));
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.#add();
    });
    return form;
  }

  #channels(): Channels {
    return this.#store.report.value?.channels ?? [];
  }

  get #chosen(): FaultKind {
    return this.#kind.value as FaultKind;
  }

  /** The kinds that the drive can have, and the signals that can fail in this way. */
  #offer(): void {
    const hasRanges = isRunnable(this.#store.report.value, 'gnss');
    for (const option of this.#kind.options) {
      option.disabled = !isPossible(option.value as FaultKind, this.#channels(), hasRanges);
      option.title = option.disabled && option.value === 'clock_jump' ? say.faults.needsRanges : '';
    }
    this.#needsRanges.hidden = hasRanges;
    if (this.#kind.selectedOptions[0]?.disabled) this.#kind.value = 'bias';
    const chosen = this.#signal.value;
    const signals = signalsFor(this.#chosen, this.#channels());
    this.#signal.replaceChildren(...signals.map((s) => h('option', { value: s, selected: s === chosen }, say.faults.channels[s] ?? s)));
    this.#signal.hidden = signals.length === 0;
    this.#satelliteLabel.hidden = this.#chosen !== 'multipath';
    this.#offerAmount();
  }

  #offerAmount(): void {
    const kind = this.#chosen;
    const signal = this.#signal.value;
    const unit = signalUnit(kind, signal);
    const { factor, label } = paramUnit(unit, this.#store.display.value);
    this.#amount.hidden = kind === 'freeze';
    this.#unit.textContent = kind === 'freeze' ? '' : kind === 'noise' ? say.faults.times : label;
    this.#amount.setAttribute('aria-label', say.faults.amount(say.faults.kinds[kind] ?? kind, this.#unit.textContent));
    this.#amount.value = String(Number((usualAmount(kind, signal) * (kind === 'noise' ? 1 : factor)).toPrecision(2)));
  }

  #propose(): void {
    if (this.#isTyped) return;
    const { t0, t1 } = proposedSpan(this.#store.window.value, this.#store.blind.value);
    this.#from.value = formatTime(this.#store.sinceStart(t0));
    this.#to.value = formatTime(this.#store.sinceStart(t1));
  }

  /** Ask where the drive is. */
  async #locate(): Promise<void> {
    const items = [{ source: 'drive', column: 'gnss_lat', step: false }];
    const reply = await this.#rpc.call('grid', { items, ...this.#store.span.value, buckets: 60 }).catch(() => null);
    this.#latitude = reply?.columns[0]?.find(Number.isFinite) ?? 0;
    this.#show();
  }

  /** How an amount is shown: what it is in SI times `factor`, in `label`. */
  #shownAs(kind: FaultKind, signal: string): { factor: number; label: string } {
    const { factor, label } = paramUnit(signalUnit(kind, signal), this.#store.display.value);
    return { factor: factor * metresPer(kind, signal, this.#latitude), label };
  }

  async #add(): Promise<void> {
    const store = this.#store;
    const start = store.span.value.t0;
    const [from, to] = [start + parseTime(this.#from.value), start + parseTime(this.#to.value)];
    if (!(to > from)) {
      this.#from.setCustomValidity(say.add.badTimes);
      this.#from.reportValidity();
      this.#from.setCustomValidity('');
      return;
    }
    const kind = this.#chosen;
    await this.#located;
    const { factor } = this.#shownAs(kind, this.#signal.value);
    const amount = kind === 'noise' ? this.#amount.valueAsNumber : this.#amount.valueAsNumber / factor;
    const seed = store.faults.value.length + 1;
    const fault = makeFault(kind, { signal: this.#signal.value, amount, satellites: this.#satellites.valueAsNumber, from, to, seed });
    this.#isTyped = false;
    await this.#faults.set([...store.faults.value, fault]);
  }

  #show(): void {
    const store = this.#store;
    const faults = store.faults.value;
    const texts = say.faults;
    this.#strip.faults = faults;
    this.#host.style.height = `${faults.length * ROW}px`;
    this.#host.hidden = faults.length === 0;
    this.#strip.redraw();
    this.#removeAll.disabled = faults.length === 0;
    const entries = faults.map((fault, i) =>
      h('li', {}, h('span', {}, `${this.#words(fault)}, ${texts.span(formatTime(store.sinceStart(fault.from)), formatTime(store.sinceStart(fault.to)))}`),
        iconButton('close', texts.remove(String(i + 1)), () => void this.#faults.set(faults.filter((f) => f !== fault)))));
    this.#list.replaceChildren(faults.length > 0 ? h('ol', { 'aria-label': texts.list }, ...entries) : h('p.note', {}, texts.none));
  }

  #words(fault: Fault): string {
    const texts = say.faults;
    const kind = texts.kinds[fault.kind] ?? fault.kind;
    const signal = 'signal' in fault ? ` ${texts.channels[fault.signal] ?? fault.signal}` : '';
    const { factor, label } = this.#shownAs(fault.kind, 'signal' in fault ? fault.signal : '');
    const shown = (value: number): string => `${formatSignificant(value * factor)} ${label}`;
    switch (fault.kind) {
      case 'bias':
        return `${kind}${signal} ${shown(fault.amount)}`;
      case 'delay':
        return `${kind}${signal} ${shown(fault.seconds)}`;
      case 'noise':
        return `${kind}${signal} ${texts.times} ${formatSignificant(fault.factor)}`;
      case 'freeze':
        return `${kind}${signal}`;
      case 'clock_jump':
        return `${kind} ${shown(fault.metres)}`;
      case 'multipath':
        return `${kind} ${shown(fault.metres)}, ${texts.manySatellites(fault.satellites)}`;
    }
  }
}
