use drivescope_drive::frames::body_to_nav;

use super::*;

/// One step of a truth, written without the mechanisation: where it goes, how fast, how it is turned.
#[derive(Clone, Copy)]
pub(crate) struct Truth {
    pub(crate) place: Geodetic,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) rotation: Matrix3<f64>,
}

impl Truth {
    pub(crate) fn navigation(&self) -> Navigation {
        Navigation { place: self.place, velocity: self.velocity, body_to_nav: self.rotation }
    }
}

/// The inertial sample that carries one navigation state into the next: the step of SPEC navigation 2 solved for its inputs.
pub(crate) fn inertial_sample(a: &Truth, b: &Truth, dt: f64) -> (Vector3<f64>, Vector3<f64>) {
    let (sin, cos) = a.place.lat.sin_cos();
    let (meridian, transverse) = drivescope_drive::geodesy::radii(a.place.lat);
    let earth = Vector3::new(EARTH_RATE * cos, 0.0, -EARTH_RATE * sin);
    let transport = Vector3::new(
        a.velocity.y / (transverse + a.place.alt),
        -a.velocity.x / (meridian + a.place.alt),
        -a.velocity.y * sin / cos / (transverse + a.place.alt),
    );
    let turn = a.rotation.transpose() * exp_rotation(&((earth + transport) * dt)) * b.rotation;
    let rate = log_rotation(&turn) / dt;
    let gravity = Vector3::new(0.0, 0.0, drivescope_drive::geodesy::gravity(a.place.lat, a.place.alt));
    let force = (b.velocity - a.velocity) / dt - gravity + (earth * 2.0 + transport).cross(&a.velocity);
    let mean = (a.rotation + b.rotation) * 0.5;
    (mean.try_inverse().unwrap() * force, rate)
}

/// A winding, climbing, accelerating drive as a list of states; places follow from the velocities by the trapezoid.
pub(crate) fn winding_drive(seconds: f64, dt: f64) -> Vec<Truth> {
    let mut place = Geodetic { lat: 0.63, lon: 2.2, alt: 50.0 };
    let mut states: Vec<Truth> = Vec::new();
    for k in 0..=(seconds / dt) as usize {
        let t = k as f64 * dt;
        let yaw = 0.6 + 0.8 * (0.11 * t).sin();
        let speed = 12.0 + 8.0 * (0.2 * t).sin();
        let climb = 0.05 * (0.3 * t).sin();
        let velocity =
            Vector3::new(speed * climb.cos() * yaw.cos(), speed * climb.cos() * yaw.sin(), -speed * climb.sin());
        let rotation = body_to_nav(0.03 * (0.7 * t).sin(), climb + 0.01, yaw);
        if let Some(last) = states.last() {
            let (meridian, transverse) = drivescope_drive::geodesy::radii(last.place.lat);
            let moved = (last.velocity + velocity) * (0.5 * dt);
            let lat = last.place.lat + moved.x / (meridian + last.place.alt);
            place.lon += moved.y / ((transverse + last.place.alt) * (0.5 * (lat + last.place.lat)).cos());
            place.lat = lat;
            place.alt -= moved.z;
        }
        states.push(Truth { place, velocity, rotation });
    }
    states
}

/// Catches any term missing or misplaced in the mechanisation: the inputs come from the step's own inverse, so after
/// 14,000 steps only rounding is left (1e-9 m a step in latitude would give 1e-7 m by random walk).
#[test]
fn navigation_without_sensor_errors_closes_on_the_truth() {
    let dt = 0.01;
    let truth = winding_drive(140.0, dt);
    let mut navigation = truth[0].navigation();
    for (k, pair) in truth.windows(2).enumerate() {
        let (force, rate) = inertial_sample(&pair[0], &pair[1], dt);
        navigation.advance(&force, &rate, dt, GravityModel::Wgs84);
        if k % 1000 == 999 {
            navigation.orthonormalize();
        }
    }
    let last = truth[truth.len() - 1];
    let earth = Earth::at(&last.place, GravityModel::Wgs84);
    let errors = navigation.errors_against(&last.navigation(), &earth);
    assert!(errors.fixed_rows::<3>(POSITION).norm() < 1e-6, "{errors}");
    assert!(errors.fixed_rows::<3>(ATTITUDE).norm() < 1e-11, "{errors}");
}

fn fast_flight() -> (Navigation, Vector3<f64>, Vector3<f64>) {
    let navigation = Navigation {
        place: Geodetic { lat: 0.7, lon: 2.0, alt: 300.0 },
        velocity: Vector3::new(110.0, -90.0, 20.0),
        body_to_nav: body_to_nav(0.2, -0.1, 2.3),
    };
    (navigation, Vector3::new(3.0, -2.0, -11.0), Vector3::new(0.1, -0.2, 0.3))
}

/// Mean rates of the errors over a step of `dt`, by central differences through the mechanisation.
fn numeric_rates(dt: f64) -> ErrorRates {
    // Steps: large enough that rounding (1e-9 m in latitude) vanishes, small enough that the curvature does.
    let steps = [1e3, 1.0, 1e-3, 1e-2, 1e-4];
    let (truth, force, rate) = fast_flight();
    let model = GravityModel::Wgs84;
    let run = |column: usize, size: f64| {
        let mut errors = SVector::<f64, STATES>::zeros();
        errors[column] = size;
        let mut indicated = truth;
        indicated.correct(&-errors.fixed_rows::<9>(0).into_owned(), &Earth::at(&truth.place, model));
        indicated.advance(
            &(force + errors.fixed_rows::<3>(ACCEL_BIAS)),
            &(rate + errors.fixed_rows::<3>(GYRO_BIAS)),
            dt,
            model,
        );
        let mut end = truth;
        end.advance(&force, &rate, dt, model);
        let after = indicated.errors_against(&end, &Earth::at(&end.place, model));
        (after - errors.fixed_rows::<9>(0)) / dt
    };
    let mut rates = ErrorRates::zeros();
    for column in 0..STATES {
        let step = steps[column / 3];
        rates.set_column(column, &((run(column, step) - run(column, -step)) / (2.0 * step)));
    }
    rates
}

/// Catches a dropped, misplaced or sign-flipped term of F at 144 m/s, where each is at least ten times its block's tolerance.
/// Richardson extrapolation takes out the F^2 dt / 2 of a finite step. What is left, by blocks (rows position, velocity,
/// attitude): with position the neglected dR/dlat (v/R e^2 = 1e-7) and dg/dlat (8e-9); with attitude and biases the third
/// order, about w f dt^2; else rounding.
#[test]
fn error_rates_are_the_derivative_of_the_mechanisation() {
    const TOLERANCE: [[f64; 5]; 3] =
        [[1e-7, 1e-7, 3e-4, 3e-5, 1e-3], [2e-8, 1e-10, 1e-4, 1e-5, 5e-4], [1e-13, 1e-13, 2e-11, 1e-13, 1e-5]];
    let (navigation, force, _) = fast_flight();
    let earth = Earth::at(&navigation.place, GravityModel::Wgs84);
    let analytic = error_rates(&navigation, &(navigation.body_to_nav * force), &earth, true);
    let numeric = numeric_rates(0.01) * 2.0 - numeric_rates(0.02);
    for row in 0..NAVIGATION_STATES {
        for column in 0..STATES {
            let (model, measured) = (analytic[(row, column)], numeric[(row, column)]);
            let tolerance = TOLERANCE[row / 3][column / 3];
            assert!((model - measured).abs() < tolerance, "F[{row},{column}]: model {model:e} numeric {measured:e}");
        }
    }
}

/// The paper prints plus; with `phi` indicated minus true in the velocity line, a gyro that reads too much must turn the
/// indicated body too far: after one second about the body's z axis the error `phi` is minus the bias, rotated.
#[test]
fn the_gyro_error_enters_the_attitude_line_with_a_minus() {
    let model = GravityModel::Wgs84;
    let place = Geodetic { lat: 0.6, lon: 0.0, alt: 0.0 };
    let mut truth = Navigation { place, velocity: Vector3::zeros(), body_to_nav: body_to_nav(0.0, 0.0, 1.0) };
    let mut indicated = truth;
    let force = Vector3::new(0.0, 0.0, -9.8);
    for _ in 0..100 {
        truth.advance(&force, &Vector3::zeros(), 0.01, model);
        indicated.advance(&force, &Vector3::new(0.0, 0.0, 1e-3), 0.01, model);
    }
    let errors = indicated.errors_against(&truth, &Earth::at(&place, model));
    assert!((errors[ATTITUDE + 2] + 1e-3).abs() < 1e-7, "{errors}");
    let rates = error_rates(&truth, &force, &Earth::at(&place, model), true);
    assert!((rates[(ATTITUDE + 2, GYRO_BIAS + 2)] + 1.0).abs() < 1e-6);
}

/// The reduced model keeps what a car needs and nothing else: every kept term is one of the full model's.
#[test]
fn without_earth_terms_only_the_car_scale_couplings_stay() {
    let (navigation, force, _) = fast_flight();
    let earth = Earth::at(&navigation.place, GravityModel::Wgs84);
    let full = error_rates(&navigation, &force, &earth, true);
    let reduced = error_rates(&navigation, &force, &earth, false);
    let difference = full - reduced;
    // At 144 m/s the dropped terms stay below 2 v / R + 2 w_e = 2e-4 1/s.
    assert!(difference.amax() < 2.5e-4 && difference.amax() > 1e-5, "{}", difference.amax());
    assert!(reduced.iter().filter(|v| **v != 0.0).count() == 3 + 6 + 9 + 9);
}

/// Gravity by choice: constant everywhere, or what the ellipsoid says.
#[test]
fn gravity_follows_the_chosen_model() {
    let place = Geodetic { lat: 36f64.to_radians(), lon: 0.0, alt: 0.0 };
    assert_eq!(Earth::at(&place, GravityModel::Constant).gravity, 9.80665);
    let wgs = Earth::at(&place, GravityModel::Wgs84).gravity;
    // International gravity formula of 1980 at 36 N: 9.780327 (1 + 0.0053024 s2 - 0.0000058 sin^2 72 deg),
    // good to 1e-5.
    assert!((wgs - 9.798_193).abs() < 1e-5, "{wgs}");
}
