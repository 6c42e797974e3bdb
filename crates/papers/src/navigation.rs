//! Navigation of an unmanned car by satellites, inertial sensors and sliding-mode control: Yun & Yu 2007.

use crate::claim::Paper;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "navigation",
    authors: "Yun & Yu 2007",
    title: "Autonomous Navigation Algorithm Development with Extended Kalman Filter and Sliding Mode Control",
    setting: "",
    claims: &[],
};
