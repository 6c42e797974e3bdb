/** The language of the page. Another language is another file with the same keys. */

import { en } from './en';

type Widen<T> = T extends string
  ? string
  : T extends (...args: infer A) => string
    ? (...args: A) => string
    : { readonly [K in keyof T]: Widen<T[K]> };

/** Every text of the page, by key. */
export type Messages = Widen<typeof en>;

export const t: Messages = en;
