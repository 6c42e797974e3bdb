/** One claim: what the paper says, a button that tries it here, and what came out. */

import { h, prose } from '../dom';
import { t } from '../messages';
import { gallery as say } from '../messages/gallery';
import type { Store } from '../state';
import { formatSignificant, prettyUnit } from '../units';
import type { Claim, Figure, Finding, Trial } from './door';
import type { ClaimState, Runner } from './runner';

/** A figure's unit as shown. */
const unit = (text: string): string => (text === 'deg' ? '°' : prettyUnit(text));

/** A number of the paper or a limit: three digits, no more than it has. */
const bare = (value: number): string => String(Number(value.toPrecision(3))).replace('-', '−');

/** In words, what a figure must be to speak for the claim. */
export function limitsText({ limits }: Figure): string {
  if (!limits) return say.informs;
  const [low, high] = limits;
  if (low === -Infinity) return say.atMost(bare(high));
  if (high === Infinity) return say.atLeast(bare(low));
  return say.between(bare(low), bare(high));
}

/** Whether a figure speaks for the claim; null where it only informs. */
export function holds({ limits, value }: Figure): boolean | null {
  return limits === null ? null : value >= limits[0] && value <= limits[1];
}

function figureRow(figure: Figure): HTMLElement {
  const held = holds(figure);
  const mark = held !== null && [' ', h('span', { class: held ? 'holds' : 'fails' }, held ? say.holds : say.fails)];
  return h(
    'tr',
    {},
    h('th', { scope: 'row' }, figure.name),
    h('td', {}, figure.claimed === null ? '–' : bare(figure.claimed)),
    h('td.obtained', {}, formatSignificant(figure.value)),
    h('td.unit', {}, unit(figure.unit)),
    h('td', {}, h('span.limits', {}, limitsText(figure)), mark),
  );
}

function figures({ figures }: Finding, says: string): HTMLElement {
  const c = say.columns;
  const head = [c.figure, c.claimed, c.obtained, c.unit, c.limits].map((name) => h('th', { scope: 'col' }, name));
  return h(
    'div.scroll',
    { tabindex: '0', role: 'region', 'aria-label': say.figuresOf(says) },
    h('table.figures', {}, h('thead', {}, h('tr', {}, ...head)), h('tbody', {}, ...figures.map(figureRow))),
  );
}

export class ClaimCard {
  readonly element: HTMLElement;
  #store: Store;
  #runner: Runner;
  #claim: Claim;
  #verdict = h('p.verdict-line', { role: 'status' });
  #button = h('button', { type: 'button' });
  #bar = h('progress', { max: 1, 'aria-label': t.work.progress });
  #result = h('div.claim-result', { hidden: true });

  constructor(store: Store, runner: Runner, id: string, claim: Claim, openTrial: (trial: Trial) => void) {
    this.#store = store;
    this.#runner = runner;
    this.#claim = claim;
    const says = `claim-${id.replace('/', '-')}`;
    this.#button.setAttribute('aria-describedby', says);
    this.#button.addEventListener('click', () => {
      const { kind } = runner.claim(id).value;
      if (kind === 'running' || kind === 'waiting') runner.stop(id);
      else runner.run([id]);
    });
    this.element = h(
      'li.claim',
      { 'data-claim': id },
      h('p.says', { id: says }, claim.says),
      h('p.place', {}, claim.place),
      h('div.claim-run', {}, this.#button, this.#bar, this.#verdict),
      this.#result,
      claim.trials.length > 0 && this.#trials(openTrial),
    );
    runner.claim(id).watch((state) => this.#show(state));
    runner.dead.on(() => this.#show(runner.claim(id).value));
  }

  #show(state: ClaimState): void {
    const g = say;
    const isBusy = state.kind === 'running' || state.kind === 'waiting';
    this.element.dataset['state'] = state.kind;
    this.#button.textContent = isBusy ? t.work.stop : state.kind === 'tried' ? g.again : g.run;
    this.#button.disabled = this.#runner.dead.value !== null;
    this.#bar.hidden = state.kind !== 'running';
    if (state.kind === 'running') this.#bar.value = state.fraction;
    this.#verdict.dataset['verdict'] = state.kind === 'tried' ? state.finding.verdict : '';
    this.#verdict.textContent = this.#words(state);
    if (state.kind !== 'tried') {
      // What was found before stays in sight while the claim is tried again.
      return;
    }
    this.#result.hidden = false;
    this.#result.replaceChildren(
      figures(state.finding, this.#claim.says),
      h('p.remark', {}, ...prose(this.#claim.remark)),
      h('p.note', {}, g.seconds(formatSignificant(state.seconds, 2))),
    );
  }

  #words(state: ClaimState): string {
    const g = say;
    switch (state.kind) {
      case 'untried':
        return g.untried;
      case 'waiting':
        return g.waiting;
      case 'stopped':
        return say.stopped;
      case 'running':
        return state.stage === '' ? g.running : g.runningTrial(state.stage);
      case 'failed':
        return g.failed(state.message);
      case 'tried':
        return g.verdicts[state.finding.verdict];
    }
  }

  #trials(openTrial: (trial: Trial) => void): HTMLElement {
    const { trials } = this.#claim;
    const items = trials.map((trial) => {
      const open = h('button.quiet', { type: 'button', 'aria-label': say.openTrial(trial.name), onclick: () => openTrial(trial) }, say.open);
      return h('li', {}, open, h('span', {}, h('strong', {}, trial.name), ': ', ...this.#describe(trial)));
    });
    return h('details.trials', {}, h('summary', {}, say.trials(trials.length)), h('ul', {}, ...items));
  }

  /** Drive and estimator by their titles, and what was set about them. */
  #describe({ source, estimator, params, vehicle }: Trial): (string | HTMLElement)[] {
    const catalogue = this.#store.catalogue.value;
    const drive = catalogue?.drives.find((d) => d.name === source.drive)?.title ?? source.drive;
    const title = catalogue?.estimators.find((e) => e.name === estimator)?.title ?? estimator;
    const set = [source.changes, params].filter((text) => text !== '').map((text) => h('code', {}, text));
    const more = [source.seed === null ? '' : say.seed(String(source.seed)), vehicle === null ? '' : say.vehicle(vehicle)];
    return [[drive, title, ...more.filter((text) => text !== '')].join(', '), ...set.flatMap((code) => [', ', code])];
  }
}
