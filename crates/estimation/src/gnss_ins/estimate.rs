//! The columns of the GNSS/INS filter.

use drivescope_drive::frames::euler_zyx;
use drivescope_drive::geodesy::LocalFrame;
use drivescope_drive::record;
use nalgebra::{Matrix3, Vector3};

use super::covariance::{CLOCK_BIAS, CLOCK_DRIFT, Covariance, ODOMETER_SCALE};
use super::filter::Verdict;
use super::state::State;
use crate::ins::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, Navigation, POSITION, VELOCITY};

record! {
    /// Position, velocity, attitude and sensor biases, with what each measurement was worth.
    pub struct GnssInsEstimate {
        /// North of the local origin.
        north: "m", truth "n";
        /// Sigma of the position to the north.
        north_sigma: "m", sigma_of "north";
        /// East of the local origin.
        east: "m", truth "e";
        /// Sigma of the position to the east.
        east_sigma: "m", sigma_of "east";
        /// Correlation of the errors to the north and to the east, -1 to 1: how the ellipse of the position lies.
        north_east_correlation: "1";
        /// Below the local origin.
        down: "m", truth "d";
        /// Sigma of the position downward.
        down_sigma: "m", sigma_of "down";
        /// Latitude.
        lat: "rad", truth "lat";
        /// Longitude.
        lon: "rad", truth "lon";
        /// Height above the ellipsoid.
        alt: "m", truth "alt";
        /// Sigma of the height.
        alt_sigma: "m", sigma_of "alt";
        /// Velocity to the north.
        v_north: "m/s", truth "vn";
        /// Sigma of the velocity to the north.
        v_north_sigma: "m/s", sigma_of "v_north";
        /// Velocity to the east.
        v_east: "m/s", truth "ve";
        /// Sigma of the velocity to the east.
        v_east_sigma: "m/s", sigma_of "v_east";
        /// Velocity downward.
        v_down: "m/s", truth "vd";
        /// Sigma of the velocity downward.
        v_down_sigma: "m/s", sigma_of "v_down";
        /// Roll, right side down positive.
        roll: "rad", truth "roll";
        /// Sigma of the roll.
        roll_sigma: "rad", sigma_of "roll";
        /// Pitch, nose up positive.
        pitch: "rad", truth "pitch";
        /// Sigma of the pitch.
        pitch_sigma: "rad", sigma_of "pitch";
        /// Yaw, clockwise from true north; no value until it is known.
        yaw: "rad", truth "yaw";
        /// Sigma of the yaw.
        yaw_sigma: "rad", sigma_of "yaw";
        /// Forward velocity.
        speed: "m/s", truth "vx";
        /// Sigma of the forward velocity.
        speed_sigma: "m/s", sigma_of "speed";
        /// Angle between heading and velocity, above 2 m/s.
        sideslip: "rad", truth "sideslip";
        /// Sigma of the sideslip.
        sideslip_sigma: "rad", sigma_of "sideslip";
        /// Bias of the forward accelerometer.
        accel_bias_x: "m/s^2", truth "accel_bias_x";
        /// Its sigma.
        accel_bias_x_sigma: "m/s^2", sigma_of "accel_bias_x";
        /// Bias of the rightward accelerometer.
        accel_bias_y: "m/s^2", truth "accel_bias_y";
        /// Its sigma.
        accel_bias_y_sigma: "m/s^2", sigma_of "accel_bias_y";
        /// Bias of the downward accelerometer.
        accel_bias_z: "m/s^2", truth "accel_bias_z";
        /// Its sigma.
        accel_bias_z_sigma: "m/s^2", sigma_of "accel_bias_z";
        /// Bias of the roll gyro.
        gyro_bias_x: "rad/s", truth "gyro_bias_x";
        /// Its sigma.
        gyro_bias_x_sigma: "rad/s", sigma_of "gyro_bias_x";
        /// Bias of the pitch gyro.
        gyro_bias_y: "rad/s", truth "gyro_bias_y";
        /// Its sigma.
        gyro_bias_y_sigma: "rad/s", sigma_of "gyro_bias_y";
        /// Bias of the yaw gyro.
        gyro_bias_z: "rad/s", truth "gyro_bias_z";
        /// Its sigma.
        gyro_bias_z_sigma: "rad/s", sigma_of "gyro_bias_z";
        /// What the odometer shows over what is driven; no value where it is not estimated.
        odometer_scale: "1";
        /// Sigma of the odometer's scale.
        odometer_scale_sigma: "1", sigma_of "odometer_scale";
        /// Offset of the receiver clock, as a distance; with tight coupling only.
        clock_bias: "m";
        /// Sigma of the clock's offset.
        clock_bias_sigma: "m", sigma_of "clock_bias";
        /// Drift of the receiver clock, as a speed; with tight coupling only.
        clock_drift: "m/s";
        /// Sigma of the clock's drift.
        clock_drift_sigma: "m/s", sigma_of "clock_drift";
        /// Normalized innovation squared of a satellite position; no value if its height was missing. Below 1 where the errors of
        /// satellites are correlated over minutes: the filter follows them, so that its sigma of the position is too small then.
        /// Raise `gnss_scale`.
        position_nis: "1", nis 3;
        /// Normalized innovation squared of a satellite velocity; no value if its vertical part was missing. Below 1 where the
        /// receiver measures velocity better than it states.
        velocity_nis: "1", nis 3;
        /// Normalized innovation squared of the odometer. Below 1 where its sigma leaves room for a wrong scale.
        odometer_nis: "1", nis 1;
        /// Normalized innovation squared of the non-holonomic constraint. Below 1 because its sigma leaves room for sideslip in
        /// corners.
        nhc_nis: "1", nis 2;
        /// Normalized innovation squared of the zero velocity of a standing car. Below 1 while the car
        /// stands and far above 1 where wheels read zero although the car already moves, or rolls out: the gate refuses those.
        zupt_nis: "1", nis 3;
        /// Normalized innovation squared of the zero rate of a standing car. Below 1 where the gyros
        /// are quieter than stated, far above 1 where wheels read zero while the body still rocks on its springs: the gate refuses those.
        zaru_nis: "1", nis 3;
        /// Normalized innovation squared of the pseudoranges of an instant, mean over the satellites. Below 1 where the errors of
        /// satellites are correlated over minutes.
        range_nis: "1", nis 1;
        /// Normalized innovation squared of the rates of the pseudoranges of an instant, mean over the satellites.
        range_rate_nis: "1", nis 1;
        /// 1 where a satellite position was used, 0 where it was refused.
        position_accepted: "1";
        /// 1 where a satellite velocity was used, 0 where it was refused.
        velocity_accepted: "1";
        /// 1 where the odometer was used, 0 where it was refused.
        odometer_accepted: "1";
        /// 1 where the non-holonomic constraint was used, 0 where it was refused.
        nhc_accepted: "1";
        /// 1 where the zero velocity was used, 0 where it was refused.
        zupt_accepted: "1";
        /// 1 where the zero rate was used, 0 where it was refused.
        zaru_accepted: "1";
        /// Share of the pseudoranges of an instant that were used.
        range_accepted: "1";
        /// Share of the rates of the pseudoranges that were used.
        range_rate_accepted: "1";
        /// Satellites that the receiver used for its last fix; with tight coupling, whose pseudoranges were used.
        satellites: "1";
        /// Position dilution of precision of the last fix; with tight coupling, of all satellites in view.
        pdop: "1";
    }
}

/// Speed below which the sideslip means nothing, m/s.
const SLOWEST_SIDESLIP: f64 = 2.0;

/// What each sensor's measurement of this epoch was worth; `None` where there was none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Verdicts {
    /// Satellite position.
    pub position: Option<Verdict>,
    /// Satellite velocity.
    pub velocity: Option<Verdict>,
    /// Odometer.
    pub odometer: Option<Verdict>,
    /// Non-holonomic constraint.
    pub nhc: Option<Verdict>,
    /// Zero velocity.
    pub zupt: Option<Verdict>,
    /// Zero rate.
    pub zaru: Option<Verdict>,
    /// Pseudoranges.
    pub range: Tally,
    /// Their rates.
    pub range_rate: Tally,
}

/// What many measurements of one kind and instant were worth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// How many there were.
    pub count: usize,
    /// How many were used.
    pub accepted: usize,
    /// Sum of the normalized innovations squared.
    pub nis: f64,
}

impl Tally {
    /// Count one; a measurement that could not be computed with counts as refused.
    pub fn add(&mut self, verdict: Option<Verdict>) {
        self.count += 1;
        if let Some(verdict) = verdict {
            self.accepted += usize::from(verdict.is_accepted);
            self.nis += verdict.nis;
        }
    }
}

fn nis(verdict: Option<Verdict>, rows: usize) -> f64 {
    verdict.filter(|v| v.rows == rows).map_or(f64::NAN, |v| v.nis)
}

fn accepted(verdict: Option<Verdict>) -> f64 {
    verdict.map_or(f64::NAN, |v| f64::from(u8::from(v.is_accepted)))
}

impl Verdicts {
    /// Put statistics and decisions into their columns.
    pub fn write(&self, row: &mut GnssInsEstimate) {
        row.position_nis = nis(self.position, 3);
        row.velocity_nis = nis(self.velocity, 3);
        row.odometer_nis = nis(self.odometer, 1);
        row.nhc_nis = nis(self.nhc, 2);
        row.zupt_nis = nis(self.zupt, 3);
        row.zaru_nis = nis(self.zaru, 3);
        row.position_accepted = accepted(self.position);
        row.velocity_accepted = accepted(self.velocity);
        row.odometer_accepted = accepted(self.odometer);
        row.nhc_accepted = accepted(self.nhc);
        row.zupt_accepted = accepted(self.zupt);
        row.zaru_accepted = accepted(self.zaru);
        // No measurement: 0 / 0 is no value.
        let mean = |tally: &Tally, sum: f64| sum / tally.count as f64;
        row.range_nis = mean(&self.range, self.range.nis);
        row.range_rate_nis = mean(&self.range_rate, self.range_rate.nis);
        row.range_accepted = mean(&self.range, self.range.accepted as f64);
        row.range_rate_accepted = mean(&self.range_rate, self.range_rate.accepted as f64);
    }
}

/// The sigmas of the columns, and the covariance of north and east.
///
/// Those of north, east, down are of the local frame at the car; its turn against the frame at the origin (1e-3 rad at
/// 6 km) is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sigmas {
    of: [f64; 20],
    north_east: f64,
}

impl Sigmas {
    /// Those of a state with a covariance.
    pub fn new(state: &State, covariance: &Covariance) -> Self {
        let sigma = |k: usize| covariance[(k, k)].max(0.0).sqrt();
        let mut out = [0.0; 20];
        for (k, slot) in out[..6].iter_mut().enumerate() {
            *slot = sigma(POSITION + k);
        }
        for (k, slot) in out[6..15].iter_mut().enumerate() {
            *slot = sigma(ACCEL_BIAS + k);
        }
        out[15..18].copy_from_slice(&euler_sigmas(&state.navigation, covariance));
        out[18..].copy_from_slice(&body_velocity_sigmas(&state.navigation, covariance));
        Self { of: out, north_east: covariance[(POSITION, POSITION + 1)] }
    }

    /// Between these and later ones: variances and the covariance in proportion.
    pub fn between(&self, later: &Self, share: f64) -> Self {
        let between = |first: f64, second: f64| first * (1.0 - share) + second * share;
        Self {
            of: std::array::from_fn(|k| between(self.of[k].powi(2), later.of[k].powi(2)).sqrt()),
            north_east: between(self.north_east, later.north_east),
        }
    }

    /// Put them into their columns; an error that is not estimated has none.
    pub fn write(&self, row: &mut GnssInsEstimate) {
        const { assert!(VELOCITY == 3 && GYRO_BIAS == ACCEL_BIAS + 3 && ODOMETER_SCALE == ACCEL_BIAS + 6) };
        const { assert!(CLOCK_BIAS == ACCEL_BIAS + 7 && CLOCK_DRIFT == ACCEL_BIAS + 8) };
        let s = &self.of;
        let estimated = |v: f64| if v > 0.0 { v } else { f64::NAN };
        [row.north_sigma, row.east_sigma, row.down_sigma] = [s[0], s[1], s[2]];
        row.alt_sigma = row.down_sigma;
        // Both sigmas 0: 0 / 0 is no value.
        row.north_east_correlation = (self.north_east / (s[0] * s[1])).clamp(-1.0, 1.0);
        [row.v_north_sigma, row.v_east_sigma, row.v_down_sigma] = [s[3], s[4], s[5]];
        [row.accel_bias_x_sigma, row.accel_bias_y_sigma, row.accel_bias_z_sigma] = [s[6], s[7], s[8]];
        [row.gyro_bias_x_sigma, row.gyro_bias_y_sigma, row.gyro_bias_z_sigma] = [s[9], s[10], s[11]];
        row.odometer_scale_sigma = estimated(s[12]);
        [row.clock_bias_sigma, row.clock_drift_sigma] = [estimated(s[13]), estimated(s[14])];
        [row.roll_sigma, row.pitch_sigma, row.yaw_sigma] = [s[15], s[16], s[17]];
        [row.speed_sigma, row.sideslip_sigma] = [s[18], s[19]];
    }
}

/// Sigmas of roll, pitch and yaw from those of the rotation about north, east, down.
fn euler_sigmas(navigation: &Navigation, covariance: &Covariance) -> [f64; 3] {
    let c = &navigation.body_to_nav;
    let cos_pitch = c[(2, 1)].hypot(c[(2, 2)]).max(1e-6);
    let (sin_yaw, cos_yaw, tan_pitch) = (c[(1, 0)] / cos_pitch, c[(0, 0)] / cos_pitch, -c[(2, 0)] / cos_pitch);
    let jacobian = Matrix3::new(
        cos_yaw / cos_pitch,
        sin_yaw / cos_pitch,
        0.0,
        -sin_yaw,
        cos_yaw,
        0.0,
        tan_pitch * cos_yaw,
        tan_pitch * sin_yaw,
        1.0,
    );
    let p = covariance.fixed_view::<3, 3>(ATTITUDE, ATTITUDE);
    [0, 1, 2].map(|k| {
        let row = jacobian.row(k);
        (row * p * row.transpose())[0].max(0.0).sqrt()
    })
}

/// Sigmas of the forward velocity and of the sideslip.
fn body_velocity_sigmas(navigation: &Navigation, covariance: &Covariance) -> [f64; 2] {
    let h = super::measurement::body_velocity(navigation, &Vector3::zeros(), &Vector3::zeros(), 0.0, 1.0).h;
    let h = h.fixed_view::<3, 6>(0, VELOCITY);
    let p = covariance.fixed_view::<6, 6>(VELOCITY, VELOCITY);
    let sigma = |k: usize| (h.row(k) * p * h.row(k).transpose())[0].max(0.0).sqrt();
    [sigma(0), sigma(1) / navigation.velocity.norm().max(SLOWEST_SIDESLIP)]
}

/// Put everything that is estimated into its columns; the sigmas are there already.
pub fn write_state(state: &State, frame: &LocalFrame, row: &mut GnssInsEstimate) {
    let n = &state.navigation;
    [row.north, row.east, row.down] = frame.to_ned(n.place).into();
    (row.lat, row.lon, row.alt) = (n.place.lat, n.place.lon, n.place.alt);
    [row.v_north, row.v_east, row.v_down] = n.velocity.into();
    let angles = euler_zyx(&n.body_to_nav);
    (row.roll, row.pitch, row.yaw) = (angles.roll, angles.pitch, angles.yaw);
    let forward = n.body_to_nav.column(0).dot(&n.velocity);
    let rightward = n.body_to_nav.column(1).dot(&n.velocity);
    row.speed = forward;
    row.sideslip = if forward.abs() >= SLOWEST_SIDESLIP { rightward.atan2(forward) } else { f64::NAN };
    [row.accel_bias_x, row.accel_bias_y, row.accel_bias_z] = state.accel_bias.into();
    [row.gyro_bias_x, row.gyro_bias_y, row.gyro_bias_z] = state.gyro_bias.into();
    let estimated = |value: f64, sigma: f64| if sigma.is_finite() { value } else { f64::NAN };
    row.odometer_scale = estimated(state.odometer_scale, row.odometer_scale_sigma);
    row.clock_bias = estimated(state.clock_bias, row.clock_bias_sigma);
    row.clock_drift = estimated(state.clock_drift, row.clock_drift_sigma);
}

/// Take out what a filter without a yaw cannot know.
pub fn blank_yaw(row: &mut GnssInsEstimate) {
    row.yaw = f64::NAN;
    row.yaw_sigma = f64::NAN;
    row.speed = f64::NAN;
    row.speed_sigma = f64::NAN;
    row.sideslip = f64::NAN;
    row.sideslip_sigma = f64::NAN;
}

/// Take out the clock of a receiver whose ranges have not been seen yet.
pub fn blank_clock(row: &mut GnssInsEstimate) {
    row.clock_bias = f64::NAN;
    row.clock_bias_sigma = f64::NAN;
    row.clock_drift = f64::NAN;
    row.clock_drift_sigma = f64::NAN;
}

#[cfg(test)]
mod tests {
    use drivescope_drive::geodesy::Geodetic;

    use super::*;

    /// Catches a covariance taken from the wrong place, one that is not divided by both sigmas, and one that is interpolated as
    /// if it were a sigma: it may be negative.
    #[test]
    fn the_correlation_of_north_and_east_is_their_covariance_over_both_sigmas_also_between_two_instants() {
        let of = |north_east: f64| {
            let mut covariance = Covariance::identity();
            covariance[(POSITION, POSITION)] = 4.0;
            covariance[(POSITION + 1, POSITION + 1)] = 9.0;
            covariance[(POSITION, POSITION + 1)] = north_east;
            covariance[(POSITION + 1, POSITION)] = north_east;
            let place = Geodetic { lat: 0.8, lon: 0.2, alt: 0.0 };
            let navigation = Navigation { place, velocity: Vector3::zeros(), body_to_nav: Matrix3::identity() };
            Sigmas::new(&State::new(navigation, Vector3::zeros()), &covariance)
        };
        let mut row = GnssInsEstimate::default();
        of(-3.0).write(&mut row);
        assert!((row.north_sigma - 2.0).abs() < 1e-15 && (row.east_sigma - 3.0).abs() < 1e-15);
        assert!((row.north_east_correlation + 0.5).abs() < 1e-15, "{}", row.north_east_correlation);
        of(-3.0).between(&of(1.0), 0.25).write(&mut row);
        assert!((row.north_east_correlation + 2.0 / 6.0).abs() < 1e-15, "{}", row.north_east_correlation);
    }
}
