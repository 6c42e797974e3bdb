/** The gallery of papers: a dialog with a chapter for each, whose claims are tried in the page. Loaded when it is opened. */

import '../style/gallery.css';
import { h, iconButton } from '../dom';
import { t } from '../messages';
import { gallery as say } from '../messages/gallery';
import type { Store } from '../state';
import { ClaimCard } from './claim';
import type { Paper, Trial, Verdict } from './door';
import { Runner } from './runner';

const VERDICTS: readonly Verdict[] = ['supported', 'partly', 'not_supported'];

/** A paper as books cite it: with a letter where the same authors wrote two in a year. */
function cited(papers: Paper[], index: number): string {
  const { authors } = papers[index] as Paper;
  const same = papers.flatMap((paper, i) => (paper.authors === authors ? [i] : []));
  return same.length > 1 ? authors + String.fromCharCode(97 + same.indexOf(index)) : authors;
}

export class Gallery {
  readonly element: HTMLDialogElement;
  readonly runner: Runner;
  #store: Store;
  #openTrial: (trial: Trial) => void;
  #body = h('div.gallery-body', { tabindex: '0', role: 'region', 'aria-label': say.title });
  #chapters = h('nav', { 'aria-label': say.chapters });
  #all = h('button.run-all', { type: 'button', disabled: true }, say.runAll);

  constructor(store: Store, openTrial: (trial: Trial) => void) {
    this.#store = store;
    this.#openTrial = openTrial;
    const worker = new Worker(new URL('./gallery-worker.ts', import.meta.url), { type: 'module' });
    this.runner = new Runner(worker);
    this.element = h(
      'dialog.gallery',
      { 'aria-label': say.title },
      h('header', {}, h('h2', {}, say.title), this.#all, iconButton('close', t.close, () => this.element.close())),
      h('p.note', {}, say.intro),
      this.#chapters,
      this.#body,
    );
    this.#body.append(h('p.note.loading', { role: 'status' }, say.loading));
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    this.runner.papers.on((papers) => this.#fill((papers ?? []).filter((p) => p.claims.length > 0)));
    this.runner.dead.on((reason) => {
      if (reason !== null) this.#body.prepend(h('p.failure', { role: 'alert' }, say.dead(reason)));
      this.#all.disabled = true;
      this.#body.querySelector('.loading')?.remove();
    });
  }

  show(): void {
    this.element.showModal();
  }

  #fill(papers: Paper[]): void {
    const ids = (paper: Paper): string[] => paper.claims.map((c) => `${paper.id}/${c.id}`);
    const sections = papers.map((paper) => this.#chapter(paper, ids(paper)));
    this.#body.replaceChildren(...sections);
    this.#chapters.replaceChildren(
      ...papers.map((paper, i) =>
        h('button.quiet', { type: 'button', title: paper.title, onclick: () => {
          sections[i]?.scrollIntoView({ block: 'start' });
          sections[i]?.querySelector('h3')?.focus({ preventScroll: true });
        } }, cited(papers, i)),
      ),
    );
    const all = papers.flatMap(ids);
    const untried = (): string[] => all.filter((id) => this.runner.claim(id).value.kind !== 'tried');
    this.#all.addEventListener('click', () => {
      if (this.runner.current.value !== null) this.runner.stopAll();
      else this.runner.run(untried().length > 0 ? untried() : all);
    });
    this.runner.current.watch((current) => {
      this.#all.disabled = this.runner.dead.value !== null;
      this.#all.textContent = current === null ? say.runAll : say.stopAll;
    });
  }

  #chapter(paper: Paper, ids: string[]): HTMLElement {
    const heading = `chapter-${paper.id}`;
    const tally = h('p.tally', { role: 'status' });
    const count = (): void => {
      const states = ids.map((id) => this.runner.claim(id).value);
      const found = VERDICTS.map((verdict) => states.filter((s) => s.kind === 'tried' && s.finding.verdict === verdict).length);
      const parts = VERDICTS.flatMap((verdict, i) => (found[i] ? [`${found[i]} ${say.verdicts[verdict]}`] : []));
      const left = states.filter((s) => s.kind !== 'tried').length;
      tally.textContent = [...parts, ...(left > 0 ? [say.left(left)] : [])].join(', ');
    };
    for (const id of ids) this.runner.claim(id).on(count);
    count();
    const card = (index: number): HTMLElement | null => {
      const claim = paper.claims[index];
      const id = ids[index];
      return claim && id !== undefined ? new ClaimCard(this.#store, this.runner, id, claim, this.#openTrial).element : null;
    };
    return h(
      'section.chapter',
      { 'aria-labelledby': heading },
      h('h3', { id: heading, tabindex: '-1' }, paper.title),
      h('p.authors', {}, paper.authors),
      h('p.setting', {}, paper.setting),
      tally,
      h('ol.claims', {}, ...ids.map((_, i) => card(i))),
    );
  }
}
