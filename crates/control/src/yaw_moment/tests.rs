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
