//! Sine and cosine together, of the angles of a car.
//!
//! In WebAssembly those of the standard library are two calls, each with its own reduction; a step needs thirteen pairs.
//! Source: FreeBSD msun `k_sin.c`, `k_cos.c` and the first stage of `e_rem_pio2.c` (coefficients), by which the error stays
//! below one unit in the last place for angles up to 1e6 rad.

/// pi / 2 in 33 bits, and the rest of it.
const HALF_TURN: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
/// 1.5 * 2^52: a number added to this and taken off again is rounded to an integer.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_007e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Sine and cosine of an angle, rad; NaN for one that is not finite.
#[inline]
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    let rounded = angle * std::f64::consts::FRAC_2_PI + ROUNDING;
    let quarters = rounded - ROUNDING;
    let x = (angle - quarters * HALF_TURN[0]) - quarters * HALF_TURN[1];
    let z = x * x;
    let s = SINE[1] + z * (SINE[2] + z * (SINE[3] + z * (SINE[4] + z * SINE[5])));
    let sin = x + x * z * (SINE[0] + z * s);
    let c = COSINE[0] + z * (COSINE[1] + z * (COSINE[2] + z * (COSINE[3] + z * (COSINE[4] + z * COSINE[5]))));
    let half = 0.5 * z;
    let near = 1.0 - half;
    let cos = near + (((1.0 - near) - half) + z * z * c);
    // The number of quarters stands in the last bits.
    match rounded.to_bits() & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_those_of_the_platform_to_the_last_digit_but_one() {
        // Catches a wrong quarter and a digit lost in a coefficient.
        for k in -40_000..40_000 {
            let angle = f64::from(k) * 0.000_917_3 + if k % 7 == 0 { 1e5 } else { 0.0 };
            let (sin, cos) = sin_cos(angle);
            assert!((sin - angle.sin()).abs() < 2.5e-16 && (cos - angle.cos()).abs() < 2.5e-16, "{angle}: {sin} {cos}");
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        assert!(sin_cos(f64::NAN).0.is_nan() && sin_cos(f64::INFINITY).1.is_nan());
    }
}
