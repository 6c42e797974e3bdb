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
