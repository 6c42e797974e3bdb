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
