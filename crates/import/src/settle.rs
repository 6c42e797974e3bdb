//! Names and physics made one: a proposal by names, checked and completed by an examination.

use crate::candidate::Confidence;
use crate::examine::{Examination, Finding, Thinned, Weight, contradictions};
use crate::propose::{Entry, Proposal};

/// Check a proposal by what was found, complete it where no person gave it, and hand over all that is to be said.
///
/// What contradicts is only said, with its correction. Completed are columns without a known name that physics is sure
/// of, and values that stand for none; each is a note.
pub(crate) fn settle(proposal: &mut Proposal, found: &Examination, thin: &Thinned, is_given: bool) -> Vec<Finding> {
    let against = contradictions(&proposal.mapping, found, thin);
    proposal.notes.retain(|note| !is_told(note, &against));
    let mut findings = against;
    if !is_given {
        blank(proposal, found);
        findings.extend(adopt(proposal, found));
    }
    let now = &proposal.mapping;
    let stands = |f: &&Finding| !f.correction.as_ref().is_some_and(|c| c.is_done(now));
    findings.extend(found.findings.iter().filter(stands).cloned());
    findings
}

/// Whether a note of the proposal's own doubts is told by a contradiction with numbers and a correction.
fn is_told(note: &str, against: &[Finding]) -> bool {
    let about = |f: &Finding| f.columns.iter().any(|c| note.contains(&format!("`{c}`")));
    let on_its_side = |f: &Finding| f.text.contains("otherwise than its names say");
    note.contains("seems to have the wrong sign") && against.iter().any(about)
        || note.contains("mounted on its side") && against.iter().any(on_its_side)
}

/// Values that stand for none are left out, and that is said.
fn blank(proposal: &mut Proposal, found: &Examination) {
    for (signal, source) in proposal.mapping.signals.iter_mut() {
        let Some(own) = found.mapping.signals.get(signal).filter(|o| o.column == source.column) else { continue };
        if source.blank.is_empty() && !own.blank.is_empty() {
            source.blank.clone_from(&own.blank);
            let about = |f: &&Finding| f.columns == [source.column.clone()] && f.text.contains("no value");
            proposal.notes.extend(found.findings.iter().filter(about).map(|f| f.text.clone()));
        }
    }
}

/// Columns without a known name become what physics is sure that they are.
fn adopt(proposal: &mut Proposal, found: &Examination) -> Vec<Finding> {
    let mut out = Vec::new();
    for view in &found.columns {
        let sure = view.confidence.filter(|c| *c >= Confidence::Likely && !view.by_name && view.name_says.is_none());
        let (Some(confidence), Some(signal)) = (sure, &view.signal) else { continue };
        let Some(source) = found.mapping.signals.get(signal) else { continue };
        let mapping = &proposal.mapping;
        if mapping.signals.iter().any(|(name, s)| name == signal || s.column == view.column) {
            continue;
        }
        let text = format!("`{}` has no known name: taken as {signal}, since it {}.", view.column, view.why);
        proposal.mapping.signals.insert(signal.clone(), source.clone());
        proposal.unused.retain(|u| u.column != view.column);
        let why = format!("by physics: {}", view.why);
        proposal.entries.push(Entry { signal: signal.clone(), column: view.column.clone(), why, confidence });
        proposal.notes.push(text.clone());
        let columns = vec![view.column.clone()];
        out.push(Finding { weight: Weight::Guess, columns, text, correction: None });
    }
    out
}
