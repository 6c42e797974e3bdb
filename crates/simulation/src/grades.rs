//! Sensor grades: how good the simulated sensors are, each with its source.

/// Errors of an inertial sensor, the same on its three axes unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuGrade {
    /// Noise density of specific force, m/s^2/sqrt(Hz).
    pub accel_noise: f64,
    /// Turn-on bias of specific force, 1-sigma, m/s^2.
    pub accel_bias: f64,
    /// Walk of that bias, m/s^2/sqrt(s).
    pub accel_walk: f64,
    /// Noise density of turn rate, rad/s/sqrt(Hz).
    pub gyro_noise: f64,
    /// Turn-on bias of turn rate, 1-sigma, rad/s.
    pub gyro_bias: f64,
    /// Walk of that bias, rad/s/sqrt(s).
    pub gyro_walk: f64,
    /// Scale error, 1-sigma.
    pub scale: f64,
    /// Resolution of specific force, m/s^2; 0 for none.
    pub accel_resolution: f64,
    /// Resolution of turn rate, rad/s; 0 for none.
    pub gyro_resolution: f64,
    /// Vibration of engine and road felt by the sensor, as a factor of the built-in level.
    pub vibration: f64,
    /// Misalignment of each axis, 1-sigma, rad.
    pub misalignment: f64,
    /// Largest specific force, m/s^2, and largest turn rate, rad/s, that can be read.
    pub range: [f64; 2],
}

/// Errors of a magnetometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagGrade {
    /// Noise of a sample, 1-sigma, uT.
    pub noise: f64,
    /// Offset fixed to the car, body axes, uT.
    pub hard_iron: [f64; 3],
    /// Distortion fixed to the car, row by row; the identity for none.
    pub soft_iron: [[f64; 3]; 3],
    /// Resolution, uT; 0 for none.
    pub resolution: f64,
}

/// Errors of wheel speeds and steering angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarGrade {
    /// Pulses per turn of a wheel; 0 reads the speed directly.
    pub pulses: f64,
    /// Pitch error of single pulses, 1-sigma as a share of the pitch.
    pub pulse_error: f64,
    /// Slower rim speeds read 0, m/s.
    pub slowest: f64,
    /// Scale error common to the wheels and of each, 1-sigma.
    pub scale: [f64; 2],
    /// Noise of the reported speed while moving, 1-sigma, m/s.
    pub speed_noise: f64,
    /// Resolution of the speeds, m/s; 0 for none.
    pub speed_resolution: f64,
    /// Offset of the steering wheel's angle, 1-sigma, rad.
    pub steering_offset: f64,
    /// Resolution of the steering wheel's angle, rad; 0 for none.
    pub steering_resolution: f64,
    /// How late speeds and steering angle are, s.
    pub latency: f64,
}

/// Errors of a satellite receiver and a barometer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionGrade {
    /// Fixes per second.
    pub rate: f64,
    /// White position noise, horizontal and vertical, 1-sigma, m.
    pub white: [f64; 2],
    /// Correlated position error, horizontal and vertical, 1-sigma, m.
    pub correlated: [f64; 2],
    /// Correlation time of it, s.
    pub correlation_time: f64,
    /// Velocity noise, horizontal and vertical, 1-sigma, m/s.
    pub velocity: [f64; 2],
    /// No course below this speed over ground, m/s.
    pub slowest_course: f64,
    /// Barometer: white noise, drift (1-sigma) and its correlation time; m, m, s.
    pub baro: [f64; 3],
    /// How late fixes are, s.
    pub latency: f64,
}

/// A named set of sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grade {
    /// Name in drive files.
    pub name: &'static str,
    /// What it is and where the numbers are from.
    pub source: &'static str,
    /// Inertial sensor.
    pub imu: ImuGrade,
    /// Magnetometer.
    pub mag: MagGrade,
    /// Wheel speeds and steering.
    pub car: CarGrade,
    /// Receiver and barometer.
    pub position: PositionGrade,
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

const UNLIMITED: [f64; 2] = [f64::INFINITY; 2];

const AUTOMOTIVE_IMU: ImuGrade = ImuGrade {
    accel_noise: 8e-4,
    accel_bias: 0.012,
    accel_walk: 5e-5,
    gyro_noise: 2e-4,
    gyro_bias: 2e-3,
    gyro_walk: 3e-6,
    scale: 1e-3,
    accel_resolution: 0.001,
    gyro_resolution: 1e-4,
    vibration: 1.0,
    misalignment: 0.0,
    range: UNLIMITED,
};

const AUTOMOTIVE_MAG: MagGrade = MagGrade { noise: 0.05, hard_iron: [0.0; 3], soft_iron: IDENTITY, resolution: 0.01 };

const AUTOMOTIVE_CAR: CarGrade = CarGrade {
    pulses: 48.0,
    pulse_error: 0.004,
    slowest: 0.3,
    scale: [2e-3, 1e-3],
    speed_noise: 0.05,
    speed_resolution: 0.01,
    steering_offset: 0.01,
    steering_resolution: 0.001_745,
    latency: 0.0,
};

const AUTOMOTIVE_POSITION: PositionGrade = PositionGrade {
    rate: 1.0,
    white: [0.5, 0.9],
    correlated: [0.8, 1.4],
    correlation_time: 90.0,
    velocity: [0.08, 0.12],
    slowest_course: 1.0,
    baro: [0.15, 0.5, 300.0],
    latency: 0.0,
};

/// The grades that ship with Drivescope.
pub const GRADES: &[Grade] = &[
    Grade {
        name: "automotive",
        source: "Good automotive MEMS of the class of ST ASM330LHH and Bosch SMI230 after offset calibration in the factory \
                 (typical noise of data sheets: 60 to 120 ug/sqrt(Hz), 5 to 14 mdps/sqrt(Hz)); magneto-inductive \
                 magnetometer (data sheets: 15 to 50 nT), perfectly calibrated; ABS wheel speeds with 48 pulses; \
                 single-frequency receiver at 1 Hz",
        imu: AUTOMOTIVE_IMU,
        mag: AUTOMOTIVE_MAG,
        car: AUTOMOTIVE_CAR,
        position: AUTOMOTIVE_POSITION,
    },
    Grade {
        name: "esc",
        source: "Sensors of stability control as the specification of the orientation estimators has them: gyro 0.1 deg/s, \
                 accelerometer 0.05 m/s^2, magnetometer 0.3 uT, speed 0.05 m/s in each sample at 100 Hz, gyro bias 0.1 deg/s; \
                 ranges of a Bosch MM5 cluster (4.2 g, 163 deg/s); speeds 20 ms late on the CAN bus",
        imu: ImuGrade {
            accel_noise: 5e-3,
            accel_bias: 0.1,
            accel_walk: 2e-4,
            gyro_noise: 1.745e-4,
            gyro_bias: 1.745e-3,
            gyro_walk: 5e-6,
            scale: 5e-3,
            accel_resolution: 0.01,
            gyro_resolution: 5e-4,
            vibration: 0.5,
            misalignment: 5e-3,
            range: [41.2, 2.845],
        },
        mag: MagGrade { noise: 0.3, ..AUTOMOTIVE_MAG },
        car: CarGrade { latency: 0.02, ..AUTOMOTIVE_CAR },
        position: AUTOMOTIVE_POSITION,
    },
    Grade {
        name: "phone",
        source: "A phone in its holder with a Bosch BMI160 (data sheet: 180 ug/sqrt(Hz), 7 mdps/sqrt(Hz), 40 mg and 3 deg/s of \
                 offset untrimmed, read here after the phone's own calibration to a tenth of it; 8 g and 1000 deg/s in 16 bits); \
                 three-axis Hall magnetometer (0.15 uT a bit) with an offset left by its calibration; receiver 0.2 s late",
        imu: ImuGrade {
            accel_noise: 1.765e-3,
            accel_bias: 0.04,
            accel_walk: 1e-4,
            gyro_noise: 1.222e-4,
            gyro_bias: 5.2e-3,
            gyro_walk: 5e-6,
            scale: 5e-3,
            accel_resolution: 2.394e-3,
            gyro_resolution: 5.326e-4,
            vibration: 1.5,
            misalignment: 0.01,
            range: [78.45, 17.45],
        },
        mag: MagGrade { noise: 0.5, hard_iron: [1.5, -2.0, 1.0], resolution: 0.15, ..AUTOMOTIVE_MAG },
        car: AUTOMOTIVE_CAR,
        position: PositionGrade {
            white: [1.0, 2.0],
            correlated: [2.5, 4.0],
            velocity: [0.15, 0.3],
            baro: [0.1, 0.7, 300.0],
            latency: 0.2,
            ..AUTOMOTIVE_POSITION
        },
    },
    Grade {
        name: "mems",
        source: "Inertial sensor `mems` of the navigation specification: turn-on 0.03 m/s^2 and 2e-3 rad/s, noise 2e-3 and 2e-4, \
                 walk 2e-4 and 3e-6; the rest as `automotive`",
        imu: ImuGrade {
            accel_noise: 2e-3,
            accel_bias: 0.03,
            accel_walk: 2e-4,
            gyro_noise: 2e-4,
            gyro_bias: 2e-3,
            gyro_walk: 3e-6,
            misalignment: 1e-3,
            ..AUTOMOTIVE_IMU
        },
        mag: AUTOMOTIVE_MAG,
        car: AUTOMOTIVE_CAR,
        position: AUTOMOTIVE_POSITION,
    },
    Grade {
        name: "adis16465",
        source: "Analog Devices ADIS16465-1: 0.15 deg/sqrt(h) and 0.012 m/s/sqrt(h) random walk, 0.05 deg axis to axis, 125 deg/s, \
                 8 g; bias repeatability 0.14 deg/s and 1.4 mg; walks that reach its in-run stability (2 deg/h, 3.6 ug) within \
                 100 s; 16-bit output words (160 per deg/s, 4000 per g)",
        imu: ImuGrade {
            accel_noise: 2e-4,
            accel_bias: 0.0137,
            accel_walk: 3.5e-6,
            gyro_noise: 4.36e-5,
            gyro_bias: 2.44e-3,
            gyro_walk: 9.7e-7,
            scale: 1e-3,
            accel_resolution: 2.45e-3,
            gyro_resolution: 1.09e-4,
            vibration: 1.0,
            misalignment: 8.7e-4,
            range: [78.45, 2.18],
        },
        mag: AUTOMOTIVE_MAG,
        car: AUTOMOTIVE_CAR,
        position: AUTOMOTIVE_POSITION,
    },
    Grade {
        name: "navigation",
        source: "Inertial sensor `nav` of the navigation specification: turn-on 1e-4 m/s^2 and 2.4e-7 rad/s, noise 5e-5 and 6e-7, \
                 walk 1e-6 and 1e-9; carrier-smoothed receiver of a tenth of a metre at 5 Hz",
        imu: ImuGrade {
            accel_noise: 5e-5,
            accel_bias: 1e-4,
            accel_walk: 1e-6,
            gyro_noise: 6e-7,
            gyro_bias: 2.4e-7,
            gyro_walk: 1e-9,
            scale: 1e-5,
            accel_resolution: 0.0,
            gyro_resolution: 0.0,
            vibration: 1.0,
            misalignment: 1e-5,
            range: UNLIMITED,
        },
        mag: AUTOMOTIVE_MAG,
        car: AUTOMOTIVE_CAR,
        position: PositionGrade {
            rate: 5.0,
            white: [0.05, 0.1],
            correlated: [0.08, 0.15],
            velocity: [0.02, 0.03],
            ..AUTOMOTIVE_POSITION
        },
    },
    Grade {
        name: "ideal",
        source: "No errors and no vibration: for closing a strapdown integration on the truth",
        imu: ImuGrade {
            accel_noise: 0.0,
            accel_bias: 0.0,
            accel_walk: 0.0,
            gyro_noise: 0.0,
            gyro_bias: 0.0,
            gyro_walk: 0.0,
            scale: 0.0,
            accel_resolution: 0.0,
            gyro_resolution: 0.0,
            vibration: 0.0,
            misalignment: 0.0,
            range: UNLIMITED,
        },
        mag: MagGrade { noise: 0.0, hard_iron: [0.0; 3], soft_iron: IDENTITY, resolution: 0.0 },
        car: CarGrade {
            pulses: 0.0,
            pulse_error: 0.0,
            slowest: 0.0,
            scale: [0.0; 2],
            speed_noise: 0.0,
            speed_resolution: 0.0,
            steering_offset: 0.0,
            steering_resolution: 0.0,
            latency: 0.0,
        },
        position: PositionGrade {
            white: [0.0; 2],
            correlated: [0.0; 2],
            velocity: [0.0; 2],
            baro: [0.0, 0.0, 300.0],
            ..AUTOMOTIVE_POSITION
        },
    },
];

impl Grade {
    /// A grade by name.
    pub fn named(name: &str) -> Option<&'static Self> {
        GRADES.iter().find(|g| g.name == name)
    }
}
