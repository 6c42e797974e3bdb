//! The drives that ship with Drivescope, one declarative file each.

use serde_json::Value;

use crate::spec::{DriveSpec, SpecError};

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

impl NamedDrive {
    /// Its file: what a drive of one's own can begin with.
    pub fn json(&self) -> &'static str {
        self.json
    }
}

static DRIVES: [NamedDrive; 25] = [
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
    NamedDrive {
        name: "dlc80_flat",
        title: "Double lane change at 80",
        doc: "ISO 3888-1 double lane change at 80 km/h on a flat road: stability control's sensors and a magnetometer",
        duration_hint: 51.9,
        json: include_str!("drives/dlc80_flat.json"),
    },
    NamedDrive {
        name: "bank20_80",
        title: "Banked 20 deg at 80",
        doc: "Straight on at 80 km/h on a road that banks by 20 deg to the right for 350 m",
        duration_hint: 49.2,
        json: include_str!("drives/bank20_80.json"),
    },
    NamedDrive {
        name: "hill80",
        title: "Hill at 80",
        doc: "Over a hill at 80 km/h: 8 deg up, 8 deg down",
        duration_hint: 42.4,
        json: include_str!("drives/hill80.json"),
    },
    NamedDrive {
        name: "mountain120",
        title: "Mountain road at 120",
        doc: "Curves of 380 to 450 m radius at 120 km/h with grade and bank, a double lane change on the way",
        duration_hint: 78.5,
        json: include_str!("drives/mountain120.json"),
    },
    NamedDrive {
        name: "uphill15_gearshift",
        title: "Uphill 15 deg with a gear shift",
        doc: "From the flat onto 15 deg uphill; accelerating there, a shift takes the torque away for 0.4 s",
        duration_hint: 29.4,
        json: include_str!("drives/uphill15_gearshift.json"),
    },
    NamedDrive {
        name: "flat_accel_brake",
        title: "Accelerate and brake",
        doc: "Flat and straight: three times hard to 70 km/h and hard to a stop",
        duration_hint: 80.6,
        json: include_str!("drives/flat_accel_brake.json"),
    },
    NamedDrive {
        name: "slope_speedbump",
        title: "Slopes with a speed bump",
        doc: "Slopes of +5, +1.5, -4 and +2.5 deg, a speed bump on the way, a launch and a hard stop",
        duration_hint: 51.0,
        json: include_str!("drives/slope_speedbump.json"),
    },
    NamedDrive {
        name: "u_drive",
        title: "U-shaped drive",
        doc: "Two left corners between two stops, with a full inertial sensor",
        duration_hint: 82.3,
        json: include_str!("drives/u_drive.json"),
    },
    NamedDrive {
        name: "u_drive_disk",
        title: "U-shaped drive, disk",
        doc: "Two left corners between two stops, with six accelerometers on a disk and a yaw gyro",
        duration_hint: 82.3,
        json: include_str!("drives/u_drive_disk.json"),
    },
    NamedDrive {
        name: "stop_and_go",
        title: "Stop and go",
        doc: "Five launches, one of them very gentle, a bend of 120 m radius, a right and a left corner",
        duration_hint: 176.0,
        json: include_str!("drives/stop_and_go.json"),
    },
    NamedDrive {
        name: "table1",
        title: "Straight at walking pace",
        doc: "The 140 s of Yun and Yu's Table 1: 10 s at rest, 1 m/s after 20 s, 110 m straight on to a stop; single satellites",
        duration_hint: 140.0,
        json: include_str!("drives/table1.json"),
    },
    NamedDrive {
        name: "obstacle",
        title: "Round an obstacle",
        doc: "At 1 m/s round a post on the line, as in figure 6 of Yun and Yu, with the ultrasonic ring",
        duration_hint: 59.7,
        json: include_str!("drives/obstacle.json"),
    },
    NamedDrive {
        name: "j_turn",
        title: "J-turn",
        doc: "At 5 m/s the wheels are turned by 3.6 deg within 0.3 s and held there, as in figure 7 of Yun and Yu",
        duration_hint: 11.6,
        json: include_str!("drives/j_turn.json"),
    },
    NamedDrive {
        name: "urban",
        title: "Ten minutes in town",
        doc: "Ten minutes of streets with reflections at 150 s, an outage at 300 s and a street canyon at 420 s; single satellites",
        duration_hint: 600.2,
        json: include_str!("drives/urban.json"),
    },
    NamedDrive {
        name: "city_loop",
        title: "City loop",
        doc: "Three times round a block: four right corners, a light, a speed bump and trucks that pass",
        duration_hint: 298.0,
        json: include_str!("drives/city_loop.json"),
    },
    NamedDrive {
        name: "mountain_pass",
        title: "Mountain pass",
        doc: "Hairpins at 9 per cent up to a pass and down again",
        duration_hint: 322.7,
        json: include_str!("drives/mountain_pass.json"),
    },
    NamedDrive {
        name: "motorway_hour",
        title: "A motorway hour",
        doc: "An hour at 110 to 130 km/h: long curves, hills, works at 80",
        duration_hint: 3584.6,
        json: include_str!("drives/motorway_hour.json"),
    },
    NamedDrive {
        name: "tunnel",
        title: "Tunnel and bridge",
        doc: "Over a steel bridge and through a tunnel of 1.1 km: no satellites, a distorted magnetic field, a curve inside",
        duration_hint: 147.5,
        json: include_str!("drives/tunnel.json"),
    },
    NamedDrive {
        name: "truss_bridge",
        title: "Truss bridge, trucks and tunnel",
        doc: "Over a truss bridge, past trucks, through a tunnel with a curve: the magnetic field is disturbed for half of the way",
        duration_hint: 141.9,
        json: include_str!("drives/truss_bridge.json"),
    },
    NamedDrive {
        name: "parking_garage",
        title: "Parking garage",
        doc: "Up three turns of a ramp of 9 m radius at 12 per cent, across a deck and down again, without satellites",
        duration_hint: 176.7,
        json: include_str!("drives/parking_garage.json"),
    },
    NamedDrive {
        name: "step_steer",
        title: "Step steer at 80",
        doc: "At 80 km/h the wheels are turned by 1.5 deg within 0.1 s and held, at held speed (ISO 7401)",
        duration_hint: 17.6,
        json: include_str!("drives/step_steer.json"),
    },
    NamedDrive {
        name: "sine_with_dwell",
        title: "Sine with dwell at 80",
        doc: "At 80 km/h one sine of 3 deg and 0.7 Hz with half a second of hold, rolling (ISO 19365)",
        duration_hint: 16.3,
        json: include_str!("drives/sine_with_dwell.json"),
    },
    NamedDrive {
        name: "braking",
        title: "Braking across ice",
        doc: "From 80 km/h to a stop at 6 m/s^2, the right wheels over a patch of ice on the way",
        duration_hint: 8.6,
        json: include_str!("drives/braking.json"),
    },
];

/// The drives that ship with Drivescope.
pub fn drives() -> &'static [NamedDrive] {
    &DRIVES
}

/// A shipped drive by its name.
pub fn named(name: &str) -> Option<DriveSpec> {
    let drive = DRIVES.iter().find(|d| d.name == name)?;
    DriveSpec::from_json(drive.json).ok()
}

/// A shipped drive with fields of its file replaced by those of a JSON object, as in `{"heading_deg": 90}`.
///
/// # Errors
/// [`SpecError`] when there is no such drive, or when the changed one does not pass its checks.
pub fn named_with(name: &str, changes: &Value) -> Result<DriveSpec, SpecError> {
    let Some(drive) = DRIVES.iter().find(|d| d.name == name) else {
        let known = DRIVES.iter().map(|d| d.name).collect::<Vec<_>>().join(", ");
        return Err(SpecError::Unknown { path: "drive".into(), value: name.into(), known });
    };
    let mut file: Value = serde_json::from_str(drive.json).map_err(|e| SpecError::Json(e.to_string()))?;
    if let (Some(file), Some(changes)) = (file.as_object_mut(), changes.as_object()) {
        file.extend(changes.iter().map(|(field, value)| (field.clone(), value.clone())));
    }
    DriveSpec::from_json(&file.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_drive_passes_its_own_checks_and_is_named_as_listed() {
        for drive in &DRIVES {
            let spec = DriveSpec::from_json(drive.json).unwrap_or_else(|e| panic!("{}: {e}", drive.name));
            assert_eq!((spec.name.as_str(), spec.description.as_str()), (drive.name, drive.doc));
        }
        assert!(named("none").is_none());
    }

    #[test]
    fn a_changed_drive_differs_in_its_changes_alone_and_is_checked() {
        let (own, turned) = (named("hill80").unwrap(), serde_json::json!({"heading_deg": 98}));
        let changed = named_with("hill80", &turned).unwrap();
        assert_eq!(changed, DriveSpec { heading_deg: 98.0, ..own });
        assert!(named_with("hill80", &serde_json::json!({"heading": 98})).is_err(), "an unknown field");
        assert!(named_with("hill", &turned).is_err());
    }
}
