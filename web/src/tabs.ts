/** Rows of tabs: one is chosen, the arrows go along the row. */

import { h } from './dom';

/** A tab of `row`; `choose` is called when it is clicked or reached by an arrow. */
export function tabButton(row: HTMLElement, props: Record<string, unknown>, label: string, choose: () => void): HTMLButtonElement {
  const tab = h('button', { type: 'button', role: 'tab', ...props }, label);
  tab.addEventListener('click', choose);
  tab.addEventListener('keydown', (event) => {
    const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    event.stopPropagation();
    const all = [...row.children] as HTMLElement[];
    const next = all[(all.indexOf(tab) + step + all.length) % all.length];
    next?.click();
    next?.focus();
  });
  return tab;
}

/** Mark the tab with this id as chosen and bring it into the row's sight. */
export function chooseTab(row: HTMLElement, id: string): void {
  for (const tab of row.children) {
    const isChosen = tab.id === id;
    tab.setAttribute('aria-selected', String(isChosen));
    tab.setAttribute('tabindex', isChosen ? '0' : '-1');
    if (isChosen) {
      // Along the row of tabs only: the page stays where it is.
      const [outer, own] = [row.getBoundingClientRect(), tab.getBoundingClientRect()];
      row.scrollLeft += Math.min(0, own.left - outer.left) + Math.max(0, own.right - outer.right);
    }
  }
}
