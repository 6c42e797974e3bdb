//! Real magnetometers: two cars driven in circles (vn100_circles) are calibrated without a hint and held against GNSS.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use drivescope_drive::channel::Channel;
use drivescope_drive::drive::Drive;
use drivescope_drive::frames::wrap_angle;
use drivescope_drive::signals::Mag;
use drivescope_estimation::magnetometer_calibration::{
    Examination, Kind, Refusal, SectorError, examine, field_along_road, shift_gnss, turn_sensor,
};
use drivescope_estimation::orientation::{OrientationParams, reference_of};
use drivescope_import::{CsvReader, Mapping, open_table};
use drivescope_tests::{bytes, open, rms, shared};

const CAR_1: [&str; 2] = ["data/vn100_circles/circle_data_0_imu.csv", "data/vn100_circles/circle_data_0_gps.csv"];
const CAR_2: &str = "data/vn100_circles/car2/data_going_in_circles.csv";
/// The second car's rows of GNSS have a clock of their own.
const CAR_2_GNSS: &str = r#"{"version": 1,
    "time": {"column": "timestamp_sec_gps", "unit": "s", "fraction": {"column": "timestamp_nanosec_gps", "unit": "ns"}},
    "signals": {"gnss_lat": {"column": "latitude", "unit": "deg"}, "gnss_lon": {"column": "longitude", "unit": "deg"},
        "gnss_alt": {"column": "altitude", "unit": "m"}}}"#;

fn first_car() -> Option<Drive> {
    let [imu, gnss] = CAR_1.map(shared);
    let mut drive = open(&imu?);
    drive.gnss = open(&gnss?).gnss;
    Some(drive)
}

fn second_car() -> Option<Drive> {
    let path = shared(CAR_2)?;
    let mut drive = open(&path);
    drive.gnss = open_mapped(&path, CAR_2_GNSS).gnss;
    Some(drive)
}

fn open_mapped(path: &Path, mapping: &str) -> Drive {
    let mut reader = CsvReader::new("log.csv");
    reader.feed(&bytes(path)).unwrap();
    open_table(reader.finish().unwrap(), Some(&Mapping::from_json(mapping, "m.json").unwrap())).unwrap().0
}

fn examined(drive: &Drive) -> Examination {
    let (earth, notices) = reference_of(drive, &OrientationParams::default());
    assert!(notices.list().is_empty(), "place and date are in the log: {notices:?}");
    // Boston: dip 66 deg, declination -14 deg.
    assert!((earth.norm() - 51.2).abs() < 0.3 && (earth.y.atan2(earth.x).to_degrees() + 14.0).abs() < 0.2, "{earth}");
    examine(drive, &earth)
}

/// What is asked of both cars; heading against course at most `limit` deg RMS once calibrated.
fn check(drive: &Drive, limit: f64, mount_deg: f64) {
    let e = examined(drive);
    let (before, after) = (e.before.clone().unwrap(), e.after.clone().unwrap());
    assert_eq!(e.quality.kind, Some(Kind::Planar), "{:?}", e.quality);
    assert_eq!(e.quality.sectors, 12);
    // Raw, the heading disagrees with the course, and that is said without being asked.
    assert!(before.consistency.plain < 0.6 && before.consistency.balanced < 0.6, "{:?}", before.consistency);
    assert!(e.warning.as_ref().is_some_and(|w| w.contains("needs calibrating")), "{:?}", e.warning);
    let rms = after.rms.to_degrees();
    println!("heading against course {rms:.2} deg RMS, raw consistency {:.2}", before.consistency.plain);
    assert!(rms <= limit && after.consistency.plain > 0.99, "{rms:.2} deg {:?}", after.consistency);
    // The mount: the first car's sensor looks backwards, which its accelerometer in the turns says too.
    let mount = wrap_angle(after.mount_yaw - mount_deg.to_radians()).to_degrees();
    assert!(mount.abs() < 10.0, "mount {:.1} deg", after.mount_yaw.to_degrees());
    for sector in &after.sectors {
        assert!(sector.points > 0 && sector.rms.to_degrees() < 4.0 * limit, "{sector:?}");
    }
    let worst = |sectors: &[SectorError]| sectors.iter().map(|s| s.rms.to_degrees()).fold(0.0, f64::max);
    assert!(worst(&before.sectors) > 5.0 * worst(&after.sectors));

    // Applied to the drive, everything agrees and nothing is left to say.
    let (calibration, mut drive) = (e.calibration.clone().unwrap(), drive.clone());
    calibration.apply(&mut drive).unwrap();
    turn_sensor(&mut drive, after.mount_yaw).unwrap();
    shift_gnss(&mut drive, e.clock_offset()).unwrap();
    let again = examined(&drive);
    let now = again.before.clone().unwrap();
    // A calibrated sensor needs no second calibration; the search for the clock ends on the same spot.
    assert!(again.warning.is_none() && again.clock_offset().abs() < 0.1, "{:?} {:?}", again.warning, again.clock);
    assert!(now.mount_yaw.abs() < 0.02 && (now.rms.to_degrees() - rms).abs() < 0.3, "{now:?}");
    assert!(again.quality.gain.iter().all(|g| (g - 1.0).abs() < 0.05), "{:?}", again.quality);
}

#[test]
fn the_first_car_is_calibrated_without_a_hint() {
    let Some(drive) = first_car() else { return };
    check(&drive, 6.0, 180.0);
}

#[test]
fn the_second_car_is_calibrated_without_a_hint() {
    let Some(drive) = second_car() else { return };
    check(&drive, 9.0, 0.0);
    // Its receiver's clock is almost five seconds behind; standing, straights and circles tell it to a few tenths.
    let clock = examined(&drive).clock.unwrap();
    assert!((clock.offset - 4.75).abs() < 0.3 && clock.sigma < 0.3, "{clock:?}");
}

#[test]
fn a_receiver_on_the_sensors_clock_is_found_to_be_so() {
    let mut drive = drivescope_tests::built_in(300.0, 4);
    let (earth, _) = reference_of(&drive, &OrientationParams::default());
    let found = |drive: &Drive| examine(drive, &earth).clock_offset();
    let offset = found(&drive);
    // The antenna's lever over the speed, 1.7 m at 8 m/s, is 0.2 s if it is not told from the clock.
    assert!(offset.abs() < 0.18, "{offset:.3} s");
    shift_gnss(&mut drive, -3.3).unwrap();
    assert!((found(&drive) - offset - 3.3).abs() < 0.05, "{:.3} s", found(&drive));
    assert!(examine(&drive, &earth).warning.is_none());
}

#[test]
fn an_axis_with_the_wrong_sign_is_refused_though_its_ellipse_is_perfect() {
    let Some(mut drive) = first_car() else { return };
    let mut mirrored = Channel::default();
    for (time, m) in drive.mag.iter() {
        mirrored.push(time, Mag { mag_y: -m.mag_y, ..m }).unwrap();
    }
    drive.mag = mirrored;
    let e = examined(&drive);
    assert!(matches!(e.refusal, Some(Refusal::Course { consistency, .. }) if consistency < 0.5), "{:?}", e.refusal);
    assert!(e.calibration.is_none() && e.quality.residual_relative < 0.1);
}

#[test]
fn the_field_along_the_road_comes_to_the_model_once_calibrated() {
    let Some(drive) = first_car() else { return };
    let e = examined(&drive);
    let earth = e.earth.into();
    let deviation = |calibration| {
        let series = field_along_road(&drive, calibration, &earth, drive.date()).unwrap();
        let (norm, model) = (series.column("field_norm").unwrap(), series.column("field_norm_model").unwrap());
        let (dip, dip_model) = (series.column("dip").unwrap(), series.column("dip_model").unwrap());
        assert!((dip_model[0].to_degrees() - 66.2).abs() < 0.3 && (model[0] - 51.2).abs() < 0.3);
        let late = series.len() / 10..series.len();
        let strength = rms(late.clone().map(|i| norm[i] - model[i]));
        (strength, rms(late.map(|i| (dip[i] - dip_model[i]).to_degrees())))
    };
    let (raw, calibrated) = (deviation(None), deviation(e.calibration.as_ref()));
    // 4 % of the horizontal part remain, and 5 deg of dip where the car leans and the turn pulls on the accelerometer.
    assert!(raw.0 > 4.0 && calibrated.0 < 2.0, "{raw:?} {calibrated:?}");
    assert!(raw.1 > 10.0 && calibrated.1 < 8.0, "{raw:?} {calibrated:?}");
}

#[test]
fn a_straight_motorway_is_refused_with_its_figures() {
    let Some(path) = shared("data/comma2k19_rav4/canonical.csv") else { return };
    let drive = open(&path);
    let (earth, notices) = reference_of(&drive, &OrientationParams::default());
    // California: dip 61 deg, declination 13 deg east; the log has no date, which is said.
    assert!((earth.y.atan2(earth.x).to_degrees() - 13.0).abs() < 1.0, "{earth}");
    assert!(notices.list()[0].text.contains("no date"), "{notices:?}");
    let e = examine(&drive, &earth);
    assert!(e.calibration.is_none() && e.after.is_none());
    assert!(matches!(e.refusal, Some(Refusal::Coverage { sectors: 1..=2, .. })), "{:?}", e.refusal);
    assert!(e.refusal_text.unwrap().contains("of 12 sectors of heading"));
    // The straight cannot show an inconsistent heading, but its phone reads three times the Earth's field.
    assert!(e.warning.as_ref().is_some_and(|w| w.contains("differs by")), "{:?}", e.warning);
}

#[test]
fn a_simulated_drive_meets_the_field_it_was_simulated_in_also_after_a_file() {
    let drive = drivescope_tests::built_in(20.0, 3);
    let mut text = Vec::new();
    drivescope_drive::csv::write_drive(&drive, &mut text).unwrap();
    let read = drivescope_tests::open_bytes("drive.csv", &text);
    for drive in [&drive, &read] {
        let (earth, _) = reference_of(drive, &OrientationParams::default());
        let simulated = nalgebra::Vector3::from(drivescope_simulation::motion::DAEJEON_FIELD);
        // Rounded to 1e-4 uT; the drive begins at the place of the constant.
        assert!((earth - simulated).amax() < 2e-4, "{earth}");
    }
}
