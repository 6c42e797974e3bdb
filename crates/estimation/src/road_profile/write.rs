//! A road profile as a file: CSV, and GeoJSON for maps.

use std::io::{self, Write};

use super::{ProfileError, RoadPoint, RoadProfile};

/// A number with nine decimals at most: a tenth of a millimetre of longitude, a billionth of a metre of height.
fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// Write the profile as CSV: `distance` in m, grades in rad, altitudes in m, places in degrees; empty cells where unknown.
///
/// # Errors
/// Those of the writer.
pub fn write_csv(profile: &RoadProfile, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "distance,grade,grade_sigma,altitude,altitude_sigma,passes,gnss_lat,gnss_lon")?;
    for (distance, p) in profile.points.iter() {
        write!(out, "{}", rounded(distance))?;
        let (lat, lon) = (p.lat.to_degrees(), p.lon.to_degrees());
        for value in [p.grade, p.grade_sigma, p.altitude, p.altitude_sigma, p.passes, lat, lon] {
            match value.is_finite() {
                true => write!(out, ",{}", rounded(value))?,
                false => write!(out, ",")?,
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

fn is_placed(point: &RoadPoint) -> bool {
    [point.lat, point.lon, point.altitude, point.grade, point.grade_sigma].iter().all(|v| v.is_finite())
}

fn coordinates(point: &RoadPoint, out: &mut impl Write) -> io::Result<()> {
    let (lat, lon) = (rounded(point.lat.to_degrees()), rounded(point.lon.to_degrees()));
    write!(out, "[{lon},{lat},{}]", rounded(point.altitude))
}

/// Write the profile as GeoJSON (RFC 7946): the road as a line, and each point with its properties (grades in rad and per
/// cent, altitudes in the datum of the first pass, m). Points without a place are left out.
///
/// # Errors
/// The sentence of [`ProfileError::NoPlaces`] inside an [`io::Error`] of kind `InvalidInput`, and those of the writer.
pub fn write_geojson(profile: &RoadProfile, out: &mut impl Write) -> io::Result<()> {
    let placed: Vec<(f64, RoadPoint)> = profile.points.iter().filter(|(_, p)| is_placed(p)).collect();
    if placed.len() < 2 {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, ProfileError::NoPlaces.to_string()));
    }
    writeln!(out, "{{\"type\":\"FeatureCollection\",\"features\":[")?;
    write!(out, "{{\"type\":\"Feature\",\"properties\":{{\"passes\":{}}},", profile.passes)?;
    write!(out, "\"geometry\":{{\"type\":\"LineString\",\"coordinates\":[")?;
    for (index, (_, point)) in placed.iter().enumerate() {
        if index > 0 {
            write!(out, ",")?;
        }
        coordinates(point, out)?;
    }
    write!(out, "]}}}}")?;
    for (distance, p) in &placed {
        write!(out, ",\n{{\"type\":\"Feature\",\"properties\":{{\"distance\":{}", rounded(*distance))?;
        let per_cent = 100.0 * p.grade.tan();
        for (name, value) in [
            ("grade", p.grade),
            ("grade_sigma", p.grade_sigma),
            ("grade_percent", per_cent),
            ("altitude_sigma", p.altitude_sigma),
            ("passes", p.passes),
        ] {
            if value.is_finite() {
                write!(out, ",\"{name}\":{}", rounded(value))?;
            }
        }
        write!(out, "}},\"geometry\":{{\"type\":\"Point\",\"coordinates\":")?;
        coordinates(p, out)?;
        write!(out, "}}}}")?;
    }
    writeln!(out, "\n]}}")
}
