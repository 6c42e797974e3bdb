//! The sliding-mode law for one input, with its boundary layer.
//!
//! `s = S (x - x_d)`. The equivalent input holds `s` where the model has it; the switching part drives `s` to zero against
//! everything the model may be wrong about, so that `s s' <= -eta |s|` outside the boundary layer.
//! Source: Yun & Yu 2007, equations (21) to (42); SPEC navigation 9 and errata 10 to 12.
//! Departure: (41) has the bar over `1 - xi` and over `|S| F` in the wrong place; the gain here is
//! `xi (|S| F + eta) + |xi - 1| |S b u|` at the largest `xi`, without which (23) does not hold.

/// What the law knows of the plant's uncertainty, and how hard it pulls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Least speed of approach to the surface (eta), in units of `s` per second.
    pub reaching_rate: f64,
    /// Bound on the model's error `|S (f - f_model)|` (`|S| F`), in units of `s` per second.
    pub model_error: f64,
    /// Largest ratio of the model's input gain to the true one, and of the true one to the model's (xi_max), at least 1.
    pub gain_ratio: f64,
    /// Half thickness of the boundary layer (Phi), in units of `s`; 0 switches at once.
    pub boundary: f64,
}

/// An input and what it is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input {
    /// The whole.
    pub total: f64,
    /// What holds the surface where the model is right.
    pub equivalent: f64,
    /// Gain of the switching part (k), in units of `s` per second.
    pub gain: f64,
}

/// Sign of `s`, linear within the boundary layer. (32)
pub fn saturation(s: f64, boundary: f64) -> f64 {
    if s.abs() < boundary {
        return s / boundary;
    }
    if s == 0.0 { 0.0 } else { s.signum() } // (29)
}

impl Law {
    /// The input for a surface value `s`, the model's `S b` and its drift `S (f - x_d') + S' (x - x_d)`.
    pub fn input(&self, s: f64, input_gain: f64, drift: f64) -> Input {
        let equivalent = -drift / input_gain; // (38)
        let xi = self.gain_ratio;
        let gain = xi * (self.model_error + self.reaching_rate) + (xi - 1.0).abs() * (input_gain * equivalent).abs(); // (41)
        Input { total: equivalent - gain * saturation(s, self.boundary) / input_gain, equivalent, gain } // (42)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator of its own: numbers in 0 to 1 (splitmix64).
    fn next(state: &mut u64) -> f64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Largest `s s' + eta |s|` over random plants inside the bounds, relative to `eta |s|`; `input` makes the input of the law's,
    /// `S b` and `s`. Half of the plants lie on the bounds themselves, where the condition is tight.
    fn worst(input: impl Fn(&Law, &Input, f64, f64) -> f64) -> f64 {
        let mut rng = 7;
        let mut worst = f64::NEG_INFINITY;
        for _ in 0..200_000 {
            let law = Law {
                reaching_rate: 0.05 + 5.0 * next(&mut rng),
                model_error: 2.0 * next(&mut rng),
                gain_ratio: 1.0 + next(&mut rng),
                boundary: 0.002 + 0.2 * next(&mut rng),
            };
            let sign = if next(&mut rng) < 0.5 { -1.0 } else { 1.0 };
            let model = sign * (1e-4 + next(&mut rng));
            let drift = 20.0 * (next(&mut rng) - 0.5);
            let s = law.boundary * (1.0 + 50.0 * next(&mut rng)) * if next(&mut rng) < 0.5 { -1.0 } else { 1.0 };
            let total = input(&law, &law.input(s, model, drift), model, s);
            // The true plant: any input gain within the ratio either way, any drift within the bound.
            let is_on_bound = next(&mut rng) < 0.5;
            let mut between = || {
                let share = 2.0 * next(&mut rng) - 1.0;
                if is_on_bound { share.signum() } else { share }
            };
            let (xi, truth) = (law.gain_ratio.powf(between()), drift + law.model_error * between());
            let rate = truth + model / xi * total;
            worst = worst.max((s * rate + law.reaching_rate * s.abs()) / (law.reaching_rate * s.abs()));
        }
        worst
    }

    #[test]
    fn the_surface_is_approached_from_anywhere_inside_the_uncertainty_bounds() {
        // (23): s s' <= -eta |s| with the input that the law gives; only rounding may pass zero.
        assert!(worst(|_, input, _, _| input.total) < 1e-9);
    }

    /// The bounds are used up: a law that switches by one per cent less lets a plant on them away.
    #[test]
    fn a_gain_one_per_cent_smaller_does_not_approach_the_surface_everywhere() {
        assert!(worst(|_, input, sb, s| input.equivalent - 0.99 * input.gain * s.signum() / sb) > 1e-3);
    }

    #[test]
    fn the_gain_as_printed_does_not_approach_the_surface() {
        // (41) as printed: (1 - xi) S b |u|, negative beyond xi = 1 for a positive S b.
        let printed = |law: &Law, input: &Input, sb: f64, s: f64| {
            let part = (1.0 - law.gain_ratio) * sb * input.equivalent.abs();
            let gain = law.gain_ratio * (law.model_error + law.reaching_rate) + part;
            input.equivalent - gain * s.signum() / sb
        };
        assert!(worst(printed) > 1.0, "the printed gain was enough: the test cannot tell");
    }

    #[test]
    fn the_saturation_is_the_sign_outside_the_layer_and_a_line_inside() {
        for (s, boundary, expected) in
            [(0.5, 1.0, 0.5), (-3.0, 1.0, -1.0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1e-9, 0.0, 1.0), (-0.0, 0.1, -0.0)]
        {
            assert_eq!(saturation(s, boundary), expected);
        }
    }

    #[test]
    fn a_first_order_plant_of_the_paper_is_driven_to_its_surface_in_time() {
        // x' = f + u with s = x: from s = 1 with eta = 0.5 the surface is reached within s / eta = 2 s (31).
        let law = Law { reaching_rate: 0.5, model_error: 0.3, gain_ratio: 1.0, boundary: 0.01 };
        let mut x = 1.0;
        for k in 0..2000 {
            x += 0.001 * (0.3 * (f64::from(k) * 0.003).sin() + law.input(x, 1.0, 0.0).total);
        }
        assert!(x.abs() <= law.boundary, "{x}");
    }
}
