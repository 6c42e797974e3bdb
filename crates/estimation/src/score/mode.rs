//! Decisions of the motion mode against labels: accuracy, confusion, latency.

/// Seconds left out on either side of a change of truth in the guarded accuracy.
pub const GUARD: f64 = 0.6;

/// Changes of truth that last less than this (s) have no latency.
pub const SHORTEST: f64 = 1.0;

/// Delay from a change of truth to the first row with the new mode; 0 where the decision was there already.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Latency {
    /// Changes of this kind that were followed before the next change of truth.
    pub count: usize,
    /// Changes that were never followed.
    pub missed: usize,
    /// Mean delay, s; NaN if none was followed.
    pub mean: f64,
    /// Longest delay, s; NaN if none was followed.
    pub max: f64,
}

/// How the decided mode compares with the true one. Modes: 0 stationary, 1 straight, 2 cornering.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ModeScore {
    /// Rows compared.
    pub count: usize,
    /// Share of rows with the right mode.
    pub accuracy: f64,
    /// The same, with [`GUARD`] seconds left out on either side of each change of truth; NaN if nothing is left.
    pub accuracy_guarded: f64,
    /// Rows by true mode (first index) and decided mode.
    pub confusion: [[usize; 3]; 3],
    /// From stationary to moving.
    pub launch: Latency,
    /// From moving to stationary.
    pub stop: Latency,
    /// From straight to cornering.
    pub corner_entry: Latency,
    /// From cornering to straight.
    pub corner_exit: Latency,
}

impl ModeScore {
    /// Compare `decided` with `truth`, both at `time` (s); rows where either is not 0, 1 or 2 are left out.
    pub fn new(time: &[f64], decided: &[f64], truth: &[f64]) -> Option<Self> {
        let code = |v: f64| (0..3usize).find(|&m| v == m as f64);
        let rows: Vec<Row> = (time.iter().zip(decided.iter().zip(truth)))
            .filter_map(|(&time, (&d, &t))| Some(Row { time, decided: code(d)?, truth: code(t)? }))
            .collect();
        let changes: Vec<usize> = (1..rows.len()).filter(|&i| rows[i].truth != rows[i - 1].truth).collect();
        let mut confusion = [[0; 3]; 3];
        let (mut right, mut guarded, mut guarded_right, mut next) = (0, 0usize, 0usize, 0);
        for row in &rows {
            confusion[row.truth][row.decided] += 1;
            let is_right = row.truth == row.decided;
            right += usize::from(is_right);
            while next < changes.len() && rows[changes[next]].time < row.time {
                next += 1;
            }
            let near = |c: Option<&usize>| c.is_some_and(|&c| (rows[c].time - row.time).abs() <= GUARD);
            if !near(changes.get(next)) && !near(next.checked_sub(1).and_then(|i| changes.get(i))) {
                guarded += 1;
                guarded_right += usize::from(is_right);
            }
        }
        let latency = |kind: fn(usize, usize) -> bool| latency(&rows, &changes, kind);
        (!rows.is_empty()).then(|| Self {
            count: rows.len(),
            accuracy: right as f64 / rows.len() as f64,
            accuracy_guarded: guarded_right as f64 / guarded as f64,
            confusion,
            launch: latency(|from, _| from == 0),
            stop: latency(|_, to| to == 0),
            corner_entry: latency(|from, to| from == 1 && to == 2),
            corner_exit: latency(|from, to| from == 2 && to == 1),
        })
    }
}

struct Row {
    time: f64,
    decided: usize,
    truth: usize,
}

fn latency(rows: &[Row], changes: &[usize], kind: fn(usize, usize) -> bool) -> Latency {
    let mut delays = Vec::new();
    let mut missed = 0;
    for (i, &start) in changes.iter().enumerate() {
        let end = changes.get(i + 1).copied().unwrap_or(rows.len());
        let (from, to) = (rows[start - 1].truth, rows[start].truth);
        if !kind(from, to) || rows[end - 1].time - rows[start].time < SHORTEST {
            continue;
        }
        match rows[start..end].iter().find(|r| r.decided == to) {
            Some(row) => delays.push(row.time - rows[start].time),
            None => missed += 1,
        }
    }
    if delays.is_empty() {
        return Latency { count: 0, missed, mean: f64::NAN, max: f64::NAN };
    }
    let mean = delays.iter().sum::<f64>() / delays.len() as f64;
    Latency { count: delays.len(), missed, mean, max: delays.iter().copied().fold(0.0, f64::max) }
}
