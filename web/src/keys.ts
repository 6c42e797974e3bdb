/** The keyboard, for everything that is not a control of its own. */

import type { Store } from './state';

export interface KeyActions {
  togglePlay(): void;
  openDialog(): void;
  chooseDrive(): void;
  showPapers(): void;
  showLoops(): void;
  showHelp(): void;
  nextRoom(): void;
  focusView(key: string): void;
  focusParams(): void;
  undo(): void;
  redo(): void;
  zoomMap(factor: number): void;
  fitMap(): void;
}

/** Whether the focused element makes something of its own of a key. */
function isTaken(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.closest('dialog, [popover]')) return key !== '?';
  const isText = target.matches('input:not([type=range], [type=checkbox], [type=radio]), textarea, select');
  if (isText) return true;
  if (key === ' ') return target.matches('button, input, summary, a');
  if (key.startsWith('Arrow') || key === 'Home' || key === 'End') {
    return target.matches('input, [role=tab], .table-panel, .scroll') || (key.length > 4 && /Up|Down/.test(key));
  }
  return false;
}

export function listenToKeys(store: Store, actions: KeyActions): void {
  const step = (share: number): void => {
    const { t0, t1 } = store.window.value;
    store.isPlaying.value = false;
    store.moveCursor(store.cursor.value + share * (t1 - t0));
    store.follow();
  };
  const isOnMap = (target: EventTarget | null): boolean => target instanceof HTMLElement && target.closest('[data-view="4"]') !== null;
  const zoom = (event: KeyboardEvent, factor: number): void => {
    if (isOnMap(event.target)) actions.zoomMap(1 / factor);
    else {
      const { t0, t1 } = store.window.value;
      const cursor = store.cursor.value;
      store.zoom(factor, cursor >= t0 && cursor <= t1 ? cursor : (t0 + t1) / 2);
    }
  };
  const plain: Record<string, (event: KeyboardEvent) => void> = {
    ' ': () => actions.togglePlay(),
    ArrowLeft: (event) => step(event.shiftKey ? -0.1 : -0.01),
    ArrowRight: (event) => step(event.shiftKey ? 0.1 : 0.01),
    Home: () => (store.moveCursor(store.span.value.t0), store.follow()),
    End: () => (store.moveCursor(store.span.value.t1), store.follow()),
    '+': (event) => zoom(event, 0.7),
    '=': (event) => zoom(event, 0.7),
    '-': (event) => zoom(event, 1 / 0.7),
    '0': (event) => (isOnMap(event.target) ? actions.fitMap() : store.show(store.span.value.t0, store.span.value.t1)),
    '[': () => store.pan(-0.2),
    ']': () => store.pan(0.2),
    '1': () => actions.focusView('1'),
    '2': () => actions.focusView('2'),
    '3': () => actions.focusView('3'),
    '4': () => actions.focusView('4'),
    '5': () => actions.focusView('5'),
    '6': () => actions.focusView('6'),
    v: () => actions.nextRoom(),
    x: () => {
      store.over.value = store.over.value === 'time' ? 'distance' : 'time';
    },
    p: () => actions.focusParams(),
    d: () => actions.chooseDrive(),
    g: () => actions.showPapers(),
    c: () => actions.showLoops(),
    o: () => actions.openDialog(),
    '?': () => actions.showHelp(),
    Escape: () => {
      store.error.value = null;
    },
  };
  addEventListener('keydown', (event) => {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if ((event.ctrlKey || event.metaKey) && (key === 'z' || key === 'y')) {
      if (event.target instanceof HTMLInputElement && event.target.type === 'text') return;
      event.preventDefault();
      if (key === 'y' || event.shiftKey) actions.redo();
      else actions.undo();
      return;
    }
    if (event.ctrlKey || event.metaKey || event.altKey || isTaken(event.target, key)) return;
    const action = plain[key];
    if (!action) return;
    // The browser closes an open menu by Escape, unless it is told not to.
    if (key !== 'Escape') event.preventDefault();
    action(event);
  });
}
