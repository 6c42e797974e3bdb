//! Tuning of the GNSS/INS filter, and the numbers derived from it once.

use drivescope_drive::{choice, params};
use nalgebra::{SVector, Vector3};

use super::covariance::{ALL_STATES, CLOCK_BIAS, Covariance, ODOMETER_SCALE, ProcessNoise};
use crate::chi_square;

choice! {
    /// Which gravity the mechanisation takes off.
    pub enum Gravity {
        /// Normal gravity of WGS-84, but standard gravity where positions are given in local metres only.
        Auto = "auto",
        /// Normal gravity of WGS-84 at the latitude and height.
        Wgs84 = "wgs84",
        /// Standard gravity, 9.80665 m/s^2: for synthetic logs made over a flat Earth.
        Constant = "constant",
    }
}

choice! {
    /// What of the satellites enters the filter.
    pub enum Coupling {
        /// Position and velocity of the receiver's fix.
        Loose = "loose",
        /// Pseudoranges and their rates, each on its own, and the receiver clock as two more states. The fix is used while there
        /// are no ranges.
        Tight = "tight",
    }
}

choice! {
    /// Whether a second pass lets later measurements tell about earlier states.
    pub enum Smoother {
        /// No: each row knows the past only.
        Off = "off",
        /// Rauch, Tung and Striebel: backward over what the filter kept.
        Rts = "rts",
    }
}

params! {
    /// Tuning of the GNSS/INS filter.
    pub struct GnssInsParams {
        /// What of the satellites enters: the fix, or single pseudoranges (which the drive must have).
        coupling (""): choice Coupling, from "SPEC navigation 4";
        /// Whether a second pass lets later measurements tell about earlier states.
        smoother (""): choice Smoother, from "SPEC navigation 7";
        /// Accelerometer noise density. More: trust satellites and odometer more.
        accel_noise ("na"): number = 2e-3, "m/s^2/sqrt(Hz)", 1e-5 ..= 5e-2 Log, from "SPEC navigation 3";
        /// Gyro noise density. More: attitude follows the measurements faster and shakes more.
        gyro_noise ("ng"): number = 2e-4, "rad/s/sqrt(Hz)", 1e-7 ..= 1e-2 Log, from "SPEC navigation 3";
        /// Walk of the accelerometer biases. More: biases are relearnt faster.
        accel_bias_walk ("rba"): number = 2e-4, "m/s^2/sqrt(s)", 1e-7 ..= 1e-2 Log, from "SPEC navigation 3";
        /// Walk of the gyro biases. More: biases are relearnt faster.
        gyro_bias_walk ("rbg"): number = 3e-6, "rad/s/sqrt(s)", 1e-10 ..= 1e-4 Log, from "SPEC navigation 3";
        /// Time in which accelerometer biases fade; not given: they walk and never fade.
        accel_bias_time ("tau_a"): optional, "s", 1.0 ..= 1e6, from "SPEC navigation 3: infinite";
        /// Time in which gyro biases fade; not given: they walk and never fade.
        gyro_bias_time ("tau_g"): optional, "s", 1.0 ..= 1e6, from "SPEC navigation 3: infinite";
        /// Sigma of the horizontal position at the start.
        initial_position_sigma (""): number = 3.0, "m", 0.01 ..= 100.0 Log, from "SPEC navigation 3, P0";
        /// Sigma of the height at the start.
        initial_height_sigma (""): number = 5.0, "m", 0.01 ..= 200.0 Log, from "SPEC navigation 3, P0";
        /// Sigma of the velocity at the start.
        initial_velocity_sigma (""): number = 0.2, "m/s", 0.001 ..= 10.0 Log, from "SPEC navigation 3, P0";
        /// Sigma of roll and pitch at the start, levelled by gravity.
        initial_tilt_sigma (""): number = 0.01, "rad", 1e-4 ..= 0.5 Log, from "SPEC navigation 3, P0";
        /// Sigma of roll and pitch when the log starts in motion: they start at zero then.
        moving_tilt_sigma (""): number = 0.087, "rad", 0.01 ..= 0.5 Log, from "ours: 5 deg, grade and mounting of a phone";
        /// Sigma of a given start yaw. At least the error to be expected.
        initial_yaw_sigma ("P0_yaw"): number = 0.087_266_462_599_716_47, "rad", 0.008 ..= 1.571 Log,
            from "SPEC navigation 3, P0: 5 deg";
        /// Sigma of the accelerometer biases at the start.
        initial_accel_bias_sigma (""): number = 0.05, "m/s^2", 1e-5 ..= 1.0 Log, from "SPEC navigation 3, P0";
        /// Sigma of the gyro biases at the start.
        initial_gyro_bias_sigma (""): number = 3e-3, "rad/s", 1e-7 ..= 0.1 Log, from "SPEC navigation 3, P0";
        /// Believe the gyro biases that were found while the car stood at the start, as far as the length of that rest allows. Off:
        /// their sigma at the start is `initial_gyro_bias_sigma` even so, as in the specification.
        resting_gyro_bias (""): toggle = true, from "ours: without it steady turns in an outage are taken for gyro bias";
        /// Sigma of a satellite position where the receiver states none.
        gnss_position_sigma (""): number = 1.5, "m", 0.01 ..= 20.0 Log, from "SPEC navigation 3";
        /// Sigma of a satellite height where the receiver states none.
        gnss_height_sigma (""): number = 3.0, "m", 0.01 ..= 40.0 Log, from "SPEC navigation 3";
        /// Sigma of the horizontal satellite velocity; in proportion more where the receiver states a position worse than
        /// `gnss_position_sigma`.
        gnss_velocity_sigma (""): number = 0.1, "m/s", 0.01 ..= 2.0 Log, from "SPEC navigation 3";
        /// Sigma of the vertical satellite velocity; more where it states a height worse than `gnss_height_sigma`.
        gnss_vertical_velocity_sigma (""): number = 0.15, "m/s", 0.01 ..= 2.0 Log, from "SPEC navigation 3";
        /// Factor on every satellite sigma: receivers state too little where their errors last for minutes.
        gnss_scale (""): number = 1.0, "1", 1.0 ..= 5.0 Linear, from "SPEC navigation 10.6";
        /// Sigma of a pseudorange.
        range_sigma (""): number = 1.5, "m", 0.3 ..= 10.0 Log, from "SPEC navigation 3";
        /// How long errors of pseudoranges last, for the second pass: later ones tell less that is new, and their mean stays off.
        /// The filter without a second pass takes each for new. More: the second pass leans on the car's own motion, which
        /// pays up to 12 s where `odometer_scale` is on.
        range_error_time (""): number = 2.0, "s", 0.0 ..= 600.0 Linear,
            from "ours: as long as the scale of an odometer that is not estimated allows; SPEC navigation 5 has 120 s";
        /// Sigma of the rate of a pseudorange.
        range_rate_sigma (""): number = 0.08, "m/s", 0.02 ..= 1.0 Log, from "SPEC navigation 3";
        /// Noise of the receiver clock's offset. More: the clock follows the ranges faster.
        clock_bias_noise ("sp"): number = 0.009, "m^2/s", 1e-4 ..= 10.0 Log, from "SPEC navigation 4";
        /// Noise of the receiver clock's drift.
        clock_drift_noise ("sf"): number = 0.0355, "m^2/s^3", 1e-5 ..= 10.0 Log, from "SPEC navigation 4";
        /// Sigma of the odometer at rest.
        odometer_sigma (""): number = 0.05, "m/s", 0.01 ..= 1.0 Log, from "SPEC navigation 3";
        /// Sigma of the odometer per unit of speed.
        odometer_speed_sigma (""): number = 0.005, "1", 0.0001 ..= 0.1 Log, from "SPEC navigation 3: 0.5 %";
        /// Estimate the odometer's scale (tyre radius) as one more state.
        odometer_scale (""): toggle = false, from "SPEC navigation 10.5: the obvious extension";
        /// Sigma of the odometer's scale at the start.
        initial_odometer_scale_sigma (""): number = 0.02, "1", 0.001 ..= 0.2 Log, from "ours: wear and pressure of a tyre";
        /// Walk of the odometer's scale. More: the scale follows the satellites faster.
        odometer_scale_walk (""): number = 1e-4, "1/sqrt(s)", 1e-6 ..= 1e-2 Log, from "ours: 0.2 % in six minutes";
        /// Sigma of the speed sideways and upward, which the non-holonomic constraint takes as zero.
        nhc_sigma (""): number = 0.15, "m/s", 0.01 ..= 1.0 Log, from "SPEC navigation 3";
        /// Sigma of the zero velocity of a standing car.
        zupt_sigma (""): number = 0.02, "m/s", 0.001 ..= 1.0 Log, from "SPEC navigation 3";
        /// Sigma of the mean rate of a standing car.
        zaru_sigma (""): number = 1e-3, "rad/s", 1e-6 ..= 1.0 Log, from "SPEC navigation 3";
        /// Probability with which a good measurement passes its gate.
        gate_probability ("p_gate"): number = 0.999, "1", 0.9 ..= 0.99999 Linear, from "SPEC navigation 3";
        /// Refusals in a row after which the filter doubts itself: 25 m^2 and 1 (m/s)^2 are added to its covariance.
        max_reject (""): number = 60.0, "1", 5.0 ..= 300.0 Linear, from "SPEC navigation 4";
        /// Inertial samples over which the covariance is carried in one step. More: faster and coarser.
        node (""): number = 10.0, "1", 1.0 ..= 50.0 Linear, from "SPEC navigation 3";
        /// Longest time at rest that is spent on levelling and gyro bias before the filter starts.
        align_time ("k0"): number = 18.0, "s", 0.0 ..= 120.0 Linear, from "SPEC navigation 11: k0";
        /// Yaw to start from; not given: the satellite course, as soon as the car moves.
        initial_yaw (""): optional, "rad", -7.0 ..= 7.0, from "SPEC navigation 4";
        /// Use the odometer.
        odometer (""): toggle = true, from "SPEC navigation 4";
        /// Use that a car moves neither sideways nor upward (non-holonomic constraint).
        nhc (""): toggle = true, from "SPEC navigation 4";
        /// Use that a car whose odometer stands has no velocity.
        zupt (""): toggle = true, from "SPEC navigation 4";
        /// Use that a car whose odometer stands does not turn.
        zaru (""): toggle = true, from "SPEC navigation 4";
        /// Refuse measurements that the filter finds too improbable.
        gate (""): toggle = true, from "SPEC navigation 4";
        /// Model how curvature and rotation of the Earth carry the errors; a car between fixes does not need it.
        earth_terms ("full_F"): toggle = true, from "SPEC navigation 3";
        /// Which gravity is taken off.
        gravity (""): choice Gravity, from "SPEC navigation 1";
        /// Antenna ahead of the inertial sensor.
        antenna_x ("l_x"): number = 0.0, "m", -10.0 ..= 10.0 Linear, from "SPEC navigation 4: none";
        /// Antenna to the right of the inertial sensor.
        antenna_y ("l_y"): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC navigation 4: none";
        /// Antenna below the inertial sensor.
        antenna_z ("l_z"): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC navigation 4: none";
        /// Odometer's axle ahead of the inertial sensor. None: where the drive says its rear axle is, else at the sensor.
        odometer_x ("l_o_x"): optional, "m", -10.0 ..= 10.0, from "SPEC navigation 4: at the sensor";
        /// Odometer's axle to the right of the inertial sensor.
        odometer_y ("l_o_y"): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC navigation 4: none";
        /// Odometer's axle below the inertial sensor.
        odometer_z ("l_o_z"): number = 0.0, "m", -5.0 ..= 5.0 Linear, from "SPEC navigation 4: none";
    }
}

/// Sigma of the receiver clock at the start: offset, m, and drift, m/s (SPEC navigation 4).
pub const START_CLOCK_SIGMA: [f64; 2] = [100.0, 10.0];

/// Largest accepted normalized innovation squared by number of rows; infinite with the gate off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates([f64; 3]);

impl Gates {
    /// From the probability that a good measurement passes.
    pub fn new(probability: f64, is_on: bool) -> Self {
        Self([1.0, 2.0, 3.0].map(|dof| if is_on { chi_square::quantile(probability, dof) } else { f64::INFINITY }))
    }
    /// For `M` rows.
    pub fn rows<const M: usize>(&self) -> Option<f64> {
        Some(self.0[M - 1]).filter(|g| g.is_finite())
    }
}

/// What the filter reads of the parameters at every step.
#[derive(Clone, Debug, PartialEq)]
pub struct Tuning {
    /// The parameters.
    pub params: GnssInsParams,
    /// Process noise.
    pub noise: ProcessNoise,
    /// Gates.
    pub gates: Gates,
    /// Antenna from the inertial sensor, body axes, m.
    pub antenna: Vector3<f64>,
    /// Odometer's point from the inertial sensor, body axes, m.
    pub odometer: Vector3<f64>,
    /// Inertial samples in a node.
    pub node: usize,
}

impl Tuning {
    /// Derive everything once. `rear_axle` is where the drive says it is, seen from the inertial sensor, m ahead.
    pub fn new(params: &GnssInsParams, rear_axle: Option<f64>) -> Self {
        let odometer_x = if params.odometer_x.is_finite() { params.odometer_x } else { rear_axle.unwrap_or(0.0) };
        let is_tight = params.coupling == Coupling::Tight;
        let decay = |time: f64| if time.is_finite() { 1.0 / time } else { 0.0 };
        let noise = ProcessNoise {
            accel: params.accel_noise.powi(2),
            gyro: params.gyro_noise.powi(2),
            accel_bias: params.accel_bias_walk.powi(2),
            gyro_bias: params.gyro_bias_walk.powi(2),
            accel_bias_decay: decay(params.accel_bias_time),
            gyro_bias_decay: decay(params.gyro_bias_time),
            odometer_scale: if params.odometer_scale { params.odometer_scale_walk.powi(2) } else { 0.0 },
            clock_bias: if is_tight { params.clock_bias_noise } else { 0.0 },
            clock_drift: if is_tight { params.clock_drift_noise } else { 0.0 },
        };
        Self {
            noise,
            gates: Gates::new(params.gate_probability, params.gate),
            antenna: Vector3::new(params.antenna_x, params.antenna_y, params.antenna_z),
            odometer: Vector3::new(odometer_x, params.odometer_y, params.odometer_z),
            node: params.node as usize,
            params: params.clone(),
        }
    }

    /// How many ranges of a satellite share one error, where they come every `step` s; 1 without a second pass.
    ///
    /// `(1 + a) / (1 - a)` with `a = exp(-step / time)`: so many times larger is the variance of white noise that leaves a long mean
    /// as uncertain as a first-order Gauss-Markov error does.
    pub fn ranges_per_error(&self, step: f64) -> f64 {
        let time = self.params.range_error_time;
        if self.params.smoother == Smoother::Off || time <= 0.0 {
            return 1.0;
        }
        let left = (-step.max(1e-3) / time).exp();
        (1.0 + left) / (1.0 - left)
    }

    /// Number of errors that a run may estimate, counted to the last one.
    pub fn states(&self) -> usize {
        match self.params.coupling {
            Coupling::Tight => ALL_STATES,
            Coupling::Loose if self.params.odometer_scale => CLOCK_BIAS,
            Coupling::Loose => ODOMETER_SCALE,
        }
    }

    /// Covariance of a fresh start with the given sigmas of roll and pitch and of yaw, rad.
    pub fn initial_covariance(&self, tilt: f64, yaw: f64) -> Covariance {
        let p = &self.params;
        let (position, height, velocity) = (p.initial_position_sigma, p.initial_height_sigma, p.initial_velocity_sigma);
        let (accel, gyro) = (p.initial_accel_bias_sigma, p.initial_gyro_bias_sigma);
        let scale = if p.odometer_scale { p.initial_odometer_scale_sigma } else { 0.0 };
        let clock = if p.coupling == Coupling::Tight { START_CLOCK_SIGMA } else { [0.0; 2] };
        let sigmas: [f64; ALL_STATES] = [
            position, position, height, velocity, velocity, velocity, tilt, tilt, yaw, accel, accel, accel, gyro, gyro,
            gyro, scale, clock[0], clock[1],
        ];
        Covariance::from_diagonal(&SVector::from(sigmas.map(|s| s * s)))
    }
}
