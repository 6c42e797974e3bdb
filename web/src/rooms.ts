/** Rooms: what stands left of the map, one at a time. */

import { h } from './dom';
import { t } from './messages';
import { ROOM_NAMES, type RoomName, roomOf, ROOMS } from './room-names';
import type { Store } from './state';
import { chooseTab, tabButton } from './tabs';

/** What a room holds. */
export interface Room {
  elements: HTMLElement[];
  /** Its plots from top to bottom, for pictures: the name of a file each. */
  pictures(): [string, HTMLCanvasElement[]][];
}

/** How each room is made; a room's code is loaded when it is entered first. */
export type Builders = Record<RoomName, () => Room | Promise<Room>>;

export class Rooms {
  readonly element: HTMLElement;
  #store: Store;
  #builders: Builders;
  #tabs = h('div.tabs.rooms', { role: 'tablist', 'aria-label': t.rooms.label });
  #panels = new Map<RoomName, HTMLElement>();
  #made = new Map<RoomName, Promise<Room>>();
  #entered: Room | null = null;
  /** Lets go of the estimators of the room that is entered. */
  #release: () => void = () => {};

  constructor(store: Store, builders: Builders) {
    this.#store = store;
    this.#builders = builders;
    for (const name of ROOM_NAMES) {
      const panel = h('div.room', { role: 'tabpanel', id: `room-${name}`, 'aria-labelledby': `room-tab-${name}`, hidden: true });
      this.#panels.set(name, panel);
      const choose = (): void => {
        store.room.value = name;
      };
      this.#tabs.append(tabButton(this.#tabs, { id: `room-tab-${name}`, 'aria-controls': `room-${name}`, title: t.rooms.about[name] }, t.rooms.names[name], choose));
    }
    this.element = h('div.time-views', {}, this.#tabs, ...this.#panels.values());
    store.room.watch((name) => this.#enter(name));
    store.estimator.on((estimator) => {
      store.room.value = roomOf(estimator, store.room.value);
    });
  }

  #enter(name: RoomName): void {
    chooseTab(this.#tabs, `room-tab-${name}`);
    for (const [other, panel] of this.#panels) panel.hidden = other !== name;
    const store = this.#store;
    // The new room's first, so that what both need is not given up between.
    const release = store.want(ROOMS[name]);
    this.#release();
    this.#release = release;
    if (!(ROOMS[name] as readonly string[]).includes(store.estimator.value)) store.estimator.value = ROOMS[name][0];
    let made = this.#made.get(name);
    if (!made) {
      made = Promise.resolve(this.#builders[name]());
      this.#made.set(name, made);
      made.then(
        (room) => this.#panels.get(name)?.append(...room.elements),
        () => {
          this.#made.delete(name);
          store.error.value = t.rooms.failed(t.rooms.names[name]);
        },
      );
    }
    made.then((room) => (store.room.value === name ? (this.#entered = room) : null), () => undefined);
  }

  /** Enter the room after this one. */
  next(): void {
    const index = ROOM_NAMES.indexOf(this.#store.room.value);
    this.#store.room.value = ROOM_NAMES[(index + 1) % ROOM_NAMES.length] ?? 'overview';
  }

  /** The plots of the room that is entered. */
  pictures(): [string, HTMLCanvasElement[]][] {
    return this.#entered?.pictures() ?? [];
  }
}
