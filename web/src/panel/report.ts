/** The side panel's second page: what a log holds, how its columns were read, what can be estimated from it. */

import { h, prose } from '../dom';
import type { DriveReport, OpenReport } from '../door';
import { t } from '../messages';
import type { Store } from '../state';
import { formatSignificant, formatTime } from '../units';
import { saveMapping } from '../views/header';
import { words } from './params';

function table(head: string[], rows: (HTMLElement | string)[][], label: string): HTMLElement {
  return h(
    'div.scroll',
    { tabindex: '0', role: 'region', 'aria-label': label },
    h(
      'table.report-table',
      {},
      h('thead', {}, h('tr', {}, ...head.map((text) => h('th', { scope: 'col' }, text)))),
      h('tbody', {}, ...rows.map((cells) => h('tr', {}, ...cells.map((c) => h('td', {}, c))))),
    ),
  );
}

function size(bytes: number): string {
  return bytes >= 1e6 ? `${formatSignificant(bytes / 1e6)} MB` : `${formatSignificant(bytes / 1e3)} kB`;
}

export class ReportPanel {
  readonly element = h('div.report', { tabindex: '-1' });
  #store: Store;
  #columns: { notice: HTMLElement; button: HTMLElement };

  /** `columns` says what should be looked at of how the columns were read, and opens their table. */
  constructor(store: Store, columns: { notice: HTMLElement; button: HTMLElement }) {
    this.#store = store;
    this.#columns = columns;
    store.report.on(() => this.#show());
    store.catalogue.on(() => this.#show());
  }

  #show(): void {
    const report = this.#store.report.value;
    if (!report) return;
    this.element.replaceChildren(
      h('h3', {}, report.name),
      h('p', {}, `${report.kind === 'file' ? t.report.file : this.#drivesDoc(report)} ${t.report.span(formatTime(report.end - report.start), report.channels.length)}`),
      this.#columns.notice,
      ...this.#fileFacts(report, report.import),
      h('h4', {}, t.report.runs),
      this.#runs(report),
      ...this.#warnings(report.import),
      h('h4', {}, t.report.found),
      table(
        [t.report.channel, t.report.rate, t.report.rows, t.report.columns],
        report.channels.map((c) => [c.name, t.report.hertz(formatSignificant(c.rate_hz)), c.rows.toLocaleString('en'), c.columns.join(', ')]),
        t.report.found,
      ),
      h('h4', {}, t.report.truth),
      h('p', {}, report.truth.length > 0 ? report.truth.join(', ') : t.report.noTruth),
      ...this.#mapping(report),
    );
  }

  #drivesDoc(report: DriveReport): string {
    const drive = this.#store.catalogue.value?.drives.find((d) => d.name === this.#store.builtIn.value?.name || d.name === report.name);
    return `${t.report.simulated}${drive ? ` ${drive.doc}` : ''}`;
  }

  #fileFacts(report: DriveReport, opened: OpenReport | null): HTMLElement[] {
    if (!opened) return [];
    const facts = [
      t.report.fileSize(size(opened.bytes), opened.rows.toLocaleString('en')),
      t.report.layout(opened.layout.separator, opened.layout.decimal),
      opened.epoch ? t.report.epoch(opened.epoch) : '',
      report.start !== 0 ? t.report.start(report.start.toLocaleString('en', { maximumFractionDigits: 3 })) : '',
    ];
    return [h('p', {}, facts.filter(Boolean).join(' '))];
  }

  #runs(report: DriveReport): HTMLElement {
    const items = report.estimators.map((e) => {
      const title = this.#store.catalogue.value?.estimators.find((i) => i.name === e.name)?.title ?? words(e.name);
      const needs = e.missing.map((n) => h('li', {}, n.required ? t.report.needs(n.label, n.why) : t.report.runsWithout(n.label, n.why)));
      const verdict = h(`span.verdict.${e.runnable ? 'better' : 'worse'}`, {}, e.runnable ? t.report.runnable : t.report.notRunnable);
      return h('li', {}, h('strong', {}, title), ' ', verdict, needs.length > 0 && h('ul', {}, ...needs));
    });
    return h('ul.runs', {}, ...items);
  }

  #warnings(opened: OpenReport | null): HTMLElement[] {
    if (!opened) return [];
    const list = (title: string, texts: string[]): HTMLElement[] =>
      texts.length > 0 ? [h('h4', {}, title), h('ul', {}, ...texts.map((text) => h('li', {}, ...prose(text))))] : [];
    return [...list(t.report.warnings, opened.warnings.map((w) => w.message)), ...list(t.report.notes, opened.notes)];
  }

  #mapping(report: DriveReport): HTMLElement[] {
    const opened = report.import;
    if (!opened) return [];
    const download = h('button', { type: 'button', onclick: () => saveMapping(report) }, t.report.download);
    const used = opened.used.map((u) => [
      u.column === u.signal ? h('code', {}, u.signal) : h('span', {}, `${u.column} → `, h('code', {}, u.signal)),
      h('span', {}, ...prose(`${[u.conversion, u.why].filter(Boolean).join('; ')}; `), h('span.confidence', { 'data-confidence': u.confidence }, t.report.confidences[u.confidence])),
    ]);
    const unused = opened.unused.map((u) => [u.column, h('span', {}, ...prose(u.reason))]);
    return [
      h('h4', {}, t.report.mapped),
      this.#columns.button,
      table([t.report.column, t.report.how], used, t.report.mapped),
      ...(unused.length > 0 ? [h('h4', {}, t.report.unused), table([t.report.column, t.report.how], unused, t.report.unused)] : []),
      download,
      h('p.note', {}, t.report.mappingHint),
    ];
  }
}
