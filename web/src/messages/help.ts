/** Texts of the page of keys. */

export const help = {
  title: 'Keyboard',
  keys: [
    ['Space', 'play or pause'],
    ['← →', 'step the cursor by one hundredth of what is shown (Shift: a tenth)'],
    ['Home End', 'to the start or the end of the drive'],
    ['+ −', 'zoom in or out about the cursor'],
    ['0', 'show the whole drive'],
    ['[ ]', 'move what is shown'],
    ['1 2 3 5 6', 'go to a view of the room that is open, from top to bottom'],
    ['4', 'go to the trajectory'],
    ['V', 'the next room: overview, road, …'],
    ['X', 'plots over time or over distance'],
    ['P', 'go to the parameters'],
    ['Ctrl+Z, Ctrl+Shift+Z', 'undo or redo a parameter'],
    ['D', 'choose a built-in drive'],
    ['G', 'the gallery of papers'],
    ['C', 'closed loops: control of a car'],
    ['O', 'open a log'],
    ['?', 'this page'],
    ['Esc', 'close'],
  ] as readonly (readonly [string, string])[],
  mouse: 'Mouse and touch',
  mouseText:
    'Wheel or pinch zooms time, drag marks a stretch to zoom into, Shift-drag or two fingers move it, a double click shows the whole drive. One finger moves the cursor. On the map, drag moves and wheel or pinch zooms.',
  privacy: 'Everything is computed on this computer; nothing is sent anywhere.',
  version: (version: string) => `Version ${version}`,
} as const;
