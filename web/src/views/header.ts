/** The bar at the top: which drive, opening a log, saving results, how things are displayed. */

import { h, save } from '../dom';
import { t } from '../messages';
import type { DriveReport } from '../door';
import type { Session } from '../session';
import type { Store } from '../state';
import { toHash } from '../tuning';
import type { Display } from '../units';

export interface HeaderActions {
  openFiles(files: File[]): void;
  savePictures(): void;
  showHelp(): void;
  showReport(): void;
  showPapers(): void;
  showLoops(): void;
}

let nextId = 0;
/** Pages narrower than this, px, have menus that begin at the left. */
const PHONE = 560;

/** A button with a panel that opens under it and closes by Escape or a click elsewhere; one of a given `width`, px, opens to the right. */
export function menu(label: string, content: HTMLElement, width?: number): HTMLElement {
  const id = `menu-${nextId++}`;
  content.id = id;
  content.classList.add('menu');
  content.setAttribute('popover', 'auto');
  const button = h('button', { type: 'button', popovertarget: id, 'aria-haspopup': 'true' }, label, h('span.caret', { 'aria-hidden': 'true' }));
  content.addEventListener('beforetoggle', () => {
    const box = button.getBoundingClientRect();
    content.style.top = `${box.bottom + 4}px`;
    const { clientWidth } = document.documentElement;
    if (clientWidth < PHONE) content.style.inset = `${box.bottom + 4}px auto auto 8px`;
    else if (width !== undefined) content.style.left = `max(8px, min(${box.left}px, 100vw - ${width + 8}px))`;
    else content.style.right = `${Math.max(8, clientWidth - box.right)}px`;
  });
  return h('div.menu-holder', {}, button, content);
}

function radios<T extends string>(legend: string, name: string, now: T, options: [T, string][], choose: (value: T) => void): HTMLElement {
  const choices = options.map(([value, label]) => {
    const input = h('input', { type: 'radio', name, value, checked: value === now });
    input.addEventListener('change', () => choose(value));
    return h('label', {}, input, h('span', {}, label));
  });
  return h('fieldset', {}, h('legend', {}, legend), h('div.segmented', {}, ...choices));
}

function displayMenu(store: Store): HTMLElement {
  const { value } = store.display;
  const set = (patch: Partial<Display>): void => {
    store.display.value = { ...store.display.value, ...patch };
  };
  const note = h('p.note');
  store.display.watch(({ axes }) => {
    note.textContent = `${axes === 'sae' ? t.display.saeNote : t.display.isoNote} ${t.display.gradeNote}`;
  });
  const d = t.display;
  return menu(
    t.header.display,
    h(
      'div.display-menu',
      {},
      radios(d.angle, 'angle', value.angle, [['deg', d.degrees], ['rad', d.radians]], (angle) => set({ angle })),
      radios(d.speed, 'speed', value.speed, [['km/h', 'km/h'], ['m/s', 'm/s'], ['mph', 'mph']], (speed) => set({ speed })),
      radios(d.grade, 'grade', value.grade, [['percent', d.percent], ['angle', d.likeAngles]], (grade) => set({ grade })),
      radios(d.axes, 'axes', value.axes, [['sae', d.sae], ['iso', d.iso]], (axes) => set({ axes })),
      note,
      radios(d.theme, 'theme', store.theme.value, [['auto', d.auto], ['light', d.light], ['dark', d.dark]], (theme) => {
        store.theme.value = theme;
      }),
    ),
  );
}

function exportMenu(store: Store, session: Session, actions: HeaderActions): HTMLElement {
  const list = h('div.export-menu', { role: 'group', 'aria-label': t.header.export });
  const name = (): string => fileName(store.report.value);
  const item = (label: string, action: () => void | Promise<void>): HTMLButtonElement =>
    h('button', { type: 'button', onclick: () => {
      list.hidePopover();
      void Promise.resolve(action()).catch((reason: unknown) => {
        store.error.value = reason instanceof Error ? reason.message : String(reason);
      });
    } }, label);
  const csv = async (source: string, suffix: string): Promise<void> => {
    const bytes = await session.rpc.call('csv', { source });
    save(`${name()}${suffix}.csv`, bytes as Uint8Array<ArrayBuffer>, 'text/csv');
  };
  const fill = (): void => {
    const report = store.report.value;
    const builtIn = store.builtIn.value;
    const done = (store.catalogue.value?.estimators ?? []).filter((e) => store.run(e.name).value.reply);
    list.replaceChildren(
      ...done.map((e) => item(t.header.exportEstimates(e.title), () => csv(`${e.name}:current`, `_${e.name}`))),
      item(t.header.exportDrive, () => csv('drive', '')),
      item(t.header.exportTuning, () => save(`${name()}_params.json`, JSON.stringify(store.tuning.value.params, null, 2), 'application/json')),
      ...(report?.import ? [item(t.header.exportMapping, () => saveMapping(report))] : []),
      ...(builtIn ? [item(t.header.exportDescription, async () => save(`${builtIn.name}.json`, await session.rpc.call('description', { name: builtIn.name }), 'application/json'))] : []),
      item(t.header.exportPlots, actions.savePictures),
      item(t.header.copyLink, () => navigator.clipboard.writeText(location.href)),
    );
  };
  list.addEventListener('beforetoggle', fill);
  return menu(t.header.export, list);
}

/** Give the reader the mapping with which the open log was read. */
export function saveMapping(report: DriveReport): void {
  save(`${fileName(report)}_mapping.json`, JSON.stringify(report.import?.mapping, null, 2), 'application/json');
}

/** The name of a drive as the beginning of a file's name. */
function fileName(report: DriveReport | null): string {
  return (report?.name ?? 'drive').replace(/\.[^.]*$/, '').replace(/[^\w.-]+/g, '_');
}

export function header(store: Store, session: Session, actions: HeaderActions, chooser: HTMLElement, status: HTMLElement): { element: HTMLElement; openDialog: () => void } {
  const input = h('input', { type: 'file', multiple: true, hidden: true, 'aria-label': t.header.openFile, tabindex: '-1' });
  input.addEventListener('change', () => {
    actions.openFiles([...(input.files ?? [])]);
    input.value = '';
  });
  const open = h('button.primary', { type: 'button', onclick: () => input.click() }, t.header.openFile);
  const report = h('button', { type: 'button', onclick: actions.showReport }, t.header.report);
  const papers = h('button', { type: 'button', 'aria-haspopup': 'dialog', onclick: actions.showPapers }, t.header.papers);
  const loops = h('button', { type: 'button', 'aria-haspopup': 'dialog', title: t.header.loopsHint, onclick: actions.showLoops }, t.header.loops);
  const help = h('button.icon-button', { type: 'button', title: t.header.help, 'aria-label': t.header.help, onclick: actions.showHelp }, h('span', { 'aria-hidden': 'true' }, '?'));
  const element = h(
    'header.bar',
    {},
    h('h1', {}, t.name),
    chooser,
    report,
    open,
    input,
    status,
    papers,
    loops,
    exportMenu(store, session, actions),
    displayMenu(store),
    help,
  );
  return { element, openDialog: () => input.click() };
}

/** Keep the address in step with what is tuned, so that it can be shared; `changed` hears of one typed in by hand. */
export function followAddress(store: Store, changed: (hash: string) => void): void {
  const write = (): void => {
    const builtIn = store.coming.value ?? store.builtIn.value;
    const hash = toHash({ drive: builtIn?.name ?? null, seed: builtIn?.seed ?? null, room: store.room.value, overlays: store.overlays.value, over: store.over.value, tuning: store.tuning.value });
    history.replaceState(null, '', hash === '' ? location.pathname + location.search : `#${hash}`);
  };
  store.tuning.on(write);
  store.room.on(write);
  store.overlays.on(write);
  store.over.on(write);
  store.builtIn.on(write);
  store.coming.on(write);
  addEventListener('hashchange', () => changed(location.hash));
}
