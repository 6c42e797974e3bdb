//! Faults put into a recorded drive: what would have been measured with a sensor that fails.
//!
//! A fault changes measurements only; truth stays. The same fault on the same drive gives the same values, bit for bit: random
//! numbers come from its seed.

use serde_json::Value;

use crate::channel::Series;
use crate::drive::Drive;
use crate::geodesy::radii;

/// Widest hole across which a delayed value is interpolated, s.
const WIDEST_HOLE: f64 = 2.0;

/// What fails, when, and how.
///
/// ```
/// use drivescope_drive::fault::Fault;
/// let text = r#"{"kind": "bias", "signal": "gyro_z", "amount": 0.01, "from": 60, "to": 90}"#;
/// let fault = Fault::from_json(&serde_json::from_str(text)?)?;
/// assert_eq!(fault.to, 90.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// How it fails.
    pub kind: FaultKind,
    /// Begin, s.
    pub from: f64,
    /// End, s; measurements at this instant are good again.
    pub to: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// How a sensor fails. A `signal` is a column (`gyro_z`) or all columns of a channel, by its name in a drive's summary (`gnss`).
#[derive(Clone, Debug, PartialEq)]
pub enum FaultKind {
    /// A step is added.
    Bias {
        /// Column or channel.
        signal: String,
        /// Step, in the unit of the column.
        amount: f64,
    },
    /// The last good value stays.
    Freeze {
        /// Column or channel.
        signal: String,
    },
    /// Every value comes late.
    Delay {
        /// Column or channel.
        signal: String,
        /// By how much, s.
        seconds: f64,
    },
    /// The noise is `factor` times what it was: white noise is added to what the record holds.
    Noise {
        /// Column or channel.
        signal: String,
        /// At least 1.
        factor: f64,
    },
    /// The receiver clock jumps: all ranges are longer.
    ClockJump {
        /// Jump, m.
        metres: f64,
    },
    /// Some satellites are received by a detour: each of their ranges is longer, the second by 1.4, the third by 1.8 times this. A
    /// fix moves by `metres` to a side drawn from the seed.
    Multipath {
        /// Detour of the first satellite, m.
        metres: f64,
        /// How many satellites.
        satellites: usize,
    },
}

/// A fault that the drive cannot have.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum FaultError {
    /// No column and no channel has this name, or it has no value.
    #[error("there is no signal `{0}` in this drive that could fail")]
    NoSignal(String),
    /// The fault concerns ranges or fixes, and there are none.
    #[error("this drive has no {0} that could fail")]
    NoSatellites(&'static str),
    /// The description of a fault lacks something, or has it of another kind.
    #[error("a fault needs its {field}: {expected}")]
    Description {
        /// Which field.
        field: &'static str,
        /// What is expected.
        expected: &'static str,
    },
    /// A number makes no sense.
    #[error("{what} of a fault is {value}; {expected}")]
    Amount {
        /// Which number.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What is expected.
        expected: &'static str,
    },
}

impl Fault {
    /// From an object: `kind` (`bias`, `freeze`, `delay`, `noise`, `clock_jump`, `multipath`), `from`, `to`, `seed` (0 where it is
    /// not given), and what the kind needs: `signal`, `amount`, `seconds`, `factor`, `metres`, `satellites`.
    ///
    /// # Errors
    /// [`FaultError::Description`].
    pub fn from_json(object: &Value) -> Result<Self, FaultError> {
        // By hand: what serde derives for tagged enums weighs more in the page than all faults.
        let missing = |field, expected| FaultError::Description { field, expected };
        let number = |field: &'static str| object[field].as_f64().ok_or(missing(field, "a number"));
        let signal = || object["signal"].as_str().map(str::to_owned).ok_or(missing("signal", "the name of a signal"));
        let kind = match object["kind"].as_str() {
            Some("bias") => FaultKind::Bias { signal: signal()?, amount: number("amount")? },
            Some("freeze") => FaultKind::Freeze { signal: signal()? },
            Some("delay") => FaultKind::Delay { signal: signal()?, seconds: number("seconds")? },
            Some("noise") => FaultKind::Noise { signal: signal()?, factor: number("factor")? },
            Some("clock_jump") => FaultKind::ClockJump { metres: number("metres")? },
            Some("multipath") => {
                FaultKind::Multipath { metres: number("metres")?, satellites: number("satellites")? as usize }
            }
            _ => return Err(missing("kind", "bias, freeze, delay, noise, clock_jump or multipath")),
        };
        let seed = object["seed"].as_f64().unwrap_or(0.0) as u64;
        Ok(Self { kind, from: number("from")?, to: number("to")?, seed })
    }

    /// Put this fault into a drive.
    ///
    /// # Errors
    /// [`FaultError`]; the drive is unchanged then.
    pub fn inject(&self, drive: &mut Drive) -> Result<(), FaultError> {
        if !(self.from.is_finite() && self.to > self.from) {
            return Err(amount("the end", self.to, "it is expected after the begin"));
        }
        match &self.kind {
            FaultKind::Bias { signal, amount: step } => {
                finite("the amount", *step)?;
                self.edit(drive, signal, |_, values, _| values.iter_mut().for_each(|v| *v += step))
            }
            FaultKind::Freeze { signal } => self.edit(drive, signal, |before, values, _| values.fill(before)),
            FaultKind::Delay { signal, seconds } => {
                if !(*seconds >= 0.0 && *seconds < 60.0) {
                    return Err(amount("the delay", *seconds, "0 to 60 s are expected"));
                }
                self.delay(drive, signal, *seconds)
            }
            FaultKind::Noise { signal, factor } => {
                if !(*factor >= 1.0 && *factor <= 1e6) {
                    return Err(amount("the factor", *factor, "at least 1 is expected: noise cannot be taken out"));
                }
                let scale = (factor * factor - 1.0).sqrt();
                self.edit(drive, signal, |_, values, random| {
                    let sigma = scale * white_noise(values);
                    values.iter_mut().for_each(|v| *v += sigma * random.normal());
                })
            }
            FaultKind::ClockJump { metres } => {
                finite("the jump", *metres)?;
                if drive.raw_gnss.is_empty() {
                    return Err(FaultError::NoSatellites("ranges of single satellites"));
                }
                drive.raw_gnss.change(self.from, self.to, |satellite| satellite.range += metres);
                Ok(())
            }
            FaultKind::Multipath { metres, satellites } => {
                finite("the detour", *metres)?;
                self.reflect(drive, *metres, *satellites)
            }
        }
    }

    /// Apply `change(value before, values inside, random numbers)` to every column that a signal names.
    fn edit(
        &self,
        drive: &mut Drive,
        signal: &str,
        mut change: impl FnMut(f64, &mut [f64], &mut Random),
    ) -> Result<(), FaultError> {
        let mut random = Random(self.seed);
        self.each(drive, signal, |series, index| {
            let (time, column) = series.column_mut(index);
            let begin = time.partition_point(|&t| t < self.from);
            let end = time.partition_point(|&t| t < self.to).max(begin);
            let before = column[..begin].iter().rev().find(|v| v.is_finite()).copied();
            let before = before.or(column[begin..end].first().copied()).unwrap_or(f64::NAN);
            change(before, &mut column[begin..end], &mut random);
        })
    }

    fn delay(&self, drive: &mut Drive, signal: &str, seconds: f64) -> Result<(), FaultError> {
        self.each(drive, signal, |series, index| {
            let begin = series.time().partition_point(|&t| t < self.from);
            let end = series.time().partition_point(|&t| t < self.to).max(begin);
            let late: Vec<f64> =
                series.time()[begin..end].iter().map(|t| series.interpolate(index, t - seconds, WIDEST_HOLE)).collect();
            series.column_mut(index).1[begin..end].copy_from_slice(&late);
        })
    }

    /// Every column with a value that a signal names; whether the receiver lets a fix be used is no measurement.
    fn each(
        &self,
        drive: &mut Drive,
        signal: &str,
        mut change: impl FnMut(&mut Series, usize),
    ) -> Result<(), FaultError> {
        let mut found = false;
        for (name, series) in drive.channels_mut() {
            for index in 0..series.schema().len() {
                let column = series.schema()[index].name;
                if (column == signal || name == signal) && column != "gnss_valid" && series.has(column) {
                    found = true;
                    change(series, index);
                }
            }
        }
        if found { Ok(()) } else { Err(FaultError::NoSignal(signal.into())) }
    }

    fn reflect(&self, drive: &mut Drive, metres: f64, satellites: usize) -> Result<(), FaultError> {
        if drive.raw_gnss.is_empty() && drive.gnss.is_empty() {
            return Err(FaultError::NoSatellites("satellites"));
        }
        let mut random = Random(self.seed);
        let bearing = std::f64::consts::TAU * random.uniform();
        let mut seen: Vec<u32> = Vec::new();
        drive.raw_gnss.change(self.from, self.to, |satellite| {
            if !seen.contains(&satellite.prn) {
                seen.push(satellite.prn);
            }
        });
        // The first of a shuffled sky.
        for place in 0..seen.len().min(satellites) {
            let other = place + (random.uniform() * (seen.len() - place) as f64) as usize;
            seen.swap(place, other);
        }
        seen.truncate(satellites);
        drive.raw_gnss.change(self.from, self.to, |satellite| {
            if let Some(place) = seen.iter().position(|prn| *prn == satellite.prn) {
                satellite.range += metres * (1.0 + 0.4 * place as f64);
            }
        });
        let (north, east) = (metres * bearing.cos(), metres * bearing.sin());
        let origin = drive.origin();
        let (meridian, transverse) = radii(origin.map_or(0.0, |o| o.lat));
        let cos_lat = origin.map_or(1.0, |o| o.lat.cos());
        let shifts = [
            ("gnss_lat", north / meridian),
            ("gnss_lon", east / (transverse * cos_lat)),
            ("gnss_n", north),
            ("gnss_e", east),
        ];
        for (column, shift) in shifts {
            // A receiver that gives the other kind of position is no error.
            let _ = self.edit(drive, column, |_, values, _| values.iter_mut().for_each(|v| *v += shift));
        }
        Ok(())
    }
}

/// Put several faults into a drive, one after the other.
///
/// # Errors
/// The first [`FaultError`]; the faults before it are in the drive.
pub fn inject(drive: &mut Drive, faults: &[Fault]) -> Result<(), FaultError> {
    faults.iter().try_for_each(|fault| fault.inject(drive))
}

fn amount(what: &'static str, value: f64, expected: &'static str) -> FaultError {
    FaultError::Amount { what, value, expected }
}

fn finite(what: &'static str, value: f64) -> Result<(), FaultError> {
    if value.is_finite() { Ok(()) } else { Err(amount(what, value, "a number is expected")) }
}

/// Sigma of the white noise of a column: median of the second differences over what it is for normal noise of sigma 1.
fn white_noise(values: &[f64]) -> f64 {
    let mut bends: Vec<f64> =
        values.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).filter(|v| v.is_finite()).collect();
    if bends.is_empty() {
        return 0.0;
    }
    crate::select::median(&mut bends) / (0.674_489_75 * 6f64.sqrt())
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Sum of twelve uniform numbers less six: mean 0, variance 1, the same bits on every machine.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::satellites::Satellite;
    use crate::signals::{Gnss, Imu};

    fn drive() -> Drive {
        let mut drive = Drive::default();
        let mut random = Random(3);
        for k in 0..2000 {
            let t = f64::from(k) * 0.01;
            let imu = Imu { gyro_z: 0.1 * t + 0.02 * random.normal(), accel_x: t, ..Imu::default() };
            drive.imu.push(t, imu).unwrap();
            if k % 100 == 0 {
                let fix = Gnss { lat: 0.6, lon: 2.0, alt: 5.0, valid: 1.0, ..Gnss::default() };
                drive.gnss.push(t, fix).unwrap();
                let view: Vec<Satellite> =
                    (0..8).map(|prn| Satellite { prn, range: 2e7, ..Satellite::default() }).collect();
                drive.raw_gnss.push(t, &view).unwrap();
            }
        }
        drive
    }

    fn with(kind: FaultKind) -> Drive {
        let mut drive = drive();
        Fault { kind, from: 5.0, to: 10.0, seed: 7 }.inject(&mut drive).unwrap();
        drive
    }

    fn differences(a: &Drive, b: &Drive, column: &str) -> Vec<(f64, f64)> {
        let (a, b) = (a.column(column).unwrap(), b.column(column).unwrap());
        let rows = a.0.time().iter().zip(a.0.column_at(a.1)).zip(b.0.column_at(b.1));
        rows.map(|((t, a), b)| (*t, a - b)).filter(|(_, d)| *d != 0.0).collect()
    }

    #[test]
    fn a_bias_is_there_inside_the_window_and_nowhere_else() {
        let changed = differences(&with(FaultKind::Bias { signal: "gyro_z".into(), amount: 0.25 }), &drive(), "gyro_z");
        assert_eq!(changed.len(), 500);
        assert!(changed.iter().all(|(t, d)| (5.0..10.0).contains(t) && (d - 0.25).abs() < 1e-12));
        let other = with(FaultKind::Bias { signal: "gyro_z".into(), amount: 0.25 });
        assert!(differences(&other, &drive(), "accel_x").is_empty());
    }

    #[test]
    fn a_frozen_sensor_shows_the_last_value_before() {
        let frozen = with(FaultKind::Freeze { signal: "accel_x".into() });
        let (series, index) = frozen.column("accel_x").unwrap();
        assert!(series.column_at(index)[500..1000].iter().all(|v| *v == 4.99));
        assert_eq!(series.column_at(index)[1000], 10.0);
    }

    #[test]
    fn a_delayed_ramp_is_lower_by_slope_times_delay() {
        let late =
            differences(&with(FaultKind::Delay { signal: "inertial".into(), seconds: 0.125 }), &drive(), "accel_x");
        assert!(late.len() == 500 && late.iter().all(|(_, d)| (d + 0.125).abs() < 1e-9));
    }

    /// Three times the noise: the sigma of the sum, from 500 samples, is known to 3 %.
    #[test]
    fn noise_times_three_has_three_times_the_sigma() {
        let noisy = with(FaultKind::Noise { signal: "gyro_z".into(), factor: 3.0 });
        let (series, index) = noisy.column("gyro_z").unwrap();
        let sigma = |range: std::ops::Range<usize>| white_noise(&series.column_at(index)[range]);
        let ratio = sigma(500..1000) / sigma(1000..2000);
        assert!((ratio - 3.0).abs() < 0.3, "{ratio}");
        let again = with(FaultKind::Noise { signal: "gyro_z".into(), factor: 3.0 });
        assert!(differences(&noisy, &again, "gyro_z").is_empty(), "the seed decides");
    }

    #[test]
    fn a_clock_jump_lengthens_every_range_and_multipath_only_some() {
        let ranges = |drive: &Drive, t: f64| {
            let index = drive.raw_gnss.time().iter().position(|x| *x == t).unwrap();
            drive.raw_gnss.at(index).1.iter().map(|s| s.range - 2e7).collect::<Vec<f64>>()
        };
        let jumped = with(FaultKind::ClockJump { metres: 300.0 });
        assert_eq!(ranges(&jumped, 5.0), [300.0; 8]);
        assert_eq!((ranges(&jumped, 4.0), ranges(&jumped, 10.0)), (vec![0.0; 8], vec![0.0; 8]));
        let reflected = with(FaultKind::Multipath { metres: 20.0, satellites: 2 });
        let mut long: Vec<f64> = ranges(&reflected, 7.0).into_iter().filter(|r| *r != 0.0).collect();
        long.sort_unstable_by(f64::total_cmp);
        assert_eq!(long, [20.0, 28.0]);
        assert!(!differences(&reflected, &drive(), "gnss_lat").is_empty());
        assert!(differences(&reflected, &drive(), "gnss_valid").is_empty());
    }

    #[test]
    fn what_cannot_fail_is_refused_with_a_sentence() {
        let fault = |kind| Fault { kind, from: 5.0, to: 10.0, seed: 0 }.inject(&mut Drive::default()).unwrap_err();
        assert_eq!(
            fault(FaultKind::Freeze { signal: "mag_x".into() }).to_string(),
            "there is no signal `mag_x` in this drive that could fail"
        );
        assert!(matches!(fault(FaultKind::ClockJump { metres: 1.0 }), FaultError::NoSatellites(_)));
        assert!(matches!(fault(FaultKind::Noise { signal: "mag_x".into(), factor: 0.5 }), FaultError::Amount { .. }));
        let backward = Fault { kind: FaultKind::ClockJump { metres: 1.0 }, from: 5.0, to: 5.0, seed: 0 };
        assert!(backward.inject(&mut drive()).is_err());
    }

    #[test]
    fn a_fault_is_read_from_its_description_and_what_lacks_is_named() {
        let read = |text: &str| Fault::from_json(&serde_json::from_str(text).unwrap());
        let multipath = r#"{"kind": "multipath", "metres": 30, "satellites": 2, "from": 1, "to": 2, "seed": 7}"#;
        let kind = FaultKind::Multipath { metres: 30.0, satellites: 2 };
        assert_eq!(read(multipath), Ok(Fault { kind, from: 1.0, to: 2.0, seed: 7 }));
        let refused = |text| read(text).unwrap_err().to_string();
        assert_eq!(
            refused(r#"{"kind": "freeze", "from": 1, "to": 2}"#),
            "a fault needs its signal: the name of a signal"
        );
        assert_eq!(
            refused(r#"{"kind": "freeze", "signal": "gnss", "from": "1", "to": 2}"#),
            "a fault needs its from: a number"
        );
        assert!(refused("{}").starts_with("a fault needs its kind: bias"));
    }
}
