//! Names of columns: the canonical ones, and the aliases that loggers use.

use drivescope_drive::channel::{Column, Record};
use drivescope_drive::signals::{AccelArray, Baro, Gnss, Imu, Mag, Range, Steering, Wheels};
use drivescope_drive::truth::truth_column;

/// The measured channels, in the order of [`drivescope_drive::drive::Drive::channels`].
pub(crate) const CHANNELS: [(&str, &[Column]); 8] = [
    ("imu", Imu::COLUMNS),
    ("mag", Mag::COLUMNS),
    ("wheels", Wheels::COLUMNS),
    ("steering", Steering::COLUMNS),
    ("gnss", Gnss::COLUMNS),
    ("baro", Baro::COLUMNS),
    ("accel_array", AccelArray::COLUMNS),
    ("range", Range::COLUMNS),
];

/// The declaration of a signal by its canonical name, `truth_` included.
pub fn signal(name: &str) -> Option<&'static Column> {
    match name.strip_prefix("truth_") {
        Some(rest) => truth_column(rest),
        None => CHANNELS.iter().flat_map(|(_, columns)| columns.iter()).find(|c| c.name == name),
    }
}

/// How a name was understood.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Match {
    /// Canonical name of the signal.
    pub signal: String,
    /// -1 where the name counts the other way (up, left).
    pub sign: f64,
    /// Unit that the name's suffix states.
    pub unit: Option<&'static str>,
    /// 0 canonical, 1 alias, 2 ambiguous alias: the lower one wins.
    pub rank: u8,
    /// What is ambiguous.
    pub doubt: Option<&'static str>,
}

/// A name in lower case, its words joined by `_`: `wheelSpeedFL`, `Wheel Speed FL` and `wheel-speed.fl` are one.
pub(crate) fn normalize(name: &str) -> String {
    let chars: Vec<char> = name.chars().collect();
    let mut out = String::new();
    for (i, &c) in chars.iter().enumerate() {
        if !c.is_alphanumeric() {
            out.push('_');
            continue;
        }
        let before = i.checked_sub(1).map_or('_', |j| chars[j]);
        let after = chars.get(i + 1).copied().unwrap_or('_');
        let starts_word =
            c.is_uppercase() && (before.is_lowercase() || (before.is_uppercase() && after.is_lowercase()));
        if starts_word {
            out.push('_');
        }
        out.extend(c.to_lowercase());
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
        "gps_seconds",
        "gps_tow",
        "gps_sow",
        "tow",
        "itow",
        "i_tow",
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
            "millis" | "itow" | "i_tow" => Some("ms"),
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

fn alias(name: &str) -> Vec<Match> {
    for prefix in ["truth_", "true_", "gt_", "ground_truth_", "reference_", "ref_"] {
        if let Some(rest) = name.strip_prefix(prefix) {
            return truth_alias(rest);
        }
    }
    let compact: String = name.chars().filter(|c| *c != '_').collect();
    let mut found: Vec<Match> = Vec::new();
    for stem in stems(&compact) {
        found.extend(three_axis(stem));
        found.extend(wheel(stem));
        found.extend(single(stem));
        found.extend(numbered(stem));
        if !found.is_empty() {
            break;
        }
    }
    found
}

/// The name, and the name without a prefix that says only which device measured.
fn stems(compact: &str) -> impl Iterator<Item = &str> {
    const DEVICES: &[&str] = &["imu", "sensor", "vehicle", "car", "ins", "gnssins", "vn", "xsens", "mti"];
    let shorter = DEVICES.iter().filter_map(move |d| compact.strip_prefix(d)).filter(|s| s.len() > 1);
    std::iter::once(compact).chain(shorter)
}

fn truth_alias(rest: &str) -> Vec<Match> {
    let name = match rest {
        "latitude" => "lat",
        "longitude" | "lng" => "lon",
        "altitude" | "height" => "alt",
        "north" | "pos_n" => "n",
        "east" | "pos_e" => "e",
        "down" | "pos_d" => "d",
        "heading" => "yaw",
        "slip_angle" | "side_slip" | "beta" => "sideslip",
        "slope" | "road_grade" => "grade",
        "road_bank" => "bank",
        other => other,
    };
    let found = truth_column(name).map(|c| format!("truth_{}", c.name));
    found.map(|signal| Match { signal, sign: 1.0, unit: None, rank: 1, doubt: None }).into_iter().collect()
}

fn known(signal: &str) -> Match {
    Match { signal: signal.to_owned(), sign: 1.0, unit: None, rank: 1, doubt: None }
}

fn doubtful(signal: &str, doubt: &'static str) -> Match {
    Match { rank: 2, doubt: Some(doubt), ..known(signal) }
}

fn three_axis(name: &str) -> Vec<Match> {
    const BASES: &[(&str, &str)] = &[
        ("accelerometer", "accel"),
        ("linearacceleration", "accel"),
        ("acceleration", "accel"),
        ("specificforce", "accel"),
        ("accel", "accel"),
        ("acc", "accel"),
        ("a", "accel"),
        ("f", "accel"),
        ("gyroscope", "gyro"),
        ("angularvelocity", "gyro"),
        ("angularrate", "gyro"),
        ("bodyrate", "gyro"),
        ("gyro", "gyro"),
        ("gyr", "gyro"),
        ("omega", "gyro"),
        ("w", "gyro"),
        ("rotrate", "gyro"),
        ("rotationrate", "gyro"),
        ("g", "gyro"),
        ("magnetometer", "mag"),
        ("magneticfield", "mag"),
        ("magnetic", "mag"),
        ("magn", "mag"),
        ("mag", "mag"),
        ("m", "mag"),
    ];
    let mut out = Vec::new();
    for axis in ["x", "y", "z"] {
        let before = name.strip_suffix(axis);
        let after = name.strip_prefix(axis);
        for (base, group) in BASES {
            let signal = format!("{group}_{axis}");
            let short = base.len() == 1;
            if before == Some(base) {
                if *base == "g" {
                    out.push(doubtful(&signal, "`g` is read as gyro, unless its unit is one of acceleration"));
                    out.push(doubtful(&format!("accel_{axis}"), "`g` is read as acceleration because of its unit"));
                } else {
                    out.push(known(&signal));
                }
            } else if after == Some(base) && !short {
                out.push(known(&signal));
            }
        }
    }
    out
}

fn wheel(name: &str) -> Option<Match> {
    const PLACES: &[(&str, &[&str])] = &[
        ("fl", &["fl", "lf", "frontleft", "leftfront"]),
        ("fr", &["fr", "rf", "frontright", "rightfront"]),
        ("rl", &["rl", "lr", "rearleft", "leftrear", "bl"]),
        ("rr", &["rr", "rearright", "rightrear", "br"]),
    ];
    const BASES: &[&str] = &[
        "wheelspeed",
        "wheelspd",
        "whlspd",
        "whlspeed",
        "wspd",
        "ws",
        "wheel",
        "wheelvelocity",
        "vwheel",
        "speed",
        "v",
    ];
    for (end, places) in PLACES {
        for place in *places {
            let base = name.strip_suffix(place).filter(|b| BASES.contains(b));
            let tail = name.strip_prefix(place).filter(|b| b.starts_with("wheel") && BASES.contains(b));
            if base.or(tail).is_some() {
                return Some(known(&format!("wheel_speed_{end}")));
            }
        }
    }
    None
}

/// `acc6_3`, `range_7` and their like.
fn numbered(name: &str) -> Option<Match> {
    let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
    let (base, number) = (name.strip_suffix(digits)?, digits);
    let group = match base {
        "range" | "ultrasonic" | "sonar" | "distance" | "uss" => "range_",
        _ => return None,
    };
    let name = format!("{group}{number}");
    signal(&name).map(|c| known(c.name))
}

fn single(name: &str) -> Option<Match> {
    const COURSE: &str = "heading and course are taken as one: course over ground";
    const SIDE: &str = "the sign is taken as right positive";
    Some(match name {
        "p" | "rollrate" => known("gyro_x"),
        "q" | "pitchrate" => known("gyro_y"),
        "r" | "yawrate" | "yawvelocity" => known("gyro_z"),
        "longitudinalacceleration" | "longaccel" | "longacc" | "accellong" | "acclong" | "accelerationlongitudinal" => {
            known("accel_x")
        }
        "lateralacceleration" | "lataccel" | "latacc" | "accellat" | "acclat" | "accelerationlateral" => {
            doubtful("accel_y", SIDE)
        }
        "verticalacceleration" | "vertaccel" | "vertacc" | "accelvert" | "accvert" => known("accel_z"),
        "vehiclespeed"
        | "carspeed"
        | "speedmps"
        | "velocity"
        | "v"
        | "vx"
        | "speedometer"
        | "obdspeed"
        | "ecuspeed"
        | "wheelspeed"
        | "vehspd"
        | "vehicleforwardspeed"
        | "odometerspeed"
        | "odospeed"
        | "forwardspeed" => known("speed"),
        "steer" | "steering" | "roadwheelangle" | "frontwheelangle" | "delta" | "steerangleroad" => known("steer"),
        "steeringwheelangle" | "steeringwheel" | "swa" | "handwheelangle" | "handwheel" | "steerwheelangle" => {
            known("steering_wheel")
        }
        "steeringangle" | "steerangle" => {
            doubtful("steering_wheel", "a steering angle may be that of the steering wheel or of the road wheels")
        }
        "cog" | "courseoverground" | "track" | "gpscourse" | "gnsscourse" | "gpstrack" | "gnsstrack" | "gpscog"
        | "gnsscog" => known("course"),
        "heading" | "bearing" | "gpsheading" | "gnssheading" | "gpsbearing" => doubtful("course", COURSE),
        _ => return gnss(name),
    })
}

fn gnss(name: &str) -> Option<Match> {
    let device = ["gnss", "gps"].iter().find_map(|d| name.strip_prefix(d));
    let up = |signal: &str| Match { sign: -1.0, ..known(signal) };
    Some(match device.unwrap_or(name) {
        "lat" | "latitude" | "positionlat" | "poslat" => known("gnss_lat"),
        "lon" | "lng" | "long" | "longitude" | "positionlon" | "poslon" => known("gnss_lon"),
        "alt" | "altitude" | "height" | "elevation" | "ele" | "hmsl" | "altitudemsl" | "positionalt" => {
            known("gnss_alt")
        }
        "speed" if device.is_some() => known("gnss_speed"),
        "groundspeed" | "speedoverground" | "sog" | "gspeed" | "speed2d" => known("gnss_speed"),
        "vn" | "veln" | "velocityn" | "northvelocity" | "velocitynorth" | "velnorth" | "vnorth" | "speednorth" => {
            known("gnss_vn")
        }
        "ve" | "vele" | "velocitye" | "eastvelocity" | "velocityeast" | "veleast" | "veast" | "speedeast" => {
            known("gnss_ve")
        }
        "vd" | "veld" | "velocityd" | "downvelocity" | "velocitydown" | "veldown" | "vdown" | "speeddown" => {
            known("gnss_vd")
        }
        "vu" | "velu" | "upvelocity" | "velocityup" | "velup" | "vup" | "climbrate" | "verticalspeed" => up("gnss_vd"),
        "n" | "north" | "posn" if device.is_some() || name != "n" => known("gnss_n"),
        "e" | "east" | "pose" if device.is_some() || name != "e" => known("gnss_e"),
        "d" | "down" | "posd" if device.is_some() || name != "d" => known("gnss_d"),
        "stdn" | "stdnorth" | "sigman" => known("gnss_std_n"),
        "stde" | "stdeast" | "sigmae" => known("gnss_std_e"),
        "stdd" | "stddown" | "sigmad" => known("gnss_std_d"),
        "nsat" | "nsats" | "numsat" | "numsats" | "satellites" | "sats" | "numsv" | "nsv" | "satellitesused"
        | "sat" => known("gnss_nsat"),
        "pdop" => known("gnss_pdop"),
        "valid" | "fixvalid" | "fixok" if device.is_some() || name != "valid" => known("gnss_valid"),
        "baro" | "baroalt" | "baroaltitude" | "barometricaltitude" | "pressurealtitude" | "baroheight"
        | "barometeraltitude" => known("baro_alt"),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
