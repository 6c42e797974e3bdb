/** What is going on (with a way to stop it) and what went wrong. */

import { h, iconButton, prose } from '../dom';
import { t } from '../messages';
import type { Session } from '../session';
import { overlayRun, type Store } from '../state';
import { perFrame } from '../signal';
import { words as plain } from './params';

/** The line under the header: progress with stop, or nothing. Its place is always kept. */
export function statusLine(store: Store, session: Session): HTMLElement {
  const bar = h('progress', { max: 1, 'aria-label': t.work.progress });
  const text = h('span.status-text');
  const stop = h('button.quiet', { type: 'button' }, t.work.stop);
  const line = h('div.status', { role: 'status' }, bar, text, stop);
  let action = (): void => {};
  stop.addEventListener('click', () => action());
  const show = perFrame(() => {
    const further = store.overlays.value.map((variant) => ({ name: overlayRun(variant), title: plain(variant) }));
    const known = store.catalogue.value?.estimators ?? [];
    const estimators = [...known.filter((e) => store.isWanted(e.name) || store.run(e.name).value.running), ...further];
    const running = estimators.filter((e) => store.run(e.name).value.running);
    const stopped = estimators.filter((e) => store.run(e.name).value.isStopped && !store.run(e.name).value.reply);
    const work = store.work.value;
    stop.textContent = t.work.stop;
    const isPartial = store.report.value?.is_partial === true;
    const isGoingOn = isPartial && !store.isRestHeld.value;
    line.dataset['state'] = work || running.length > 0 || isGoingOn ? 'busy' : stopped.length > 0 || isPartial ? 'stopped' : 'idle';
    const { fraction, words } = describe();
    if (fraction === null) bar.removeAttribute('value');
    else bar.value = fraction;
    text.textContent = words;

    function describe(): { fraction: number | null; words: string } {
      if (work) {
        action = work.cancel;
        const stage = work.progress ? `, ${t.work.stages[work.progress.stage] ?? work.progress.stage}` : '';
        const rows = work.progress?.rows ? `, ${t.work.rows(work.progress.rows.toLocaleString('en'))}` : '';
        return { fraction: work.progress?.fraction ?? null, words: `${t.work.opening(work.label)}${stage}${rows}` };
      }
      if (running.length > 0) {
        action = () => session.stop();
        const total = estimators.length;
        const done = running.reduce((sum, e) => sum + (store.run(e.name).value.running?.fraction ?? 0), total - running.length);
        return { fraction: done / total, words: t.work.estimating(running.map((e) => e.title).join(', ')) };
      }
      if (stopped.length > 0) {
        action = () => void session.runAll();
        stop.textContent = t.work.resume;
        return { fraction: 0, words: t.work.stopped(stopped.map((e) => e.title).join(', ')) };
      }
      if (isGoingOn) return { fraction: null, words: '' };
      if (isPartial) {
        action = () => void session.runAll();
        stop.textContent = t.work.resume;
        return { fraction: 0, words: t.work.partial };
      }
      if (!store.catalogue.value) {
        line.dataset['state'] = 'busy';
        return { fraction: null, words: t.work.loading };
      }
      return { fraction: 1, words: '' };
    }
  });
  store.work.on(show);
  store.isRestHeld.on(show);
  const followed = new Set<string>();
  store.overlays.on((now) => {
    for (const variant of now.filter((v) => !followed.has(v))) {
      followed.add(variant);
      store.run(overlayRun(variant)).on(show);
    }
    show();
  });
  store.catalogue.on(() => {
    for (const e of store.catalogue.value?.estimators ?? []) store.run(e.name).on(show);
    show();
  });
  show();
  return line;
}

/** One sentence on what went wrong, until it is dismissed. */
export function errorBanner(store: Store): HTMLElement {
  const text = h('p');
  const banner = h('div.error-banner', { hidden: true }, h('div', { role: 'alert' }, text), iconButton('close', t.errors.dismiss, () => {
    store.error.value = null;
  }));
  store.error.watch((error) => {
    banner.hidden = error === null;
    text.replaceChildren(...prose(error ?? ''));
  });
  return banner;
}
