/** Texts of what plots are drawn over. */

export const axis = {
  label: 'What plots are drawn over',
  time: 'over time',
  distance: 'over distance',
  column: 'Distance',
  byTruth: 'distance by the true speed',
  byEstimate: 'distance by the estimated speed',
  byMeasured: 'distance by the measured speed',
  unknown: 'without a speed there is no distance',
} as const;
