//! Names of columns: the canonical ones, clocks, and how any name is understood.

pub(crate) use crate::aliases::Match;
use crate::aliases::alias;
use crate::channels::signal;

/// What stands between words though it is not ASCII; other signs of the world's scripts are letters.
const SIGNS: &str = "°º·–—−×";

/// A name in lower case, its words joined by `_`: `wheelSpeedFL`, `Wheel Speed FL` and `wheel-speed.fl` are one.
pub(crate) fn normalize(name: &str) -> String {
    let chars: Vec<char> = name.chars().collect();
    let mut out = String::new();
    for (i, &c) in chars.iter().enumerate() {
        if c.is_ascii() && !c.is_ascii_alphanumeric() || SIGNS.contains(c) {
            out.push('_');
            continue;
        }
        let before = i.checked_sub(1).map_or('_', |j| chars[j]);
        let after = chars.get(i + 1).copied().unwrap_or('_');
        let starts_word = c.is_ascii_uppercase()
            && (before.is_ascii_lowercase() || (before.is_ascii_uppercase() && after.is_ascii_lowercase()));
        if starts_word {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out.split('_').filter(|w| !w.is_empty()).collect::<Vec<_>>().join("_")
}

/// Whether a name (without unit) is that of a time column.
pub(crate) fn is_time_name(name: &str) -> bool {
    time_name(name).is_some()
}

/// Rank of a time column's name and the unit that it states; a lower rank is more certainly the clock of the rows.
pub(crate) fn time_name(name: &str) -> Option<(u8, Option<&'static str>)> {
    const NAMES: &[&str] = &[
        "t",
        "time",
        "timestamp",
        "timestamps",
        "time_stamp",
        "ts",
        "elapsed",
        "elapsed_time",
        "time_elapsed",
        "rel_time",
        "relative_time",
        "log_time",
        "sample_time",
        "stamp",
        "seconds",
        "secs",
        "sec",
        "datetime",
        "date_time",
        "utc",
        "utc_time",
        "time_utc",
        "unix_time",
        "unixtime",
        "epoch",
        "epoch_time",
        "gps_time",
        "gnss_time",
        "tow",
        "itow",
        "time_of_week",
        "local_time",
        "millis",
        "micros",
        "loggingtime",
        "logging_time",
        "tid",
        "zeit",
        "temps",
    ];
    if name.len() > LONGEST_NAME {
        return None;
    }
    let name = normalize(name);
    let rank = |n: &str| NAMES.iter().position(|known| *known == n).map(|i| u8::try_from(i).unwrap_or(u8::MAX));
    if let Some(found) = rank(&name) {
        let unit = match name.as_str() {
            "millis" | "itow" => Some("ms"),
            "micros" => Some("us"),
            "seconds" | "secs" | "sec" => Some("s"),
            _ => None,
        };
        return Some((found, unit));
    }
    crate::units::split_suffix(&name)
        .filter(|(_, unit)| crate::units::factor(unit, "s").is_some())
        .find_map(|(base, unit)| Some((rank(base)?, Some(unit))))
}

/// Longer, nothing is the name of a signal, bytes: what takes the square of a name's length stays small.
const LONGEST_NAME: usize = 160;

/// How a column's name may be understood, best first.
pub(crate) fn matches(name: &str) -> Vec<Match> {
    if name.len() > LONGEST_NAME {
        return Vec::new();
    }
    let plain = |signal: &str, rank| Match { signal: signal.to_owned(), sign: 1.0, unit: None, rank, doubt: None };
    if signal(name).is_some() {
        return vec![plain(name, 0)];
    }
    // `Speed, vehicle` is the vehicle's speed.
    if let Some((thing, whose)) = name.split_once(',')
        && !whose.contains(',')
    {
        let turned = matches(&format!("{whose} {thing}"));
        if !turned.is_empty() {
            return turned;
        }
    }
    let name = normalize(name);
    if signal(&name).is_some() {
        return vec![plain(&name, 0)];
    }
    let mut found = alias(&name);
    for (base, unit) in crate::units::split_suffix(&name) {
        let named = if signal(base).is_some() { vec![plain(base, 0)] } else { alias(base) };
        found.extend(named.into_iter().map(|m| Match { unit: Some(unit), ..m }));
    }
    found
}

/// Whether the name ends like a signal's although its beginning is not known: `can_yaw_rate` ends like `gyro_z`.
pub(crate) fn unknown_prefix(name: &str) -> Option<Match> {
    if name.len() > LONGEST_NAME {
        return None;
    }
    let name = normalize(name);
    let mut rest = name.as_str();
    while let Some((_, tail)) = rest.split_once('_') {
        rest = tail;
        if (rest.contains('_') || rest.len() > 4)
            && let Some(m) = matches(rest).into_iter().next()
        {
            return Some(m);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channels::CHANNELS;

    fn first(name: &str) -> Option<(String, u8, Option<&'static str>)> {
        matches(name).into_iter().next().map(|m| (m.signal, m.rank, m.unit))
    }

    #[test]
    fn every_canonical_name_is_its_own_match() {
        let names = CHANNELS.iter().flat_map(|(_, c)| c.iter()).map(|c| c.name.to_owned());
        let truth = drivescope_drive::truth::TRUTH_COLUMNS.iter().map(|c| format!("truth_{}", c.name));
        for name in names.chain(truth) {
            assert_eq!(first(&name), Some((name.clone(), 0, None)));
        }
    }

    #[test]
    fn aliases_are_understood_in_any_spelling() {
        for (name, signal) in [
            ("Speed, vehicle", "speed"),
            ("Acceleration, longitudinal", "accel_x"),
            ("ax", "accel_x"),
            ("acc_y", "accel_y"),
            ("AccelZ", "accel_z"),
            ("imu/accel.x", "accel_x"),
            ("linear_acceleration_x", "accel_x"),
            ("x_accel", "accel_x"),
            ("gyrX", "gyro_x"),
            ("wz", "gyro_z"),
            ("yaw_rate", "gyro_z"),
            ("YawRate", "gyro_z"),
            ("p", "gyro_x"),
            ("angular_velocity_y", "gyro_y"),
            ("mx", "mag_x"),
            ("magnetic_field_z", "mag_z"),
            ("Latitude", "gnss_lat"),
            ("lng", "gnss_lon"),
            ("altitude", "gnss_alt"),
            ("vehicle_speed", "speed"),
            ("v", "speed"),
            ("wheel_speed_FL", "wheel_speed_fl"),
            ("wheelspeed_rl", "wheel_speed_rl"),
            ("WheelSpeedRearRight", "wheel_speed_rr"),
            ("steering_wheel_angle", "steering_wheel"),
            ("steering_angle", "steering_wheel"),
            ("gnss_course", "course"),
            ("heading", "course"),
            ("gps_speed", "gnss_speed"),
            ("GPSSpeed", "gnss_speed"),
            ("vn", "gnss_vn"),
            ("pressure_altitude", "baro_alt"),
            ("num_sats", "gnss_nsat"),
            ("ultrasonic_3", "range_3"),
            ("gt_latitude", "truth_lat"),
            ("truth_heading", "truth_yaw"),
        ] {
            assert_eq!(first(name).map(|m| m.0), Some(signal.to_owned()), "{name}");
        }
        assert_eq!(first("speed_kmh"), Some(("speed".into(), 0, Some("kmh"))));
        assert!(matches("gyro_z_deg_s").iter().any(|m| m.signal == "gyro_z" && m.unit == Some("deg_s")));
        assert_eq!(matches("vel_up")[0].sign, -1.0);
    }

    #[test]
    fn other_names_are_not_understood() {
        for name in [
            "can_yaw_rate",
            "can_accel_x",
            "frame_id",
            "hdop",
            "utm_easting",
            "orientation_x",
            "prn",
            "sat_x",
            "truth_foo",
            "n",
            "range_13",
            "",
        ] {
            assert_eq!(first(name), None, "{name}");
        }
        assert_eq!(unknown_prefix("can_yaw_rate").unwrap().signal, "gyro_z");
        assert_eq!(unknown_prefix("can_accel_x").unwrap().signal, "accel_x");
        assert_eq!(unknown_prefix("frame_id"), None);
    }

    /// Catches work that grows with the square of a damaged name: each of its words begins a name of its own.
    #[test]
    fn a_name_of_a_hundred_thousand_words_is_none_at_once() {
        let long = "word_".repeat(100_000) + "accel_x";
        let begin = std::time::Instant::now();
        assert!(matches(&long).is_empty() && unknown_prefix(&long).is_none() && time_name(&long).is_none());
        assert!(begin.elapsed().as_secs_f64() < 0.5, "{:?}", begin.elapsed());
    }

    #[test]
    fn time_names_rank_and_state_units() {
        assert!(time_name("t").unwrap().0 < time_name("timestamp").unwrap().0);
        assert_eq!(time_name("Time_ms").unwrap().1, Some("ms"));
        assert_eq!(time_name("timestamp_us").unwrap().1, Some("us"));
        assert_eq!(time_name("uptime_of_day"), None);
        assert_eq!(time_name("accel_t"), None);
    }
}
