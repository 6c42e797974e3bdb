/** The page: builds its parts, opens the built-in drive, and leaves the rest to them. */

import './style/base.css';
import './style/layout.css';
import './style/dialog.css';
import './style/plots.css';
import './style/panel.css';
import './style/score.css';
import './style/magnetic.css';
import { Doctor } from './compass/doctor';
import { CompassEntry } from './compass/entry';
import { h, iconButton, save } from './dom';
import type { ParamValue } from './door';
import { dropTarget } from './drop';
import type { Trial } from './gallery/door';
import { listenToKeys } from './keys';
import { Later, LaterDialog } from './later';
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
import { driveChooser } from './views/chooser';
import { followAddress, header } from './views/header';
import { modeView } from './views/mode';
import { slopeView } from './views/slope';
import { TrajectoryView } from './views/trajectory';
import { Transport } from './views/transport';
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
const compass = new LaterDialog(t.compass.open_doctor, async () => new (await import('./compass/dialog')).CompassDialog(store, session, doctor), tell);
const views = [attitudeView(store, session, history, new CompassEntry(doctor, compass.show)), slopeView(store, session)];
const mode = modeView(store, session);
const trajectory = new TrajectoryView(store, session);
trajectory.onOutages = (outages) => mode.setOutages(outages);
const transport = new Transport(store, session);
const tune = new TunePanel(store, session, history);
/** What is said beside a log of how its columns were read, and what opens their table. */
const beside = { notice: h('div.columns-notice', { role: 'status', hidden: true }), button: h('button', { type: 'button', hidden: true }) };
const report = new ReportPanel(store, beside);
const files = new Later(() => import('./files'));
const help = new LaterDialog(t.header.help, async () => new (await import('./views/help')).Help(store), tell);
const openDrive = (name: string, seed: number | null): void => void openBuiltIn(name, seed);
const drives = new LaterDialog(t.drives.title, async () => new (await import('./views/drives')).DriveDialog(store, session, openDrive), tell);
const papers = new LaterDialog(t.header.papers, async () => new (await import('./gallery/gallery')).Gallery(store, (trial) => void openTrial(trial).catch(tell)), tell);
/** The closed loops come with the gallery's module. */
const loops = new LaterDialog(t.header.loops, async () => new (await import('./loops/gallery-loops')).Loops(store), tell);
/** What watches over the columns of logs; without it a log opens all the same. */
const watch = new Later(async () => new (await import('./wizard/watch')).Watch(store, session, beside, () => columns.show()));
const columns = new LaterDialog(t.header.columns, async () => {
  const [{ ColumnsDialog }, watching] = await Promise.all([import('./wizard/columns'), watch.get()]);
  return new ColumnsDialog(store, watching);
}, tell);
store.report.on((now) => now?.import?.mapping && watch.fetch());
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
  if (!(await session.open({ kind: 'simulation', name, seed, first, composed: null }, drive?.title ?? name))) return;
  // Once nothing else is to be done, so that a file can be opened later without a network.
  void session.runAll().then(fetchRest, () => undefined);
}

/** What a drive or a file is opened with. */
function fetchRest(): void {
  for (const part of [watch, files, drives, help, compass]) part.fetch();
}

/** Open what a claim was tried on, tuned as it was tried. */
async function openTrial({ source, estimator, params, vehicle }: Trial): Promise<void> {
  (await papers.get()).element.close();
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

function tell(reason: unknown): void {
  store.error.value = reason instanceof Error ? reason.message : String(reason);
}

async function openDropped(dropped: File[]): Promise<void> {
  const { labelsAmong, openFiles } = await files.get();
  const labels = await labelsAmong(dropped);
  const others = dropped.filter((file) => file !== labels?.file);
  if (await openFiles(store, session, others, FIRST_LOOK, (text) => doctor.applySaved(text))) side.showReport(true);
  if (!labels) return;
  store.room.value = 'motion';
  (await import('./motion/paint')).takeLabels(store, labels.text, labels.file.name);
}

/** Open what was dropped or chosen; what opens it may have to be loaded first. */
function openAll(dropped: File[]): void {
  openDropped(dropped).catch(tell);
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
  openFiles: openAll,
  savePictures,
  showHelp: help.show,
  showReport: () => side.toggleReport(),
  showPapers: papers.show,
  showLoops: loops.show,
}, driveChooser(store, drives.show), statusLine(store, session));

document.querySelector('#app')?.replaceWith(
  h(
    'div.page',
    {},
    bar.element,
    offerIn(errorBanner(store), store, (request, label) => void openPart(request, label).catch(tell)),
    faults.sign,
    h('main', {}, rooms.element, h('div.side-column', {}, trajectory.element, side.element)),
    transport.element,
    dropTarget(openAll),
  ),
);

listenToKeys(store, {
  togglePlay: () => transport.toggle(),
  openDialog: bar.openDialog,
  chooseDrive: drives.show,
  showPapers: papers.show,
  showLoops: loops.show,
  showHelp: help.show,
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

/** Say so where an address names a drive that there is not. */
function tellUnknown(hash: string): void {
  const name = new URLSearchParams(hash.slice(1)).get('drive');
  if (name !== null) store.error.value = t.drives.unknown(name);
}

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
    const now = store.coming.value ?? store.builtIn.value;
    if (drive !== null && (drive !== now?.name || seed !== now.seed)) void openBuiltIn(drive, seed);
    if (drive === null) tellUnknown(hash);
  });
  const first = address.drive ?? catalogue.drives[0]?.name;
  const hash = location.hash;
  if (first !== undefined) await openBuiltIn(first, address.seed);
  if (address.drive === null) tellUnknown(hash);
}

start().catch(tell);
