//! Values of MDF4 channels: bits of a record, and their conversion to physical values.

use crate::formats::carry::le;

/// Where a channel is in a record and how it is stored.
#[derive(Clone, Debug, Default)]
pub(super) struct Channel {
    pub name: String,
    pub unit: String,
    pub kind: u8,
    pub data_type: u8,
    pub bit_offset: u8,
    pub byte_offset: usize,
    pub bits: usize,
    /// Where signal data of variable length are, or 0.
    pub data: u64,
    /// Bit after the data bytes that says that the value is invalid.
    pub invalid: Option<usize>,
    pub conversion: Conversion,
}

/// How a raw value becomes a physical one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Conversion {
    #[default]
    None,
    Linear(f64, f64),
    Rational([f64; 6]),
    /// Raw and physical values in order; between them interpolated or not.
    Table(Vec<(f64, f64)>, bool),
    /// Ranges of raw values, and the value beside them.
    Ranges(Vec<[f64; 3]>, f64),
}

impl Conversion {
    /// From the type and the values of a conversion block. Formulas and texts are left alone.
    pub fn new(kind: u8, values: &[f64]) -> Self {
        let pairs = || values.chunks_exact(2).map(|p| (p[0], p[1])).collect();
        match (kind, values) {
            (1, [offset, factor, ..]) => Self::Linear(*offset, *factor),
            (2, [a, b, c, d, e, f, ..]) => Self::Rational([*a, *b, *c, *d, *e, *f]),
            (4, [_, _, ..]) => Self::Table(pairs(), true),
            (5, [_, _, ..]) => Self::Table(pairs(), false),
            (6, [_, _, _, ..]) => {
                let ranges = values.chunks_exact(3).map(|r| [r[0], r[1], r[2]]).collect();
                Self::Ranges(ranges, if values.len() % 3 == 1 { values[values.len() - 1] } else { f64::NAN })
            }
            _ => Self::None,
        }
    }

    pub fn apply(&self, raw: f64) -> f64 {
        match self {
            Self::None => raw,
            Self::Linear(offset, factor) => offset + factor * raw,
            Self::Rational([a, b, c, d, e, f]) => ((a * raw + b) * raw + c) / ((d * raw + e) * raw + f),
            Self::Table(pairs, interpolated) => table(pairs, raw, *interpolated),
            Self::Ranges(ranges, other) => {
                ranges.iter().find(|r| (r[0]..=r[1]).contains(&raw)).map_or(*other, |r| r[2])
            }
        }
    }
}

fn table(pairs: &[(f64, f64)], raw: f64, interpolated: bool) -> f64 {
    let after = pairs.partition_point(|(x, _)| *x < raw);
    let (last, before) = (pairs.len() - 1, after.saturating_sub(1));
    let ((x0, y0), (x1, y1)) = (pairs[before.min(last)], pairs[after.min(last)]);
    if after > last || x1 == x0 {
        y1
    } else if interpolated {
        y0 + (y1 - y0) * ((raw.max(x0) - x0) / (x1 - x0))
    } else if raw - x0 <= x1 - raw && after > 0 {
        y0
    } else {
        y1
    }
}

impl Channel {
    /// Whether the channel holds a number in the record itself.
    pub fn is_number(&self) -> bool {
        let float = matches!(self.data_type, 4 | 5) && matches!(self.bits, 16 | 32 | 64);
        let integer = self.data_type <= 3 && (1..=64).contains(&self.bits);
        matches!(self.kind, 0 | 2 | 4) && (float || integer)
    }

    /// The bits as an unsigned number; 0 beyond the record.
    pub fn raw(&self, record: &[u8]) -> u64 {
        let shift = usize::from(self.bit_offset);
        let count = (shift + self.bits).div_ceil(8);
        let wide = if matches!(self.data_type, 1 | 3 | 5) {
            let end = self.byte_offset.saturating_add(count).min(record.len());
            let bytes = record.get(self.byte_offset..end).unwrap_or_default();
            bytes.iter().fold(0u128, |v, b| v << 8 | u128::from(*b))
        } else {
            let high = if count > 8 { le(record, self.byte_offset.saturating_add(8), 1) } else { 0 };
            u128::from(high) << 64 | u128::from(le(record, self.byte_offset, count.min(8)))
        };
        (wide >> shift) as u64 & (u64::MAX >> (64 - self.bits.clamp(1, 64)))
    }

    /// The physical value; NaN where the record says that it is invalid.
    pub fn value(&self, record: &[u8], data_bytes: usize) -> f64 {
        if let Some(bit) = self.invalid
            && record.get(data_bytes + bit / 8).is_some_and(|b| b >> (bit % 8) & 1 == 1)
        {
            return f64::NAN;
        }
        let raw = self.raw(record);
        let unused = 64 - self.bits.clamp(1, 64);
        let number = match (self.data_type, self.bits) {
            (4 | 5, 16) => half(raw as u16),
            (4 | 5, 32) => f64::from(f32::from_bits(raw as u32)),
            (4 | 5, _) => f64::from_bits(raw),
            (2 | 3, _) => (((raw << unused) as i64) >> unused) as f64,
            _ => raw as f64,
        };
        self.conversion.apply(number)
    }
}

/// IEEE 754 half precision.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    match exponent {
        0 => sign * fraction / f64::from(1 << 24),
        31 => f64::NAN,
        e if e >= 25 => sign * (1024.0 + fraction) * f64::from(1 << (e - 25)),
        e => sign * (1024.0 + fraction) / f64::from(1 << (25 - e)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_cut_out_in_both_byte_orders() {
        let channel = |data_type, bit_offset, byte_offset, bits| Channel {
            data_type,
            bit_offset,
            byte_offset,
            bits,
            ..Channel::default()
        };
        let record = [0x12, 0x34, 0x56, 0xf8];
        assert_eq!(channel(0, 4, 0, 12).raw(&record), 0x341);
        assert_eq!(channel(1, 0, 1, 16).raw(&record), 0x3456);
        assert_eq!(channel(2, 3, 3, 5).value(&record, 4), -1.0);
        assert_eq!(channel(0, 0, 3, 64).raw(&record), 0xf8);
        assert_eq!(channel(0, 0, 9, 8).raw(&record), 0);
        assert_eq!(half(0x3c00), 1.0);
        assert_eq!(half(0xc500), -5.0);
    }

    #[test]
    fn conversions_follow_their_definitions() {
        assert_eq!(Conversion::new(1, &[1.0, 2.0]).apply(3.0), 7.0);
        assert_eq!(Conversion::new(2, &[0.0, 1.0, 2.0, 0.0, 0.0, 4.0]).apply(6.0), 2.0);
        let table = [0.0, 10.0, 2.0, 20.0];
        assert_eq!([-1.0, 1.0, 5.0].map(|x| Conversion::new(4, &table).apply(x)), [10.0, 15.0, 20.0]);
        assert_eq!([-1.0, 0.9, 1.1, 5.0].map(|x| Conversion::new(5, &table).apply(x)), [10.0, 10.0, 20.0, 20.0]);
        assert_eq!(Conversion::new(6, &[0.0, 1.0, 5.0, 9.0]).apply(3.0), 9.0);
    }
}
