/** What a mapping says besides its columns: mounts, delays, the clock's steps back, the origin. */

import { h, prose } from '../dom';
import { columns as beside } from '../messages/columns';
import { wizard as say } from '../messages/wizard';
import type { Signal } from '../signal';
import { formatFixed } from '../units';
import type { Found, Mapping, Origin } from './door';
import { setDelay, setMount, setOrigin } from './mapping';
import { showNumber } from './row';

const ANGLES = ['roll_deg', 'pitch_deg', 'yaw_deg'] as const;
const PLACES = ['lat_deg', 'lon_deg', 'alt'] as const;
const TRIADS = ['imu', 'mag'] as const;
const LATE = ['wheels', 'steering', 'gnss', 'mag', 'baro'];
const LEVEL = { roll_deg: 0, pitch_deg: 0, yaw_deg: 0 };

export class Placing {
  readonly element: HTMLElement;
  #draft: Signal<Mapping | null>;
  /** Shows the mapping in every control. */
  #updates: ((mapping: Mapping) => void)[] = [];
  #notes = new Map<string, HTMLElement>();

  constructor(draft: Signal<Mapping | null>) {
    this.#draft = draft;
    this.element = h(
      'div.placing',
      { hidden: true },
      h('section', {}, h('h3', {}, say.mounts), h('p.note', {}, say.mountsNote), ...TRIADS.map((triad) => this.#mount(triad))),
      h('section', {}, h('h3', {}, say.delays), h('p.note', {}, say.delaysNote), ...LATE.map((channel) => this.#delay(channel))),
      h('section', {}, h('h3', {}, say.clockTitle), this.#stepsBack(), h('h3', {}, say.origin), h('p.note', {}, say.originNote), this.#origin()),
    );
    draft.watch((mapping) => {
      this.element.hidden = mapping === null;
      if (mapping) this.#updates.forEach((update) => update(mapping));
    });
  }

  /** Say beside the controls what was found. */
  show(found: Found | null): void {
    this.#notes.forEach((note) => note.replaceChildren());
    for (const { channel, mount, sigma_deg, why } of found?.mounts ?? []) {
      const [roll, pitch, yaw] = ANGLES.map((angle) => formatFixed(mount[angle], 1)) as [string, string, string];
      this.#notes.get(`mount ${channel}`)?.replaceChildren(`${say.foundMount(roll, pitch, yaw, formatFixed(sigma_deg, 1))}; `, ...prose(why));
    }
    for (const { channel, late, sigma, why } of found?.delays ?? []) {
      this.#notes.get(`delay ${channel}`)?.replaceChildren(`${say.foundDelay(formatFixed(late, 3), formatFixed(sigma, 3))}; `, ...prose(why));
    }
  }

  #set(next: (mapping: Mapping) => Mapping): void {
    if (this.#draft.value) this.#draft.value = next(this.#draft.value);
  }

  #note(key: string): HTMLElement {
    const note = h('p.note');
    this.#notes.set(key, note);
    return note;
  }

  #number(label: string, value: (mapping: Mapping) => number, next: (mapping: Mapping, value: number) => Mapping): HTMLElement {
    const input = h('input', { type: 'number', step: 'any' });
    input.addEventListener('change', () => this.#set((mapping) => next(mapping, Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : 0)));
    this.#updates.push((mapping) => showNumber(input, value(mapping)));
    return h('label', {}, label, input);
  }

  #mount(triad: (typeof TRIADS)[number]): HTMLElement {
    const angle = (key: (typeof ANGLES)[number]): HTMLElement =>
      this.#number(say.angles[key], (m) => m.mounts?.[triad]?.[key] ?? 0, (m, value) => setMount(m, triad, { ...(m.mounts?.[triad] ?? LEVEL), [key]: value }));
    return h('fieldset', {}, h('legend', {}, say.triads[triad]), ...ANGLES.map(angle), this.#note(`mount ${triad}`));
  }

  #delay(channel: string): HTMLElement {
    const label = `${beside.channels[channel] ?? channel}, ${say.seconds}`;
    return h('div.delay', {}, this.#number(label, (m) => m.delays?.[channel] ?? 0, (m, value) => setDelay(m, channel, value)), this.#note(`delay ${channel}`));
  }

  #stepsBack(): HTMLElement {
    const box = h('input', { type: 'checkbox' });
    box.addEventListener('change', () => this.#set((mapping) => {
      const { skip_steps_back: _, ...time } = mapping.time;
      return { ...mapping, time: box.checked ? { ...time, skip_steps_back: true } : time };
    }));
    this.#updates.push((mapping) => {
      box.checked = mapping.time.skip_steps_back ?? false;
    });
    return h('label.check', {}, box, say.skipBack);
  }

  /** An origin is one once it has a latitude and a longitude; what is typed before that stays. */
  #origin(): HTMLElement {
    const inputs = PLACES.map(() => h('input', { type: 'number', step: 'any' }));
    let shown: Origin | null = null;
    const read = (): void => {
      const [lat, lon, alt] = inputs.map((input) => input.valueAsNumber) as [number, number, number];
      shown = Number.isFinite(lat) && Number.isFinite(lon) ? { lat_deg: lat, lon_deg: lon, alt: Number.isFinite(alt) ? alt : 0 } : null;
      if (shown || this.#draft.value?.origin) this.#set((mapping) => setOrigin(mapping, shown));
    };
    this.#updates.push((mapping) => {
      const origin = mapping.origin ?? null;
      if (JSON.stringify(origin) === JSON.stringify(shown)) return;
      shown = origin;
      inputs.forEach((input, i) => showNumber(input, origin?.[PLACES[i] as keyof Origin] ?? null));
    });
    return h('fieldset', {}, ...PLACES.map((key, i) => {
      const input = inputs[i] as HTMLInputElement;
      input.addEventListener('change', read);
      return h('label', {}, say.places[key], input);
    }));
  }
}
