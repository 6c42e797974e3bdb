/** English, continued: variants of orientation, the magnetic gate, the compass doctor’s button. */

export const variants = {
  button: 'Variants',
  title: 'Variants of orientation',
  hint: 'One is the estimate that is tuned; any others are drawn with it, with the same parameters.',
  main: 'estimate',
  overlay: 'overlay',
  name: 'variant',
  makeMain: (name: string) => `Take ${name} as the estimate`,
  addOverlay: (name: string) => `Draw ${name} too`,
  rmse: (unit: string) => `RMSE, ${unit}`,
  running: 'running',
  failed: 'failed',
  docs: {
    switch: 'The paper’s: field and gravity while straight, the filter with springs otherwise',
    triad: 'Field and pseudo gravity at every sample; wrong in turns',
    ekf_model: 'Kalman filter on the field, springs as roll and pitch model',
    ekf_nomodel: 'Kalman filter on the field alone',
    model: 'Springs and yaw rate, open loop',
    road: 'Also bank, grade and gyro bias; believes every field',
    robust: 'As road, behind the magnetic gate',
    robust_ax: 'As robust, with the forward accelerometer: better near magnetic east and west, if that one is level',
  } as Readonly<Record<string, string>>,
} as const;

export const gate = {
  title: 'Magnetic gate',
  /** By the number of a state; see `gateState`. */
  states: ['used', 'used with less weight', 'left out: strength', 'left out: dip', 'left out: does not fit', 'left out: a moment ago', 'believed again'] as readonly string[],
  keys: ['used', 'less weight', 'strength', 'dip', 'does not fit', 'a moment ago', 'believed again'] as readonly string[],
  label: 'Whether the magnetic field was used, over time. The table holds the numbers.',
  norm: (value: string) => `${value} µT from the model`,
  dip: (value: string) => `${value} from the model`,
  nis: (value: string) => `NIS ${value}`,
  column: 'gate',
  reason: 'reason',
  none: 'no field',
} as const;

export const compass = {
  button: 'Compass',
  buttonApplied: 'Compass, calibrated',
  open_doctor: 'Compass doctor',
  unreadable: (reason: string) => `Expected a saved magnetometer calibration, found ${reason}.`,
  nothing: 'This log has no magnetometer to calibrate.',
} as const;
