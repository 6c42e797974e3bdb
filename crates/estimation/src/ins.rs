//! Strapdown inertial navigation on WGS-84 and the linear model of its errors.
//!
//! State: place (latitude, longitude, height), velocity in local north, east, down, rotation from body (FRD) to that
//! frame. Inputs: specific force and body rates without bias, averaged over the step that ends now.
//! Source: SPEC navigation 2 and 3, after Yun & Yu 2007 (15) to (17) with their misprints put right: the attitude line
//! carries minus the rotated gyro error, and the position line turns with the transport rate. Errors are indicated minus
//! true, the attitude error `phi` is resolved in NED: indicated rotation = `(I - [phi x])` true rotation.
//! Not modelled: the change of the radii and of gravity with latitude (8e-9 1/s^2) and the gravity anomaly.

use drivescope_drive::frames::{exp_rotation, log_rotation, orthonormalize, skew};
use drivescope_drive::geodesy::{EARTH_RATE, Geodetic, STANDARD_GRAVITY, gravity_at, radii_at};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// First of the three position errors: metres north, east, down.
pub const POSITION: usize = 0;
/// First of the three velocity errors: m/s north, east, down.
pub const VELOCITY: usize = 3;
/// First of the three attitude errors: rad about north, east, down.
pub const ATTITUDE: usize = 6;
/// First of the three residual accelerometer biases: m/s^2, body axes.
pub const ACCEL_BIAS: usize = 9;
/// First of the three residual gyro biases: rad/s, body axes.
pub const GYRO_BIAS: usize = 12;
/// Number of navigation errors: position, velocity and attitude.
pub const NAVIGATION_STATES: usize = 9;
/// Number of errors with the biases.
pub const STATES: usize = 15;

/// Rates of the nine navigation errors as a linear function of all fifteen errors.
pub type ErrorRates = SMatrix<f64, NAVIGATION_STATES, STATES>;

/// Which gravity the mechanisation takes off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GravityModel {
    /// Normal gravity of WGS-84 at the latitude and height.
    Wgs84,
    /// Standard gravity 9.80665 m/s^2 everywhere: for synthetic logs made over a flat Earth.
    Constant,
}

/// What the Earth does at one place: rotation, curvature, gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Earth {
    /// Sine of the latitude.
    pub sin_lat: f64,
    /// Cosine of the latitude.
    pub cos_lat: f64,
    /// Metres per radian of latitude: meridian radius plus height.
    pub north_radius: f64,
    /// Transverse radius plus height; times `cos_lat`, metres per radian of longitude.
    pub east_radius: f64,
    /// Gravity, positive down, m/s^2.
    pub gravity: f64,
    /// Decrease of gravity with height, 1/s^2.
    pub gravity_gradient: f64,
}

impl Earth {
    /// The Earth at a place.
    pub fn at(place: &Geodetic, model: GravityModel) -> Self {
        let (sin_lat, cos_lat) = place.lat.sin_cos();
        let sin2 = sin_lat * sin_lat;
        let (meridian, transverse) = radii_at(sin2);
        let gravity = match model {
            GravityModel::Wgs84 => gravity_at(sin2, place.alt),
            GravityModel::Constant => STANDARD_GRAVITY,
        };
        Self {
            sin_lat,
            cos_lat,
            north_radius: meridian + place.alt,
            east_radius: transverse + place.alt,
            gravity,
            gravity_gradient: 2.0 * gravity / (meridian * transverse).sqrt(),
        }
    }

    /// Rotation of the Earth in NED, rad/s.
    pub fn rate(&self) -> Vector3<f64> {
        Vector3::new(EARTH_RATE * self.cos_lat, 0.0, -EARTH_RATE * self.sin_lat)
    }

    /// Rotation of the local NED frame over the Earth at a velocity (NED, m/s), rad/s.
    pub fn transport_rate(&self, velocity: &Vector3<f64>) -> Vector3<f64> {
        let east = velocity.y / self.east_radius;
        Vector3::new(east, -velocity.x / self.north_radius, -east * self.sin_lat / self.cos_lat)
    }

    /// A small displacement (NED, m) as steps of latitude, longitude (rad) and height (m).
    pub fn to_geodetic_step(&self, ned: &Vector3<f64>) -> Geodetic {
        Geodetic { lat: ned.x / self.north_radius, lon: ned.y / (self.east_radius * self.cos_lat), alt: -ned.z }
    }

    /// From `origin` to a `place` near it, NED, m, by the radii of curvature here.
    pub fn displacement(&self, origin: &Geodetic, place: &Geodetic) -> Vector3<f64> {
        Vector3::new(
            (place.lat - origin.lat) * self.north_radius,
            (place.lon - origin.lon) * self.east_radius * self.cos_lat,
            origin.alt - place.alt,
        )
    }
}

/// Where the vehicle is, how it moves and how it is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Navigation {
    /// Latitude, longitude and height.
    pub place: Geodetic,
    /// Velocity over ground in local north, east, down, m/s.
    pub velocity: Vector3<f64>,
    /// Rotation from body to local north, east, down.
    pub body_to_nav: Matrix3<f64>,
}

impl Navigation {
    /// Move on by one inertial sample of length `dt` s; returns the mean specific force in NED, m/s^2.
    ///
    /// `specific_force` (m/s^2) and `rate` (rad/s) are without bias and averaged over the step.
    pub fn advance(
        &mut self,
        specific_force: &Vector3<f64>,
        rate: &Vector3<f64>,
        dt: f64,
        model: GravityModel,
    ) -> Vector3<f64> {
        let earth = Earth::at(&self.place, model);
        let earth_rate = earth.rate();
        let transport_rate = earth.transport_rate(&self.velocity);
        let frame_turn = exp_rotation(&((earth_rate + transport_rate) * -dt));
        let after = frame_turn * (self.body_to_nav * exp_rotation(&(rate * dt)));
        let force = (self.body_to_nav + after) * specific_force * 0.5;
        let mut acceleration = force - (earth_rate * 2.0 + transport_rate).cross(&self.velocity);
        acceleration.z += earth.gravity;
        let velocity = self.velocity + acceleration * dt;
        let moved = (self.velocity + velocity) * (0.5 * dt);
        let lat = self.place.lat + moved.x / earth.north_radius;
        let mean_cos = (0.5 * (self.place.lat + lat)).cos();
        self.place.lon += moved.y / (earth.east_radius * mean_cos);
        self.place.lat = lat;
        self.place.alt -= moved.z;
        self.velocity = velocity;
        self.body_to_nav = after;
        force
    }

    /// Make the rotation a rotation again: rounding damages it by about 1e-16 a step.
    pub fn orthonormalize(&mut self) {
        self.body_to_nav = orthonormalize(&self.body_to_nav);
    }

    /// Take the nine navigation errors off.
    pub fn correct(&mut self, errors: &SVector<f64, NAVIGATION_STATES>, earth: &Earth) {
        let step = earth.to_geodetic_step(&errors.fixed_rows::<3>(POSITION).into_owned());
        self.place.lat -= step.lat;
        self.place.lon -= step.lon;
        self.place.alt -= step.alt;
        self.velocity -= errors.fixed_rows::<3>(VELOCITY);
        self.body_to_nav = exp_rotation(&errors.fixed_rows::<3>(ATTITUDE).into_owned()) * self.body_to_nav;
    }

    /// The nine errors of this state against a `truth` near it: indicated minus true.
    pub fn errors_against(&self, truth: &Self, earth: &Earth) -> SVector<f64, NAVIGATION_STATES> {
        let mut errors = SVector::<f64, NAVIGATION_STATES>::zeros();
        errors.fixed_rows_mut::<3>(POSITION).copy_from(&earth.displacement(&truth.place, &self.place));
        errors.fixed_rows_mut::<3>(VELOCITY).copy_from(&(self.velocity - truth.velocity));
        let phi = -log_rotation(&(self.body_to_nav * truth.body_to_nav.transpose()));
        errors.fixed_rows_mut::<3>(ATTITUDE).copy_from(&phi);
        errors
    }
}

/// How the errors of `navigation` grow under a specific force (NED, m/s^2).
///
/// Yun & Yu 2007 (15) to (17), corrected (SPEC navigation 3). Without `earth_terms` only what matters to a car between
/// two fixes is kept: position from velocity, velocity from tilt and accelerometer bias, attitude from gyro bias.
pub fn error_rates(navigation: &Navigation, force: &Vector3<f64>, earth: &Earth, earth_terms: bool) -> ErrorRates {
    let mut f = ErrorRates::zeros();
    f.fixed_view_mut::<3, 3>(POSITION, VELOCITY).fill_with_identity();
    f.fixed_view_mut::<3, 3>(VELOCITY, ATTITUDE).copy_from(&skew(force));
    f.fixed_view_mut::<3, 3>(VELOCITY, ACCEL_BIAS).copy_from(&navigation.body_to_nav);
    f.fixed_view_mut::<3, 3>(ATTITUDE, GYRO_BIAS).copy_from(&-navigation.body_to_nav); // (17)
    if earth_terms {
        add_earth_terms(&mut f, &navigation.velocity, earth);
    }
    f
}

fn add_earth_terms(f: &mut ErrorRates, v: &Vector3<f64>, earth: &Earth) {
    let (north, east) = (1.0 / earth.north_radius, 1.0 / earth.east_radius);
    let tan = earth.sin_lat / earth.cos_lat;
    let (earth_rate, transport_rate) = (earth.rate(), earth.transport_rate(v));
    let mut earth_rate_by_position = Matrix3::zeros();
    earth_rate_by_position[(0, 0)] = -EARTH_RATE * earth.sin_lat * north;
    earth_rate_by_position[(2, 0)] = -EARTH_RATE * earth.cos_lat * north;
    let mut transport_by_position = Matrix3::zeros();
    transport_by_position[(0, 2)] = v.y * east * east;
    transport_by_position[(1, 2)] = -v.x * north * north;
    transport_by_position[(2, 0)] = -v.y * east * north / (earth.cos_lat * earth.cos_lat);
    transport_by_position[(2, 2)] = -v.y * tan * east * east;
    let transport_by_velocity = Matrix3::new(0.0, east, 0.0, -north, 0.0, 0.0, 0.0, -tan * east, 0.0);
    let position_by_position = Matrix3::new(
        -v.z * north,
        0.0,
        v.x * north,
        v.y * tan * north,
        -(v.z * east + v.x * tan * north),
        v.y * east,
        0.0,
        0.0,
        0.0,
    );
    let mut velocity_by_position = skew(v) * (earth_rate_by_position * 2.0 + transport_by_position);
    velocity_by_position[(2, 2)] += earth.gravity_gradient;
    let velocity_by_velocity = skew(v) * transport_by_velocity - skew(&(earth_rate * 2.0 + transport_rate));
    f.fixed_view_mut::<3, 3>(POSITION, POSITION).copy_from(&position_by_position); // (17)
    f.fixed_view_mut::<3, 3>(VELOCITY, POSITION).copy_from(&velocity_by_position);
    f.fixed_view_mut::<3, 3>(VELOCITY, VELOCITY).copy_from(&velocity_by_velocity); // (17)
    f.fixed_view_mut::<3, 3>(ATTITUDE, POSITION).copy_from(&(earth_rate_by_position + transport_by_position));
    f.fixed_view_mut::<3, 3>(ATTITUDE, VELOCITY).copy_from(&transport_by_velocity);
    f.fixed_view_mut::<3, 3>(ATTITUDE, ATTITUDE).copy_from(&-skew(&(earth_rate + transport_rate))); // (17)
}

#[cfg(test)]
#[path = "ins_tests.rs"]
pub(crate) mod tests;
