/** Has every opened log examined by physics, and says in the log's report what should be looked at. */

import { h } from '../dom';
import { t } from '../messages';
import type { Session } from '../session';
import { Signal } from '../signal';
import type { Store } from '../state';
import { Cancelled, type OpenRequest, type Pending, Unloaded } from '../worker/rpc';
import type { Examined, Mapping } from './door';
import { doubts, isDoubtful } from './mapping';

/** A log of more bytes is examined when someone asks for it: it is read once more for that. */
const UNASKED = 24e6;

type FilesRequest = Extract<OpenRequest, { kind: 'files' }>;

export class Watch {
  readonly examined = new Signal<Examined | null>(null);
  readonly isWorking = new Signal(false);
  /** Why the open log could not be examined. */
  readonly failure = new Signal<string | null>(null);
  /** What the open files were read with at first. */
  first: Mapping | null = null;
  /** Opens the table of columns; for the log's report. */
  readonly button: HTMLButtonElement;
  /** Says what should be looked at. */
  readonly notice = h('div.columns-notice', { role: 'status', hidden: true });
  #store: Store;
  #session: Session;
  #request: FilesRequest | null = null;
  #pending: Pending<Examined> | null = null;
  #show: () => void;

  /** `show` opens the table. */
  constructor(store: Store, session: Session, show: () => void) {
    this.#store = store;
    this.#session = session;
    this.#show = show;
    this.button = h('button', { type: 'button', hidden: true, 'aria-haspopup': 'dialog', onclick: show }, t.columns.button);
    store.report.on(() => this.#opened());
    this.examined.on(() => this.#tell());
  }

  /** The mapping of the open log; null where it was not read with one. */
  get mapping(): Mapping | null {
    return this.#request ? (this.#store.report.value?.import?.mapping ?? null) : null;
  }

  /** What the open log was opened with. */
  get request(): FilesRequest | null {
    return this.#request;
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
      if (this.#pending === pending) this.examined.value = examined;
    } catch (reason) {
      const sentence = reason instanceof Unloaded ? t.columns.unloaded : reason instanceof Error ? reason.message : String(reason);
      if (this.#pending === pending && !(reason instanceof Cancelled)) this.failure.value = sentence;
    } finally {
      if (this.#pending === pending) {
        this.#pending = null;
        this.isWorking.value = false;
      }
    }
  }

  #opened(): void {
    const [opened, report] = [this.#store.opened.value, this.#store.report.value];
    const request = opened?.kind === 'files' && report?.import?.mapping ? opened : null;
    const isSame = request !== null && request.files === this.#request?.files && request.keep === this.#request.keep;
    this.#request = request;
    if (!isSame) {
      this.#pending = null;
      this.isWorking.value = false;
      this.first = this.mapping;
      this.failure.value = null;
      this.examined.value = null;
    }
    this.button.hidden = request === null;
    this.#tell();
    const bytes = request?.files.reduce((sum, file) => sum + file.size, 0) ?? 0;
    if (request && bytes <= UNASKED) void this.examine();
  }

  #tell(): void {
    const [examined, mapping] = [this.examined.value, this.mapping];
    const found = examined && mapping ? doubts(mapping, examined[0], examined[2]) : null;
    this.notice.hidden = found === null || !isDoubtful(found);
    if (!found) return;
    const lines = [
      found.contradictions > 0 ? t.columns.noticeContradictions(found.contradictions) : null,
      found.columns.length > 0 ? t.columns.noticeColumns(found.columns.join(', ')) : null,
      found.channels.length > 0 ? t.columns.noticeChannels(found.channels.map((c) => t.columns.channels[c] ?? c).join(', ')) : null,
      found.guesses > 0 ? t.columns.noticeGuesses(found.guesses) : null,
    ];
    this.notice.replaceChildren(
      ...lines.filter((line) => line !== null).map((line) => h('p', {}, line)),
      h('button', { type: 'button', 'aria-haspopup': 'dialog', onclick: this.#show }, t.columns.look),
    );
  }
}
