//! What the papers claim, tried here: each verdict of the gallery is asserted, for and against. A failure means that an
//! estimator, a drive or a limit has changed what the gallery tells its reader.
#![allow(clippy::unwrap_used)]

use drivescope_papers::{PAPERS, Verdict, attempt};

/// Try a claim and print its figures, so that a failure shows them.
fn verdict(id: &str) -> Verdict {
    let finding = attempt(id).unwrap();
    for figure in &finding.figures {
        println!("{}: {:.3} {} (limits {:?})", figure.name, figure.value, figure.unit, figure.limits);
    }
    finding.verdict
}

#[test]
fn the_static_solution_fails_in_turns_and_is_good_on_a_bank() {
    assert_eq!(verdict("orientation/static_vectors"), Verdict::Supported);
}

/// Navigation grade ends a few metres off as the paper has it, the small sensors of such a car hundreds.
#[test]
fn inertial_navigation_alone_ends_a_metre_off_with_a_navigation_grade_sensor_only() {
    assert_eq!(verdict("navigation/inertial_alone"), Verdict::Partly);
}

#[test]
fn satellites_alone_scatter_and_the_receiver_filter_narrows_that() {
    assert_eq!(verdict("navigation/receiver_alone"), Verdict::Supported);
}

/// The paper gives no number but the picture: the drive ends at its destination. Loosely coupled without aids, tightly with them,
/// and smoothed: within the 2.5 m that a receiver of such ranges is off (its own fixes are 1.76 m RMS).
#[test]
fn satellites_and_inertial_sensors_together_reach_the_destination() {
    assert_eq!(verdict("navigation/integrated"), Verdict::Supported);
    let figures = attempt("navigation/integrated").unwrap().figures;
    let values: Vec<f64> = figures.iter().map(|f| f.value).collect();
    // RMS and end of loose, tight, smoothed; the receiver alone is at 1.76 and 1.71 m: no run may be worse than its input.
    assert!(values.len() == 6 && values.iter().all(|v| *v > 0.0 && *v < 2.5), "{values:?}");
    assert!([0, 2, 4].iter().all(|&k| values[k] < 1.8), "{values:?}");
}

/// A yaw that is wrong by 45 or -20 deg is right within seconds of the first metres, told that it may be so wrong; the car drives
/// off at 10 s. Yaw better than 3 deg in time, at the end, and the place reached.
#[test]
fn a_start_heading_wrong_by_45_or_20_degrees_converges_on_the_first_metres() {
    assert_eq!(verdict("navigation/wrong_heading"), Verdict::Supported);
    let figures = attempt("navigation/wrong_heading").unwrap().figures;
    for of in figures.chunks(3) {
        assert!(of[0].value > 10.0 && of[0].value < 25.0, "not before it drives, and within 15 s: {of:?}");
        assert!(of[1].value < 1.0 && of[2].value < 2.5, "{of:?}");
    }
    assert_eq!(figures.len(), 6);
}

/// No fix below four satellites; but four suffice, and a tightly coupled filter uses two.
#[test]
fn fewer_than_four_satellites_give_no_fix_but_still_help() {
    assert_eq!(verdict("navigation/four_satellites"), Verdict::Partly);
}

#[test]
fn inertial_sensors_bridge_seconds_and_with_the_odometer_a_minute() {
    assert_eq!(verdict("navigation/outage"), Verdict::Partly);
}

#[test]
fn nine_states_give_attitude_and_biases() {
    assert_eq!(verdict("navigation/nine_states"), Verdict::Supported);
}

#[test]
fn the_suspension_model_is_accurate_on_the_flat_and_blind_to_slopes() {
    assert_eq!(verdict("orientation/suspension_model"), Verdict::Supported);
}

#[test]
fn the_model_steadies_the_yaw_on_the_flat_and_not_on_banks_and_slopes() {
    assert_eq!(verdict("orientation/model_steadies_yaw"), Verdict::Partly);
}

#[test]
fn the_integrated_estimator_loses_its_steady_error_but_not_on_a_climb() {
    assert_eq!(verdict("orientation/integrated"), Verdict::Partly);
}

#[test]
fn the_integrated_estimator_is_not_the_more_robust_one_on_compound_slopes() {
    assert_eq!(verdict("orientation/compound_slopes"), Verdict::NotSupported);
}

#[test]
fn the_springs_read_a_bank_too_small_and_more_process_noise_does_not_help() {
    assert_eq!(verdict("orientation/bank_too_small"), Verdict::Supported);
}

#[test]
fn steel_beside_the_road_spoils_the_yaw() {
    assert_eq!(verdict("orientation/local_field"), Verdict::Supported);
}

#[test]
fn another_car_and_cheaper_sensors_need_no_other_tuning_on_the_flat() {
    assert_eq!(verdict("orientation/little_tuning"), Verdict::Supported);
}

#[test]
fn the_goal_is_reached_from_wrong_headings_and_the_line_is_not_followed() {
    assert_eq!(verdict("control/goal"), Verdict::Supported);
}

#[test]
fn without_the_filter_the_vehicle_strays_by_some_20_cm_but_does_not_converge() {
    assert_eq!(verdict("control/free_line"), Verdict::Partly);
}

#[test]
fn the_obstacle_is_passed_and_the_line_found_at_31_m_but_not_6_m_earlier_than_without_the_filter() {
    assert_eq!(verdict("control/obstacle"), Verdict::Partly);
}

#[test]
fn the_lateral_acceleration_of_the_j_turn_comes_down_from_0_2_to_0_15_g() {
    assert_eq!(verdict("control/j_turn"), Verdict::Supported);
}

#[test]
fn with_a_yaw_moment_of_zero_the_car_does_not_turn() {
    assert_eq!(verdict("control/moment_to_zero"), Verdict::NotSupported);
}

#[test]
fn without_steering_nothing_diverges() {
    assert_eq!(verdict("control/no_steering"), Verdict::NotSupported);
}

#[test]
fn the_printed_gain_does_not_reach_the_surface_and_the_corrected_one_does() {
    assert_eq!(verdict("control/reaching"), Verdict::NotSupported);
    let finding = attempt("control/reaching").unwrap();
    assert_eq!(finding.figures[1].value, 0.0, "{finding:?}");
}

#[test]
fn the_boundary_layer_ends_the_chattering() {
    assert_eq!(verdict("control/chattering"), Verdict::Supported);
}

#[test]
fn removing_the_slip_helps_the_path_and_not_the_place() {
    assert_eq!(verdict("control/slip"), Verdict::Partly);
}

#[test]
fn a_climb_of_15_degrees_is_found_before_and_after_the_gear_shift() {
    assert_eq!(verdict("slope/climb"), Verdict::Supported);
}

#[test]
fn hard_driving_on_the_flat_shows_as_slope_but_not_because_of_the_body_alone() {
    assert_eq!(verdict("slope/flat"), Verdict::Partly);
}

#[test]
fn the_estimated_acceleration_is_quieter_than_the_measured_one_as_in_table_3() {
    assert_eq!(verdict("slope/table_3"), Verdict::Supported);
}

#[test]
fn the_slope_follows_the_pitch_by_84_per_cent_on_slopes_and_less_where_they_are_gentle() {
    assert_eq!(verdict("slope/correlation"), Verdict::Partly);
}

#[test]
fn one_filter_can_estimate_forces_and_slope_together() {
    assert_eq!(verdict("slope/one_filter_cannot"), Verdict::NotSupported);
}

#[test]
fn the_pitch_of_the_body_can_be_taken_off_the_slope() {
    assert_eq!(verdict("slope/pitch_apart"), Verdict::Supported);
}

#[test]
fn every_claim_says_what_it_is_and_its_trials_have_names_of_their_own() {
    for paper in PAPERS {
        for claim in paper.claims {
            let id = format!("{}/{}", paper.id, claim.id);
            assert!(claim.says.ends_with('.') && claim.remark.ends_with('.') && !claim.place.is_empty(), "{id}");
            for (index, trial) in claim.trials.iter().enumerate() {
                assert!(drivescope_estimation::registry::find(trial.estimator).is_some(), "{id}: {}", trial.estimator);
                assert!(claim.trials[..index].iter().all(|t| t.name != trial.name), "{id}: {} twice", trial.name);
            }
            assert!(paper.claims.iter().filter(|c| c.id == claim.id).count() == 1, "{id} twice");
        }
    }
}

#[test]
fn rest_straight_and_corner_are_told_from_inertial_sensors_alone() {
    assert_eq!(verdict("motion/modes"), Verdict::Supported);
}

#[test]
fn the_step_of_the_forward_acceleration_finds_the_launch_early() {
    assert_eq!(verdict("motion/launch"), Verdict::Supported);
}

#[test]
fn six_accelerometers_and_a_gyro_give_rates_that_do_not_drift() {
    assert_eq!(verdict("motion/rates"), Verdict::Supported);
}

#[test]
fn modes_make_an_inertial_navigator_far_better_than_alone() {
    assert_eq!(verdict("motion/navigation"), Verdict::Supported);
}

#[test]
fn with_the_disk_the_modes_gain_less() {
    assert_eq!(verdict("motion/disk_navigation"), Verdict::Partly);
}

#[test]
fn satellites_and_the_disk_navigate_through_an_outage() {
    assert_eq!(verdict("motion/satellites"), Verdict::Supported);
}
