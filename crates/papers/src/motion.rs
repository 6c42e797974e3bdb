//! Motion modes and a land navigation system aided by them: Lee et al. 2010.

use crate::claim::Paper;

/// The chapter.
pub const PAPER: Paper = Paper {
    id: "motion",
    authors: "Lee et al. 2010",
    title: "Motion mode recognition and a land navigation system with low-cost sensors",
    setting: "",
    claims: &[],
};
