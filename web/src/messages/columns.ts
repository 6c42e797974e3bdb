/** English, continued: what is said beside a log of how its columns were read. */

export const columns = {
  button: 'Columns…',
  look: 'Look at the columns',
  contradictions: (count: number) => (count === 1 ? 'One thing contradicts how this log is read.' : `${count} things contradict how this log is read.`),
  moreIssues: (count: number) => `And ${count} more, in the table of columns.`,
  guesses: (count: number) => (count === 1 ? 'One guess is to be checked in the table of columns.' : `${count} guesses are to be checked in the table of columns.`),
  correct: 'Correct it',
  correctOf: (what: string) => `Correct it: ${what}`,
  otherwise: (column: string, now: string, proposed: string, why: string) => `\`${column}\` is read as ${now}; physics says ${proposed}: ${why}.`,
  leans: (name: string, roll: string, pitch: string, yaw: string, sigma: string, why: string) => `${name}: its housing leans by roll ${roll}°, pitch ${pitch}°, yaw ${yaw}° (± ${sigma}°), by ${why}.`,
  isLate: (name: string, late: string, sigma: string, why: string) => `${name}: its samples are ${late} s late (± ${sigma} s), by ${why}.`,
  leanOf: (name: string) => `lean of ${name}`,
  lateOf: (name: string) => `delay of ${name}`,
  names: 'names of the columns',
  recognised: (name: string, count: number) => `Read with your mapping “${name}”, recognised by the names of its ${count} columns.`,
  unrecognise: 'Read it as proposed instead',
  unloaded: 'what reads files could not be loaded; look at the connection and try again',
  unused: 'not used',
  channels: { imu: 'Inertial sensor', mag: 'Magnetometer', wheels: 'Wheels', steering: 'Steering', gnss: 'Satellites', baro: 'Barometer', accel_array: 'Accelerometer disk', range: 'Ranges' } as Record<string, string>,
} as const;
