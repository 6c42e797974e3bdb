/** The room of motion: the mode and why, right and wrong, aids of land navigation, detectors of rest, the disk. */

import '../style/motion.css';
import { h } from '../dom';
import { t } from '../messages';
import { motion as say } from '../messages/motion';
import type { Room } from '../rooms';
import type { Session } from '../session';
import type { Store } from '../state';
import type { History, Tuning } from '../tuning';
import { Against } from './against';
import { AidView } from './aids';
import { DecisionTable } from './decision-table';
import { decisionsSignal } from './decisions';
import { diskView } from './disk';
import { MotionModeView } from './mode-view';
import { RestView } from './rest';

export function motionRoom(store: Store, session: Session, history: History<Tuning>): Room {
  const decisions = decisionsSignal(store, session);
  const mode = new MotionModeView(store, session, history, decisions);
  const title = h('h2', { title: t.views.focus(say.against.title, '2') }, say.against.title);
  const against = h('section.view', { tabindex: '-1', 'aria-label': say.against.title, 'data-view': 'motion-against', 'data-key': '2' },
    h('header.view-header', {}, title),
    h('div.against-body', {}, new Against(store, session).element, new DecisionTable(store, decisions).element));
  const aids = new AidView(store, session, history);
  const rest = new RestView(store, session);
  const disk = diskView(store, session);
  const views = [mode, aids, rest, disk.view];
  for (const view of views) view.changed();
  return {
    elements: [mode.element, against, aids.element, rest.element, disk.view.element, disk.dialog],
    pictures: () => views.map((view, i) => [['motion_mode', 'aids', 'rest', 'disk'][i] ?? '', view.canvases()]),
  };
}
