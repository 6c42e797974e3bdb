//! Plain rows parsed by several threads at once, natively. Each thread takes a part of the slice that begins after an end
//! of line, and hands out its plain rows only if the rows before it turn out to end there: the same rows come out as from
//! one thread, whatever the slice holds.

use std::thread;

use super::Body;
use super::plain::Plain;
use crate::column::Kind;
use crate::error::ImportError;

/// How slices are shared between threads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split {
    /// Threads at most.
    pub threads: usize,
    /// Bytes that a thread is worth starting for.
    pub least_bytes: usize,
}

impl Default for Split {
    fn default() -> Self {
        Self { threads: thread::available_parallelism().map_or(1, |n| n.get().min(8)), least_bytes: 128 << 10 }
    }
}

impl Split {
    /// Where all parts of the slice but the first begin, each after an end of line; none if it is not worth it.
    pub fn borders(self, bytes: &[u8], eol: u8) -> Vec<usize> {
        let count = self.threads.min(bytes.len() / self.least_bytes.max(1)).max(1);
        let after_line = |at: usize| bytes[at..].iter().position(|&b| b == eol).map_or(bytes.len(), |i| at + i + 1);
        let mut borders: Vec<usize> = (1..count).map(|i| after_line(bytes.len() / count * i)).collect();
        borders.dedup();
        borders.retain(|&b| b < bytes.len());
        borders
    }
}

/// The plain rows that a part begins with.
#[derive(Debug, Default)]
struct Part {
    columns: Vec<Vec<f64>>,
    rows: usize,
    bytes: usize,
}

impl Part {
    fn parse(plain: Plain, bytes: &[u8], rows: usize) -> Self {
        let column = |kind: &Kind| Vec::with_capacity(if kind.is_kept() { rows } else { 0 });
        let mut part = Self { columns: plain.kinds.iter().map(column).collect(), rows: 0, bytes: 0 };
        let (mut block, width) = (Vec::new(), plain.kinds.len());
        loop {
            let end = plain.rows(bytes, part.bytes, &mut block);
            if end == part.bytes {
                return part;
            }
            for (i, (column, kind)) in part.columns.iter_mut().zip(plain.kinds).enumerate() {
                if kind.is_kept() {
                    column.extend(block.iter().skip(i).step_by(width));
                }
            }
            part.rows += block.len() / width;
            part.bytes = end;
        }
    }
}

impl Body {
    /// [`Body::rows_from`] the start of `region`, the parts behind the borders being parsed by other threads meanwhile.
    pub(super) fn rows_of_parts(&mut self, region: &[u8], borders: &[usize]) -> Result<usize, ImportError> {
        let (kinds, cut, decimal) = (self.kinds.clone(), self.dialect.cut, self.dialect.decimal);
        let plain = Plain { cut, decimal, kinds: &kinds };
        let ends = borders.iter().skip(1).copied().chain([region.len()]);
        let row_bytes = (self.taken / self.rows.max(1) as u64).max(1) as usize;
        thread::scope(|scope| {
            let parse = |(&from, to): (&usize, usize)| {
                let rows = (to - from) / row_bytes + 64;
                (from, to, scope.spawn(move || Part::parse(plain, &region[from..to], rows)))
            };
            let parts: Vec<_> = borders.iter().zip(ends).map(parse).collect();
            let mut pos = self.rows_from(&region[..borders[0]], 0)?;
            for (from, to, thread) in parts {
                let part = thread.join().unwrap_or_default();
                if pos == from && self.kinds == kinds && self.dialect.decimal == decimal {
                    self.push_part(&part)?;
                    pos += part.bytes;
                }
                pos = self.rows_from(&region[..to], pos)?;
            }
            Ok(pos)
        })
    }

    fn push_part(&mut self, part: &Part) -> Result<(), ImportError> {
        if part.rows == 0 {
            return Ok(());
        }
        self.begin_rows(part.rows, part.bytes)?;
        for (column, values) in self.columns.iter_mut().zip(&part.columns) {
            column.extend(values.iter());
        }
        Ok(())
    }
}
