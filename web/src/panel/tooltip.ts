/** A note beside a control: on hover, on focus, and by a tap; Escape hides it. */

import { h } from '../dom';

let nextId = 0;

export class Tooltip {
  readonly element = h('div.tooltip', { role: 'tooltip', hidden: true });
  #owner: HTMLElement | null = null;

  constructor() {
    this.element.id = `tooltip-${nextId++}`;
  }

  /** Show `content` beside `owner` when it is pointed at. */
  attach(owner: HTMLElement, content: () => HTMLElement[]): void {
    owner.setAttribute('aria-describedby', this.element.id);
    const show = (): void => this.#show(owner, content());
    owner.addEventListener('pointerenter', (event) => event.pointerType === 'mouse' && show());
    owner.addEventListener('pointerleave', (event) => event.pointerType === 'mouse' && this.#hide());
    owner.addEventListener('focus', show);
    owner.addEventListener('blur', () => this.#hide());
    owner.addEventListener('click', show);
    owner.addEventListener('keydown', (event) => {
      if (event.key !== 'Escape' || this.element.hidden) return;
      event.stopPropagation();
      this.#hide();
    });
  }

  #show(owner: HTMLElement, content: HTMLElement[]): void {
    this.#owner = owner;
    this.element.replaceChildren(...content);
    this.element.hidden = false;
    const box = owner.getBoundingClientRect();
    const own = this.element.getBoundingClientRect();
    const width = document.documentElement.clientWidth;
    const height = document.documentElement.clientHeight;
    const isLeft = box.left - own.width - 10 >= 8;
    const left = isLeft ? box.left - own.width - 10 : Math.min(Math.max(8, box.left), width - own.width - 8);
    const below = isLeft ? box.top - 6 : box.bottom + 6;
    const top = below + own.height > height - 8 && !isLeft ? box.top - own.height - 6 : Math.min(below, height - own.height - 8);
    this.element.style.left = `${left}px`;
    this.element.style.top = `${Math.max(8, top)}px`;
    addEventListener('scroll', this.#scrolled, { capture: true, once: true });
  }

  #scrolled = (): void => this.#hide();

  #hide(): void {
    if (this.#owner) this.element.hidden = true;
    this.#owner = null;
  }
}
