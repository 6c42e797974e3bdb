/** The decisions of the latest run of the motion mode, for every view that explains them. */

import type { Session } from '../session';
import { Signal } from '../signal';
import type { Store } from '../state';
import { latest } from '../worker/rpc';
import { type Decision, decisionsOf } from './explain';

export const ESTIMATOR = 'motion_mode';

/** Kept up to date with the runs. */
export function decisionsSignal(store: Store, session: Session): Signal<readonly Decision[]> {
  const decisions = new Signal<readonly Decision[]>([]);
  const load = latest(async () => {
    const { reply } = store.run(ESTIMATOR).value;
    decisions.value = reply ? decisionsOf(await session.rpc.call('decisions', { source: `${ESTIMATOR}:current` })) : [];
  });
  store.run(ESTIMATOR).on((now, before) => {
    if (now.reply !== before.reply) load();
  });
  load();
  return decisions;
}
