/** The table of columns: shows how a log is read and what physics says of it, takes changes, reads the log anew. */

import '../style/columns.css';
import { h, iconButton, prose } from '../dom';
import { t } from '../messages';
import { wizard as say } from '../messages/wizard';
import type { Session } from '../session';
import { Signal } from '../signal';
import type { Store } from '../state';
import type { Finding, Found, Mapping } from './door';
import { takeAll, takePhysics } from './mapping';
import { Placing } from './placing';
import { ColumnTable } from './table';
import type { Watch } from './watch';

function finding(found: Finding): HTMLElement {
  return h('li', { 'data-weight': found.weight }, h('strong', {}, say.weights[found.weight]), ': ', ...prose(found.text));
}

export class ColumnsDialog {
  readonly element: HTMLDialogElement;
  /** The mapping as it stands in the table; null without a log. */
  readonly draft = new Signal<Mapping | null>(null);
  #store: Store;
  #session: Session;
  #watch: Watch;
  #findings = h('div.findings');
  #state = h('p', { role: 'status', tabindex: '-1' });
  #refusal = h('p.bad', { role: 'alert', hidden: true });
  #table = new ColumnTable(this.draft);
  #placing = new Placing(this.draft);
  #apply = h('button.primary', { type: 'button', onclick: () => void this.#applyDraft() }, say.apply);
  #undo = h('button', { type: 'button', onclick: () => this.#set(this.#watch.mapping) }, say.undo);
  #startOver = h('button', { type: 'button', onclick: () => this.#set(this.#watch.first) }, say.startOver);
  #takeAll = h('button', { type: 'button', onclick: () => this.#take(takeAll) }, say.takeAll);
  #takeMounts = h('button', { type: 'button', onclick: () => this.#take(takePhysics) }, say.takeMounts);
  #examine = h('button', { type: 'button', onclick: () => void this.#watch.examine() }, say.examine);
  #isReading = false;

  constructor(store: Store, session: Session, watch: Watch) {
    this.#store = store;
    this.#session = session;
    this.#watch = watch;
    this.element = h(
      'dialog.columns',
      { 'aria-label': say.title },
      h('header', {}, h('h2', {}, say.title), iconButton('close', t.help.close, () => this.element.close())),
      h('div.columns-body', {},
        h('p.note', {}, say.intro),
        this.#findings,
        this.#examine,
        this.#table.element,
        this.#placing.element),
      h('footer', {},
        h('div.columns-said', {}, this.#refusal, this.#state),
        h('div.columns-actions', {}, this.#takeAll, this.#takeMounts, h('span.spacer'), this.#startOver, this.#undo, this.#apply)),
    );
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    store.report.watch(() => this.#set(watch.mapping));
    watch.examined.watch(() => this.#show());
    watch.isWorking.on(() => this.#show());
    watch.failure.on(() => this.#show());
    this.draft.on(() => this.#showState());
  }

  show(): void {
    this.#refusal.hidden = true;
    this.element.showModal();
    void this.#watch.examine();
  }

  #set(mapping: Mapping | null): void {
    this.draft.value = mapping;
    this.#showState();
  }

  #take(how: (mapping: Mapping, found: Found) => Mapping): void {
    const [mapping, examined] = [this.draft.value, this.#watch.examined.value];
    if (mapping && examined) this.#set(how(mapping, examined[0]));
  }

  async #applyDraft(): Promise<void> {
    const { request } = this.#watch;
    if (!request || !this.draft.value || this.#isReading) return;
    this.#isReading = true;
    this.#refusal.hidden = true;
    this.#showState();
    const label = this.#store.report.value?.name ?? '';
    const isOpen = await this.#session.open({ ...request, mapping: JSON.stringify(this.draft.value) }, label);
    this.#isReading = false;
    if (isOpen) void this.#session.runAll();
    else {
      this.#refusal.textContent = this.#store.error.value ?? '';
      this.#refusal.hidden = this.#store.error.value === null;
    }
    this.#showState();
    if (isOpen) this.#state.textContent = say.applied;
  }

  #isChanged(): boolean {
    return JSON.stringify(this.draft.value) !== JSON.stringify(this.#watch.mapping);
  }

  #showState(): void {
    const isChanged = this.#isChanged();
    const isFocused = this.element.contains(document.activeElement);
    const isExamined = this.#watch.examined.value !== null;
    this.element.dataset['state'] = this.#isReading ? 'reading' : isChanged ? 'changed' : 'applied';
    this.#state.textContent = this.#isReading ? say.applying : isChanged ? say.changed : say.unchanged;
    this.#apply.disabled = !isChanged || this.#isReading;
    this.#undo.disabled = !isChanged;
    this.#startOver.disabled = JSON.stringify(this.draft.value) === JSON.stringify(this.#watch.first);
    this.#takeAll.disabled = !isExamined;
    this.#takeMounts.disabled = !isExamined;
    // The keyboard stays in the dialog when the button that was pressed is of no use any more.
    if (isFocused && document.activeElement?.matches('body, :disabled')) this.#state.focus();
  }

  #show(): void {
    const examined = this.#watch.examined.value;
    const [failure, isWorking] = [this.#watch.failure.value, this.#watch.isWorking.value];
    this.#examine.hidden = examined !== null || isWorking;
    this.#table.show(examined);
    this.#placing.show(examined?.[0] ?? null);
    this.#showState();
    if (!examined) {
      this.#findings.replaceChildren(h('p', { role: 'status' }, isWorking ? say.examining : failure ? say.failed(failure) : ''));
      return;
    }
    const [heavy, notes] = [examined[0].findings.filter((f) => f.weight !== 'note'), examined[0].findings.filter((f) => f.weight === 'note')];
    this.#findings.replaceChildren(
      heavy.length > 0 ? h('ul', {}, ...heavy.map(finding)) : h('p.good', {}, say.nothing),
      ...(notes.length > 0 ? [h('details', {}, h('summary', {}, say.notes(notes.length)), h('ul', {}, ...notes.map(finding)))] : []),
    );
  }
}
