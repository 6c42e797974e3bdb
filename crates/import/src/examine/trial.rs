//! Trying a mapping on a log: what a person sees who changes the mapping by hand.
//!
//! The raw columns are thinned once; every change of the mapping is then tried on them without reading the file again.

use super::clash::{Clash, clashes};
use super::reading::Reading;
use super::thinned::Thinned;
use crate::error::ImportError;
use crate::mapping::Mapping;

/// What a mapping makes of a log, and where it contradicts itself.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// Contradictions, the most basic first.
    pub clashes: Vec<Clash>,
    /// The series of [`TRIAL_SERIES`], in their order; all have one value per bin.
    pub series: Vec<Vec<f64>>,
}

/// Series of a trial; SI units and the frames of a drive. The first three are what the inertial sensors say, those that
/// are `expected` and over ground what the rest says of the same.
pub const TRIAL_SERIES: [&str; 17] = [
    "roll",
    "pitch",
    "turned",
    "accel_x",
    "accel_y",
    "accel_z",
    "gyro_z",
    "north",
    "east",
    "speed",
    "expected_x",
    "expected_y",
    "expected_turn",
    "course",
    "grade",
    "compass",
    "ground_speed",
];

/// Try a mapping on a thinned log: its motion, and what contradicts it.
///
/// # Errors
/// Those of [`Mapping::validate`].
pub fn try_out(thin: &Thinned, mapping: &Mapping) -> Result<Trial, ImportError> {
    mapping.validate("mapping.json")?;
    let r = Reading::new(thin, mapping);
    let clashes = clashes(thin, mapping, &r);
    let none = || vec![f64::NAN; r.bins];
    let ([roll, pitch, turned], [expected_x, expected_y], compass) = (r.attitude(), r.expected(), r.compass());
    let Reading { force: [ax, ay, az], rates: [_, _, gz], place: [north, east], ground, speed, grade, .. } = r;
    let speed = speed.unwrap_or_else(none);
    let [ground_speed, course, expected_turn] = ground.unwrap_or_else(|| [none(), none(), none()]);
    let series = vec![
        roll,
        pitch,
        turned,
        ax,
        ay,
        az,
        gz,
        north,
        east,
        speed,
        expected_x,
        expected_y,
        expected_turn,
        course,
        grade,
        compass,
        ground_speed,
    ];
    Ok(Trial { clashes, series })
}

#[cfg(test)]
mod tests {
    use drivescope_drive::frames::wrap_angle;
    use drivescope_drive::geodesy::STANDARD_GRAVITY;

    use super::super::scene::STEP;
    use super::*;
    use crate::mapping::{SignalSource, TimeSource};

    const BINS: usize = 1200;

    /// A car that circles, brakes and speeds up, 10 samples a second; columns are named as the signals.
    fn driven() -> Thinned {
        let names = [
            "accel_x", "accel_y", "accel_z", "gyro_x", "gyro_y", "gyro_z", "speed", "gnss_vn", "gnss_ve", "mag_x",
            "mag_y", "mag_z",
        ];
        let mut columns = vec![Vec::new(); names.len()];
        let mut yaw: f64 = 0.3;
        for i in 0..BINS {
            let t = i as f64 * STEP;
            let (v, change) = (15.0 + 5.0 * (0.2 * t).sin(), (0.2 * t).cos());
            let rate = 0.2 * (0.13 * t).sin() + 0.1;
            let noise = |k: f64| 0.05 * (k * 1.9 * i as f64 + k).sin();
            let field = [20.0 * yaw.cos(), -20.0 * yaw.sin(), 43.0];
            let values = [
                change + noise(1.0),
                v * rate + noise(2.0),
                -STANDARD_GRAVITY + noise(3.0),
                0.01 * noise(4.0),
                0.01 * noise(5.0),
                rate + 0.01 * noise(6.0),
                v,
                v * yaw.cos(),
                v * yaw.sin(),
                field[0],
                field[1],
                field[2],
            ];
            columns.iter_mut().zip(values).for_each(|(c, v)| c.push(v));
            yaw += rate * STEP;
        }
        Thinned { names: names.map(String::from).to_vec(), start: 0.0, columns }
    }

    fn plain(thin: &Thinned) -> Mapping {
        let time =
            TimeSource { column: "t".into(), unit: "s".into(), offset: 0.0, fraction: None, skip_steps_back: false };
        let mut mapping = Mapping::of(time);
        for name in &thin.names {
            mapping.signals.insert(name.clone(), SignalSource::plain(name));
        }
        mapping
    }

    fn corrected(mapping: &mut Mapping, clash: &Clash) {
        for c in &clash.corrections {
            let source = mapping.signals.get_mut(&c.signal).unwrap();
            (source.unit, source.scale) = (Some(c.unit.clone()), c.scale);
        }
    }

    /// Catches a check that cries wolf: its sign convention is not the drive's.
    #[test]
    fn a_drive_in_canonical_columns_contradicts_nothing() {
        let thin = driven();
        let clashes = try_out(&thin, &plain(&thin)).unwrap().clashes;
        assert!(clashes.is_empty(), "{clashes:#?}");
    }

    /// Catches a contradiction that is not seen, that blames another column, or whose correction does not put it right.
    #[test]
    fn every_wrong_sign_and_unit_is_told_and_put_right() {
        let thin = driven();
        let wrong = [
            ("accel_x", None, -1.0),
            ("accel_y", None, -1.0),
            ("accel_z", None, -1.0),
            ("gyro_z", None, -1.0),
            ("gyro_z", Some("deg/s"), 1.0),
            ("gyro_z", Some("deg/s"), -1.0),
            ("speed", Some("km/h"), 1.0),
            ("speed", Some("mph"), -1.0),
            ("mag_y", None, -1.0),
        ];
        for (name, unit, scale) in wrong {
            let mut mapping = plain(&thin);
            let source = mapping.signals.get_mut(name).unwrap();
            (source.unit, source.scale) = (unit.map(String::from), scale);
            let found = try_out(&thin, &mapping).unwrap().clashes;
            let [clash] = &found[..] else { panic!("{name} {unit:?} {scale}: {found:#?}") };
            assert_eq!(clash.columns, [name]);
            assert!(clash.text.contains(|c: char| c.is_ascii_digit()), "{}", clash.text);
            corrected(&mut mapping, clash);
            let left = try_out(&thin, &mapping).unwrap().clashes;
            // The unit of a sensor is that of its three axes; these were right before.
            let left: Vec<_> = left.iter().filter(|c| c.signals == [name]).collect();
            assert!(left.is_empty(), "{name} {unit:?} {scale}: {left:#?}");
        }
    }

    /// Catches units of a whole triad that are corrected one axis at a time, and a compass that points backwards.
    #[test]
    fn a_triad_in_another_unit_is_put_right_as_a_whole() {
        let thin = driven();
        for (names, unit, scale) in
            [(["accel_x", "accel_y", "accel_z"], "g", 1.0), (["mag_x", "mag_y", "mag_z"], "nT", 1.0)]
        {
            let mut mapping = plain(&thin);
            for name in names {
                let source = mapping.signals.get_mut(name).unwrap();
                (source.unit, source.scale) = (Some(unit.into()), scale);
            }
            let found = try_out(&thin, &mapping).unwrap().clashes;
            corrected(&mut mapping, &found[0]);
            assert!(try_out(&thin, &mapping).unwrap().clashes.is_empty(), "{found:#?}");
        }
        let mut mapping = plain(&thin);
        for name in ["mag_x", "mag_y"] {
            mapping.signals.get_mut(name).unwrap().scale = -1.0;
        }
        let found = try_out(&thin, &mapping).unwrap().clashes;
        assert_eq!(found[0].columns, ["mag_x", "mag_y"]);
    }

    /// Catches a circle at one speed whose lateral force is on the wrong side and correlates with nothing.
    #[test]
    fn a_sensor_that_looks_backwards_in_a_steady_circle_is_turned_round() {
        let mut thin = driven();
        let (v, rate) = (7.0, 0.25);
        for i in 0..BINS {
            let yaw = rate * i as f64 * STEP;
            let noise = 0.2 * (1.7 * i as f64).sin();
            let values = [noise, -v * rate + noise, -STANDARD_GRAVITY, 0.0, 0.0, rate, v, v * yaw.cos(), v * yaw.sin()];
            thin.columns.iter_mut().zip(values).for_each(|(c, v)| c[i] = v);
            (thin.columns[9][i], thin.columns[10][i]) = (20.0 * yaw.cos(), -20.0 * yaw.sin());
        }
        let mut mapping = plain(&thin);
        let found = try_out(&thin, &mapping).unwrap().clashes;
        let [clash] = &found[..] else { panic!("{found:#?}") };
        assert_eq!(clash.columns, ["accel_y"]);
        corrected(&mut mapping, clash);
        assert_eq!(["accel_x", "accel_y", "accel_z"].map(|n| mapping.signals[n].scale), [-1.0, -1.0, 1.0]);
        assert!(try_out(&thin, &mapping).unwrap().clashes.is_empty());
    }

    /// Catches an attitude whose pitch or roll has the wrong sign: uphill the nose is up, and the body turns with the gyro.
    #[test]
    fn the_car_leans_and_turns_as_its_sensors_say() {
        let mut thin = driven();
        let (up, right) = (0.1_f64, 0.05_f64);
        for i in 0..BINS {
            thin.columns[0][i] += STANDARD_GRAVITY * up.sin();
            thin.columns[1][i] -= STANDARD_GRAVITY * right.sin();
        }
        let trial = try_out(&thin, &plain(&thin)).unwrap();
        let of = |name: &str| &trial.series[TRIAL_SERIES.iter().position(|n| *n == name).unwrap()];
        assert!((of("pitch")[600] - up).abs() < 0.03 && (of("roll")[600] - right).abs() < 0.03);
        let turned = of("turned")[600] - of("turned")[400];
        let course = wrap_angle(of("course")[600] - of("course")[400]);
        assert!(wrap_angle(turned - course).abs() < 0.05, "{turned} {course}");
    }
}
