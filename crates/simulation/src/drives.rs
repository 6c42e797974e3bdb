//! The drives that ship with Drivescope, one declarative file each.

use crate::spec::DriveSpec;

/// A drive that ships with Drivescope.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct NamedDrive {
    /// Name on the command line.
    pub name: &'static str,
    /// Name for menus.
    pub title: &'static str,
    /// What happens on it, in one line.
    pub doc: &'static str,
    /// About how long it lasts, s.
    pub duration_hint: f64,
    #[serde(skip)]
    json: &'static str,
}

const DRIVES: &[NamedDrive] = &[
    NamedDrive {
        name: "city_hills",
        title: "City and hills",
        doc: "Ten minutes through a hilly town: stops, corners, banked curves, a minute without satellites",
        duration_hint: 617.0,
        json: include_str!("drives/city_hills.json"),
    },
    NamedDrive {
        name: "motorway_bank",
        title: "Motorway with banked curves",
        doc: "Three and a half minutes of a rear-driven BMW 320i: slip road, long curves banked up to 7 deg at 110 km/h, a rest area",
        duration_hint: 211.0,
        json: include_str!("drives/motorway_bank.json"),
    },
];

/// The drives that ship with Drivescope.
pub fn drives() -> &'static [NamedDrive] {
    DRIVES
}

/// A shipped drive by its name.
pub fn named(name: &str) -> Option<DriveSpec> {
    let drive = DRIVES.iter().find(|d| d.name == name)?;
    DriveSpec::from_json(drive.json).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_drive_passes_its_own_checks_and_is_named_as_listed() {
        for drive in DRIVES {
            let spec = DriveSpec::from_json(drive.json).unwrap_or_else(|e| panic!("{}: {e}", drive.name));
            assert_eq!((spec.name.as_str(), spec.description.as_str()), (drive.name, drive.doc));
        }
        assert!(named("none").is_none());
    }
}
