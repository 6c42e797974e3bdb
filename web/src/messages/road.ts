/** Texts of the room of road and forces. */

export const road = {
  slope: 'Slope, grade and body pitch',
  body: 'Slope of the body',
  pitch: 'Body pitch',
  acceleration: 'Longitudinal acceleration',
  forces: 'Tyre forces',
  lanes: {
    angles: 'Slope',
    bodyPitch: 'Body pitch',
    acceleration: 'Acceleration',
    longitudinal: 'Longitudinal, effective',
    lateral: 'Lateral',
  },
  curves: {
    slope: 'slope of the body',
    grade: 'road grade',
    measured: 'measured',
    estimated: 'estimated',
    net: 'net, over ground',
    front: 'front axle',
    rear: 'rear axle',
    trueFront: 'truth, front',
    trueRear: 'truth, rear',
  },
} as const;
