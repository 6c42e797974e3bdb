/** The built-in drives: a dialog of small pictures to choose from, with the seed of all noise. */

import '../style/drives.css';
import { h, iconButton } from '../dom';
import type { Catalogue } from '../door';
import { t } from '../messages';
import { drives as say } from '../messages/drives';
import type { Session } from '../session';
import type { Store } from '../state';
import { convert, formatTime } from '../units';

type Entry = Catalogue['drives'][number];

/** What a picture is drawn from: pairs of east and north (m), of time (s) and speed (m/s). */
export interface Sketch {
  readonly length: number;
  readonly road: readonly (readonly [number, number])[];
  readonly speed: readonly (readonly [number, number])[];
}

/** Take apart what the core gives: length, number of points, points, speeds. */
export function readSketch(flat: Float64Array): Sketch {
  const pairs: [number, number][] = [];
  for (let i = 2; i + 1 < flat.length; i += 2) pairs.push([flat[i] ?? 0, flat[i + 1] ?? 0]);
  const count = flat[1] ?? 0;
  return { length: flat[0] ?? 0, road: pairs.slice(0, count), speed: pairs.slice(count) };
}

const MAP = { width: 92, height: 76, margin: 5 };
const PLOT = { left: 104, width: 156, top: 6, height: 64 };

function svg(tag: string, attributes: Record<string, string | number>, ...children: SVGElement[]): SVGElement {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

const path = (points: readonly (readonly [number, number])[]): string =>
  points.map(([x, y], i) => `${i === 0 ? 'M' : 'L'}${x.toFixed(1)} ${y.toFixed(1)}`).join('');

/** The road from above, north up, fitted into its box. */
export function roadPath(road: Sketch['road']): [number, number][] {
  const [east, north] = [road.map((p) => p[0]), road.map((p) => p[1])];
  const [west, south] = [Math.min(...east), Math.min(...north)];
  const [width, height] = [Math.max(...east) - west, Math.max(...north) - south];
  const [roomX, roomY] = [MAP.width - 2 * MAP.margin, MAP.height - 2 * MAP.margin];
  const scale = Math.min(roomX / Math.max(width, 1), roomY / Math.max(height, 1));
  const [left, top] = [MAP.margin + (roomX - scale * width) / 2, MAP.margin + (roomY - scale * height) / 2];
  return road.map(([e, n]) => [left + scale * (e - west), top + scale * (height - (n - south))]);
}

/** The picture: the road with its start, and speed over time. */
function picture(sketch: Sketch): SVGElement {
  const road = roadPath(sketch.road);
  const [start] = road;
  const end = sketch.speed[sketch.speed.length - 1]?.[0] ?? 1;
  const top = Math.max(...sketch.speed.map((p) => p[1]), 0.1);
  const ground = PLOT.top + PLOT.height;
  const curve = sketch.speed.map(([time, speed]): [number, number] => [PLOT.left + (PLOT.width * time) / end, ground - (PLOT.height * speed) / top]);
  const line = path(curve);
  return svg(
    'svg',
    { viewBox: `0 0 ${PLOT.left + PLOT.width + 2} ${MAP.height}`, class: 'sketch', 'aria-hidden': 'true' },
    svg('path', { class: 'sketch-road', d: path(road) }),
    svg('circle', { class: 'sketch-start', cx: start?.[0] ?? 0, cy: start?.[1] ?? 0, r: 3 }),
    svg('path', { class: 'sketch-area', d: `M${PLOT.left} ${ground}${line.replace('M', 'L')}L${PLOT.left + PLOT.width} ${ground}Z` }),
    svg('path', { class: 'sketch-speed', d: line }),
    svg('path', { class: 'sketch-ground', d: `M${PLOT.left} ${ground}H${PLOT.left + PLOT.width}` }),
  );
}

/** Which card an arrow key leads to; the same one at the edge. */
function neighbour(cards: HTMLElement[], from: HTMLElement, key: string): HTMLElement | undefined {
  const index = cards.indexOf(from);
  if (key === 'ArrowRight') return cards[index + 1];
  if (key === 'ArrowLeft') return cards[index - 1];
  if (key === 'Home') return cards[0];
  if (key === 'End') return cards[cards.length - 1];
  const here = from.getBoundingClientRect();
  const rows = cards.map((card) => ({ card, box: card.getBoundingClientRect() }));
  const ahead = rows.filter(({ box }) => (key === 'ArrowDown' ? box.top > here.top + 4 : box.top < here.top - 4));
  const nearest = key === 'ArrowDown' ? Math.min(...ahead.map((r) => r.box.top)) : Math.max(...ahead.map((r) => r.box.top));
  const row = ahead.filter((r) => Math.abs(r.box.top - nearest) < 4);
  return row.reduce<typeof row[number] | undefined>((a, b) => (a && Math.abs(a.box.left - here.left) <= Math.abs(b.box.left - here.left) ? a : b), undefined)?.card;
}

/** Largest seed that the address and the core both hold exactly. */
const MAX_SEED = 999_999_999_999_999;

export class DriveDialog {
  readonly element: HTMLDialogElement;
  #store: Store;
  #session: Session;
  #open: (name: string, seed: number | null) => void;
  #cards = new Map<string, { card: HTMLButtonElement; entry: Entry; facts: HTMLElement; sketch: Sketch | null }>();
  #list = h('ul.drive-list');
  #none = h('p.note', { hidden: true, role: 'status' }, say.none);
  #search = h('input.filter', { type: 'search', placeholder: say.search, 'aria-label': say.search });
  #seed = h('input.number', { type: 'number', min: 0, max: MAX_SEED, step: 1, placeholder: t.drives.ownSeed, 'aria-label': say.seed, 'aria-describedby': 'seed-note' });
  #isDrawn = false;

  constructor(store: Store, session: Session, open: (name: string, seed: number | null) => void) {
    this.#store = store;
    this.#session = session;
    this.#open = open;
    const random = h('button', { type: 'button', onclick: () => {
      this.#seed.value = String(Math.floor(Math.random() * 1_000_000));
      this.#checkSeed();
    } }, say.random);
    const seed = h('form.seed', {}, h('label', {}, say.seed, ' ', this.#seed), random, h('span.note', { id: 'seed-note' }, say.seedNote));
    seed.addEventListener('submit', (event) => {
      event.preventDefault();
      const name = store.builtIn.value?.name;
      if (name !== undefined) this.#choose(name);
    });
    this.element = h(
      'dialog.drives',
      { 'aria-label': t.drives.title },
      h('header', {}, h('h2', {}, t.drives.title), this.#search, iconButton('close', t.close, () => this.element.close())),
      seed,
      this.#none,
      this.#list,
      h('p.note', {}, say.compose),
    );
    this.element.addEventListener('click', (event) => event.target === this.element && this.element.close());
    this.#search.addEventListener('input', () => this.#filter());
    this.#seed.addEventListener('input', () => this.#checkSeed());
    this.element.addEventListener('keydown', (event) => this.#key(event));
    store.catalogue.watch((catalogue) => this.#fill(catalogue?.drives ?? []));
    store.builtIn.watch(() => this.#mark());
    store.display.on(() => this.#cards.forEach((_, key) => this.#fact(key)));
  }

  /** Open the dialog on the drive that is open. */
  show(): void {
    const { value: builtIn } = this.#store.builtIn;
    this.#seed.value = builtIn?.seed == null ? '' : String(builtIn.seed);
    this.#search.value = '';
    this.#checkSeed();
    this.#filter();
    this.element.showModal();
    (this.#cards.get(builtIn?.name ?? '')?.card ?? this.#shown()[0])?.focus();
    void this.#draw();
  }

  #fill(drives: Entry[]): void {
    this.#cards.clear();
    const items = drives.map((entry) => {
      const facts = h('span.facts', {}, formatTime(entry.duration, 0));
      const card = h('button.drive-card', { type: 'button', 'data-name': entry.name, onclick: () => this.#choose(entry.name) }, h('strong', {}, entry.title), h('span.doc', {}, entry.doc), h('span.sketch-room'), facts);
      this.#cards.set(entry.name, { card, entry, facts, sketch: null });
      return h('li', {}, card);
    });
    this.#list.replaceChildren(...items);
    this.#mark();
  }

  /** Mark the drive that is open. */
  #mark(): void {
    for (const [name, { card }] of this.#cards) card.setAttribute('aria-current', String(name === this.#store.builtIn.value?.name));
  }

  /** Draw the pictures, once; each appears as it comes. */
  async #draw(): Promise<void> {
    if (this.#isDrawn) return;
    this.#isDrawn = true;
    for (const [name, entry] of this.#cards) {
      entry.sketch = readSketch(await this.#session.rpc.call('sketch', { name }));
      entry.card.querySelector('.sketch-room')?.replaceChildren(picture(entry.sketch));
      this.#fact(name);
    }
  }

  #fact(name: string): void {
    const card = this.#cards.get(name);
    if (!card?.sketch) return;
    const { value: display } = this.#store.display;
    const top = Math.max(...card.sketch.speed.map((p) => p[1]), 0);
    const { length } = card.sketch;
    const way = length < 1000 ? `${length.toFixed(0)} m` : `${(length / 1000).toFixed(1)} km`;
    card.facts.textContent = say.facts(formatTime(card.entry.duration, 0), way, `${convert('speed', top, display).toFixed(0)} ${display.speed}`);
  }

  #shown(): HTMLButtonElement[] {
    return [...this.#cards.values()].map((c) => c.card).filter((card) => card.parentElement?.hidden === false);
  }

  #filter(): void {
    const words = this.#search.value.toLowerCase().split(/\s+/).filter((w) => w !== '');
    for (const { card, entry } of this.#cards.values()) {
      const text = `${entry.name} ${entry.title} ${entry.doc}`.toLowerCase();
      if (card.parentElement) card.parentElement.hidden = !words.every((word) => text.includes(word));
    }
    this.#none.hidden = this.#shown().length > 0;
  }

  #checkSeed(): void {
    this.#seed.setAttribute('aria-invalid', String(!this.#seed.checkValidity()));
  }

  #key(event: KeyboardEvent): void {
    const { target, key } = event;
    if (!(target instanceof HTMLElement) || event.ctrlKey || event.metaKey || event.altKey) return;
    const isCard = target.matches('.drive-card');
    if (isCard && (key.startsWith('Arrow') || key === 'Home' || key === 'End')) {
      event.preventDefault();
      neighbour(this.#shown(), target, key)?.focus();
    } else if (isCard && key.length === 1 && key !== ' ') {
      this.#search.focus();
    } else if (target === this.#search && (key === 'ArrowDown' || key === 'Enter')) {
      event.preventDefault();
      if (key === 'Enter') this.#shown()[0]?.click();
      else this.#shown()[0]?.focus();
    }
  }

  #choose(name: string): void {
    if (!this.#seed.checkValidity()) {
      this.#seed.reportValidity();
      return;
    }
    const seed = this.#seed.value === '' ? null : Number(this.#seed.value);
    this.element.close();
    const { value: builtIn } = this.#store.builtIn;
    if (builtIn?.name !== name || builtIn.seed !== seed || this.#store.work.value !== null) this.#open(name, seed);
  }
}
