//! What is wrong with a drive, said with path, value and what was expected.

/// Why a drive cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// Not JSON, or not the fields of a drive.
    #[error("the drive is not readable: {0}")]
    Json(String),
    /// A value outside its range.
    #[error("`{path}` = {value} is outside {min}..={max}")]
    OutOfRange {
        /// Where it stands, as in `segments[3].bank_deg`.
        path: String,
        /// What was found.
        value: f64,
        /// Smallest accepted value.
        min: f64,
        /// Largest accepted value.
        max: f64,
    },
    /// A name that is not known.
    #[error("`{path}` = \"{value}\" is not known; there are {known}")]
    Unknown {
        /// Where it stands.
        path: String,
        /// What was found.
        value: String,
        /// The names that there are.
        known: String,
    },
    /// A list without entries.
    #[error("`{path}` is empty; expected at least one entry")]
    Empty {
        /// Where it stands.
        path: String,
    },
    /// A turn too tight to be driven.
    #[error("`{path}` turns {turn_deg} deg in {length} m: radius {radius:.1} m, expected at least {min} m")]
    TooTight {
        /// Where it stands.
        path: String,
        /// Change of heading, deg.
        turn_deg: f64,
        /// Length, m.
        length: f64,
        /// Radius, m.
        radius: f64,
        /// Smallest accepted radius, m.
        min: f64,
    },
    /// Two values that exclude or need each other.
    #[error("`{path}`: {expected}")]
    Conflict {
        /// Where it stands.
        path: String,
        /// What was expected.
        expected: String,
    },
    /// The car left the road: too fast for it, or a car that cannot be steered like one.
    #[error("the car left the road at {position:.0} m after {time:.0} s: {offset:.1} m beside the centre line")]
    LeftRoad {
        /// Place along the road, m.
        position: f64,
        /// Time, s.
        time: f64,
        /// Offset to the right, m.
        offset: f64,
    },
    /// The car did not get on for a minute.
    #[error("the car got stuck at {position:.0} m after {time:.0} s")]
    Stuck {
        /// Place along the road, m.
        position: f64,
        /// Time, s.
        time: f64,
    },
}

/// Refuse a value outside `min..=max`; NaN is inside no range.
#[inline(never)]
pub(crate) fn within(path: &str, value: f64, min: f64, max: f64) -> Result<(), SpecError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(SpecError::OutOfRange { path: path.into(), value, min, max })
}

/// Refuse the first of the fields of `path` (name, value, smallest, largest) that is out of its range.
#[inline(never)]
pub(crate) fn ranges(path: &str, fields: &[(&str, f64, f64, f64)]) -> Result<(), SpecError> {
    let outside = fields.iter().find(|(_, value, min, max)| !(*min..=*max).contains(value));
    outside.map_or(Ok(()), |&(name, value, min, max)| within(&[path, ".", name].concat(), value, min, max))
}

/// Refuse a name that is not among `names`.
pub(crate) fn known<'a>(path: &str, value: &str, names: impl Iterator<Item = &'a str>) -> Result<(), SpecError> {
    let names: Vec<&str> = names.collect();
    if names.contains(&value) {
        return Ok(());
    }
    Err(SpecError::Unknown { path: path.into(), value: value.into(), known: names.join(", ") })
}

/// Refuse a drive in which `holds` is false.
#[inline(never)]
pub(crate) fn expect(holds: bool, path: &str, expected: &str) -> Result<(), SpecError> {
    if holds { Ok(()) } else { Err(SpecError::Conflict { path: path.into(), expected: expected.into() }) }
}
