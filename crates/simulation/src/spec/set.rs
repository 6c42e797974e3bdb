//! Single values of a drive's JSON replaced from the command line.

use serde_json::{Map, Value};

use super::error::SpecError;

/// Replace one value, `path=value`: `sensors=phone`, `driver.cornering=4`, `segments[2].speed_kmh=70`,
/// `faults[+]={"kind": "outage", "start": 60, "duration": 30}`.
///
/// The value is JSON, or else a text. `[+]` appends to a list. What a field may hold is checked when the drive is read.
///
/// # Errors
/// [`SpecError::Conflict`] for a change without `=`, or a path that leads into something that is no object or list.
pub fn replace(drive: &mut Value, change: &str) -> Result<(), SpecError> {
    let conflict = |expected: String| Err(SpecError::Conflict { path: change.into(), expected });
    let Some((path, text)) = change.split_once('=') else {
        return conflict("expected path=value, as in sensors=phone".into());
    };
    let mut place = &mut *drive;
    for step in path.trim().split('.') {
        let (name, entries) = step.split_once('[').unwrap_or((step, ""));
        if place.is_null() {
            *place = Value::Object(Map::new());
        }
        let Value::Object(fields) = place else { return conflict(format!("`{name}` is not inside an object")) };
        place = fields.entry(name.to_owned()).or_insert(Value::Null);
        if entries.is_empty() {
            continue;
        }
        for entry in entries.split('[') {
            if place.is_null() {
                *place = Value::Array(Vec::new());
            }
            let Value::Array(list) = place else { return conflict(format!("`{name}` is not a list")) };
            let count = list.len();
            let index = match entry.trim_end_matches(']') {
                "+" => count,
                digits => digits.parse().unwrap_or(usize::MAX),
            };
            if index == count {
                list.push(Value::Null);
            }
            match list.get_mut(index) {
                Some(entry) => place = entry,
                None => return conflict(format!("`{name}` has {count} entries, from [0]; [+] appends one")),
            }
        }
    }
    let text = text.trim();
    *place = serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.into()));
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::spec::{DriveSpec, FaultKind};

    const BASE: &str = r#"{"name": "x", "description": "y", "segments": [{"length": 300, "speed_kmh": 50}]}"#;

    fn with(changes: &[&str]) -> Result<DriveSpec, String> {
        DriveSpec::from_json_with(BASE, changes).map_err(|e| e.to_string())
    }

    #[test]
    fn values_are_replaced_appended_and_made_where_there_was_none() {
        let spec = with(&[
            "sensors=phone",
            "driver.cornering = 4",
            "segments[0].speed_kmh=70",
            "segments[+]={\"length\": 50, \"speed_kmh\": 30}",
            "faults[+].kind=canyon",
            "faults[0].start=10",
            "faults[0].duration=5",
            "duration=20",
            "lever_arm=[0.5, 0, 0]",
            "car_changes.m=1500",
        ])
        .unwrap();
        assert_eq!((spec.sensors.as_str(), spec.driver.cornering, spec.segments.len()), ("phone", 4.0, 2));
        assert_eq!((spec.segments[0].speed_kmh, spec.lever_arm[0], spec.duration), (70.0, 0.5, Some(20.0)));
        assert_eq!((spec.faults[0].kind, spec.faults[0].start), (FaultKind::Canyon, 10.0));
        assert_eq!(spec.vehicle().unwrap().mass, 1500.0);
    }

    #[test]
    fn a_wrong_change_is_one_sentence_that_says_what_there_is() {
        let error = |change: &str| with(&[change]).unwrap_err();
        assert_eq!(error("phone"), "`phone`: expected path=value, as in sensors=phone");
        assert!(error("segments[3].turn_deg=9").contains("`segments` has 1 entries"));
        assert!(error("sensors=tape").contains("there are automotive"));
        assert!(error("sensors.imu=esc").contains("expected a text"));
        assert!(error("slope=3").contains("unknown field `slope`, expected one of `name`"));
        assert_eq!(error("duration=0"), "`duration` = 0 is outside 1..=14400");
        assert!(error("segments[0].speed_kmh=fast").contains("segments[0].speed_kmh: expected a number"));
        assert!(error("name.x=3").contains("not inside an object"));
    }
}
