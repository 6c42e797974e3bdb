//! Checks of a mapping: its names, units and numbers, and whether a table has its columns.

use drivescope_drive::csv::file_unit;

use crate::channels::{CHANNELS, signal};
use crate::error::ImportError;
use crate::mapping::{Mapping, SignalSource, TimeSource};
use crate::table::Table;
use crate::units;

impl Mapping {
    /// Check names, units and factors without a table; `file` names the mapping in errors.
    ///
    /// # Errors
    /// [`ImportError::UnknownSignal`], [`ImportError::UnknownUnit`], [`ImportError::BadFactor`].
    pub fn validate(&self, file: &str) -> Result<(), ImportError> {
        self.time.factors(file)?;
        let bad = |signal: &str, field, found| ImportError::BadFactor {
            file: file.into(),
            signal: signal.into(),
            field,
            found,
        };
        if !self.time.offset.is_finite() {
            return Err(bad("time", "offset", self.time.offset));
        }
        if let Some(found) = self.drop_repeats.iter().find(|d| !CHANNELS.iter().any(|(name, _)| name == d)) {
            let suggestion =
                "`drop_repeats` takes channels: imu, mag, wheels, steering, gnss, baro, accel_array, range".into();
            return Err(ImportError::UnknownSignal { file: file.into(), found: found.clone(), suggestion });
        }
        self.check_mounts(file)?;
        for (name, source) in self.signals.iter() {
            source.factor(name, file)?;
            if !source.scale.is_finite() || source.scale == 0.0 {
                return Err(bad(name, "scale", source.scale));
            }
            if !source.offset.is_finite() {
                return Err(bad(name, "offset", source.offset));
            }
        }
        Ok(())
    }

    /// Check the channels and numbers of mounts and delays.
    fn check_mounts(&self, file: &str) -> Result<(), ImportError> {
        let unknown = |found: &str, suggestion: &str| ImportError::UnknownSignal {
            file: file.into(),
            found: found.into(),
            suggestion: suggestion.into(),
        };
        for (name, mount) in self.mounts.iter() {
            if !["imu", "mag"].contains(&name.as_str()) {
                return Err(unknown(name, "`mounts` takes imu and mag"));
            }
            for (field, found) in
                [("roll_deg", mount.roll_deg), ("pitch_deg", mount.pitch_deg), ("yaw_deg", mount.yaw_deg)]
            {
                if !found.is_finite() {
                    return Err(ImportError::BadFactor { file: file.into(), signal: name.clone(), field, found });
                }
            }
        }
        for (name, &found) in self.delays.iter() {
            if !CHANNELS.iter().any(|(channel, _)| channel == name) {
                return Err(unknown(name, "`delays` takes imu, mag, wheels, steering, gnss, baro, accel_array, range"));
            }
            if !found.is_finite() {
                return Err(ImportError::BadFactor { file: file.into(), signal: name.clone(), field: "delay", found });
            }
        }
        Ok(())
    }

    /// Check that a table has every column that the mapping names.
    ///
    /// # Errors
    /// [`ImportError::UnknownColumn`], [`ImportError::TextColumn`].
    pub fn check_columns(&self, table: &Table) -> Result<(), ImportError> {
        let fraction = self.time.fraction.iter().map(|f| ("time", &f.column));
        let signals = self.signals.iter().map(|(name, source)| (name.as_str(), &source.column));
        for (signal, column) in std::iter::once(("time", &self.time.column)).chain(fraction).chain(signals) {
            if table.column(column).is_some() {
                continue;
            }
            let (file, signal, column) = (table.name.clone(), format!("`{signal}`"), column.clone());
            return Err(match table.text_columns.iter().find(|t| t.name == column) {
                Some(text) => ImportError::TextColumn { file, signal, column, found: text.example.clone() },
                None => ImportError::UnknownColumn { file, signal, column, found: table.columns_found() },
            });
        }
        Ok(())
    }
}

impl TimeSource {
    /// Factors to seconds of the column and of its fraction.
    pub(crate) fn factors(&self, file: &str) -> Result<(f64, f64), ImportError> {
        let factor = |unit: &str| units::factor(unit, "s").ok_or_else(|| unknown_unit(file, "`time`", "s", unit));
        Ok((factor(&self.unit)?, self.fraction.as_ref().map_or(Ok(0.0), |f| factor(&f.unit))?))
    }
}

impl SignalSource {
    /// Factor from raw values to the SI values of `signal`, without `scale`.
    pub(crate) fn factor(&self, name: &str, file: &str) -> Result<f64, ImportError> {
        let Some(column) = signal(name) else {
            let suggestion = match crate::names::matches(name).first() {
                Some(m) => format!("use `{}`", m.signal),
                None => "see the list of signals".into(),
            };
            return Err(ImportError::UnknownSignal { file: file.to_owned(), found: name.to_owned(), suggestion });
        };
        let unit = self.unit.as_deref().unwrap_or(file_unit(name, column.unit));
        units::factor(unit, column.unit).ok_or_else(|| unknown_unit(file, &format!("`{name}`"), column.unit, unit))
    }
}

fn unknown_unit(file: &str, signal: &str, expected: &str, found: &str) -> ImportError {
    let (file, signal, expected) = (file.to_owned(), signal.to_owned(), expected.to_owned());
    let suggestion = format!("use one of {}", units::spellings(&expected));
    ImportError::UnknownUnit { file, signal, expected, found: found.to_owned(), suggestion }
}
