/** Parts of the page that are loaded when they are asked for first. */

import { t } from './messages';

/** What is loaded once; where that has failed, it is tried again the next time. */
export class Later<T> {
  #made: Promise<T> | null = null;
  readonly #load: () => Promise<T>;

  constructor(load: () => Promise<T>) {
    this.#load = load;
  }

  /** What is loaded; loads it. */
  get(): Promise<T> {
    this.#made ??= this.#load().catch((reason: unknown) => {
      this.#made = null;
      throw reason;
    });
    return this.#made;
  }

  /** Load it although nobody asks yet; without a network that is found out when somebody does. */
  fetch(): void {
    this.get().catch(() => undefined);
  }
}

/** What a dialog of the page offers. */
export interface Dialog {
  readonly element: HTMLElement;
  show(): void;
}

/** A dialog that is loaded when it is opened first. */
export class LaterDialog<D extends Dialog> extends Later<D> {
  readonly #name: string;
  readonly #tell: (sentence: string) => void;

  constructor(name: string, load: () => Promise<D>, tell: (sentence: string) => void) {
    super(async () => {
      const dialog = await load();
      document.querySelector('.page')?.append(dialog.element);
      return dialog;
    });
    this.#name = name;
    this.#tell = tell;
  }

  /** Open it. */
  readonly show = (): void => {
    this.get().then(
      (dialog) => dialog.show(),
      () => this.#tell(t.errors.unloaded(this.#name)),
    );
  };
}
