/** Has every opened log examined by physics, and says in the log's report what contradicts how it was read. */

import { h, prose } from '../dom';
import { columns as say } from '../messages/columns';
import type { Session } from '../session';
import { Signal } from '../signal';
import type { Store } from '../state';
import { Cancelled, type OpenRequest, type Pending, Unloaded } from '../worker/rpc';
import type { Clash, Examined, Mapping, Trial } from './door';
import { type Issue, issuesOf } from './issues';
import { guesses } from './mapping';
import { columnsOf, recognise, saved, type Shelved } from './shelf';

/** So many issues are told beside the log; the table has all. */
const TOLD = 4;

type FilesRequest = Extract<OpenRequest, { kind: 'files' }>;

/** In the log's report: what says what should be looked at, and what opens the table of columns. */
export interface Beside {
  readonly notice: HTMLElement;
  readonly button: HTMLButtonElement;
}

export class Watch {
  readonly examined = new Signal<Examined | null>(null);
  readonly isWorking = new Signal(false);
  /** Why the open log could not be examined. */
  readonly failure = new Signal<string | null>(null);
  /** What the mapping of the open log makes of it. */
  readonly trial = new Signal<Trial | null>(null);
  /** Whether the log is being read anew. */
  readonly isReading = new Signal(false);
  /** The saved mapping with which the open log was read because it was recognised. */
  readonly recognised = new Signal<Shelved | null>(null);
  /** What the open files were read with at first. */
  first: Mapping | null = null;
  /** Where what physics proposes contradicts itself: there it is not to be believed. */
  weak: Clash[] = [];
  #beside: Beside;
  #store: Store;
  #session: Session;
  #request: FilesRequest | null = null;
  #pending: Pending<Examined> | null = null;
  #show: () => void;

  /** `show` opens the table. */
  constructor(store: Store, session: Session, beside: Beside, show: () => void) {
    this.#store = store;
    this.#session = session;
    this.#show = show;
    this.#beside = beside;
    beside.button.textContent = say.button;
    beside.button.ariaHasPopup = 'dialog';
    beside.button.addEventListener('click', show);
    store.report.watch(() => this.#opened());
    for (const heard of [this.examined, this.isWorking, this.trial, this.isReading, this.recognised]) heard.on(() => this.#tell());
  }

  /** The mapping of the open log; null where it was not read with one. */
  get mapping(): Mapping | null {
    return this.#request ? (this.#store.report.value?.import?.mapping ?? null) : null;
  }

  /** The columns of the open log. */
  get columns(): string[] {
    const opened = this.#store.report.value?.import;
    return opened ? columnsOf(opened) : [];
  }

  /** Whether a mapping is that of the open log. */
  isApplied(mapping: Mapping | null): boolean {
    return JSON.stringify(mapping) === JSON.stringify(this.mapping);
  }

  /** Examine the open log, if that is not being or has not been done. */
  async examine(): Promise<void> {
    const request = this.#request;
    if (!request || this.#pending || this.examined.value) return;
    this.failure.value = null;
    const { files, mapping, keep } = request;
    const pending = this.#session.rpc.start('examine', { files, mapping, ...(keep ? { keep } : {}) });
    this.#pending = pending;
    this.isWorking.value = true;
    try {
      const examined = await pending.answer;
      if (this.#pending !== pending) return;
      // Asked before anything else is tried, hence answered before.
      const proposed = this.tryOut(examined[0].mapping).catch(() => null);
      this.weak = [];
      this.examined.value = examined;
      this.weak = (await proposed)?.clashes ?? [];
      if (this.#pending !== pending) return;
      await this.#weigh();
    } catch (reason) {
      const sentence = reason instanceof Unloaded ? say.unloaded : reason instanceof Error ? reason.message : String(reason);
      if (this.#pending === pending && !(reason instanceof Cancelled)) this.failure.value = sentence;
    } finally {
      if (this.#pending === pending) {
        this.#pending = null;
        this.isWorking.value = false;
      }
    }
  }

  /** What a mapping makes of the log that was examined; null where it cannot be read with it. */
  async tryOut(mapping: Mapping): Promise<Trial | null> {
    try {
      return await this.#session.rpc.call('try_out', { mapping: JSON.stringify(mapping) });
    } catch (reason) {
      if (reason instanceof Cancelled) return null;
      throw reason;
    }
  }

  /** Read the open files anew with a mapping, null for what is proposed. Null once they are, else why they are not. */
  async apply(mapping: Mapping | null): Promise<string | null> {
    const request = this.#request;
    if (!request || this.isReading.value) return '';
    this.isReading.value = true;
    const label = this.#store.report.value?.name ?? '';
    const isOpen = await this.#session.open({ ...request, mapping: mapping && JSON.stringify(mapping) }, label);
    this.isReading.value = false;
    if (isOpen) void this.#session.runAll();
    return isOpen ? null : (this.#store.error.value ?? '');
  }

  /** What contradicts a mapping of the open log. */
  issues(mapping: Mapping, trial: Trial | null): Issue[] {
    const examined = this.examined.value;
    return examined ? issuesOf({ mapping, trial, examined, weak: this.weak, first: this.first ?? mapping }) : [];
  }

  async #weigh(): Promise<void> {
    const mapping = this.mapping;
    if (!mapping || !this.examined.value) return;
    const trial = await this.tryOut(mapping);
    if (this.isApplied(mapping)) this.trial.value = trial;
  }

  #opened(): void {
    const [opened, report] = [this.#store.opened.value, this.#store.report.value];
    const request = opened?.kind === 'files' && report?.import?.mapping ? opened : null;
    const isSame = request !== null && request.files === this.#request?.files && request.keep === this.#request.keep;
    this.#request = request;
    this.trial.value = null;
    if (!isSame) {
      this.#pending = null;
      this.isWorking.value = false;
      this.first = this.mapping;
      this.failure.value = null;
      this.recognised.value = null;
      this.examined.value = null;
    }
    this.#beside.button.hidden = request === null;
    const known = !isSame && request?.mapping === null ? recognise(this.columns, saved()) : null;
    if (known) {
      setTimeout(() => void this.#readAs(known, request));
      return;
    }
    this.#tell();
    if (this.examined.value) void this.#weigh().catch(() => undefined);
    // A log that was not examined while it was opened is when someone asks for it: it is read once more for that.
    else if (request && report?.import?.is_examined) void this.examine();
  }

  /** Read a log that was recognised as it was read before. */
  async #readAs(known: Shelved, request: FilesRequest | null): Promise<void> {
    if (this.#request !== request) return;
    if ((await this.apply(known.mapping)) === null) this.recognised.value = known;
    else void this.examine();
  }

  /** A button that corrects one thing and reads the log anew. */
  #correct(mapping: Mapping, { fix, what }: Issue): HTMLElement | null {
    if (!fix) return null;
    const act = (): void => void this.apply(fix(mapping));
    return h('button', { type: 'button', disabled: this.isReading.value, 'aria-label': say.correctOf(what), onclick: act }, say.correct);
  }

  #recognisedBy(): HTMLElement | null {
    const saved = this.recognised.value;
    if (!saved || !this.#request) return null;
    const drop = (): void => void this.apply(null).then((refusal) => refusal === null && (this.recognised.value = null));
    return h('p.recognised', {}, `${say.recognised(saved.name, saved.columns.length)} `, h('button', { type: 'button', disabled: this.isReading.value, onclick: drop }, say.unrecognise));
  }

  #tell(): void {
    const mapping = this.mapping;
    const issues = mapping && this.trial.value ? this.issues(mapping, this.trial.value) : [];
    const recognised = this.#recognisedBy();
    // What contradicts comes first.
    const guessed = this.examined.value && !this.isWorking.value ? guesses(this.examined.value[0]) : 0;
    const isFocused = this.#beside.notice.contains(document.activeElement);
    this.#beside.notice.hidden = issues.length === 0 && !recognised && guessed === 0;
    this.#beside.notice.replaceChildren(...(mapping && !this.#beside.notice.hidden ? this.#told(mapping, issues, recognised, guessed) : []));
    // The keyboard stays here when the button that was pressed is gone.
    if (isFocused) (this.#beside.notice.querySelector<HTMLElement>('button:enabled') ?? this.#beside.button).focus();
  }

  #told(mapping: Mapping, issues: Issue[], recognised: HTMLElement | null, guessed: number): (HTMLElement | string)[] {
    const rest = issues.length - TOLD;
    return [
      ...(recognised ? [recognised] : []),
      ...(issues.length > 0 ? [h('p', {}, h('strong', {}, say.contradictions(issues.length)))] : []),
      h('ul.issues', {}, ...issues.slice(0, TOLD).map((issue) => h('li', {}, h('span', {}, ...prose(issue.text)), this.#correct(mapping, issue)))),
      rest > 0 ? h('p', {}, say.moreIssues(rest)) : '',
      guessed > 0 ? h('p', {}, say.guesses(guessed)) : '',
      h('button', { type: 'button', 'aria-haspopup': 'dialog', onclick: this.#show }, say.look),
    ];
  }
}
