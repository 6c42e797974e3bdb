/** Mappings under a name: saved in this browser, used, exported, imported, deleted. */

import { h, save } from '../dom';
import { wizard } from '../messages/wizard';
import type { Signal } from '../signal';
import type { Examined, Mapping } from './door';
import { forget, keep, saved, type Shelved } from './shelf';
import type { Watch } from './watch';

const say = wizard.shelf;

/** A name as the beginning of a file's name. */
function fileName(name: string): string {
  return `${name.replace(/[^\w.-]+/g, '_') || 'mapping'}.json`;
}

export class SavedMappings {
  readonly element: HTMLElement;
  #draft: Signal<Mapping | null>;
  #watch: Watch;
  #examined: Examined | null = null;
  #name = h('input', { type: 'text', required: true, maxlength: '60', autocomplete: 'off' });
  #list = h('ul.saved-list');
  #said = h('p', { role: 'status' });

  constructor(draft: Signal<Mapping | null>, watch: Watch) {
    this.#draft = draft;
    this.#watch = watch;
    const file = h('input', { type: 'file', accept: '.json,application/json', hidden: true, tabindex: '-1', 'aria-label': say.take });
    file.addEventListener('change', () => {
      const [chosen] = file.files ?? [];
      file.value = '';
      if (chosen) void this.#import(chosen);
    });
    const form = h('form', {}, h('label', {}, say.name, this.#name), h('button', { type: 'submit' }, say.save));
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.#save(this.#name.value.trim());
    });
    const share = (): void => this.#share(this.#name.value.trim() || 'mapping', this.#draft.value);
    this.element = h(
      'section.saved',
      { hidden: true },
      h('h3', {}, say.title),
      h('p.note', {}, say.note),
      form,
      h('button', { type: 'button', onclick: share }, say.shareShown),
      h('button', { type: 'button', onclick: () => file.click() }, say.take),
      file,
      this.#said,
      this.#list,
    );
  }

  show(examined: Examined | null): void {
    this.#examined = examined;
    this.element.hidden = examined === null;
    this.#said.textContent = '';
    this.#name.value = this.#watch.recognised.value?.name ?? '';
    this.#showList();
  }

  #save(name: string): void {
    const mapping = this.#draft.value;
    if (!mapping || name === '') return;
    const isKept = keep({ name, columns: this.#watch.columns, mapping });
    this.#said.textContent = isKept ? say.saved(name) : say.notKept;
    this.#showList();
  }

  #share(name: string, mapping: Mapping | null): void {
    if (mapping) save(fileName(name), JSON.stringify(mapping, null, 2), 'application/json');
  }

  async #import(file: File): Promise<void> {
    try {
      const mapping = JSON.parse(await file.text()) as Mapping;
      await this.#use(mapping);
      this.#name.value = file.name.replace(/\.json$/i, '');
      this.#said.textContent = say.used(this.#name.value);
    } catch (reason) {
      this.#said.textContent = say.isNone(file.name, reason instanceof Error ? reason.message : String(reason));
    }
  }

  /** Put a mapping into the table, if it is one and this log has its columns. */
  async #use(mapping: Mapping): Promise<void> {
    await this.#watch.tryOut(mapping);
    const here = new Set([...(this.#examined?.[0].columns.map((c) => c.column) ?? []), ...this.#watch.columns]);
    const missing = [mapping.time.column, ...Object.values(mapping.signals).map((s) => s.column)].filter((c) => !here.has(c));
    if (missing.length > 0) throw new Error(say.lacks([...new Set(missing)].join(', ')));
    this.#draft.value = mapping;
  }

  async #useSaved({ name, mapping }: Shelved): Promise<void> {
    try {
      await this.#use(mapping);
      this.#name.value = name;
      this.#said.textContent = say.used(name);
    } catch (reason) {
      this.#said.textContent = say.isNone(name, reason instanceof Error ? reason.message : String(reason));
    }
  }

  #forget(name: string): void {
    forget(name);
    this.#said.textContent = say.forgotten(name);
    this.#showList();
    this.#name.focus();
  }

  #showList(): void {
    const button = (text: string, label: string, onclick: () => void): HTMLElement => h('button', { type: 'button', 'aria-label': label, onclick }, text);
    const all = saved();
    this.#list.replaceChildren(...all.map((entry) => h(
      'li',
      {},
      h('strong', {}, entry.name),
      h('span.note', {}, say.columns(entry.columns.length)),
      button(say.use, say.useOf(entry.name), () => void this.#useSaved(entry)),
      button(say.share, say.shareOf(entry.name), () => this.#share(entry.name, entry.mapping)),
      button(say.forget, say.forgetOf(entry.name), () => this.#forget(entry.name)),
    )));
    this.#list.hidden = all.length === 0;
  }
}
