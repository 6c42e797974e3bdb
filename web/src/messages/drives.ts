/** Texts of the dialog of built-in drives. */

export const drives = {
  search: 'Find a drive',
  none: 'No drive is called or described so.',
  seed: 'Seed',
  random: 'Another',
  seedNote: 'All noise and every sensor’s biases come from it: same drive, same seed, same numbers.',
  facts: (duration: string, way: string, top: string) => `${duration} · ${way} · up to ${top}`,
  compose: 'A drive of your own is a JSON file: drop it on the page to drive it. To begin with, export the JSON of one of these.',
} as const;
