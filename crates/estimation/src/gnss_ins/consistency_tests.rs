//! Sensors with their own clock, lever arms, holes and hostile input, on a simulated drive.
//!
//! The truth comes from the exact inverse of the mechanisation, written apart from it.

use drivescope_drive::drive::LogStart;
use drivescope_drive::frames::exp_rotation;
use drivescope_drive::geodesy::Geodetic;
use drivescope_drive::signals::{Gnss, Imu, Wheels};
use nalgebra::Vector3;

use super::*;
use crate::ins::tests::{Truth, inertial_sample, winding_drive};
use crate::ins::{Earth, Navigation};

/// Normal deviates by Box and Muller from a splitmix generator.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    pub(super) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
    pub(super) fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal()) * sigma
    }
}

pub(super) const ORIGIN: Geodetic = Geodetic { lat: 0.63, lon: 2.2, alt: 50.0 };
pub(super) const START: LogStart = LogStart { imu_step: 0.01, origin: Some(ORIGIN), ..LogStart::UNKNOWN };
pub(super) const DT: f64 = 0.01;

pub(super) fn params() -> GnssInsParams {
    GnssInsParams { odometer: false, nhc: false, zupt: false, zaru: false, gate: false, ..GnssInsParams::default() }
}

pub(super) fn imu(force: Vector3<f64>, rate: Vector3<f64>) -> Imu {
    Imu { accel_x: force.x, accel_y: force.y, accel_z: force.z, gyro_x: rate.x, gyro_y: rate.y, gyro_z: rate.z }
}

/// A fix of the truth with the default sigmas times `noise`.
pub(super) fn fix(truth: &Truth, noise: &mut Noise, scale: f64) -> Gnss {
    let p = GnssInsParams::default();
    let earth = Earth::at(&truth.place, GravityModel::Wgs84);
    let position = noise.vector(scale).component_mul(&Vector3::new(
        p.gnss_position_sigma,
        p.gnss_position_sigma,
        p.gnss_height_sigma,
    ));
    let step = earth.to_geodetic_step(&position);
    let velocity = truth.velocity
        + noise.vector(scale).component_mul(&Vector3::new(
            p.gnss_velocity_sigma,
            p.gnss_velocity_sigma,
            p.gnss_vertical_velocity_sigma,
        ));
    Gnss {
        lat: truth.place.lat + step.lat,
        lon: truth.place.lon + step.lon,
        alt: truth.place.alt + step.alt,
        v_north: velocity.x,
        v_east: velocity.y,
        v_down: velocity.z,
        ..Gnss::default()
    }
}

/// Feed a drive without noise; `lag` is how long before an inertial sample the fixes are, s.
fn clean_run(truth: &[Truth], lag: f64, params: &GnssInsParams) -> (GnssIns, Vec<GnssInsEstimate>) {
    let mut estimator = GnssIns::new(params, &VehicleParams::default(), &START);
    estimator.begin_at(0.0, truth[0].navigation());
    let mut rows = Vec::new();
    for (k, pair) in truth.windows(2).enumerate() {
        let time = (k + 1) as f64 * DT;
        let gnss = ((k + 1) % 100 == 0).then(|| {
            let share = lag / DT;
            let mut at = pair[1];
            at.place.lat -= (pair[1].place.lat - pair[0].place.lat) * share;
            at.place.lon -= (pair[1].place.lon - pair[0].place.lon) * share;
            at.place.alt -= (pair[1].place.alt - pair[0].place.alt) * share;
            at.velocity -= (pair[1].velocity - pair[0].velocity) * share;
            fix(&at, &mut Noise(1), 0.0)
        });
        if lag > 0.0 && gnss.is_some() {
            assert_eq!(estimator.step(&Epoch { time: time - lag, gnss, ..Epoch::default() }), Ok(None));
        }
        let (force, rate) = inertial_sample(&pair[0], &pair[1], DT);
        let epoch = Epoch { time, imu: Some(imu(force, rate)), gnss: gnss.filter(|_| lag == 0.0), ..Epoch::default() };
        rows.push(estimator.step(&epoch).unwrap().unwrap());
    }
    (estimator, rows)
}

/// A fix 6 ms before an inertial sample is 0.1 m behind at 20 m/s; carried on, it leaves no error along the track.
#[test]
fn a_fix_between_inertial_samples_is_carried_on_to_the_next() {
    let truth = winding_drive(30.0, DT);
    let (_, rows) = clean_run(&truth, 0.006, &params());
    let (_, same) = clean_run(&truth, 0.0, &params());
    let worst = |rows: &[GnssInsEstimate]| {
        (rows.iter().zip(&truth[1..]))
            .map(|(row, truth)| {
                let here = Geodetic { lat: row.lat, lon: row.lon, alt: row.alt };
                Earth::at(&here, GravityModel::Wgs84).displacement(&truth.place, &here).norm()
            })
            .fold(0.0, f64::max)
    };
    assert!(rows.iter().filter(|r| r.position_accepted == 1.0).count() == 30);
    assert!(worst(&same) < 1e-6 && worst(&rows) < 2e-3, "{} {}", worst(&same), worst(&rows));
}

/// Antenna and odometer away from the sensor: with their lever arms told, clean data leave no error; untold, they do.
#[test]
fn lever_arms_are_taken_into_account() {
    let truth = winding_drive(30.0, DT);
    let arm = Vector3::new(1.5, -0.4, -1.1);
    let shifted: Vec<Truth> = truth
        .iter()
        .enumerate()
        .map(|(k, t)| {
            // The rate over the step that ends here, as the sensor gives it.
            let last = &truth[k.saturating_sub(1)];
            let rate = drivescope_drive::frames::log_rotation(&(last.rotation.transpose() * t.rotation)) / DT;
            let step = Earth::at(&t.place, GravityModel::Wgs84).to_geodetic_step(&(t.rotation * arm));
            let place =
                Geodetic { lat: t.place.lat + step.lat, lon: t.place.lon + step.lon, alt: t.place.alt + step.alt };
            Truth { place, velocity: t.velocity + t.rotation * rate.cross(&arm), rotation: t.rotation }
        })
        .collect();
    let final_error = |params: &GnssInsParams| {
        let mut estimator = GnssIns::new(params, &VehicleParams::default(), &START);
        estimator.begin_at(0.0, truth[0].navigation());
        for (k, pair) in truth.windows(2).enumerate() {
            let (force, rate) = inertial_sample(&pair[0], &pair[1], DT);
            let gnss = ((k + 1) % 100 == 0).then(|| fix(&shifted[k + 1], &mut Noise(1), 0.0));
            let time = (k + 1) as f64 * DT;
            estimator.step(&Epoch { time, imu: Some(imu(force, rate)), gnss, ..Epoch::default() }).unwrap();
        }
        let end = truth[truth.len() - 1];
        let earth = Earth::at(&end.place, GravityModel::Wgs84);
        estimator.filter().unwrap().state.navigation.errors_against(&end.navigation(), &earth).fixed_rows::<3>(0).norm()
    };
    let told = GnssInsParams { antenna_x: arm.x, antenna_y: arm.y, antenna_z: arm.z, ..params() };
    assert!(final_error(&told) < 0.01, "{}", final_error(&told));
    assert!(final_error(&params()) > 0.5);
}

/// Hostile samples in any order must neither panic nor put a value that is not finite into the state.
#[test]
fn hostile_input_never_panics_and_never_enters_the_state() {
    let values = [f64::NAN, f64::INFINITY, -1e300, 1e9, 0.0, -5.0, 300.0, 1.0];
    let mut noise = Noise(7);
    let mut pick = |usual: f64| if noise.uniform() < 0.03 { values[(noise.uniform() * 8.0) as usize] } else { usual };
    let mut estimator = GnssIns::new(&GnssInsParams::default(), &VehicleParams::default(), &START);
    let mut time = 0.0;
    for k in 0..20_000 {
        time += if k % 3001 == 3000 {
            7.0
        } else if k % 997 == 996 {
            1.5
        } else {
            DT
        };
        let speed = if k < 300 { 0.0 } else { 10.0 };
        let sample = imu(Vector3::new(pick(0.0), pick(0.0), pick(-9.8)), Vector3::new(pick(0.0), pick(0.0), pick(0.0)));
        let gnss = (k % 100 == 0).then(|| Gnss {
            lat: pick(0.6 + if k < 300 { 0.0 } else { 10.0 * (time - 3.0) / 6.36e6 }),
            lon: pick(2.0),
            alt: pick(30.0),
            v_north: pick(speed),
            v_east: pick(0.0),
            v_down: pick(0.0),
            std_north: pick(1.0),
            ..Gnss::default()
        });
        let wheels = Some(Wheels { speed: pick(speed), ..Wheels::default() });
        let epoch = Epoch { time, imu: Some(sample), gnss, wheels, ..Epoch::default() };
        let Ok(row) = estimator.step(&epoch) else { return };
        let Some(row) = row else { continue };
        for value in [row.lat, row.alt, row.v_north, row.roll, row.accel_bias_x, row.north_sigma, row.gyro_bias_z_sigma]
        {
            assert!(value.is_finite(), "{row:?}");
        }
    }
    assert!(estimator.notices().list().len() >= 3, "holes and bad values are counted: {:?}", estimator.notices());
}

/// A hole of 8 s in every sensor: velocity, attitude and position are admitted to be unknown, and found again by the satellites.
#[test]
fn after_a_long_hole_the_filter_finds_itself_again() {
    let truth = winding_drive(60.0, DT);
    let mut estimator = GnssIns::new(&GnssInsParams { gate: true, ..params() }, &VehicleParams::default(), &START);
    estimator.begin_at(0.0, truth[0].navigation());
    let mut refused = 0;
    for (k, pair) in truth.windows(2).enumerate().filter(|(k, _)| !(2000..2800).contains(k)) {
        let (force, rate) = inertial_sample(&pair[0], &pair[1], DT);
        let gnss = ((k + 1) % 100 == 0).then(|| fix(&pair[1], &mut Noise(1), 0.0));
        let epoch = Epoch { time: (k + 1) as f64 * DT, imu: Some(imu(force, rate)), gnss, ..Epoch::default() };
        let row = estimator.step(&epoch).unwrap().unwrap();
        assert!(k != 2805 || row.yaw.is_nan() && row.north_sigma > 30.0, "{row:?}");
        refused += u32::from(row.position_accepted == 0.0);
    }
    let end = truth[truth.len() - 1].navigation();
    let earth = Earth::at(&end.place, GravityModel::Wgs84);
    let errors = estimator.filter().unwrap().state.navigation.errors_against(&end, &earth);
    assert!(refused == 0 && errors.fixed_rows::<3>(0).norm() < 0.5 && errors[8].abs() < 0.02, "{refused} {errors}");
    assert_eq!(estimator.notices().list().len(), 2);
}

/// A filter that is surer of a wrong velocity than it may be must not refuse for ever that its car stands: it drifted on beside
/// the truth through a stop of 7 s in a garage. For 2 s it may: wheels that lock read zero too.
#[test]
fn a_standing_car_is_believed_after_two_seconds_of_refused_zero_velocities() {
    let p = GnssInsParams {
        initial_velocity_sigma: 0.001,
        initial_tilt_sigma: 1e-4,
        initial_accel_bias_sigma: 1e-3,
        accel_noise: 1e-4,
        ..GnssInsParams::default()
    };
    let mut estimator = GnssIns::new(&p, &VehicleParams::default(), &START);
    let earth = Earth::at(&ORIGIN, GravityModel::Wgs84);
    let velocity = Vector3::new(0.3, 0.0, -0.2);
    estimator.begin_at(0.0, Navigation { place: ORIGIN, velocity, body_to_nav: nalgebra::Matrix3::identity() });
    let (mut verdicts, mut speed) = (Vec::new(), 0.0);
    for k in 1..=400 {
        let sample = imu(Vector3::new(0.0, 0.0, -earth.gravity), Vector3::zeros());
        let wheels = Some(Wheels { speed: 0.0, ..Wheels::default() });
        let epoch = Epoch { time: f64::from(k) * DT, imu: Some(sample), wheels, ..Epoch::default() };
        let row = estimator.step(&epoch).unwrap().unwrap();
        verdicts.extend(Some(row.zupt_accepted).filter(|v| v.is_finite()));
        speed = row.v_north.hypot(row.v_down);
    }
    assert!(verdicts[..20].iter().all(|v| *v == 0.0) && verdicts[20..].iter().all(|v| *v == 1.0), "{verdicts:?}");
    assert!(speed < 0.01, "{speed}");
}

/// Nothing may happen, not even time, in an epoch of sensors that the filter does not use.
#[test]
fn an_epoch_without_a_used_sensor_changes_nothing() {
    let truth = winding_drive(2.0, DT);
    let (mut estimator, _) = clean_run(&truth, 0.0, &params());
    let before = format!("{estimator:?}");
    let epoch = Epoch { time: 2.005, mag: Some(drivescope_drive::signals::Mag::default()), ..Epoch::default() };
    assert_eq!(estimator.step(&epoch), Ok(None));
    assert_eq!(format!("{estimator:?}"), before);
}

/// A car that is turned by `yaw` and rolls backward out of its parking space must be aligned against its course.
#[test]
fn a_car_that_backs_out_is_aligned_against_its_course() {
    let mut estimator = GnssIns::new(&GnssInsParams::default(), &VehicleParams::default(), &START);
    let place = Geodetic { lat: 0.6, lon: 2.0, alt: 30.0 };
    let earth = Earth::at(&place, GravityModel::Wgs84);
    let mut yaw = f64::NAN;
    for k in 0..1200 {
        let t = k as f64 * DT;
        let v = -(t - 5.0).clamp(0.0, 2.0);
        let accel = if (5.0..7.0).contains(&t) { -1.0 } else { 0.0 };
        let back = (5.0 - t).clamp(-2.0, 0.0).powi(2) * 0.5 + 2.0 * (t - 7.0).max(0.0);
        let gnss = (k % 100 == 0).then(|| Gnss {
            lat: place.lat - back / earth.north_radius,
            lon: place.lon,
            alt: place.alt,
            v_north: v,
            v_east: 0.0,
            v_down: 0.0,
            ..Gnss::default()
        });
        let sample = imu(Vector3::new(accel, 0.0, -earth.gravity), Vector3::zeros());
        let wheels = Some(Wheels { speed: v, ..Wheels::default() });
        let epoch = Epoch { time: t, imu: Some(sample), gnss, wheels, ..Epoch::default() };
        if let Some(row) = estimator.step(&epoch).unwrap() {
            yaw = row.yaw;
        }
    }
    assert!(yaw.abs() < 0.02, "the car looks north while it moves south: {yaw}");
}

/// An attitude error of the truth's own rotation must not matter: the filter's frame is the body's.
#[test]
fn a_start_error_in_yaw_is_found_from_the_manoeuvres() {
    let truth = winding_drive(60.0, DT);
    let mut start = truth[0].navigation();
    start.body_to_nav = exp_rotation(&Vector3::new(0.0, 0.0, 0.1)) * start.body_to_nav;
    let mut estimator = GnssIns::new(&params(), &VehicleParams::default(), &START);
    estimator.begin_at(0.0, start);
    for (k, pair) in truth.windows(2).enumerate() {
        let (force, rate) = inertial_sample(&pair[0], &pair[1], DT);
        let gnss = ((k + 1) % 100 == 0).then(|| fix(&pair[1], &mut Noise(1), 0.0));
        let time = (k + 1) as f64 * DT;
        estimator.step(&Epoch { time, imu: Some(imu(force, rate)), gnss, ..Epoch::default() }).unwrap();
    }
    let end: Navigation = truth[truth.len() - 1].navigation();
    let earth = Earth::at(&end.place, GravityModel::Wgs84);
    let errors = estimator.filter().unwrap().state.navigation.errors_against(&end, &earth);
    assert!(errors[8].abs() < 0.01, "{errors}");
}
