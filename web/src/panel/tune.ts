/** The side panel's first page: which estimator, how good it was, its parameters. */

import { h, iconButton } from '../dom';
import type { EstimatorInfo } from '../door';
import { t } from '../messages';
import { ROOMS } from '../room-names';
import type { Session } from '../session';
import type { Store } from '../state';
import { chooseTab, tabButton } from '../tabs';
import type { History, Tuning } from '../tuning';
import { ParamList } from './params';
import { ScoreCard } from './score';

/** From this many parameters on there is a filter for them. */
const MANY = 12;

export class TunePanel {
  readonly element: HTMLElement;
  #store: Store;
  #history: History<Tuning>;
  #tabs = h('div.tabs', { role: 'tablist', 'aria-label': t.params.estimators });
  #list: ParamList;
  #score: ScoreCard;
  #doc = h('p.doc');
  #vehicle = h('select', { 'aria-label': t.params.vehicle });
  #count = h('span.count');
  #filter = h('input.filter', { type: 'search', placeholder: t.params.filter, 'aria-label': t.params.filter });
  #undo: HTMLButtonElement;
  #redo: HTMLButtonElement;
  #resetAll: HTMLButtonElement;

  constructor(store: Store, session: Session, history: History<Tuning>) {
    this.#store = store;
    this.#history = history;
    this.#list = new ParamList(store, session, history);
    this.#score = new ScoreCard(store, session);
    this.#undo = iconButton('undo', t.params.undo, () => this.undo());
    this.#redo = iconButton('redo', t.params.redo, () => this.redo());
    this.#resetAll = h('button.quiet', { type: 'button', onclick: () => this.#reset() }, t.params.resetAll);
    const bar = h('div.params-bar', {}, h('h3', {}, t.params.parameters), this.#count, h('span.spacer'), this.#undo, this.#redo, this.#resetAll);
    const filter = this.#filter;
    filter.addEventListener('input', () => this.#list.filter(filter.value));
    const vehicle = h('label.vehicle', {}, h('span', {}, t.params.vehicle), this.#vehicle);
    const body = h('div.tab-body', { role: 'tabpanel', id: 'tune-body', 'aria-label': t.params.parameters }, this.#score.element, bar, filter, vehicle, this.#list.element, this.#score.details, this.#doc);
    this.element = h('div.tune', {}, this.#tabs, body);
    this.#vehicle.addEventListener('change', () => this.#put({ ...store.tuning.value, vehicle: this.#vehicle.value || null }));
    store.catalogue.on(() => this.#fill());
    store.room.on(() => this.#fillTabs());
    store.estimator.on(() => this.#choose());
    store.tuning.on(() => this.#update());
  }

  undo(): void {
    if (this.#history.undo()) this.#store.tuning.value = this.#history.now;
  }

  redo(): void {
    if (this.#history.redo()) this.#store.tuning.value = this.#history.now;
  }

  #put(tuning: Tuning): void {
    this.#history.push(tuning);
    this.#store.tuning.value = tuning;
  }

  #reset(): void {
    const { value } = this.#store.tuning;
    this.#put({ ...value, params: { ...value.params, [this.#store.estimator.value]: {} } });
  }

  #info(): EstimatorInfo | null {
    return this.#store.catalogue.value?.estimators.find((e) => e.name === this.#store.estimator.value) ?? null;
  }

  #fill(): void {
    const catalogue = this.#store.catalogue.value;
    if (!catalogue) return;
    this.#vehicle.replaceChildren(
      h('option', { value: '' }, t.params.ownVehicle),
      ...catalogue.vehicles.map((v) => h('option', { value: v.name, title: v.doc }, v.name.replaceAll('_', ' '))),
    );
    this.#fillTabs();
  }

  /** Tabs of the estimators that the entered room shows. */
  #fillTabs(): void {
    const names: readonly string[] = ROOMS[this.#store.room.value];
    const shown = this.#store.catalogue.value?.estimators.filter((e) => names.includes(e.name)) ?? [];
    this.#tabs.replaceChildren(...shown.map((e) => this.#tab(e)));
    this.#tabs.hidden = shown.length < 2;
    this.#choose();
  }

  #tab(estimator: EstimatorInfo): HTMLElement {
    const props = { id: `tab-${estimator.name}`, 'aria-controls': 'tune-body', title: `${estimator.title}. ${estimator.doc}` };
    return tabButton(this.#tabs, props, t.tabs[estimator.name] ?? estimator.title, () => {
      this.#store.estimator.value = estimator.name;
    });
  }

  #choose(): void {
    const info = this.#info();
    chooseTab(this.#tabs, `tab-${info?.name}`);
    this.#list.setEstimator(info);
    this.#filter.value = '';
    this.#filter.hidden = (info?.params.length ?? 0) < MANY;
    this.#score.setEstimator(info);
    this.#doc.textContent = info?.doc ?? '';
    this.#update();
  }

  #update(): void {
    const { value } = this.#store.tuning;
    const changed = Object.keys(value.params[this.#store.estimator.value] ?? {}).length;
    this.#count.textContent = t.params.changedCount(changed);
    this.#resetAll.disabled = changed === 0;
    this.#undo.disabled = !this.#history.canUndo;
    this.#redo.disabled = !this.#history.canRedo;
    this.#vehicle.value = value.vehicle ?? '';
  }
}
