/** A value that tells its listeners when it has changed. */
export class Signal<T> {
  #value: T;
  #listeners = new Set<(value: T, before: T) => void>();

  constructor(value: T) {
    this.#value = value;
  }

  get value(): T {
    return this.#value;
  }

  set value(next: T) {
    if (Object.is(next, this.#value)) return;
    const before = this.#value;
    this.#value = next;
    for (const listener of [...this.#listeners]) listener(next, before);
  }

  /** Call `listener` after every change; returns how to stop. */
  on(listener: (value: T, before: T) => void): () => void {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  /** Call `listener` now and after every change. */
  watch(listener: (value: T) => void): () => void {
    listener(this.#value);
    return this.on(listener);
  }
}

/** Run `action` once in the next frame however often it is asked for. */
export function perFrame(action: () => void): () => void {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      action();
    });
  };
}
