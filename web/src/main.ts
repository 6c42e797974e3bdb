/** The page: builds its parts, opens the built-in drive, and leaves the rest to them. */

import './style/base.css';
import './style/layout.css';
import './style/dialog.css';
import './style/plots.css';
import './style/panel.css';
import './style/score.css';
import './style/drives.css';
import './style/magnetic.css';
import { CompassDialog } from './compass/dialog';
import { Doctor } from './compass/doctor';
import { h, iconButton, save } from './dom';
import type { ParamValue } from './door';
import { dropTarget, labelsAmong, openFiles } from './files';
import type { Trial } from './gallery/door';
import type { Gallery } from './gallery/gallery';
import type { Loops } from './loops/gallery-loops';
import { listenToKeys } from './keys';
import { t } from './messages';
import { FaultSwitch } from './navigation/fault-switch';
import { offerIn } from './panel/offer';
import { ReportPanel } from './panel/report';
import { errorBanner, statusLine } from './panel/status';
import { TunePanel } from './panel/tune';
import { picture } from './picture';
import { followTheme } from './plot/palette';
import { Rooms } from './rooms';
import { Session } from './session';
import { Store } from './state';
import { fromHash, History, type Tuning, withParam } from './tuning';
import { attitudeView } from './views/attitude';
import { DriveDialog } from './views/drives';
import { followAddress, header, helpDialog } from './views/header';
import { modeView } from './views/mode';
import { slopeView } from './views/slope';
import { TrajectoryView } from './views/trajectory';
import { Transport } from './views/transport';
import type { ColumnsDialog } from './wizard/columns';
import type { Watch } from './wizard/watch';
import type { OpenRequest } from './worker/rpc';

/** Seconds of a long drive that are simulated before they are estimated and shown; the rest follows. */
const FIRST_LOOK = 120;
/** A drive that lasts at most this long, s, is simulated at once. */
const SHORT_DRIVE = 300;

const store = new Store();
const worker = new Worker(new URL('./worker/worker.ts', import.meta.url), { type: 'module' });
const session = new Session(store, worker);
const history = new History<Tuning>(store.tuning.value);
followTheme(store);

const doctor = new Doctor(store, session);
const compass = new CompassDialog(store, session, doctor);
const views = [attitudeView(store, session, history, compass), slopeView(store, session)];
const mode = modeView(store, session);
const trajectory = new TrajectoryView(store, session);
trajectory.onOutages = (outages) => mode.setOutages(outages);
const transport = new Transport(store, session);
const tune = new TunePanel(store, session, history);
/** What is said beside a log of how its columns were read, and what opens their table. */
const beside = { notice: h('div.columns-notice', { role: 'status', hidden: true }), button: h('button', { type: 'button', hidden: true }) };
const report = new ReportPanel(store, beside);
const help = helpDialog(store);
const drives = new DriveDialog(store, session, (name, seed) => void openBuiltIn(name, seed));
const side = sidePanel();
const faults = new FaultSwitch(store, session);
const rooms = new Rooms(store, {
  overview: () => ({
    elements: [...views.map((v) => v.element), mode.element],
    pictures: () => [...views, mode].map((v, i) => [['attitude', 'slope', 'mode'][i] ?? '', v.canvases()]),
  }),
  road: async () => (await import('./road/room')).roadRoom(store, session, history),
  motion: async () => (await import('./motion/room')).motionRoom(store, session, history),
  navigation: async () => (await import('./navigation/room')).navigationRoom(store, session, faults),
});

async function openBuiltIn(name: string, seed: number | null = null): Promise<void> {
  const drive = store.catalogue.value?.drives.find((d) => d.name === name);
  const first = drive && drive.duration <= SHORT_DRIVE ? null : FIRST_LOOK;
  if (await session.open({ kind: 'simulation', name, seed, first, composed: null }, drive?.title ?? name)) void session.runAll();
}

/** Open what a claim was tried on, tuned as it was tried. */
async function openTrial({ source, estimator, params, vehicle }: Trial): Promise<void> {
  (await gallery)?.element.close();
  const info = store.catalogue.value?.estimators.find((e) => e.name === estimator);
  let tuning: Tuning = { params: { ...store.tuning.value.params, [estimator]: {} }, vehicle };
  const values = (params === '' ? {} : JSON.parse(params)) as Record<string, ParamValue>;
  for (const spec of info?.params ?? []) {
    const value = values[spec.name];
    if (value !== undefined) tuning = withParam(tuning, estimator, spec, value);
  }
  history.push(tuning);
  store.tuning.value = tuning;
  store.estimator.value = estimator;
  if (source.changes === '') return openBuiltIn(source.drive, source.seed);
  const description = JSON.parse(await session.rpc.call('description', { name: source.drive })) as object;
  const composed = JSON.stringify({ ...description, ...(JSON.parse(source.changes) as object) });
  const opened = await session.open({ kind: 'simulation', name: source.drive, seed: source.seed, first: null, composed }, source.drive);
  if (opened) void session.runAll();
}

let gallery: Promise<Gallery> | null = null;

/** The gallery and its WebAssembly module are loaded when it is opened first. */
async function showPapers(): Promise<void> {
  gallery ??= import('./gallery/gallery').then(({ Gallery }) => {
    const made = new Gallery(store, (trial) => void openTrial(trial).catch(tell));
    document.querySelector('.page')?.append(made.element);
    return made;
  });
  try {
    (await gallery).show();
  } catch (reason) {
    gallery = null;
    tell(reason);
  }
}

let loops: Promise<Loops> | null = null;

/** The closed loops come with the gallery's module, when they are opened first. */
async function showLoops(): Promise<void> {
  loops ??= import('./loops/gallery-loops').then(({ Loops }) => {
    const made = new Loops(store);
    document.querySelector('.page')?.append(made.element);
    return made;
  });
  try {
    (await loops).show();
  } catch (reason) {
    loops = null;
    tell(reason);
  }
}

let watch: Promise<Watch> | null = null;

/** What watches over the columns of logs is loaded with the first one; without it a log opens all the same. */
function watched(): Promise<Watch> {
  watch ??= import('./wizard/watch').then(({ Watch }) => new Watch(store, session, beside, () => void showColumns().catch(tell)));
  watch.catch(() => (watch = null));
  return watch;
}
store.report.on((now) => now?.import?.mapping && void watched().catch(() => undefined));

let columns: Promise<ColumnsDialog> | null = null;

/** The table of columns is loaded when it is opened first. */
async function showColumns(): Promise<void> {
  columns ??= Promise.all([import('./wizard/columns'), watched()]).then(([{ ColumnsDialog }, watch]) => {
    const made = new ColumnsDialog(store, watch);
    document.querySelector('.page')?.append(made.element);
    return made;
  });
  try {
    (await columns).show();
  } catch (reason) {
    columns = null;
    tell(reason);
  }
}

function tell(reason: unknown): void {
  store.error.value = reason instanceof Error ? reason.message : String(reason);
}

async function openDropped(files: File[]): Promise<void> {
  const labels = await labelsAmong(files);
  const others = files.filter((file) => file !== labels?.file);
  if (await openFiles(store, session, others, FIRST_LOOK, (text) => doctor.applySaved(text))) side.showReport(true);
  if (!labels) return;
  store.room.value = 'motion';
  (await import('./motion/paint')).takeLabels(store, labels.text, labels.file.name);
}

/** Open a part of a log that does not fit as a whole. */
async function openPart(request: OpenRequest, label: string): Promise<void> {
  if (!(await session.open(request, label))) return;
  side.showReport(true);
  await session.runAll();
}

function savePictures(): void {
  for (const [name, canvases] of [...rooms.pictures(), ['trajectory', [trajectory.canvas]] as const]) {
    picture([...canvases]).toBlob((blob) => blob && save(`${name}.png`, blob, 'image/png'));
  }
}

/** The side panel: parameters and results, or what the log holds. */
function sidePanel(): { element: HTMLElement; showReport(isShown: boolean): void; toggleReport(): void } {
  const close = iconButton('close', t.side.close, () => showReport(false));
  const page = h('div.report-page', { hidden: true }, h('header', {}, h('h2', {}, t.header.report), close), report.element);
  const showReport = (isShown: boolean): void => {
    page.hidden = !isShown;
    tune.element.hidden = isShown;
    if (isShown) page.scrollIntoView({ block: 'nearest' });
  };
  const element = h('aside.side', { 'aria-label': t.side.label }, tune.element, page);
  return { element, showReport, toggleReport: () => showReport(page.hidden === true) };
}

const bar = header(store, session, {
  openFiles: (files) => void openDropped(files),
  savePictures,
  showHelp: () => help.showModal(),
  showReport: () => side.toggleReport(),
  showPapers: () => void showPapers(),
  showLoops: () => void showLoops(),
}, drives.button, statusLine(store, session));

document.querySelector('#app')?.replaceWith(
  h(
    'div.page',
    {},
    bar.element,
    offerIn(errorBanner(store), store, (request, label) => void openPart(request, label).catch(tell)),
    faults.sign,
    h('main', {}, rooms.element, h('div.side-column', {}, trajectory.element, side.element)),
    transport.element,
    dropTarget((files) => void openDropped(files)),
    help,
    drives.element,
    compass.element,
  ),
);

listenToKeys(store, {
  togglePlay: () => transport.toggle(),
  openDialog: bar.openDialog,
  chooseDrive: () => drives.show(),
  showPapers: () => void showPapers(),
  showLoops: () => void showLoops(),
  showHelp: () => (help.open ? help.close() : help.showModal()),
  nextRoom: () => rooms.next(),
  focusView: (key) => {
    const view = [...document.querySelectorAll<HTMLElement>(`[data-key="${key}"]`)].find((v) => v.checkVisibility());
    view?.focus();
    view?.scrollIntoView({ block: 'nearest' });
  },
  focusParams: () => {
    side.showReport(false);
    tune.element.querySelector<HTMLElement>('[role=tab][aria-selected=true]')?.focus();
  },
  undo: () => tune.undo(),
  redo: () => tune.redo(),
  zoomMap: (factor) => trajectory.zoom(factor),
  fitMap: () => trajectory.fit(),
});

async function start(): Promise<void> {
  const catalogue = await session.rpc.call('catalogue', {});
  const address = fromHash(location.hash, catalogue);
  history.push(address.tuning);
  store.catalogue.value = catalogue;
  store.tuning.value = address.tuning;
  store.room.value = address.room;
  store.overlays.value = address.overlays;
  store.over.value = address.over ?? 'time';
  followAddress(store, (hash) => {
    const { tuning, drive, seed, room, overlays, over } = fromHash(hash, catalogue);
    store.room.value = room;
    store.overlays.value = overlays;
    store.over.value = over ?? 'time';
    history.push(tuning);
    store.tuning.value = tuning;
    if (drive !== null && (drive !== store.builtIn.value?.name || seed !== store.builtIn.value.seed)) void openBuiltIn(drive, seed);
  });
  const first = address.drive ?? catalogue.drives[0]?.name;
  if (first !== undefined) await openBuiltIn(first, address.seed);
}

start().catch(tell);
