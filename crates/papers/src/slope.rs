//! Road slope and motion of a car from wheel speeds and accelerometers: Kim, Kim & Lee 2014.

use crate::claim::Paper;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "slope",
    authors: "Kim, Kim & Lee 2014",
    title: "Vehicle Dynamics and Road Slope Estimation based on Cascade Extended Kalman Filter",
    setting: "",
    claims: &[],
};
