/** What a mapping says besides its columns: mounts, delays, the clock's steps back, the origin. */

import { h, prose } from '../dom';
import { t } from '../messages';
import type { Signal } from '../signal';
import { formatFixed } from '../units';
import type { Found, Mapping, Mount, Origin } from './door';
import { setDelay, setMount, setOrigin } from './mapping';

const ANGLES = ['roll_deg', 'pitch_deg', 'yaw_deg'] as const;
const PLACES = ['lat_deg', 'lon_deg', 'alt'] as const;
const TRIADS = ['imu', 'mag'] as const;
const LATE = ['wheels', 'steering', 'gnss', 'mag', 'baro'];

export class Placing {
  readonly element = h('div.placing');
  #draft: Signal<Mapping | null>;
  #found: Found | null = null;

  constructor(draft: Signal<Mapping | null>) {
    this.#draft = draft;
    draft.on(() => this.#show());
  }

  show(found: Found | null): void {
    this.#found = found;
    this.#show();
  }

  #show(): void {
    const mapping = this.#draft.value;
    if (!mapping) {
      this.element.replaceChildren();
      return;
    }
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset['key'] : undefined;
    this.element.replaceChildren(
      h('section', {}, h('h3', {}, t.columns.mounts), h('p.note', {}, t.columns.mountsNote), ...TRIADS.map((triad) => this.#mount(mapping, triad))),
      h('section', {}, h('h3', {}, t.columns.delays), h('p.note', {}, t.columns.delaysNote), ...LATE.map((channel) => this.#delay(mapping, channel))),
      h('section', {}, h('h3', {}, t.columns.clockTitle), this.#stepsBack(mapping), h('h3', {}, t.columns.origin), h('p.note', {}, t.columns.originNote), this.#origin(mapping)),
    );
    if (focused !== undefined) this.element.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }

  #number(value: number | null, label: string, key: string, set: (value: number | null) => void): HTMLElement {
    const input = h('input', { type: 'number', step: 'any', value: value === null ? '' : Number(value.toPrecision(10)), 'data-key': key });
    input.addEventListener('change', () => set(Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : null));
    return h('label', {}, label, input);
  }

  #mount(mapping: Mapping, triad: (typeof TRIADS)[number]): HTMLElement {
    const mount: Mount = mapping.mounts?.[triad] ?? { roll_deg: 0, pitch_deg: 0, yaw_deg: 0 };
    const found = this.#found?.mounts.find((m) => m.channel === triad);
    const set = (angle: (typeof ANGLES)[number]) => (value: number | null): void => {
      this.#draft.value = setMount(mapping, triad, { ...mount, [angle]: value ?? 0 });
    };
    const [roll, pitch, yaw] = ANGLES.map((angle) => formatFixed(found?.mount[angle] ?? 0, 1)) as [string, string, string];
    return h(
      'fieldset',
      {},
      h('legend', {}, t.columns.triads[triad]),
      ...ANGLES.map((angle) => this.#number(mount[angle], t.columns.angles[angle], `${triad} ${angle}`, set(angle))),
      found ? h('p.note', {}, `${t.columns.foundMount(roll, pitch, yaw, formatFixed(found.sigma_deg, 1))}; `, ...prose(found.why)) : null,
    );
  }

  #delay(mapping: Mapping, channel: string): HTMLElement {
    const found = this.#found?.delays.find((d) => d.channel === channel);
    const set = (value: number | null): void => {
      this.#draft.value = setDelay(mapping, channel, value ?? 0);
    };
    return h(
      'div.delay',
      {},
      this.#number(mapping.delays?.[channel] ?? 0, `${t.columns.channels[channel] ?? channel}, ${t.columns.seconds}`, `late ${channel}`, set),
      found ? h('p.note', {}, `${t.columns.foundDelay(formatFixed(found.late, 3), formatFixed(found.sigma, 3))}; `, ...prose(found.why)) : null,
    );
  }

  #stepsBack(mapping: Mapping): HTMLElement {
    const box = h('input', { type: 'checkbox', checked: mapping.time.skip_steps_back ?? false, 'data-key': 'steps back' });
    box.addEventListener('change', () => {
      const { skip_steps_back: _, ...time } = mapping.time;
      this.#draft.value = { ...mapping, time: box.checked ? { ...time, skip_steps_back: true } : time };
    });
    return h('label.check', {}, box, t.columns.skipBack);
  }

  /** An origin is one once it has a latitude and a longitude. */
  #origin(mapping: Mapping): HTMLElement {
    const inputs = PLACES.map((key) => h('input', { type: 'number', step: 'any', value: mapping.origin?.[key] ?? '', 'data-key': `origin ${key}` }));
    const read = (): void => {
      const [lat, lon, alt] = inputs.map((input) => input.valueAsNumber) as [number, number, number];
      const origin: Origin | null = Number.isFinite(lat) && Number.isFinite(lon) ? { lat_deg: lat, lon_deg: lon, alt: Number.isFinite(alt) ? alt : 0 } : null;
      if (origin || mapping.origin) this.#draft.value = setOrigin(mapping, origin);
    };
    return h('fieldset', {}, ...PLACES.map((key, i) => {
      const input = inputs[i] as HTMLInputElement;
      input.addEventListener('change', read);
      return h('label', {}, t.columns.places[key], input);
    }));
  }
}
