/** The closed loops: a dialog in which controllers drive a car, watched from above. Loaded when it is opened. */

import '../style/loops.css';
import { h, icon, iconButton } from '../dom';
import type { EstimatorInfo } from '../door';
import { t } from '../messages';
import { loops as say } from '../messages/loops';
import { ParamList } from '../panel/params';
import { Store } from '../state';
import { History, type Tuning } from '../tuning';
import { formatFixed, formatSignificant } from '../units';
import type { Driven, LoopInfo } from './door';
import { type Comparison, Runner, specsOf } from './runner';
import { type Key, keysOf, rowAt, Stage } from './stage';
import { Trace, traceSpecs } from './traces';

const COMPARISONS: Comparison[] = ['nothing', 'before', 'off'];
/** How the legend shows what is no plain line. */
const SWATCHES: Partial<Record<Key, string>> = { compared: 'dashed', path: 'dashed', obstacle: 'dot', blocked: 'band', target: 'ring' };
/** Name of the loop's parameters in its own tuning. */
const LOOP = 'loop';
const SEED = 1;

export class Loops {
  readonly element: HTMLDialogElement;
  readonly runner: Runner;
  /** The loop's own tuning and display, apart from those of the drive. */
  #store = new Store();
  #history = new History<Tuning>(this.#store.tuning.value);
  #params: ParamList;
  #choose = h('select', { 'aria-label': say.choose });
  #doc = h('p.note');
  #status = h('p.loop-status', { role: 'status' });
  #stage: Stage;
  #traces: Trace[];
  #results = h('table.figures');
  #legend = h('div.loop-keys');
  #says = h('p.map-readout');
  #play: HTMLButtonElement;
  #slider = h('input', { type: 'range', min: 0, max: 1000, step: 1, 'aria-label': say.time });
  #clock = h('output.time');
  #count = h('span.count');
  #undo: HTMLButtonElement;
  #redo: HTMLButtonElement;
  #reset: HTMLButtonElement;
  #seed = h('input.number', { type: 'text', inputmode: 'numeric', size: 6, value: SEED, 'aria-label': say.seed });
  #follow = h('input', { type: 'checkbox', checked: true });
  #loop: LoopInfo | null = null;
  #time = 0;
  #playing: number | null = null;

  constructor(page: Store) {
    const worker = new Worker(new URL('./gallery-loops-worker.ts', import.meta.url), { type: 'module' });
    this.runner = new Runner(worker);
    const store = this.#store;
    page.display.watch((display) => {
      store.display.value = display;
    });
    this.#params = new ParamList(store, { beginGesture: () => this.runner.hold(true), endGesture: () => this.runner.hold(false) }, this.#history);
    const host = h('div.map.stage', { role: 'img', 'aria-label': say.stage }, this.#says);
    this.#stage = new Stage(host);
    this.#traces = traceSpecs().map((spec) => new Trace(spec, (time) => this.#seek(time)));
    this.#play = h('button.play', { type: 'button', 'aria-label': say.play, onclick: () => this.#toggle() }, icon('play'));
    this.#undo = iconButton('undo', t.params.undo, () => this.#step(this.#history.undo()));
    this.#redo = iconButton('redo', t.params.redo, () => this.#step(this.#history.redo()));
    this.#reset = h('button.quiet', { type: 'button', onclick: () => this.#put({ params: {}, vehicle: null }) }, say.resetAll);
    this.element = h('dialog.loops', { 'aria-label': say.title }, ...this.#layout(host));
    this.#listen();
  }

  #layout(host: HTMLElement): HTMLElement[] {
    const compare = h('div.segmented', { role: 'radiogroup', 'aria-label': say.compare });
    for (const choice of COMPARISONS) {
      const input = h('input', { type: 'radio', name: 'loop-comparison', value: choice, checked: choice === this.runner.comparison.value });
      input.addEventListener('change', () => {
        this.runner.comparison.value = choice;
      });
      compare.append(h('label', { title: say.compareTitle[choice] }, input, h('span', {}, say.comparisons[choice])));
    }
    const header = h('header', {}, h('h2', {}, say.title), this.#choose, this.#status, iconButton('close', t.close, () => this.element.close()));
    const transport = h('div.loop-transport', {}, this.#play, this.#slider, this.#clock, h('label.follow', {}, this.#follow, say.follow));
    const bar = h('div.params-bar', {}, h('h3', {}, say.parameters), this.#count, h('span.spacer'), this.#undo, this.#redo, this.#reset);
    const options = h('div.loop-options', {}, h('span', {}, say.compare), compare, h('label', {}, say.seed, this.#seed));
    const side = h('section.loop-side', { 'aria-label': say.parameters }, this.#doc, options, h('h3', {}, say.results), this.#results, bar, this.#params.element);
    const main = h('section.loop-main', {}, this.#legend, host, transport, h('div.loop-traces', {}, ...this.#traces.map((trace) => trace.element)));
    return [header, h('div.loop-body', {}, main, side)];
  }

  #listen(): void {
    const { runner } = this;
    runner.catalogue.on((catalogue) => {
      this.#choose.replaceChildren(...(catalogue?.loops ?? []).map((l) => h('option', { value: l.name, title: l.doc }, l.title)));
      this.#enter();
    });
    for (const signal of [runner.progress, runner.failed, runner.dead, runner.driven]) signal.on(() => this.#tell());
    runner.driven.on(() => this.#draw());
    runner.compared.on(() => this.#draw());
    this.#choose.addEventListener('change', () => this.#enter());
    this.#slider.addEventListener('input', () => this.#seek((Number(this.#slider.value) / 1000) * this.#end()));
    this.#follow.addEventListener('change', () => this.#stage.follow(this.#follow.checked));
    this.#seed.addEventListener('change', () => this.#drive());
    this.#store.tuning.on(() => this.#drive());
    this.#store.display.on(() => this.#draw());
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    this.element.addEventListener('close', () => this.#stop());
    this.element.addEventListener('keydown', (event) => {
      const key = event.key.toLowerCase();
      if ((event.ctrlKey || event.metaKey) && (key === 'z' || key === 'y')) {
        event.preventDefault();
        event.stopPropagation();
        this.#step(key === 'y' || event.shiftKey ? this.#history.redo() : this.#history.undo());
      }
    });
    this.#tell();
  }

  show(): void {
    this.element.showModal();
    this.#draw();
  }

  /** Begin with the chosen loop as it comes. */
  #enter(): void {
    const catalogue = this.runner.catalogue.value;
    this.#loop = catalogue?.loops.find((l) => l.name === this.#choose.value) ?? null;
    if (!catalogue || !this.#loop) return;
    this.#doc.textContent = `${this.#loop.doc}. ${say.intro}`;
    const specs = specsOf(catalogue, this.#loop);
    this.#params.setEstimator({ name: LOOP, params: specs } as unknown as EstimatorInfo);
    this.#follow.checked = this.#loop.name === 'obstacle_course';
    this.#stage.follow(this.#follow.checked);
    this.#time = 0;
    this.#history.push({ params: {}, vehicle: null });
    if (this.#store.tuning.value.params[LOOP]) this.#store.tuning.value = { params: {}, vehicle: null };
    else this.#drive();
  }

  #put(tuning: Tuning): void {
    this.#history.push(tuning);
    this.#store.tuning.value = tuning;
  }

  #step(isThere: boolean): void {
    if (isThere) this.#store.tuning.value = this.#history.now;
  }

  #drive(): void {
    if (!this.#loop) return;
    const settings = this.#store.tuning.value.params[LOOP] ?? {};
    const seed = Number(this.#seed.value);
    const isGood = Number.isInteger(seed) && seed >= 0 && seed < 1e15;
    this.#seed.setAttribute('aria-invalid', String(!isGood));
    this.runner.drive(this.#loop.name, settings, isGood ? seed : SEED);
    const changed = Object.keys(settings).length;
    this.#count.textContent = say.changed(changed);
    this.#reset.disabled = changed === 0;
    this.#undo.disabled = !this.#history.canUndo;
    this.#redo.disabled = !this.#history.canRedo;
  }

  #tell(): void {
    const { dead, failed, progress, catalogue, driven } = this.runner;
    if (dead.value !== null) this.#status.textContent = say.dead(dead.value);
    else if (failed.value !== null) this.#status.textContent = say.failed(failed.value);
    else if (!catalogue.value) this.#status.textContent = say.loading;
    else if (progress.value !== null) this.#status.textContent = say.driving(formatFixed(100 * progress.value, 0));
    else this.#status.textContent = driven.value?.hasFailed ? say.turnedOver : '';
    this.#status.classList.toggle('bad', dead.value !== null || failed.value !== null);
  }

  #end(): number {
    const time = this.runner.driven.value?.car.time;
    return time?.[time.length - 1] ?? 1;
  }

  #draw(): void {
    const driven = this.runner.driven.value;
    if (!driven || !this.element.open) return;
    const compared = this.runner.compared.value;
    this.#stage.show(driven, compared);
    this.#legend.replaceChildren(...keysOf(driven, compared).map(([key, colour]) => h('span.key', {}, h(`span.swatch.${SWATCHES[key] ?? 'line'}`, { 'data-colour': colour, 'data-dashed': SWATCHES[key] === 'dashed' || undefined }), say.keys[key])));
    for (const trace of this.#traces) trace.show(driven, compared, this.#store.display.value);
    this.#fillResults(driven, compared);
    this.#seek(Math.min(this.#time, this.#end()));
    this.element.dataset['driven'] = driven.name;
  }

  #fillResults(driven: Driven, compared: Driven | null): void {
    const { columns, figures } = say;
    const shown = Object.entries(figures).filter(([name]) => Number.isFinite(driven.summary[name] ?? Number.NaN));
    const head = h('tr', {}, h('th', { scope: 'col' }, columns.figure), h('th', { scope: 'col' }, columns.now), compared ? h('th', { scope: 'col' }, columns.compared) : null);
    const rows = shown.map(([name, [label, unit]]) =>
      h('tr', {}, h('th', { scope: 'row' }, `${label} [${unit}]`), h('td', {}, formatSignificant(driven.summary[name])), compared ? h('td', {}, formatSignificant(compared.summary[name])) : null),
    );
    this.#results.replaceChildren(h('thead', {}, head), h('tbody', {}, ...rows));
  }

  #seek(time: number): void {
    this.#time = time;
    this.#stage.setTime(time);
    for (const trace of this.#traces) trace.setTime(time, this.#store.display.value);
    this.#slider.value = String((1000 * time) / this.#end());
    const text = say.timeIs(formatFixed(time, 1), formatFixed(this.#end(), 0));
    this.#slider.setAttribute('aria-valuetext', text);
    this.#clock.textContent = text;
    const guidance = this.runner.driven.value?.guidance;
    const avoiding = guidance && guidance.time.length > 0 ? guidance.columns['avoiding']?.[rowAt(guidance.time, time)] : undefined;
    this.#says.textContent = avoiding === undefined ? '' : (say.avoiding[avoiding] ?? '');
  }

  #toggle(): void {
    if (this.#playing !== null) return this.#stop();
    if (this.#time >= this.#end() - 0.05) this.#time = 0;
    let last = performance.now();
    const frame = (now: number): void => {
      const next = this.#time + (now - last) / 1000;
      last = now;
      this.#seek(Math.min(next, this.#end()));
      if (next >= this.#end()) this.#stop();
      else this.#playing = requestAnimationFrame(frame);
    };
    this.#playing = requestAnimationFrame(frame);
    this.#play.replaceChildren(icon('pause'));
    this.#play.setAttribute('aria-label', say.pause);
  }

  #stop(): void {
    if (this.#playing !== null) cancelAnimationFrame(this.#playing);
    this.#playing = null;
    this.#play.replaceChildren(icon('play'));
    this.#play.setAttribute('aria-label', say.play);
  }
}
