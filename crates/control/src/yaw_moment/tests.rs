use super::*;
use crate::tyre::LateralTyre;
use drivescope_drive::vehicle::VehicleParams;

fn model() -> YawModel {
    let car = VehicleParams::preset("yun_2007").unwrap();
    YawModel::with_tyre(&car, &LateralTyre::named(TyreName::Table2), 1.0)
}

fn pose(speed: f64, yaw_rate: f64) -> Pose {
    Pose { speed, yaw_rate, ..Pose::default() }
}

#[test]
fn the_reference_rises_with_its_lag_to_the_limited_yaw_rate() {
    let mut control = YawMomentControl::new(YawMomentParams::default(), model());
    let first = control.step(&pose(5.0, 0.0), 0.002_096_67, 0.01);
    // SPEC navigation 9: V delta / L through a lag of 0.1 s.
    assert!((first.yaw_rate_reference - 5.0 * 0.002_096_67 / 0.8 * (1.0 - (-0.1_f64).exp())).abs() < 1e-12);
    let last = (0..500).map(|_| control.step(&pose(5.0, 0.0), 0.0629, 0.01)).last().unwrap();
    assert!((last.yaw_rate_reference - 0.15 * GRAVITY / 5.0).abs() < 1e-9, "limited to 0.15 g");
}

#[test]
fn turning_too_slowly_brakes_the_inner_wheels_and_too_fast_the_outer_ones() {
    for (yaw_rate, braked, free) in [(0.0, [1, 3], [0, 2]), (1.0, [0, 2], [1, 3])] {
        let mut control = YawMomentControl::new(YawMomentParams::default(), model());
        let row = (0..100).map(|_| control.step(&pose(5.0, yaw_rate), 0.0629, 0.01)).last().unwrap();
        let brakes = row.brakes();
        assert!(brakes[braked[0]] > 0.0 && (brakes[braked[0]] / brakes[braked[1]] - 1.5).abs() < 1e-12);
        assert!(brakes[free[0]] == 0.0 && brakes[free[1]] == 0.0);
        assert_eq!(row.moment > 0.0, yaw_rate == 0.0);
    }
}

#[test]
fn without_steering_speed_or_sense_there_is_no_moment() {
    // SPEC navigation 12.12: inactive, not diverging.
    let off = YawMomentParams { yaw_target: YawTarget::Off, ..YawMomentParams::default() };
    let on = YawMomentParams::default();
    for (params, pose, steer) in [
        (on.clone(), pose(5.0, 0.5), 0.0),
        (on.clone(), pose(0.9, 0.5), 0.1),
        (off, pose(5.0, 0.5), 0.1),
        (on.clone(), pose(f64::NAN, 0.5), 0.1),
        (on.clone(), pose(5.0, f64::NAN), 0.1),
        (on, pose(5.0, 0.5), f64::NAN),
    ] {
        let mut control = YawMomentControl::new(params, model());
        let rows: Vec<_> = (0..50).map(|_| control.step(&pose, steer, 0.01)).collect();
        assert!(rows.iter().all(|r| r.moment_command == 0.0 && r.moment == 0.0 && r.yaw_rate_reference.is_finite()));
    }
}

#[test]
fn a_wheel_never_brakes_beyond_its_share_of_the_peak() {
    let model = model();
    for moment in [-1e6, -400.0, 0.0, 400.0, 1e6] {
        let brakes = model.allocate(moment);
        assert!(brakes[0].max(brakes[1]) <= 0.8 * model.front.peak && brakes.iter().all(|b| *b >= 0.0));
        let given = 0.5 * model.track * (brakes[1] + brakes[3] - brakes[0] - brakes[2]);
        assert!(given * moment >= 0.0 && (moment.abs() > 1e3 || (given - moment).abs() < 1e-9));
    }
    assert_eq!(model.allocate(f64::NAN), [0.0; 4]);
}

#[test]
fn an_understeering_car_turns_less_than_its_wheels_are_set() {
    let car = VehicleParams::default();
    let model = YawModel::with_own_tyres(&car, 1.0);
    assert!(
        (model.rear.slope() / model.front.slope()
            - car.rear_cornering * car.cg_to_front / (car.front_cornering * car.cg_to_rear))
            .abs()
            < 1e-12
    );
    let (slow, fast) = (model.steady_yaw_rate(1.0, 0.01) / 1.0, model.steady_yaw_rate(30.0, 0.01) / 30.0);
    assert!(fast < slow);
    // At the steady state of the linear model both rates vanish.
    let (speed, steer) = (20.0, 1e-4);
    let rate = model.steady_yaw_rate(speed, steer);
    let rear_slip = -car.mass * speed * rate * car.cg_to_front / (model.wheelbase() * 2.0 * model.rear.slope());
    let steady =
        Pose { speed, yaw_rate: rate, lateral_speed: speed * rear_slip + car.cg_to_rear * rate, ..Pose::default() };
    let (sideways, turning) = model.rates(&steady, steer);
    // What is left is of third order in the angles: 1e-8 m/s^2 here, 1e-5 at ten times the angle.
    assert!(sideways.abs() < 1e-7 && turning.abs() < 1e-7, "{sideways} {turning}");
}

/// A small generator of its own: numbers in -1 to 1 (splitmix64).
fn next(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 10) as f64 / (1_u64 << 53) as f64 - 1.0
}

#[test]
fn the_whole_controller_reaches_its_surface_on_every_car_inside_the_bounds() {
    // (23) with what the controller really puts out: s s' <= -eta |s| outside the boundary layer, on cars whose yaw inertia
    // differs by up to xi_max either way and whose yaw acceleration differs by up to F_r, with any weights of the surface.
    // The largest moment and the lag of the brakes, which the paper does not have, are out of the way.
    let (mut rng, mut outside, mut slowest) = (3, 0, f64::NEG_INFINITY);
    for _ in 0..50_000 {
        let params = YawMomentParams {
            reaching_rate: 0.05 + 2.5 * (1.0 + next(&mut rng)),
            model_error: 1.0 + next(&mut rng),
            gain_ratio: 1.5 + 0.5 * next(&mut rng),
            boundary_layer: 0.05 + 0.049 * next(&mut rng),
            sideslip_weight: 2.0 * next(&mut rng),
            yaw_rate_weight: 2.5 + 2.4 * next(&mut rng),
            moment_limit: 1e9,
            brake_lag: 0.0,
            ..YawMomentParams::default()
        };
        let (p, model) = (params.clone(), model());
        let mut control = YawMomentControl::new(params, model);
        let pose = Pose {
            speed: 11.0 + 9.0 * next(&mut rng),
            lateral_speed: next(&mut rng),
            yaw_rate: next(&mut rng),
            ..Pose::default()
        };
        let steer = 0.2 * next(&mut rng);
        let row = control.step(&pose, steer, 0.01);
        if steer.abs() < LEAST_STEER || row.surface.abs() < p.boundary_layer {
            continue;
        }
        outside += 1;
        let reference_slope = row.yaw_rate_reference / 0.01;
        let xi = p.gain_ratio.powf(next(&mut rng));
        let (sideways, turning) = model.rates(&pose, steer);
        let turning = turning + p.model_error * next(&mut rng) + xi * row.moment_command / model.inertia;
        let rate = p.sideslip_weight * sideways / pose.speed + p.yaw_rate_weight * (turning - reference_slope);
        let s = row.surface;
        assert!(s * rate <= -p.reaching_rate * s.abs() + 1e-9, "s {s}, rate {rate}, xi {xi}, {p:?}");
        slowest = f64::max(slowest, rate * s.signum() / p.reaching_rate);
    }
    // Random plants come near the bound: the gain is not many times what it has to be.
    assert!(outside > 30_000 && slowest > -2.0, "{outside} {slowest}");
}
