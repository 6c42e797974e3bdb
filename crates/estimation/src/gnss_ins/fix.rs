//! A satellite fix as the filter uses it: one place, a velocity, and sigmas, whatever columns carried them.

use drivescope_drive::geodesy::{Geodetic, LocalFrame};
use drivescope_drive::satellites::Satellite;
use drivescope_drive::signals::Gnss;
use nalgebra::Vector3;

use super::tuning::GnssInsParams;
use crate::gnss::integrity::Integrity;

/// Origin of logs that hold local metres only: 36 N, 127 E, on the ellipsoid.
pub const NOMINAL_ORIGIN: Geodetic =
    Geodetic { lat: 36.0 * std::f64::consts::PI / 180.0, lon: 127.0 * std::f64::consts::PI / 180.0, alt: 0.0 };
/// No position is believed to be better than this, m.
const SIGMA_FLOOR: f64 = 0.05;

/// A usable fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Where; `None` for a velocity alone. Its height means nothing without `has_height`.
    pub place: Option<Geodetic>,
    /// Whether the height was measured.
    pub has_height: bool,
    /// Whether the receiver gave local metres and no latitude.
    pub is_local: bool,
    /// Sigma of the position, NED, m.
    pub position_sigma: Vector3<f64>,
    /// Velocity, NED, m/s; `None` if not measured. Its down component means nothing without `has_vertical_velocity`.
    pub velocity: Option<Vector3<f64>>,
    /// Whether the vertical velocity was measured.
    pub has_vertical_velocity: bool,
    /// Sigma of the velocity, NED, m/s.
    pub velocity_sigma: Vector3<f64>,
    /// Speed over ground, m/s; NaN if not measured. Known of a standing car that has no course.
    pub ground_speed: f64,
}

impl Fix {
    /// What a record holds; `None` if the receiver says not to use it or it holds nothing. Local metres are of `origin`.
    pub fn read(gnss: &Gnss, origin: Geodetic, params: &GnssInsParams) -> Option<Self> {
        if !gnss.is_usable() {
            return None;
        }
        let (place, has_height, is_local) = Self::place_of(gnss, origin);
        let (north, east) = gnss.horizontal_velocity();
        let has_vertical_velocity = gnss.v_down.is_finite();
        let down = if has_vertical_velocity { gnss.v_down } else { 0.0 };
        let velocity = (north.is_finite() && east.is_finite()).then(|| Vector3::new(north, east, down));
        let ground_speed = gnss.ground_speed();
        if place.is_none() && velocity.is_none() && !ground_speed.is_finite() {
            return None;
        }
        let stated = |sigma: f64, default: f64| {
            let sigma = if sigma > 0.0 && sigma.is_finite() { sigma } else { default };
            (sigma * params.gnss_scale).max(SIGMA_FLOOR)
        };
        let (horizontal, vertical) = (params.gnss_velocity_sigma, params.gnss_vertical_velocity_sigma);
        let (position, height) = (params.gnss_position_sigma, params.gnss_height_sigma);
        Some(Self {
            place,
            has_height,
            is_local,
            position_sigma: Vector3::new(
                stated(gnss.std_north, params.gnss_position_sigma),
                stated(gnss.std_east, params.gnss_position_sigma),
                stated(gnss.std_down, params.gnss_height_sigma),
            ),
            velocity,
            has_vertical_velocity,
            velocity_sigma: Vector3::new(
                horizontal * worse(gnss.std_north, position),
                horizontal * worse(gnss.std_east, position),
                vertical * worse(gnss.std_down, height),
            ) * params.gnss_scale,
            ground_speed,
        })
    }

    /// The fix of raw ranges, for a receiver that gives none: that of the satellites that agree, `None` without such.
    pub fn of_ranges(
        frame: &LocalFrame,
        satellites: &[Satellite],
        integrity: &Integrity,
        params: &GnssInsParams,
    ) -> Option<Self> {
        let checked = integrity.fix(frame, satellites, None).filter(|checked| checked.passes != Some(false))?;
        let fix = checked.fix;
        // The frame at the origin is turned against the one here by 1e-3 rad at 6 km: left out.
        let cofactor = |k: usize| fix.cofactor[(k, k)].max(0.0).sqrt() * params.gnss_scale;
        let spread = Vector3::new(cofactor(0), cofactor(1), cofactor(2));
        let velocity = fix.velocity.map(|(velocity, _)| velocity);
        Some(Self {
            place: Some(frame.to_geodetic(&fix.place)),
            has_height: true,
            is_local: false,
            position_sigma: spread.map(|s| (s * params.range_sigma).max(SIGMA_FLOOR)),
            velocity,
            has_vertical_velocity: velocity.is_some(),
            velocity_sigma: spread * params.range_rate_sigma,
            ground_speed: velocity.map_or(f64::NAN, |v| v.x.hypot(v.y)),
        })
    }

    /// Place, whether its height is measured, and whether it came from local metres.
    fn place_of(gnss: &Gnss, origin: Geodetic) -> (Option<Geodetic>, bool, bool) {
        let height = |v: f64| if v.is_finite() { v } else { 0.0 };
        if gnss.lat.is_finite() && gnss.lon.is_finite() {
            let place = Geodetic { lat: gnss.lat, lon: gnss.lon, alt: height(gnss.alt) };
            return (Some(place), gnss.alt.is_finite(), false);
        }
        if gnss.north.is_finite() && gnss.east.is_finite() {
            let ned = Vector3::new(gnss.north, gnss.east, height(gnss.down));
            return (Some(LocalFrame::new(origin).to_geodetic(&ned)), gnss.down.is_finite(), true);
        }
        (None, false, false)
    }

    /// Course and its sigma, rad: what the velocity's noise makes of it, and 1 deg.
    pub fn course(&self) -> Option<(f64, f64)> {
        let velocity = self.velocity?;
        let sigma = self.velocity_sigma.x / velocity.x.hypot(velocity.y) + 1f64.to_radians();
        Some((velocity.y.atan2(velocity.x), sigma)).filter(|c| c.1.is_finite())
    }
}

/// How many times worse than usual the receiver says its position is, at least 1: so much worse is its velocity too, which
/// comes from the same satellites and of which it says nothing.
fn worse(stated: f64, usual: f64) -> f64 {
    if stated.is_finite() { (stated / usual).max(1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A phone that states 3 m instead of the usual 1.5 m measures velocity twice as badly; a good receiver no better than usual.
    /// With 0.1 m/s for a phone's 0.25 m/s every third velocity of the city loop was refused.
    #[test]
    fn a_receiver_that_states_a_worse_position_is_believed_less_in_velocity() {
        let params = GnssInsParams::default();
        let read = |std: f64| {
            let gnss =
                Gnss { lat: 0.6, lon: 2.0, std_north: std, std_east: 1.5, std_down: 2.0 * std, ..Gnss::default() };
            Fix::read(&gnss, NOMINAL_ORIGIN, &params).unwrap().velocity_sigma
        };
        assert!((read(3.0) - Vector3::new(0.2, 0.1, 0.3)).amax() < 1e-12, "{}", read(3.0));
        for usual in [0.5, 1.5, f64::NAN, -1.0] {
            assert_eq!(read(usual), Vector3::new(0.1, 0.1, 0.15));
        }
    }

    #[test]
    fn sigmas_come_from_the_receiver_if_it_states_them_and_never_fall_below_five_centimetres() {
        let params = GnssInsParams { gnss_scale: 2.0, ..GnssInsParams::default() };
        let gnss = Gnss { lat: 0.6, lon: 2.0, std_north: 0.8, std_east: -1.0, std_down: 1e-4, ..Gnss::default() };
        let fix = Fix::read(&gnss, NOMINAL_ORIGIN, &params).unwrap();
        assert_eq!(fix.position_sigma, Vector3::new(1.6, 3.0, 0.05));
        assert!(!fix.has_height && fix.velocity.is_none());
    }

    #[test]
    fn speed_and_course_make_a_horizontal_velocity() {
        let gnss = Gnss { speed: 4.0, course: 0.5, ..Gnss::default() };
        let fix = Fix::read(&gnss, NOMINAL_ORIGIN, &GnssInsParams::default()).unwrap();
        assert!((fix.ground_speed - 4.0).abs() < 1e-12 && !fix.has_vertical_velocity && fix.place.is_none());
        let (course, sigma) = fix.course().unwrap();
        assert!((course - 0.5).abs() < 1e-12 && (sigma - (0.025 + 1f64.to_radians())).abs() < 1e-12);
    }

    #[test]
    fn a_fix_that_the_receiver_withdraws_or_that_is_empty_is_none() {
        let params = GnssInsParams::default();
        assert!(
            Fix::read(&Gnss { lat: 0.6, lon: 2.0, valid: 0.0, ..Gnss::default() }, NOMINAL_ORIGIN, &params).is_none()
        );
        assert!(Fix::read(&Gnss::default(), NOMINAL_ORIGIN, &params).is_none());
    }

    #[test]
    fn local_metres_come_back_as_local_metres() {
        let gnss = Gnss { north: 300.0, east: -200.0, down: 4.0, ..Gnss::default() };
        let fix = Fix::read(&gnss, NOMINAL_ORIGIN, &GnssInsParams::default()).unwrap();
        let ned = LocalFrame::new(NOMINAL_ORIGIN).to_ned(fix.place.unwrap());
        assert!((ned - Vector3::new(300.0, -200.0, 4.0)).norm() < 1e-7 && fix.is_local && fix.has_height);
    }
}
