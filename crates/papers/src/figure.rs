//! Numbers with the limits by which they are judged, and the verdict that follows.

use serde::Serialize;

/// A measured number beside what the paper says of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// What it is, as in `RMS error of yaw, lane change, switch`.
    pub name: String,
    /// Its unit, as shown: degrees for angles.
    pub unit: &'static str,
    /// What was obtained here.
    pub value: f64,
    /// What the paper prints; `None` where it gives no number.
    pub claimed: Option<f64>,
    /// The figure speaks for the claim from the first to the second number; `None` where it only informs.
    pub limits: Option<[f64; 2]>,
}

impl Figure {
    /// A number that informs and is not judged.
    pub fn shown(name: impl Into<String>, unit: &'static str, value: f64) -> Self {
        Self { name: name.into(), unit, value, claimed: None, limits: None }
    }
    /// A number that speaks for the claim when it is at most `limit`.
    pub fn at_most(name: impl Into<String>, unit: &'static str, value: f64, limit: f64) -> Self {
        Self::between(name, unit, value, f64::NEG_INFINITY, limit)
    }
    /// A number that speaks for the claim when it is at least `limit`.
    pub fn at_least(name: impl Into<String>, unit: &'static str, value: f64, limit: f64) -> Self {
        Self::between(name, unit, value, limit, f64::INFINITY)
    }
    /// A number that speaks for the claim when it is from `low` to `high`.
    pub fn between(name: impl Into<String>, unit: &'static str, value: f64, low: f64, high: f64) -> Self {
        Self { limits: Some([low, high]), ..Self::shown(name, unit, value) }
    }
    /// With the number that the paper prints.
    pub fn claimed(mut self, value: f64) -> Self {
        self.claimed = Some(value);
        self
    }
    /// Whether it speaks for the claim; `None` where it only informs. A value that is no number speaks against it.
    pub fn holds(&self) -> Option<bool> {
        self.limits.map(|[low, high]| (low..=high).contains(&self.value))
    }
}

/// What the figures say of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every judged figure speaks for it.
    Supported,
    /// Some do and some do not.
    Partly,
    /// None does.
    NotSupported,
}

impl Verdict {
    /// In words.
    pub fn label(self) -> &'static str {
        match self {
            Self::Supported => "supported",
            Self::Partly => "partly",
            Self::NotSupported => "not supported",
        }
    }
}

/// What came out when a claim was tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The claim, `paper/claim`.
    pub id: String,
    /// The numbers.
    pub figures: Vec<Figure>,
    /// What follows from them.
    pub verdict: Verdict,
}

impl Finding {
    pub(crate) fn new(id: String, figures: Vec<Figure>) -> Self {
        let (mut held, mut judged) = (0, 0);
        for holds in figures.iter().filter_map(Figure::holds) {
            judged += 1;
            held += usize::from(holds);
        }
        let verdict = match held {
            0 => Verdict::NotSupported,
            _ if held == judged => Verdict::Supported,
            _ => Verdict::Partly,
        };
        Self { id, figures, verdict }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_is_that_of_the_judged_figures_alone() {
        let good = Figure::at_most("a", "m", 1.0, 1.0);
        let bad = Figure::at_least("b", "m", f64::NAN, 0.0);
        let shown = Figure::shown("c", "m", 3.0);
        let verdict =
            |figures: &[&Figure]| Finding::new("x/y".into(), figures.iter().map(|f| (*f).clone()).collect()).verdict;
        assert_eq!(verdict(&[&good, &shown]), Verdict::Supported);
        assert_eq!(verdict(&[&good, &bad]), Verdict::Partly);
        assert_eq!(verdict(&[&bad, &shown]), Verdict::NotSupported);
        assert_eq!(verdict(&[&shown]), Verdict::NotSupported, "what is not judged supports nothing");
    }
}
