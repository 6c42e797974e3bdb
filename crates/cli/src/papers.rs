//! What `papers` prints.

use std::fmt::Write;

use drivescope_papers::{Claim, Figure, Finding, PAPERS, Paper, attempt};
use serde_json::{Value, json};

/// Try every claim of a chapter, one claim, or all of them.
///
/// # Errors
/// One sentence: no such claim, or one that could not be tried.
pub fn papers(id: Option<&str>, as_json: bool) -> Result<String, String> {
    let chosen = PAPERS.iter().flat_map(|p| p.claims.iter().map(move |c| (*p, c)));
    let chosen: Vec<(&Paper, &Claim)> = chosen.filter(|(p, c)| is_chosen(id, p.id, c.id)).collect();
    if chosen.is_empty() {
        let known: Vec<String> = drivescope_papers::ids().collect();
        return Err(format!("there is no claim `{}`; there are {}", id.unwrap_or_default(), known.join(", ")));
    }
    let mut found = Vec::new();
    for (paper, claim) in chosen {
        let id = format!("{}/{}", paper.id, claim.id);
        found.push((paper, claim, attempt(&id).map_err(|e| format!("{id}: {e}"))?));
    }
    Ok(if as_json { format!("{:#}", Value::Array(found.iter().map(entry).collect())) } else { table(&found) })
}

fn is_chosen(id: Option<&str>, paper: &str, claim: &str) -> bool {
    id.is_none_or(|id| id == paper || id.split_once('/') == Some((paper, claim)))
}

fn entry((paper, claim, finding): &(&Paper, &Claim, Finding)) -> Value {
    json!({"paper": paper.authors, "claim": claim, "figures": finding.figures, "verdict": finding.verdict, "id": finding.id})
}

fn table(found: &[(&Paper, &Claim, Finding)]) -> String {
    let mut text = String::new();
    let mut last = "";
    for (paper, claim, finding) in found {
        if paper.id != last {
            let _ = writeln!(text, "{}: {}\n{}\n", paper.authors, paper.title, paper.setting);
            last = paper.id;
        }
        let _ = writeln!(text, "{} ({}): {}", finding.id, claim.place, finding.verdict.label());
        let _ = writeln!(text, "  \"{}\"", claim.says);
        for figure in &finding.figures {
            let _ = writeln!(text, "  {}", line(figure));
        }
        let _ = writeln!(text, "  {}\n", claim.remark);
    }
    text
}

fn line(f: &Figure) -> String {
    let mark = match f.holds() {
        Some(true) => "+",
        Some(false) => "-",
        None => " ",
    };
    let limit = match f.limits {
        Some([low, high]) if low == f64::NEG_INFINITY => format!(", supports at most {high}"),
        Some([low, high]) if high == f64::INFINITY => format!(", supports at least {low}"),
        Some([low, high]) => format!(", supports {low} to {high}"),
        None => String::new(),
    };
    let claimed = f.claimed.map_or(String::new(), |c| format!(", the paper says {c}"));
    format!("{mark} {}: {:.3} {}{claimed}{limit}", f.name, f.value, f.unit)
}
