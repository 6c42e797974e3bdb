//! The chi-square distribution: probability and quantile, for gates and consistency bands.

/// Natural logarithm of the gamma function for positive arguments (Lanczos, g = 7, error below 1e-14 relative).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        let pi = std::f64::consts::PI;
        return (pi / (pi * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let t = x + 7.5;
    let sum = C[0] + (1..9).map(|i| C[i] / (x + i as f64)).sum::<f64>();
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// Probability that a chi-square variable with `dof` degrees of freedom is at most `x`.
pub fn probability(x: f64, dof: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let (a, x) = (0.5 * dof, 0.5 * x);
    let scale = (-x + a * x.ln() - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // Series of the lower incomplete gamma function.
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-17 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return (sum * scale).min(1.0);
    }
    // Continued fraction of the upper one, by Lentz's method.
    let tiny = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / tiny;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..100_000 {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = 1.0 / non_zero(an * d + b, tiny);
        c = non_zero(b + an / c, tiny);
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-16 {
            break;
        }
    }
    1.0 - scale * h
}

fn non_zero(v: f64, tiny: f64) -> f64 {
    if v.abs() < tiny { tiny } else { v }
}

/// The value that a chi-square variable with `dof` degrees of freedom stays below with probability `p`.
///
/// By bisection to full precision; `p` outside (0, 1) gives 0 or infinity.
pub fn quantile(p: f64, dof: f64) -> f64 {
    if p <= 0.0 {
        return 0.0;
    }
    if p >= 1.0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (0.0, dof + 10.0);
    while probability(high, dof) < p {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if probability(middle, dof) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_match_the_printed_tables() {
        // NIST/SEMATECH e-Handbook table 1.3.6.7.4, three decimals; 0.999 with 6 degrees: 22.458.
        for (p, dof, value) in [
            (0.95, 1.0, 3.841),
            (0.99, 3.0, 11.345),
            (0.999, 6.0, 22.458),
            (0.025, 15.0, 6.262),
            (0.975, 100.0, 129.561),
        ] {
            assert!((quantile(p, dof) - value).abs() < 5e-4, "{p} {dof} {}", quantile(p, dof));
        }
    }

    #[test]
    fn two_degrees_have_a_closed_form() {
        for x in [0.01, 1.0, 5.0, 40.0] {
            assert!((probability(x, 2.0) - (1.0 - (-0.5 * x).exp())).abs() < 1e-14);
        }
        for p in [1e-3, 0.5, 0.999] {
            assert!((quantile(p, 2.0) + 2.0 * (1.0f64 - p).ln()).abs() < 1e-11);
        }
    }
}
