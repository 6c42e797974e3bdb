/** The table of columns: shows how a log is read and what physics says of it, takes changes, reads the log anew. */

import '../style/columns.css';
import { h, iconButton, prose } from '../dom';
import { t } from '../messages';
import { columns as beside } from '../messages/columns';
import { wizard as say } from '../messages/wizard';
import { Signal } from '../signal';
import type { Store } from '../state';
import { latest } from '../worker/rpc';
import type { Finding, Found, Mapping, Trial } from './door';
import type { Issue } from './issues';
import { takeAll, takePhysics } from './mapping';
import { Placing } from './placing';
import { Preview } from './preview';
import { SavedMappings } from './saved';
import { ColumnTable } from './table';
import type { Watch } from './watch';

function finding(found: Finding): HTMLElement {
  return h('li', { 'data-weight': found.weight }, ...(found.weight === 'guess' ? [h('strong', {}, say.guess), ': '] : []), ...prose(found.text));
}

export class ColumnsDialog {
  readonly element: HTMLDialogElement;
  /** The mapping as it stands in the table; null without a log. */
  readonly draft = new Signal<Mapping | null>(null);
  /** What it makes of the log. */
  readonly trial = new Signal<Trial | null>(null);
  #watch: Watch;
  #findings = h('div.findings');
  #issues = h('div.findings', { role: 'status' });
  #state = h('p', { role: 'status', tabindex: '-1' });
  #refusal = h('p.bad', { role: 'alert', hidden: true });
  #table = new ColumnTable(this.draft);
  #placing = new Placing(this.draft);
  #preview: Preview;
  #saved: SavedMappings;
  #apply = h('button.primary', { type: 'button', onclick: () => void this.#applyDraft() }, say.apply);
  #undo = h('button', { type: 'button', onclick: () => this.#set(this.#watch.mapping) }, say.undo);
  #startOver = h('button', { type: 'button', onclick: () => this.#set(this.#watch.first) }, say.startOver);
  #takeAll = h('button', { type: 'button', title: say.takeAllTitle, onclick: () => this.#take(takeAll) }, say.takeAll);
  #takeMounts = h('button', { type: 'button', onclick: () => this.#take(takePhysics) }, say.takeMounts);
  #examine = h('button', { type: 'button', onclick: () => void this.#watch.examine() }, say.examine);
  /** Try the mapping as it stands; of many changes the last one counts. */
  #try = latest(() => this.#tryDraft());
  #tried: Mapping | null = null;

  constructor(store: Store, watch: Watch) {
    this.#watch = watch;
    this.#preview = new Preview(store, this.trial);
    this.#saved = new SavedMappings(this.draft, watch);
    this.element = h(
      'dialog.columns',
      { 'aria-label': say.title },
      h('header', {}, h('h2', {}, say.title), iconButton('close', t.close, () => this.element.close())),
      h('div.columns-body', {},
        h('p.note', {}, say.intro),
        this.#examine,
        this.#issues,
        h('div.columns-actions', {}, this.#takeAll, this.#takeMounts),
        this.#preview.element,
        this.#table.element,
        this.#findings,
        this.#placing.element,
        this.#saved.element),
      h('footer', {},
        h('div.columns-said', {}, this.#refusal, this.#state),
        h('div.columns-actions', {}, this.#startOver, this.#undo, this.#apply)),
    );
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    this.element.addEventListener('close', () => this.#preview.stop());
    store.report.watch(() => this.#set(watch.mapping));
    watch.examined.watch(() => this.#show());
    for (const heard of [watch.isWorking, watch.failure]) heard.on(() => this.#show());
    watch.isReading.on(() => this.#showState());
    this.trial.on(() => this.#showIssues());
    this.draft.on(() => {
      this.#showState();
      this.#try();
    });
  }

  show(): void {
    this.#refuse(null);
    if (!this.element.open) this.element.showModal();
    void this.#watch.examine();
    this.#try();
  }

  #set(mapping: Mapping | null): void {
    this.draft.value = mapping;
    this.#showState();
  }

  #take(how: (mapping: Mapping, found: Found) => Mapping): void {
    const [mapping, examined] = [this.draft.value, this.#watch.examined.value];
    if (mapping && examined) this.#set(how(mapping, examined[0]));
  }

  /** Nothing is tried while nobody looks. */
  async #tryDraft(): Promise<void> {
    const mapping = this.draft.value;
    if (!mapping || !this.#watch.examined.value || !this.element.open || mapping === this.#tried) return;
    const isSame = this.trial.value !== null && JSON.stringify(mapping) === JSON.stringify(this.#tried);
    let trial = this.trial.value;
    let refusal = '';
    if (!isSame) {
      try {
        trial = await this.#watch.tryOut(mapping);
      } catch (reason) {
        refusal = reason instanceof Error ? reason.message : String(reason);
      }
    }
    this.#refuse(refusal);
    this.#tried = mapping;
    this.trial.value = trial;
    if (isSame) this.#showIssues();
  }

  async #applyDraft(): Promise<void> {
    if (!this.draft.value) return;
    this.#refuse(null);
    const refusal = await this.#watch.apply(this.draft.value);
    this.#refuse(refusal);
    if (refusal === null) this.#state.textContent = say.applied;
  }

  /** Say why a mapping cannot be read with, if it cannot. */
  #refuse(sentence: string | null): void {
    this.#refusal.textContent = sentence;
    this.#refusal.hidden = !sentence;
  }

  #showState(): void {
    const { isReading, examined, first } = this.#watch;
    const isChanged = !this.#watch.isApplied(this.draft.value);
    const isFocused = this.element.contains(document.activeElement);
    this.element.dataset['state'] = isReading.value ? 'reading' : isChanged ? 'changed' : 'applied';
    this.#state.textContent = isReading.value ? say.applying : isChanged ? say.changed : say.unchanged;
    this.#apply.disabled = !isChanged || isReading.value;
    this.#undo.disabled = !isChanged;
    this.#startOver.disabled = JSON.stringify(this.draft.value) === JSON.stringify(first);
    this.#takeAll.disabled = this.#takeMounts.disabled = examined.value === null;
    // The keyboard stays in the dialog when the button that was pressed is of no use any more.
    if (isFocused && document.activeElement?.matches('body, :disabled')) this.#state.focus();
  }

  #show(): void {
    const { examined: { value: examined }, failure: { value: failure }, isWorking: { value: isWorking } } = this.#watch;
    this.#examine.hidden = examined !== null || isWorking;
    this.#table.show(examined);
    this.#placing.show(examined?.[0] ?? null);
    this.#saved.show(examined);
    this.#showState();
    this.#tried = null;
    this.trial.value = null;
    this.#showIssues();
    this.#try();
    this.#findings.replaceChildren();
    if (!examined) {
      this.#issues.replaceChildren(h('p', {}, isWorking ? say.examining : failure ? say.failed(failure) : ''));
      return;
    }
    const guesses = examined[0].findings.filter((f) => f.weight === 'guess');
    const notes = examined[0].findings.filter((f) => f.weight === 'note');
    if (guesses.length > 0) this.#findings.append(h('ul', {}, ...guesses.map(finding)));
    if (notes.length > 0) this.#findings.append(h('details', {}, h('summary', {}, say.notes(notes.length)), h('ul', {}, ...notes.map(finding))));
  }

  #showIssues(): void {
    const [mapping, trial] = [this.draft.value, this.trial.value];
    if (!mapping || !trial) return;
    const issues = this.#watch.issues(mapping, trial);
    const isFocused = this.#issues.contains(document.activeElement);
    this.#issues.replaceChildren(
      issues.length > 0 ? h('h3', {}, say.contradictions) : h('p.good', {}, say.nothing),
      h('ul.issues', {}, ...issues.map((issue) => h('li', { 'data-weight': 'contradiction' }, h('span', {}, ...prose(issue.text)), this.#correct(issue)))),
    );
    if (isFocused) (this.#issues.querySelector('button') ?? this.#state).focus();
  }

  #correct({ what, fix }: Issue): HTMLElement | null {
    if (!fix) return null;
    const act = (): void => this.#set(this.draft.value && fix(this.draft.value));
    return h('button', { type: 'button', 'aria-label': beside.correctOf(what), onclick: act }, beside.correct);
  }
}
