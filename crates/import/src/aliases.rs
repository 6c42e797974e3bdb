//! Aliases of signals that loggers use, and how a name is understood by them.

use drivescope_drive::truth::truth_column;

use crate::channels::signal;

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

/// What a normalized name may be by the aliases, without its unit.
pub(crate) fn alias(name: &str) -> Vec<Match> {
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
