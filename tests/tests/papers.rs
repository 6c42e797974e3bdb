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
fn rest_straight_and_corner_are_told_from_inertial_sensors_alone_but_stops_come_late() {
    assert_eq!(verdict("motion/modes"), Verdict::Partly);
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
