//! The road: its profile from the latest slope estimate and the passes that are kept, what can be known of it, and what the
//! drive says of its own sensors.

use drivescope_drive::channel::Series;
use drivescope_drive::param::Params;
use drivescope_drive::summary::{Spread, distances};
use drivescope_drive::vehicle::VehicleParams;
use drivescope_estimation::latency::{WheelLatency, find_wheel_latency};
use drivescope_estimation::levelling::{ForwardOffset, find_forward_offset};
use drivescope_estimation::road_profile::{RoadProfile, SPACING, write_csv, write_geojson};
use drivescope_estimation::slope::SlopeParams;
use drivescope_estimation::slope::observability::{Available, REASONS, lamp_series};
use js_sys::{Float64Array, Uint8Array};
use serde::Serialize;
use wasm_bindgen::prelude::*;

use crate::session::Session;
use drivescope_door::{plain, sentence};

/// What a session keeps of roads; passes outlive the drive.
#[derive(Default)]
pub struct Road {
    /// Passes of drives by name, in the order in which they were kept.
    kept: Vec<(String, Vec<RoadProfile>)>,
    profile: Option<RoadProfile>,
    lamps: Option<Series>,
}

/// What a profile was made of.
#[derive(Serialize)]
struct ProfileReport {
    /// Names of the drives that are kept, and whether each shares a stretch with this road.
    kept: Vec<(String, bool)>,
    /// Passes of this drive, and of all.
    laps: usize,
    passes: usize,
    points: usize,
    length: f64,
    /// Why there is none.
    refusal: Option<String>,
}

/// What a drive says of its own sensors, where it is clear.
#[derive(Serialize)]
struct Offers {
    latency: Option<WheelLatency>,
    is_late: bool,
    offset: Option<ForwardOffset>,
    is_offset: bool,
    /// Whether the receiver's height could be used and is not.
    has_height: bool,
}

impl Road {
    /// The profile over its distance (`profile`), or the lamps along the drive (`lamps`).
    pub fn series(&self, which: &str) -> Option<&Series> {
        if which == "lamps" { self.lamps.as_ref() } else { self.profile.as_ref().map(|p| p.points.series()) }
    }

    /// Another drive is open: only the passes that were kept are left.
    pub fn clear(&mut self) {
        (self.profile, self.lamps) = (None, None);
    }
}

#[wasm_bindgen]
impl Session {
    /// Make the profile of the road from the current slope estimate, whose pass is called `name`: its laps and the kept passes
    /// over the same road merged. The source `road:profile` holds it, over distance in place of time.
    pub fn profile(&mut self, name: &str) -> Result<JsValue, JsError> {
        self.road.profile = None;
        let mut kept: Vec<(String, bool)> = self.road.kept.iter().map(|(own, _)| (own.clone(), own == name)).collect();
        let report = |kept, laps: usize, profile: Result<&RoadProfile, String>| {
            plain(&ProfileReport {
                kept,
                laps,
                passes: profile.as_ref().map_or(0, |p| p.passes),
                points: profile.as_ref().map_or(0, |p| p.points.len()),
                length: profile.as_ref().map_or(0.0, |p| p.length()),
                refusal: profile.err(),
            })
        };
        let Some(laps) = self.laps()? else { return report(kept, 0, Err(String::new())) };
        let others = self.road.kept.iter().enumerate().filter(|(_, (own, _))| own != name);
        let (owner, others): (Vec<usize>, Vec<RoadProfile>) =
            others.flat_map(|(k, (_, passes))| passes.iter().map(move |pass| (k, pass.clone()))).unzip();
        let (merged, is_common) = RoadProfile::of_laps(&laps, &others).map_err(sentence)?;
        for (k, is_common) in owner.into_iter().zip(is_common) {
            kept[k].1 |= is_common;
        }
        let out = report(kept, laps.len(), Ok(&merged));
        self.road.profile = Some(merged);
        out
    }

    /// Keep this drive's passes, to be merged with those of others over the same road.
    pub fn keep_pass(&mut self, name: String) -> Result<(), JsError> {
        if let Some(laps) = self.laps()? {
            self.road.kept.retain(|(other, _)| *other != name);
            self.road.kept.push((name, laps));
        }
        Ok(())
    }

    /// Forget every pass that is kept.
    pub fn forget_passes(&mut self) {
        self.road.kept.clear();
    }

    /// The profile as a file: GeoJSON, else CSV.
    pub fn profile_file(&self, is_map: bool) -> Result<Uint8Array, JsError> {
        let Some(profile) = &self.road.profile else { return Err(JsError::new("there is no road profile")) };
        let mut text = Vec::new();
        if is_map { write_geojson(profile, &mut text) } else { write_csv(profile, &mut text) }.map_err(sentence)?;
        Ok(Uint8Array::from(text.as_slice()))
    }

    /// Find out along the current slope estimate which quantities can be known; the source `road:lamps` holds it. Gives the
    /// reasons by their number, from 1.
    pub fn lamps(&mut self, vehicle: Option<String>) -> Result<JsValue, JsError> {
        let vehicle = vehicle.and_then(|name| VehicleParams::preset(&name));
        self.road.lamps = match self.slots.get("slope").and_then(|slot| slot.current.as_ref()) {
            Some(run) => {
                let params = SlopeParams::from_json(&run.params).map_err(sentence)?;
                Some(lamp_series(&run.series, &self.drive, &params, vehicle.as_ref()))
            }
            None => None,
        };
        plain(&REASONS)
    }

    /// What the drive says of its own sensors: a late wheel speed, an offset of the forward accelerometer.
    pub fn sensor_offers(&self) -> Result<JsValue, JsError> {
        let (latency, offset) = (find_wheel_latency(&self.drive), find_forward_offset(&self.drive));
        let has_height = |use_gnss_height| {
            let params = SlopeParams { use_gnss_height, use_baro: false, ..SlopeParams::default() };
            Available::new(&self.drive, &params).altitude
        };
        plain(&Offers {
            is_late: latency.as_ref().is_some_and(WheelLatency::is_notable),
            latency,
            is_offset: offset.as_ref().is_some_and(ForwardOffset::is_notable),
            offset,
            has_height: has_height(true) && self.drive.baro.is_empty(),
        })
    }

    /// Number, mean, standard deviation, least and greatest of a column's values in a stretch; empty without values.
    pub fn spread(&self, source: &str, column: &str, t0: f64, t1: f64) -> Float64Array {
        let spread = self.column(source, column).and_then(|(series, index)| Spread::of(series, index, (t0, t1)));
        let flat = spread.map_or_else(Vec::new, |s| vec![s.count as f64, s.mean, s.deviation, s.min, s.max]);
        Float64Array::from(flat.as_slice())
    }

    /// Distance that a column of speed makes, at `count` instants evenly from `t0` to `t1`; empty without that column.
    pub fn distance(&self, source: &str, column: &str, t0: f64, t1: f64, count: usize) -> Float64Array {
        let Some((series, index)) = self.column(source, column) else { return Float64Array::new_with_length(0) };
        Float64Array::from(distances(series, index, (t0, t1), count).as_slice())
    }
}

impl Session {
    /// The laps of the drive by the current slope estimate; `None` before there is one.
    fn laps(&self) -> Result<Option<Vec<RoadProfile>>, JsError> {
        let Some(run) = self.slots.get("slope").and_then(|slot| slot.current.as_ref()) else { return Ok(None) };
        RoadProfile::of_pass(&run.series, &self.drive, SPACING).map(|pass| Some(pass.laps())).map_err(sentence)
    }
}
