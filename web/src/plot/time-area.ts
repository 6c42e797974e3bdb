/** Pointing at time: one cursor and one zoom for everything that is drawn over time or distance. */

import { h } from '../dom';
import type { Store } from '../state';
import type { Signal } from '../signal';
import { LEFT, RIGHT } from './axes';
import { type Axis, axis, shareOf, timeAt } from './axis';

interface Touch {
  x: number;
  y: number;
}

/** A layer over a plot that moves the cursor, zooms and pans, and shows the cursor's line. */
export class TimeArea {
  readonly element = h('div.time-area');
  #line = h('div.cursor-line');
  #selection = h('div.selection', { hidden: true });
  #store: Store;
  #axis: Signal<Axis>;
  #touches = new Map<number, Touch>();
  #drag: { kind: 'select' | 'pan' | 'pinch'; from: number } | null = null;

  /** `own` is the axis of the plot beneath, where that is not the one of all plots. */
  constructor(store: Store, own: Signal<Axis> = axis) {
    this.#store = store;
    this.#axis = own;
    this.element.style.left = `${LEFT}px`;
    this.element.style.right = `${RIGHT}px`;
    this.element.append(this.#selection, this.#line);
    this.#listen();
    store.cursor.on(() => this.#place());
    store.window.on(() => this.#place());
    own.on(() => this.#place());
    this.#place();
  }

  #share(clientX: number): number {
    const box = this.element.getBoundingClientRect();
    return box.width > 0 ? (clientX - box.left) / box.width : 0;
  }

  #time(clientX: number): number {
    return timeAt(Math.min(1, Math.max(0, this.#share(clientX))), this.#store.window.value, this.#axis.value);
  }

  #place(): void {
    const share = shareOf(this.#store.cursor.value, this.#store.window.value, this.#axis.value);
    this.#line.hidden = share < 0 || share > 1;
    this.#line.style.left = `${100 * share}%`;
  }

  #listen(): void {
    const { element } = this;
    element.addEventListener('pointerdown', (event) => this.#down(event));
    element.addEventListener('pointermove', (event) => this.#move(event));
    element.addEventListener('pointerup', (event) => this.#up(event, true));
    element.addEventListener('pointercancel', (event) => this.#up(event, false));
    element.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
    element.addEventListener('dblclick', () => {
      const { t0, t1 } = this.#store.span.value;
      this.#store.show(t0, t1);
    });
  }

  #wheel(event: WheelEvent): void {
    event.preventDefault();
    const scale = event.deltaMode === 1 ? 16 : 1;
    const sideways = event.shiftKey ? event.deltaY || event.deltaX : event.deltaX;
    if (Math.abs(sideways) > Math.abs(event.shiftKey ? 0 : event.deltaY)) this.#store.pan((sideways * scale) / 1000, this.#axis.value);
    else this.#store.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * scale * 0.002))), this.#time(event.clientX), this.#axis.value);
  }

  #down(event: PointerEvent): void {
    if (event.button > 1) return;
    this.element.setPointerCapture(event.pointerId);
    this.#touches.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (event.pointerType === 'touch') {
      this.#drag = this.#touches.size === 2 ? { kind: 'pinch', from: 0 } : null;
      if (this.#touches.size === 1) this.#store.moveCursor(this.#time(event.clientX));
      return;
    }
    const isPan = event.shiftKey || event.button === 1;
    this.#drag = { kind: isPan ? 'pan' : 'select', from: event.clientX };
  }

  #move(event: PointerEvent): void {
    const touch = this.#touches.get(event.pointerId);
    if (!touch) {
      if (event.pointerType === 'mouse' && !this.#store.isPlaying.value) this.#store.moveCursor(this.#time(event.clientX));
      return;
    }
    if (this.#drag?.kind === 'pinch') this.#pinch(event, touch);
    else if (this.#drag?.kind === 'pan') this.#store.pan(this.#share(touch.x) - this.#share(event.clientX), this.#axis.value);
    else if (this.#drag) this.#select(event.clientX);
    else this.#store.moveCursor(this.#time(event.clientX));
    touch.x = event.clientX;
    touch.y = event.clientY;
  }

  #pinch(event: PointerEvent, touch: Touch): void {
    const other = [...this.#touches.entries()].find(([id]) => id !== event.pointerId)?.[1];
    if (!other) return;
    const before = Math.abs(touch.x - other.x);
    const after = Math.abs(event.clientX - other.x);
    this.#store.pan((this.#share(touch.x) - this.#share(event.clientX)) / 2, this.#axis.value);
    if (before > 12 && after > 12) this.#store.zoom(before / after, this.#time((event.clientX + other.x) / 2), this.#axis.value);
  }

  #select(clientX: number): void {
    if (!this.#drag) return;
    const [a, b] = [this.#share(this.#drag.from), this.#share(clientX)].map((s) => Math.min(1, Math.max(0, s)));
    const [from, to] = [Math.min(a ?? 0, b ?? 0), Math.max(a ?? 0, b ?? 0)];
    this.#selection.hidden = Math.abs(clientX - this.#drag.from) < 4;
    this.#selection.style.left = `${100 * from}%`;
    this.#selection.style.width = `${100 * (to - from)}%`;
  }

  #up(event: PointerEvent, isDone: boolean): void {
    this.#touches.delete(event.pointerId);
    const drag = this.#drag;
    this.#selection.hidden = true;
    this.#drag = null;
    if (drag?.kind !== 'select' || !isDone) return;
    if (Math.abs(event.clientX - drag.from) < 4) {
      this.#store.moveCursor(this.#time(event.clientX));
      return;
    }
    const [a, b] = [this.#time(drag.from), this.#time(event.clientX)];
    this.#store.show(Math.min(a, b), Math.max(a, b), this.#axis.value);
  }
}
