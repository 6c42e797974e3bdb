/** English, continued: opening files. The worker speaks these too. */

export const files = {
  more: (first: string, count: number) => `${first} and ${count} more`,
  unloaded: (name: string) => `${name}: what reads files could not be loaded. Look at the connection and open the file again.`,
  doctor: (reason: string) => `The sensors could not be examined (${reason}). Look at the connection and try again.`,
  broken: (name: string, reason: string) => `${name}: reading it ended unexpectedly (${reason}), perhaps for want of memory. What was open stays open.`,
  kept: (names: string) => `${names}: a database of bus signals, kept for this session. Open the bus log that it describes: BLF, ASC, candump or MDF 4.`,
  part: {
    first: (seconds: string) => `Read its first ${seconds}`,
    every: (n: number) => `Read one row in ${n}`,
    columns: 'Names of columns, with commas between them',
    only: 'Read these columns only',
  },
  mappingJson: (name: string, reason: string) => `${name}: expected a column mapping as JSON, found ${reason}`,
  mappingAlone: (name: string) => `${name}: a mapping alone opens nothing; drop it together with its log`,
  mappings: (names: string) => `${names}: expected one mapping, found several; drop the log with the one that belongs to it`,
  drives: (names: string) => `${names}: expected one drive, found several; drop one at a time`,
  driveAndLog: (drive: string, log: string) => `${drive}: a drive to simulate, dropped together with ${log}; drop one of them alone`,
  calibrationAndLog: (calibration: string, log: string) => `${calibration}: a magnetometer’s calibration; drop it once ${log} is open`,
} as const;
