//! What the measurements of the slope estimator can tell, from its own Jacobians: ranks, and a lamp for each quantity.
//!
//! The observability matrix of a model linearised at one moment has the rows `h A^k`. Here they are `h A^k T^k / k!` with
//! `T` = 1 s and columns in units of each state's ordinary size, so that an entry is what one ordinary amount of the state
//! changes in a measurement within a second. What adds less than [`TOLERANCE`] of a measurement's unit counts as nothing:
//! the yaw rate of a straight road is not exactly zero.
//! Source: SPEC slope 6 and 7 (the paper claims that one filter cannot have both force and slope; the ranks say it can).

use drivescope_drive::channel::{Column, Series};
use drivescope_drive::drive::{Drive, Signal};
use drivescope_drive::vehicle::VehicleParams;
use nalgebra::{SMatrix, SVector};

use super::Slope;
use super::grade::{self, Suspension};
use super::motion::{self, Car, Row, STATES, Steer};
use super::params::SlopeParams;
use crate::estimator::vehicle_of;

/// A direction that changes the measurements by less than this within a second counts as unseen.
pub const TOLERANCE: f64 = 0.02;
/// A state is unseen when more than this share of its square lies in directions that are not seen.
const UNSEEN_SHARE: f64 = 0.005;
/// Measurements of a filter at most.
const MOST_MEASUREMENTS: usize = 5;
/// Ordinary sizes of the states of the first filter.
const MOTION_SCALE: [f64; STATES] = [1.0, 1.0, 0.1, 2000.0, 2000.0, 2000.0, 0.1];
/// Ordinary sizes of the states of the grade filter; the last is none of them.
const GRADE_SCALE: [f64; STATES] = [1.0, 0.1, 0.01, 0.1, 0.1, 1.0, 0.0];

const STRAIGHT: &str =
    "on a straight road nothing measures the lateral speed unless the rear-axle aid says that the axle does not slide";
const TURNING: &str = "in a turn without the rear-axle aid only yaw rate times lateral speed less gravity along the slope \
    is seen, not each of the two";
const NO_GYRO: &str = "without a yaw gyro neither the yaw rate nor what the lateral speed adds to the slope is seen";
const NO_LATERAL: &str = "the lateral forces of the axles need the yaw gyro and the lateral accelerometer";
const STANDING: &str =
    "a standing car cannot tell a grade from a bias of its accelerometer; what was known before is held";
const NO_VERTICAL: &str = "without barometer, GNSS height or GNSS vertical velocity a constant grade and a bias of the \
    accelerometer are the same; only their sum is seen";
const NO_DATUM: &str = "without barometer or GNSS height the altitude counts from the start";
const NO_PITCH_MODEL: &str = "without a static squat no model tells the body's pitch from the grade";
const UNSEEN: &str = "nothing that is measured here depends on it";

/// Which measurements there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Available {
    /// Yaw gyro.
    pub gyro: bool,
    /// Lateral accelerometer.
    pub accel_y: bool,
    /// The aid that the rear axle does not slide.
    pub rear_axle: bool,
    /// Altitude, from a barometer or a receiver.
    pub altitude: bool,
    /// Vertical velocity from a receiver.
    pub climb: bool,
}

impl Available {
    /// What a drive and the parameters give.
    pub fn new(drive: &Drive, params: &SlopeParams) -> Self {
        let has_height = drive.gnss.column("gnss_alt").or(drive.gnss.column("gnss_d"));
        let has_height = has_height.is_some_and(|c| c.iter().any(|v| v.is_finite()));
        Self {
            gyro: drive.has(Signal::GyroZ),
            accel_y: drive.has(Signal::AccelY),
            rear_axle: params.rear_axle_aid,
            altitude: params.use_baro && drive.has(Signal::BaroAltitude) || params.use_gnss_height && has_height,
            climb: params.use_gnss && drive.has(Signal::GnssVerticalVelocity),
        }
    }
}

/// The moment at which the models are linearised.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Forward speed, m/s.
    pub speed: f64,
    /// Lateral speed, m/s.
    pub lateral_speed: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate: f64,
    /// Slope of the body, rad.
    pub slope: f64,
    /// Grade of the road, rad.
    pub grade: f64,
    /// Angle of the road wheels, rad.
    pub steer: f64,
}

/// Whether the measurements of one moment tell a quantity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Lamp {
    /// The column of the estimate.
    pub column: &'static str,
    /// Whether it is seen.
    pub is_seen: bool,
    /// Why not; empty where it is seen.
    pub why: &'static str,
}

/// Directions of a state space of [`STATES`] or fewer that the measurements see, orthonormal, the first `rank` of them.
struct Seen {
    basis: [SVector<f64, STATES>; STATES],
    rank: usize,
}

impl Seen {
    /// By Gram and Schmidt with the largest remainder first, over the rows `h A^k T^k / k!` in units of `scale`. A state that
    /// does not exist has a row and a column of zeros.
    fn new(a: &SMatrix<f64, STATES, STATES>, rows: &[&Row], scale: &[f64; STATES]) -> Self {
        let mut left = [SVector::<f64, STATES>::zeros(); MOST_MEASUREMENTS * STATES];
        let left = &mut left[..rows.len() * STATES];
        for (row, powers) in rows.iter().zip(left.chunks_mut(STATES)) {
            let mut h = SVector::<f64, STATES>::zeros();
            row.iter().for_each(|&(column, value)| h[column] = value);
            for (k, power) in powers.iter_mut().enumerate() {
                *power = SVector::from_fn(|i, _| h[i] * scale[i]);
                h = a.tr_mul(&h) / (k + 1) as f64;
            }
        }
        let mut seen = Self { basis: [SVector::zeros(); STATES], rank: 0 };
        while seen.rank < STATES {
            let (mut largest, mut length) = (0, 0.0);
            for (index, row) in left.iter().enumerate() {
                let own = row.norm_squared();
                if own > length || own.is_nan() {
                    (largest, length) = (index, own);
                }
            }
            if length.is_nan() || length.sqrt() < TOLERANCE {
                break;
            }
            let direction = left[largest] / length.sqrt();
            left.iter_mut().for_each(|row| *row -= direction * direction.dot(row));
            seen.basis[seen.rank] = direction;
            seen.rank += 1;
        }
        seen
    }

    fn sees(&self, state: usize) -> bool {
        let share: f64 = self.basis[..self.rank].iter().map(|q| q[state] * q[state]).sum();
        1.0 - share <= UNSEEN_SHARE
    }
}

fn motion_seen(vehicle: &VehicleParams, moment: &Moment, available: &Available, slope_is_state: bool) -> Seen {
    let (car, steer) = (Car::new(vehicle), Steer::new(moment.steer));
    let mut x = motion::State::zeros();
    x[motion::SPEED] = moment.speed;
    x[motion::LATERAL_SPEED] = moment.lateral_speed;
    x[motion::YAW_RATE] = moment.yaw_rate;
    x[motion::SLOPE] = moment.slope;
    let mut a = motion::jacobian(&x, &car, steer);
    if !slope_is_state {
        a.column_mut(motion::SLOPE).fill(0.0);
    }
    let (accel_x, accel_y) = (motion::accel_x_row(&car, steer), motion::accel_y_row(&car, steer));
    let rear_axle = motion::rear_axle_row(&car);
    let rows: [(bool, &Row); 5] = [
        (true, &motion::WHEEL_ROW),
        (available.gyro, &motion::GYRO_ROW),
        (true, &accel_x),
        (available.accel_y, &accel_y),
        (available.rear_axle, &rear_axle),
    ];
    let none: &Row = &[];
    Seen::new(&a, &rows.map(|(is_there, row)| if is_there { row } else { none }), &MOTION_SCALE)
}

/// Rank of the first filter's observability matrix: of 6 states with the slope known, of 7 with the slope among them.
///
/// SPEC slope 6: on a straight road 5 and 6 from the paper's measurements and 6 and 7 with the rear-axle aid; in a steady
/// turn 6 and 6, and 6 and 7.
pub fn motion_rank(vehicle: &VehicleParams, moment: &Moment, available: &Available, slope_is_state: bool) -> usize {
    motion_seen(vehicle, moment, available, slope_is_state).rank
}

fn grade_seen(params: &SlopeParams, moment: &Moment, available: &Available) -> Seen {
    let mut x = grade::State::zeros();
    x[grade::SPEED] = moment.speed;
    x[grade::GRADE] = moment.grade;
    let climb = grade::climb_row(&x);
    let rows: [(bool, &Row); 3] =
        [(true, &[(grade::SPEED, 1.0)]), (available.altitude, &[(grade::ALTITUDE, 1.0)]), (available.climb, &climb)];
    let none: &Row = &[];
    let rows = rows.map(|(is_there, row)| if is_there { row } else { none });
    let mut a = SMatrix::<f64, STATES, STATES>::zeros();
    a.fixed_view_mut::<6, 6>(0, 0).copy_from(&grade::jacobian(&x, &Suspension::new(params)));
    Seen::new(&a, &rows, &GRADE_SCALE)
}

/// Rank of the grade filter's observability matrix, of 6 states: speed, grade, body pitch, its rate, bias, altitude.
pub fn grade_rank(params: &SlopeParams, moment: &Moment, available: &Available) -> usize {
    grade_seen(params, moment, available).rank
}

/// A lamp for each quantity that is not always seen, and why it is off.
pub fn lamps(params: &SlopeParams, vehicle: &VehicleParams, moment: &Moment, available: &Available) -> [Lamp; 9] {
    let first = motion_seen(vehicle, moment, available, true);
    let last = grade_seen(params, moment, available);
    let on_a_straight = || motion_seen(vehicle, &Moment { yaw_rate: 0.0, ..*moment }, available, true);
    // Only a quantity that is out needs a reason.
    let is_straight = !first.sees(motion::LATERAL_SPEED) && on_a_straight().sees(motion::SLOPE);
    let sideways = match (available.gyro, is_straight && first.sees(motion::SLOPE)) {
        (false, _) => NO_GYRO,
        (true, true) => STRAIGHT,
        (true, false) => TURNING,
    };
    let grade = if available.altitude || available.climb { STANDING } else { NO_VERTICAL };
    let force = if available.gyro && available.accel_y { UNSEEN } else { NO_LATERAL };
    let datum = if available.altitude { UNSEEN } else { NO_DATUM };
    let pitch = if params.squat_gain > 0.0 { UNSEEN } else { NO_PITCH_MODEL };
    let has_pitch = params.squat_gain > 0.0 && last.sees(grade::BODY_PITCH);
    [
        ("lateral_speed", first.sees(motion::LATERAL_SPEED), sideways),
        ("sideslip", first.sees(motion::LATERAL_SPEED), sideways),
        ("force_yf", first.sees(motion::FORCE_YF), force),
        ("force_yr", first.sees(motion::FORCE_YR), force),
        ("slope", first.sees(motion::SLOPE), sideways),
        ("grade", last.sees(grade::GRADE), grade),
        ("body_pitch", has_pitch, pitch),
        ("accel_bias", last.sees(grade::ACCEL_BIAS), grade),
        ("altitude", last.sees(grade::ALTITUDE), datum),
    ]
    .map(|(column, is_seen, why)| Lamp { column, is_seen, why: if is_seen { "" } else { why } })
}

/// What a lamp that is off says, by its number in [`lamp_series`], from 1.
pub const REASONS: [&str; 9] =
    [STRAIGHT, TURNING, NO_GYRO, NO_LATERAL, STANDING, NO_VERTICAL, NO_DATUM, NO_PITCH_MODEL, UNSEEN];

/// Rows of [`lamp_series`] at most, and the shortest time between two, s.
const MOST_ROWS: f64 = 4000.0;
const SHORTEST_STEP: f64 = 0.1;

/// The lamps along a slope estimate, a column each: 0 where the quantity is seen, else the number of the reason why not.
///
/// `vehicle` overrides the drive's own, as in a run.
pub fn lamp_series(estimate: &Series, drive: &Drive, params: &SlopeParams, vehicle: Option<&VehicleParams>) -> Series {
    const DOC: &str = "0 where it is seen, else the number of the reason why not.";
    const NAMES: [&str; 9] =
        ["lateral_speed", "sideslip", "force_yf", "force_yr", "slope", "grade", "body_pitch", "accel_bias", "altitude"];
    let mut out = Series::new(&NAMES.map(|name| Column::new(name, "1", DOC)));
    let (Some(&start), Some(&end)) = (estimate.time().first(), estimate.time().last()) else { return out };
    let vehicle = vehicle_of::<Slope>(drive, vehicle);
    let available = Available::new(drive, params);
    let step = ((end - start) / MOST_ROWS).max(SHORTEST_STEP);
    let number = |lamp: &Lamp| REASONS.iter().position(|r| *r == lamp.why).map_or(0.0, |at| at as f64 + 1.0);
    for row in 0..=((end - start) / step) as usize {
        let time = start + row as f64 * step;
        if let Some(lamps) = lamps_at(estimate, time, params, &vehicle, &available) {
            // Times rise by construction.
            let _ = out.push(time, &lamps.each_ref().map(number));
        }
    }
    out
}

/// The lamps at the row of a slope estimate that is in force at `time`, s; `None` before the first row.
pub fn lamps_at(
    estimate: &Series,
    time: f64,
    params: &SlopeParams,
    vehicle: &VehicleParams,
    available: &Available,
) -> Option<[Lamp; 9]> {
    let row = estimate.time().partition_point(|&t| t <= time).checked_sub(1)?;
    let cell = |name: &str| estimate.column(name).map(|c| c[row]).filter(|v| v.is_finite()).unwrap_or(0.0);
    let moment = Moment {
        speed: cell("speed"),
        lateral_speed: cell("lateral_speed"),
        yaw_rate: cell("yaw_rate"),
        slope: cell("slope"),
        grade: cell("grade"),
        steer: 0.0,
    };
    Some(lamps(params, vehicle, &moment, available))
}

#[cfg(test)]
mod tests {
    use super::*;
    use drivescope_drive::signals::{Baro, Imu};

    const PAPER: Available = Available { gyro: true, accel_y: true, rear_axle: false, altitude: false, climb: false };
    const AIDED: Available = Available { rear_axle: true, ..PAPER };
    const STRAIGHT_ROAD: Moment =
        Moment { speed: 20.0, lateral_speed: 0.0, yaw_rate: 0.0, slope: 0.05, grade: 0.05, steer: 0.0 };
    const STEADY_TURN: Moment = Moment { lateral_speed: -0.2, yaw_rate: 0.3, steer: 0.05, ..STRAIGHT_ROAD };

    fn car() -> VehicleParams {
        VehicleParams::preset("kim_2014").unwrap()
    }

    #[test]
    fn the_ranks_are_those_of_the_specification() {
        // The table of SPEC slope 6. Catches an aid row with a wrong sign, a gravity term in the acceleration rows, and a
        // yaw coupling that is missing from the Jacobian.
        let ranks = |moment: &Moment| {
            [(PAPER, false), (PAPER, true), (AIDED, false), (AIDED, true)]
                .map(|(available, slope)| motion_rank(&car(), moment, &available, slope))
        };
        assert_eq!(ranks(&STRAIGHT_ROAD), [5, 6, 6, 7]);
        assert_eq!(ranks(&STEADY_TURN), [6, 6, 6, 7]);
        // Neither the plausible car nor the steering angle changes a rank.
        let saloon = VehicleParams::preset("saloon").unwrap();
        assert_eq!(motion_rank(&saloon, &Moment { steer: -0.3, ..STEADY_TURN }, &AIDED, true), 7);
    }

    #[test]
    fn the_lamps_along_a_drive_go_off_with_the_car_standing_and_name_the_reason() {
        let mut estimate =
            Series::new(&[Column::new("speed", "m/s", "Speed."), Column::new("yaw_rate", "rad/s", "Yaw rate.")]);
        (0..200).for_each(|k| estimate.push(f64::from(k) * 0.05, &[if k < 100 { 20.0 } else { 0.0 }, 0.0]).unwrap());
        let mut drive = Drive::default();
        drive.imu.push(0.0, Imu { gyro_z: 0.0, accel_y: 0.0, ..Imu::default() }).unwrap();
        drive.baro.push(0.0, Baro { altitude: 100.0 }).unwrap();
        let lamps = lamp_series(&estimate, &drive, &SlopeParams::default(), None);
        let at = |name: &str, row: usize| lamps.column(name).unwrap()[row] as usize;
        assert!((99..=100).contains(&lamps.len()), "ten times a second: {}", lamps.len());
        assert_eq!((at("grade", 20), at("slope", 20), at("altitude", 20)), (0, 0, 0));
        assert_eq!(REASONS[at("grade", 80) - 1], STANDING);
        assert_eq!(at("altitude", 80), 0);
        // The columns are those of the lamps, in their order.
        let named = lamps_at(&estimate, 1.0, &SlopeParams::default(), &car(), &AIDED).unwrap().map(|l| l.column);
        assert_eq!(lamps.schema().iter().map(|c| c.name).collect::<Vec<_>>(), named);
    }

    #[test]
    fn a_vertical_channel_tells_the_bias_from_the_grade_while_moving() {
        // SPEC slope 7, "what makes what observable".
        let params = SlopeParams::default();
        let rank = |available, speed| grade_rank(&params, &Moment { speed, ..STRAIGHT_ROAD }, &available);
        let (baro, gnss) = (Available { altitude: true, ..AIDED }, Available { climb: true, ..AIDED });
        // Without either, grade against bias, and the altitude, are open; GNSS velocity knows no altitude.
        assert_eq!([rank(AIDED, 20.0), rank(gnss, 20.0), rank(baro, 20.0)], [4, 5, 6]);
        assert_eq!([rank(gnss, 0.0), rank(baro, 0.0)], [4, 5], "standing, only the datum of the altitude is seen");
    }

    fn off(moment: &Moment, available: &Available) -> Vec<(&'static str, &'static str)> {
        let lamps = lamps(&SlopeParams::default(), &car(), moment, available);
        lamps.iter().filter(|l| !l.is_seen).map(|l| (l.column, l.why)).collect()
    }

    #[test]
    fn a_lamp_goes_off_where_a_quantity_cannot_be_known_and_says_why() {
        let all = Available { altitude: true, climb: true, ..AIDED };
        assert_eq!(off(&STRAIGHT_ROAD, &all), []);
        assert_eq!(off(&STEADY_TURN, &all), []);
        let standing = Moment { speed: 0.0, ..STRAIGHT_ROAD };
        assert_eq!(off(&standing, &all), [("grade", STANDING), ("accel_bias", STANDING)]);
        let lost = [("grade", NO_VERTICAL), ("accel_bias", NO_VERTICAL), ("altitude", NO_DATUM)];
        assert_eq!(off(&STRAIGHT_ROAD, &AIDED), lost);
        let no_aid = Available { rear_axle: false, ..all };
        assert_eq!(off(&STRAIGHT_ROAD, &no_aid), [("lateral_speed", STRAIGHT), ("sideslip", STRAIGHT)]);
        let both = [("lateral_speed", TURNING), ("sideslip", TURNING), ("slope", TURNING)];
        assert_eq!(off(&STEADY_TURN, &no_aid), both);
        // With the aid the yaw rate tells the lateral acceleration too; without both it does not.
        assert_eq!(off(&STRAIGHT_ROAD, &Available { accel_y: false, ..all }), []);
        let blind = off(&STRAIGHT_ROAD, &Available { accel_y: false, ..no_aid });
        assert!(blind.contains(&("force_yf", NO_LATERAL)) && blind.contains(&("force_yr", NO_LATERAL)), "{blind:?}");
    }
}
