/** The rooms of the page and the estimators that each of them shows. */

/** The estimators of each room, the one that is tuned first in front. */
export const ROOMS = {
  overview: ['orientation', 'slope', 'motion_mode', 'gnss_ins'],
  road: ['slope'],
  motion: ['motion_mode', 'land_ins', 'stationarity', 'gyro_free'],
  navigation: ['gnss_ins', 'gnss', 'attitude'],
} as const satisfies Record<string, readonly string[]>;

export type RoomName = keyof typeof ROOMS;

export const ROOM_NAMES = Object.keys(ROOMS) as RoomName[];

/** The room that shows an estimator: the one that is entered, if it does. */
export function roomOf(estimator: string, entered: RoomName): RoomName {
  const shows = (name: RoomName): boolean => (ROOMS[name] as readonly string[]).includes(estimator);
  return shows(entered) ? entered : (ROOM_NAMES.find(shows) ?? entered);
}
