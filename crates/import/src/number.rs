//! Decimal numbers from bytes, correctly rounded, eight digits at a time.
//!
//! A mantissa below 2^53 and a power of ten up to 22 are exact in f64, so that one multiplication or division rounds
//! correctly (Clinger 1990); every other number goes to the standard library.

const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];
const SMALL_POWERS: [u64; 9] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];

/// The number that `bytes` begin with and how many bytes it takes; `None` if they begin with none.
///
/// Grammar: sign, digits with at most one `decimal` mark, at least one digit, and an exponent after `e` or `E`. Neither
/// `nan` nor `inf` is a number here. What follows the number is the caller's to judge.
#[inline(always)]
pub(crate) fn parse_prefix(bytes: &[u8], decimal: u8) -> Option<(f64, usize)> {
    bytes.first_chunk().and_then(|window| short(window, decimal)).or_else(|| general(bytes, decimal))
}

/// Bytes that a short number is read from.
pub(crate) const WINDOW: usize = 26;

/// A number with fewer than 8 digits before its mark, no exponent and at most 2^53 without the mark, ended in the window:
/// most of a log. Takes few branches, and none that depends on the sign.
#[inline(always)]
pub(crate) fn short(window: &[u8; WINDOW], decimal: u8) -> Option<(f64, usize)> {
    let negative = usize::from(window[0] == b'-');
    let (x, whole) = eight(window, negative);
    if whole == 8 {
        return None;
    }
    let (mut end, mut places) = (negative + whole, 0);
    let mut mantissa = combine(x);
    if window[end] == decimal {
        let (y, count) = eight(window, end + 1);
        mantissa = mantissa * SMALL_POWERS[count] + combine(y);
        (end, places) = (end + 1 + count, count);
        if count == 8 {
            let (z, count) = eight(window, end);
            if count == 8 || whole + 8 + count > 19 {
                return None;
            }
            mantissa = mantissa.wrapping_mul(SMALL_POWERS[count]).wrapping_add(combine(z));
            (end, places) = (end + count, 8 + count);
            if mantissa > 1 << 53 {
                return None;
            }
        }
    }
    if whole + places == 0 || window[end] | 0x20 == b'e' {
        return None;
    }
    let value = mantissa as i64 as f64 / POWERS[places];
    Some((f64::from_bits(value.to_bits() | (negative as u64) << 63), end))
}

/// The values of the digits, at most eight, that stand at `at`, the last in the highest byte, and their number.
#[inline(always)]
fn eight(window: &[u8; WINDOW], at: usize) -> (u64, usize) {
    let mut word = [0; 8];
    word.copy_from_slice(&window[at..at + 8]);
    let (x, count) = leading_digits(word);
    // Zeros fill in before the digits; in two steps, since no shift is by 64.
    (x << (4 * (8 - count)) << (4 * (8 - count)), count)
}

/// The digit values of eight characters, the first in the lowest byte, and how many of them are digits up to the first
/// that is none.
#[inline(always)]
fn leading_digits(word: [u8; 8]) -> (u64, usize) {
    let x = u64::from_le_bytes(word) ^ 0x3030_3030_3030_3030;
    // The high bit of a byte is set where it is no digit; what a carry spoils lies behind the first such byte.
    let other = (x.wrapping_add(0x7676_7676_7676_7676) | x) & 0x8080_8080_8080_8080;
    (x, (other.trailing_zeros() / 8) as usize)
}

/// Any number.
#[cold]
fn general(bytes: &[u8], decimal: u8) -> Option<(f64, usize)> {
    let mut pos = 0;
    let negative = match bytes.first()? {
        b'-' => {
            pos = 1;
            true
        }
        b'+' => {
            pos = 1;
            false
        }
        _ => false,
    };
    let mut mantissa = 0u64;
    let whole = digits(bytes, &mut pos, &mut mantissa);
    let mut fraction = 0;
    if bytes.get(pos) == Some(&decimal) {
        pos += 1;
        fraction = digits(bytes, &mut pos, &mut mantissa);
    }
    if whole + fraction == 0 {
        return None;
    }
    let mut exponent = -(fraction as i64);
    if let Some(b'e' | b'E') = bytes.get(pos) {
        exponent += exponent_suffix(bytes, &mut pos);
    }
    if whole + fraction <= 19 && mantissa <= 1 << 53 && (-22..=22).contains(&exponent) {
        let m = mantissa as f64;
        let value = if exponent < 0 { m / POWERS[-exponent as usize] } else { m * POWERS[exponent as usize] };
        return Some((if negative { -value } else { value }, pos));
    }
    Some((slow(&bytes[..pos], decimal), pos))
}

/// Take digits from `pos` on into `mantissa`; how many there were.
fn digits(bytes: &[u8], pos: &mut usize, mantissa: &mut u64) -> usize {
    let start = *pos;
    while let Some(chunk) = bytes.get(*pos..*pos + 8) {
        let mut eight = [0; 8];
        eight.copy_from_slice(chunk);
        let (x, count) = leading_digits(eight);
        if count == 0 {
            return *pos - start;
        }
        // Digits move to the end of the word, zeros fill in before them.
        let value = combine(x << (64 - 8 * count));
        *mantissa = mantissa.wrapping_mul(SMALL_POWERS[count]).wrapping_add(value);
        *pos += count;
        if count < 8 {
            return *pos - start;
        }
    }
    while let Some(d) = bytes.get(*pos).map(|b| b.wrapping_sub(b'0')).filter(|d| *d <= 9) {
        *mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(d));
        *pos += 1;
    }
    *pos - start
}

/// The number that eight digit values make, the first in the lowest byte.
#[inline(always)]
fn combine(x: u64) -> u64 {
    const PAIRS: u64 = 0x0000_00FF_0000_00FF;
    let pairs = x.wrapping_mul(10).wrapping_add(x >> 8);
    let high = (pairs & PAIRS).wrapping_mul(100 + (1_000_000 << 32));
    let low = ((pairs >> 16) & PAIRS).wrapping_mul(1 + (10_000 << 32));
    high.wrapping_add(low) >> 32
}

/// Take `e`, a sign and digits; without digits nothing is taken, and the `e` is left to the caller.
fn exponent_suffix(bytes: &[u8], pos: &mut usize) -> i64 {
    let mut at = *pos + 1;
    let negative = bytes.get(at) == Some(&b'-');
    if matches!(bytes.get(at), Some(b'-' | b'+')) {
        at += 1;
    }
    let first = at;
    let mut value = 0i64;
    while let Some(d) = bytes.get(at).map(|b| b.wrapping_sub(b'0')).filter(|d| *d <= 9) {
        value = (value * 10 + i64::from(d)).min(1_000_000);
        at += 1;
    }
    if at == first {
        return 0;
    }
    *pos = at;
    if negative { -value } else { value }
}

/// Any number that the grammar admits.
#[cold]
fn slow(text: &[u8], decimal: u8) -> f64 {
    let standard = |text: &[u8]| std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).unwrap_or(f64::NAN);
    if decimal == b'.' {
        return standard(text);
    }
    let dotted: Vec<u8> = text.iter().map(|&b| if b == decimal { b'.' } else { b }).collect();
    standard(&dotted)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Random(u64);
    impl Random {
        fn next(&mut self) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            self.0
        }
        fn below(&mut self, n: u64) -> u64 {
            self.next() % n
        }
    }

    fn check(text: &str) {
        let expected: f64 = text.parse().unwrap();
        for tail in ["", ",", ";12345678", "\n0.123456789", ",-0.123456789,12.5,1e5,", "\r\n-1234567.123456789,5"] {
            let (value, used) = parse_prefix(format!("{text}{tail}").as_bytes(), b'.').unwrap();
            assert_eq!((value.to_bits(), used), (expected.to_bits(), text.len()), "{text}{tail}");
        }
        let comma = text.replace('.', ",");
        let (value, used) = parse_prefix(format!("{comma};1").as_bytes(), b',').unwrap();
        assert_eq!((value.to_bits(), used), (expected.to_bits(), text.len()), "{comma}");
    }

    #[test]
    fn numbers_are_rounded_as_the_standard_library_rounds_them() {
        // Would catch a wrong power of ten, a lost digit, an overflowing mantissa, and double rounding: bit for bit.
        let mut random = Random(0x9E37_79B9_7F4A_7C15);
        for _ in 0..60_000 {
            let mut text = String::from(["", "-", "+"][random.below(3) as usize]);
            let whole = random.below(22);
            (0..whole).for_each(|_| text.push(char::from(b'0' + random.below(10) as u8)));
            let fraction = if whole == 0 { 1 + random.below(22) } else { random.below(22) };
            if fraction > 0 {
                text.push('.');
                (0..fraction).for_each(|_| text.push(char::from(b'0' + random.below(10) as u8)));
            }
            if random.below(4) == 0 {
                text.push_str(&format!("e{}", random.below(700) as i64 - 350));
            }
            check(&text);
            check(&f64::from_bits(random.next() & !(1 << 62)).to_string());
            check(&format!("{:e}", f64::from_bits(random.next() & !(1 << 62))));
        }
    }

    #[test]
    fn edges_of_the_exact_range_are_exact() {
        for text in [
            "0",
            "-0",
            "+0.0",
            ".5",
            "5.",
            "9007199254740992",
            "9007199254740993",
            "9007199254740992e22",
            "1e-22",
            "1e-23",
            "18446744073709551615",
            "18446744073709551616",
            "99999999999999999999",
            "1E+05",
            "1763590172.7504675",
            "0.000000000000000000000000012345",
            "5e-324",
            "1e308",
            "1e309",
            "123456789012345678901234567890",
        ] {
            check(text);
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["", "-", "+", ".", "-.", "e5", "nan", "inf", "abc", " 1", "x1234567890"] {
            assert_eq!(parse_prefix(text.as_bytes(), b'.'), None, "{text}");
        }
        assert_eq!(parse_prefix(b"1e", b'.'), Some((1.0, 1)), "an exponent without digits is left to the caller");
        assert_eq!(parse_prefix(b"1.2.3", b'.'), Some((1.2, 3)));
        assert_eq!(parse_prefix(b"12:34", b'.'), Some((12.0, 2)));
    }
}
