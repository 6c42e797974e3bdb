//! What the papers behind Drivescope claim, and what comes out when the claim is tried here.
//!
//! Each [`Claim`] is declared once: where it stands in the paper, what it says in one sentence, the drives and estimators
//! that try it, and how its figures are measured and judged. The page's gallery, `drivescope papers` and the tests read
//! the same declaration. [`Attempt`] tries a claim piece by piece, so that a page that calls it never freezes;
//! [`attempt`] tries it in one go.
//!
//! A chapter is one module with one `pub const PAPER`; it knows estimators by name only.

mod attempt;
mod claim;
mod evidence;
mod figure;
pub mod motion;
pub mod navigation;
pub mod orientation;
pub mod slope;

pub use attempt::{Attempt, PaperError, Work, attempt};
pub use claim::{Claim, Measure, Paper, Source, Trial};
pub use evidence::{Errors, Evidence};
pub use figure::{Figure, Finding, Verdict};

/// Every paper, a chapter each.
pub const PAPERS: &[&Paper] = &[&orientation::PAPER, &slope::PAPER, &motion::PAPER, &navigation::PAPER];

/// The claim called `paper/claim`, as in `orientation/static_vectors`.
///
/// # Errors
/// [`PaperError::Unknown`] with the names that exist.
pub fn find(id: &str) -> Result<(&'static Paper, &'static Claim), PaperError> {
    let (paper, claim) = id.split_once('/').unwrap_or((id, ""));
    PAPERS
        .iter()
        .filter(|p| p.id == paper)
        .find_map(|p| Some((*p, p.claims.iter().find(|c| c.id == claim)?)))
        .ok_or_else(|| PaperError::Unknown { id: id.into(), known: ids().collect::<Vec<_>>().join(", ") })
}

/// The names of all claims, `paper/claim`, chapter by chapter.
pub fn ids() -> impl Iterator<Item = String> {
    PAPERS.iter().flat_map(|p| p.claims.iter().map(|c| [p.id, "/", c.id].concat()))
}
