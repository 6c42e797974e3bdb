//! The plant against what is known without it: statics, momentum, energy, steady cornering.

#![allow(clippy::unwrap_used)]

use drivescope_drive::vehicle::VehicleParams;
use drivescope_simulation::DriveSpec;
use drivescope_simulation::car::Car;
use drivescope_simulation::math::roll_pitch_yaw;
use drivescope_simulation::plant::{Inputs, Plant, STEP};
use drivescope_simulation::road::Road;

const GRAVITY: f64 = 9.8;

fn road(length: f64, grade_percent: f64, bank_deg: f64) -> Road {
    let text = format!(
        r#"{{"name": "x", "description": "y", "heading_deg": 40, "segments": [
            {{"length": {length}, "speed_kmh": 50, "grade_percent": {grade_percent}, "bank_deg": {bank_deg}}}]}}"#
    );
    Road::new(&DriveSpec::from_json(&text).unwrap())
}

fn plant(road: &Road, params: VehicleParams) -> Plant {
    Plant::new(Car::new("saloon", params, GRAVITY), road, 5.0, GRAVITY)
}

fn saloon() -> VehicleParams {
    VehicleParams::preset("saloon").unwrap()
}

fn run(plant: &mut Plant, road: &Road, inputs: &Inputs, seconds: f64) {
    (0..(seconds / STEP) as usize).for_each(|_| plant.step(road, inputs));
}

const HELD: Inputs = Inputs { steer: 0.0, drive: [0.0; 4], brake: [1500.0; 4] };

#[test]
fn a_car_parked_on_the_level_stays_where_it_is_and_level() {
    let road = road(100.0, 0.0, 0.0);
    let mut plant = plant(&road, saloon());
    let before = plant.place();
    run(&mut plant, &road, &HELD, 60.0);
    let [roll, pitch, _] = roll_pitch_yaw(&plant.attitude());
    assert!((plant.place() - before).norm() < 1e-9, "creeps");
    assert!(plant.velocity().norm() < 1e-12);
    assert!(roll.abs() < 1e-9 && pitch.abs() < 1e-9, "the springs' rest must be level: {roll} {pitch}");
    assert_eq!(plant.rim_speed(), [0.0; 4]);
}

#[test]
fn a_braked_car_stands_on_a_steep_grade_and_a_steep_bank_and_its_wheels_carry_its_weight() {
    for (grade_percent, bank_deg) in [(26.8, 0.0), (-26.8, 0.0), (0.0, 20.0), (10.0, -15.0)] {
        let road = road(100.0, grade_percent, bank_deg);
        let mut plant = plant(&road, saloon());
        run(&mut plant, &road, &HELD, 15.0);
        let settled = plant.place();
        run(&mut plant, &road, &HELD, 30.0);
        assert!((plant.place() - settled).norm() < 1e-7, "creeps at {grade_percent} % and {bank_deg} deg");
        let normal = plant.patch().axes[(2, 2)];
        let load: f64 = plant.forces().load.iter().sum();
        // The springs push along the road's normal; the tyres carry the rest along the road.
        assert!((load / (plant.car.mass * GRAVITY * normal) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn without_brakes_a_car_rolls_down_a_hill_and_rolling_resistance_holds_it_on_a_slight_one() {
    let steep = road(200.0, -5.0, 0.0);
    let mut rolling = plant(&steep, saloon());
    run(&mut rolling, &steep, &Inputs::default(), 5.0);
    let expected = GRAVITY * (0.05 - 0.011) / (1.0 + 4.0 * 1.7 / 0.344_f64.powi(2) / 1750.0) * 5.0;
    // Drag at 2 m/s is 1 % of the slope's force, and the first moments go into the springs.
    assert!((rolling.velocity().norm() / expected - 1.0).abs() < 0.04, "{}", rolling.velocity().norm());
    let slight = road(200.0, -0.5, 0.0);
    let mut held = plant(&slight, saloon());
    run(&mut held, &slight, &Inputs::default(), 20.0);
    assert!(held.velocity().norm() < 1e-9);
}

#[test]
fn coasting_straight_loses_momentum_to_drag_and_rolling_only() {
    let road = road(2000.0, 0.0, 0.0);
    let mut plant = plant(&road, saloon());
    plant.set_speed(20.0);
    run(&mut plant, &road, &Inputs::default(), 2.0);
    let (start, place) = (plant.velocity().norm(), plant.place());
    run(&mut plant, &road, &Inputs::default(), 5.0);
    let (end, gone) = (plant.velocity().norm(), (plant.place() - place).norm());
    let with_wheels = plant.car.mass + 4.0 * plant.car.common.wheel_inertia / plant.car.common.wheel_radius.powi(2);
    let lost = with_wheels * (start - end);
    let resisted = plant.car.resistance(0.5 * (start + end)) * 5.0;
    assert!((lost / resisted - 1.0).abs() < 0.005, "{lost} N s against {resisted} N s");
    // The trapezoid of two ends misses the bend of the speed: 5^2 / 12 times the change of 0.03 m/s^2.
    assert!((gone - 2.5 * (start + end)).abs() < 0.1);
    assert!(plant.offset().abs() < 1e-9, "a symmetric car runs straight");
}

#[test]
fn energy_never_rises_without_an_engine_and_falls_by_the_work_of_the_resistances() {
    let road = road(2000.0, -4.0, 0.0);
    let mut plant = plant(&road, saloon());
    plant.set_speed(10.0);
    run(&mut plant, &road, &Inputs::default(), 2.0);
    let (mut energy, mut work) = (plant.energy(), 0.0);
    let before = energy;
    for _ in 0..100 {
        let place = plant.place();
        run(&mut plant, &road, &Inputs::default(), 0.1);
        assert!(plant.energy() < energy);
        energy = plant.energy();
        work += plant.car.resistance(plant.velocity().norm()) * (plant.place() - place).norm();
    }
    assert!(((before - energy) / work - 1.0).abs() < 0.01, "{} J against {work} J", before - energy);
}

/// Corner with a fixed steering angle at a held speed; returns yaw rate (rad/s), the mean speed and the car.
fn corner(params: VehicleParams, speed: f64, steer: f64) -> (f64, f64, Plant) {
    let road = road(5000.0, 0.0, 0.0);
    let mut plant = plant(&road, params);
    plant.set_speed(speed);
    let mut inputs = Inputs { steer, ..Inputs::default() };
    for _ in 0..5000 {
        let forward = plant.attitude().column(0).dot(&plant.velocity());
        inputs.drive[..2].fill(0.5 * (plant.car.resistance(speed) + 4000.0 * (speed - forward)) * 0.344);
        plant.step(&road, &inputs);
    }
    (plant.rate().z, plant.velocity().norm(), plant)
}

#[test]
fn softer_front_tyres_understeer_and_softer_rear_tyres_oversteer_by_the_textbook_amount() {
    let swapped = VehicleParams { front_cornering: 21.92, rear_cornering: 19.73, ..saloon() };
    for (params, sign) in [(saloon(), 1.0), (swapped, -1.0)] {
        let (rate, speed, plant) = corner(params.clone(), 15.0, 0.012);
        let base = plant.car.wheelbase();
        let neutral = speed * 0.012 / base;
        assert!((neutral - rate) * sign > 0.0, "turns to the right and the wrong amount: {rate} against {neutral}");
        let gradient = (1.0 / params.front_cornering - 1.0 / params.rear_cornering) / GRAVITY;
        let linear = speed * 0.012 / (base + gradient * speed * speed);
        // 1 m/s^2: a tenth of the tyres' friction; load transfer and the tyres' curvature stay below 3 %.
        assert!((rate / linear - 1.0).abs() < 0.03, "{rate} against {linear}");
    }
}

#[test]
fn cornering_rolls_the_body_outward_by_the_shared_parameters_and_shifts_the_load() {
    let (rate, speed, plant) = corner(saloon(), 15.0, 0.035);
    let p = saloon();
    let [roll, ..] = roll_pitch_yaw(&plant.attitude());
    let lateral = rate * speed;
    let specific = lateral - GRAVITY * roll.sin();
    let expected = -p.sprung_mass * p.sprung_cg_arm * specific / p.roll_stiffness;
    assert!(roll < 0.0, "turning right the body leans left");
    assert!((roll / expected - 1.0).abs() < 0.02, "{roll} against {expected}");
    let load = plant.forces().load;
    let shifted = load[0] + load[2] - load[1] - load[3];
    // Both sides of the roll moment: tyre forces at the ground and the weight that moved with the body.
    let moment = p.mass * (lateral * p.cg_height + GRAVITY * plant.car.link_depth * roll.abs());
    assert!((shifted * 0.5 * p.track / moment - 1.0).abs() < 0.02, "{} against {moment}", shifted * 0.5 * p.track);
}

#[test]
fn braking_dives_and_loads_the_front_axle() {
    let road = road(2000.0, 0.0, 0.0);
    let mut plant = plant(&road, saloon());
    plant.set_speed(25.0);
    let inputs = Inputs { brake: [900.0, 900.0, 450.0, 450.0], ..Inputs::default() };
    run(&mut plant, &road, &inputs, 2.0);
    let before = plant.velocity().norm();
    run(&mut plant, &road, &inputs, 0.5);
    let braking = (before - plant.velocity().norm()) / 0.5;
    let p = saloon();
    let [_, pitch, _] = roll_pitch_yaw(&plant.attitude());
    let expected = -p.sprung_mass * p.sprung_cg_arm * braking / p.pitch_stiffness;
    assert!((pitch / expected - 1.0).abs() < 0.06, "{pitch} against {expected}");
    let load = plant.forces().load;
    let shifted = load[0] + load[1] - 2.0 * plant.car.rest_load[0];
    let moved = p.mass * braking * p.cg_height / plant.car.wheelbase();
    // Air drag acts at the centre of gravity, not at the ground: 0.24 of 4.7 m/s^2.
    assert!((shifted / moved - 1.0).abs() < 0.07, "{shifted} against {moved}");
}
