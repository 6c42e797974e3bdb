//! Units as files write them, and their factors to SI.

use std::f64::consts::PI;

const DEG: f64 = PI / 180.0;
const G: f64 = drivescope_drive::geodesy::STANDARD_GRAVITY;

/// Spellings of a unit, and its factor to the SI unit.
type Unit = (&'static [&'static str], f64);

/// For each SI unit of a signal: spellings (normalized) and the factor to that unit.
const TABLE: &[(&str, &[Unit])] = &[
    (
        "m/s^2",
        &[
            (&["m/s2", "m/s/s", "ms2", "mps2", "ms-2", "m/ss"], 1.0),
            (&["g", "gn", "g0"], G),
            (&["mg", "millig"], 1e-3 * G),
            (&["cm/s2", "gal"], 1e-2),
            (&["ft/s2"], 0.3048),
        ],
    ),
    (
        "rad/s",
        &[
            (&["rad/s", "rads", "rps", "rads-1", "radians/s"], 1.0),
            (&["deg/s", "degs", "dps", "degrees/s", "degs-1"], DEG),
            (&["mrad/s"], 1e-3),
            (&["mdeg/s", "mdps"], 1e-3 * DEG),
            (&["deg/h", "deg/hr"], DEG / 3600.0),
        ],
    ),
    (
        "uT",
        &[
            (&["ut", "microtesla"], 1.0),
            (&["nt"], 1e-3),
            (&["mg", "mgauss", "milligauss"], 0.1),
            (&["g", "gauss", "ga"], 100.0),
            (&["mt"], 1e3),
            (&["t", "tesla"], 1e6),
        ],
    ),
    (
        "m/s",
        &[
            (&["m/s", "mps", "ms", "ms-1"], 1.0),
            (&["km/h", "kmh", "kph", "kmph", "km/hr", "kmh-1"], 1.0 / 3.6),
            (&["mph", "mi/h", "mi/hr"], 0.447_04),
            (&["kn", "kt", "kts", "knot", "knots"], 1852.0 / 3600.0),
            (&["ft/s", "fps"], 0.3048),
            (&["cm/s"], 1e-2),
            (&["mm/s"], 1e-3),
        ],
    ),
    (
        "rad",
        &[
            (&["rad", "radian", "radians"], 1.0),
            (&["deg", "degree", "degrees"], DEG),
            (&["mrad"], 1e-3),
            (&["1e-7deg", "dege-7", "e-7deg", "1e7deg"], 1e-7 * DEG),
        ],
    ),
    (
        "m",
        &[
            (&["m", "meter", "meters", "metre", "metres"], 1.0),
            (&["ft", "feet", "foot"], 0.3048),
            (&["km"], 1e3),
            (&["cm"], 1e-2),
            (&["mm"], 1e-3),
        ],
    ),
    (
        "s",
        &[
            (&["s", "seconds"], 1.0),
            (&["ms", "msec", "mseconds", "milliseconds", "millis"], 1e-3),
            (&["us", "usec", "microseconds", "micros"], 1e-6),
            (&["ns", "nsec", "nanoseconds", "nanos"], 1e-9),
            (&["min", "minutes"], 60.0),
        ],
    ),
    ("N", &[(&["n", "newton"], 1.0), (&["kn"], 1e3)]),
    ("1", &[(&["1", "-", "count", "none"], 1.0), (&["%"], 1e-2)]),
];

/// Suffixes of names that state a unit, tried from the longest on.
const SUFFIXES: &[&str] = &[
    "_deg_per_sec",
    "_rad_per_sec",
    "_deg_per_s",
    "_rad_per_s",
    "_km_per_h",
    "_m_per_s2",
    "_m_per_s",
    "_deg_sec",
    "_rad_sec",
    "_radians",
    "_degrees",
    "_mgauss",
    "_meters",
    "_metres",
    "_seconds",
    "_deg_s",
    "_rad_s",
    "_degree",
    "_gauss",
    "_knots",
    "_tesla",
    "_m_s_2",
    "_m_s2",
    "_km_h",
    "_mps2",
    "_knot",
    "_msec",
    "_usec",
    "_nsec",
    "_kmph",
    "_mrad",
    "_feet",
    "_degs",
    "_rads",
    "_m_s",
    "_ms2",
    "_mps",
    "_kmh",
    "_kph",
    "_mph",
    "_kts",
    "_dps",
    "_deg",
    "_rad",
    "_sec",
    "_kn",
    "_kt",
    "_mg",
    "_ut",
    "_nt",
    "_ft",
    "_km",
    "_cm",
    "_ms",
    "_us",
    "_ns",
    "_g",
    "_m",
    "_s",
];

fn normalize(unit: &str) -> String {
    let mut out = String::new();
    for c in unit.chars() {
        match c {
            ' ' | '_' | '^' | '*' | '·' | '.' | '(' | ')' | '[' | ']' => {}
            '²' => out.push('2'),
            '⁻' | '−' => out.push('-'),
            '¹' => out.push('1'),
            'µ' | 'μ' => out.push('u'),
            '°' | 'º' => out.push_str("deg"),
            c => out.push(c.to_ascii_lowercase()),
        }
    }
    let out = out.replace("per", "/").replace("seconds", "s").replace("second", "s").replace("sec", "s");
    match out.as_str() {
        // Whole words for a time were shortened above.
        "msec" => "ms".into(),
        "millis" | "micros" | "nanos" => out,
        "radss" => "rads".into(),
        _ => out,
    }
}

/// Factor from `unit` to `si`, the SI unit of a signal; `None` if it is not a unit of that quantity.
///
/// Lower and upper case are one, since the quantity decides: `g` is 9.80665 m/s^2 of an acceleration, 100 uT of a field.
pub fn factor(unit: &str, si: &str) -> Option<f64> {
    let (unit, (_, spellings)) = (normalize(unit), TABLE.iter().find(|(name, _)| *name == si)?);
    if unit == normalize(si) {
        return Some(1.0);
    }
    spellings.iter().find(|(names, _)| names.iter().any(|n| normalize(n) == unit)).map(|(_, f)| *f)
}

/// Whether some quantity has this unit.
pub(crate) fn is_unit(text: &str) -> bool {
    TABLE.iter().any(|(si, _)| factor(text, si).is_some())
}

/// The units that convert to `si`, for a sentence.
pub(crate) fn spellings(si: &str) -> String {
    let units = TABLE.iter().find(|(name, _)| *name == si).map_or(&[][..], |(_, s)| s);
    units.iter().map(|(names, _)| names[0]).collect::<Vec<_>>().join(", ")
}

/// Ways to read a normalized name as a shorter name and a unit suffix: `speed_kmh` is `speed` in `kmh`.
pub(crate) fn split_suffix(name: &str) -> impl Iterator<Item = (&str, &'static str)> {
    SUFFIXES
        .iter()
        .filter_map(move |suffix| Some((name.strip_suffix(suffix)?, &suffix[1..])))
        .filter(|(n, _)| !n.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_convert_by_quantity() {
        let close = |unit: &str, si: &str, expected: f64| {
            let found = factor(unit, si).unwrap_or_else(|| panic!("{unit} of {si}"));
            assert!((found / expected - 1.0).abs() < 1e-15, "{unit}: {found}");
        };
        close("g", "m/s^2", 9.80665);
        close("mG", "m/s^2", 9.80665e-3);
        close("G", "uT", 100.0);
        close("mG", "uT", 0.1);
        close("µT", "uT", 1.0);
        close("T", "uT", 1e6);
        close("°/s", "rad/s", PI / 180.0);
        close("deg/sec", "rad/s", PI / 180.0);
        close("rad s^-1", "rad/s", 1.0);
        close("m/s²", "m/s^2", 1.0);
        close("m s-2", "m/s^2", 1.0);
        close("km/h", "m/s", 1.0 / 3.6);
        close("knots", "m/s", 0.514_444_444_444_444_4);
        close("mph", "m/s", 0.44704);
        close("ms", "s", 1e-3);
        close("ms", "m/s", 1.0);
        close("msec", "s", 1e-3);
        close("sec", "s", 1.0);
        close("1e-7 deg", "rad", 1e-7 * PI / 180.0);
        close("deg_s", "rad/s", PI / 180.0);
        close("m_s2", "m/s^2", 1.0);
        assert_eq!(factor("hPa", "m"), None);
        assert_eq!(factor("km/h", "m"), None);
        assert!(is_unit("deg") && !is_unit("furlong") && !is_unit("GPS"));
    }

    #[test]
    fn suffixes_state_units() {
        let all = |name| split_suffix(name).collect::<Vec<_>>();
        assert_eq!(all("speed_kmh"), [("speed", "kmh")]);
        assert!(all("gyro_z_deg_s").contains(&("gyro_z", "deg_s")));
        assert!(all("accel_x").is_empty());
        for suffix in SUFFIXES {
            assert!(is_unit(&suffix[1..]), "{suffix}");
        }
    }
}
