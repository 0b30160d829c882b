//! The standard normal distribution, whole and cut at bounds.

use std::f64::consts::FRAC_1_SQRT_2;

/// Part of a posterior that an interval holds.
const CREDIBLE: f64 = 0.95;
/// Half of that interval where nothing cuts it, in standard deviations.
pub(crate) const HALF_WIDTH: f64 = 1.959_963_985;
/// Halvings of the interval of widths that is searched.
const HALVINGS: usize = 60;
/// Standard deviations beyond which nothing is left of a normal.
const FARTHEST: f64 = 12.0;

/// Bounds of a parameter in units of its prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Bounds {
    /// No bounds.
    pub(crate) const FREE: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
    };
    /// No negative values.
    #[cfg(test)]
    pub(crate) const POSITIVE: Self = Self {
        lower: 0.0,
        ..Self::FREE
    };
}

/// Cumulative standard normal.
pub(crate) fn cdf(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

/// Probability between two values, exact in the tails too.
fn mass(from: f64, to: f64) -> f64 {
    if from > 0.0 {
        cdf(-from) - cdf(-to)
    } else {
        cdf(to) - cdf(from)
    }
}

/// Logarithm of [`cdf`], exact in the tail too.
fn log_cdf(x: f64) -> f64 {
    /// Below, the asymptotic series is better than the complementary error function.
    const TAIL: f64 = -10.0;
    if x > TAIL {
        return cdf(x).ln();
    }
    let s = (x * x).recip();
    -0.5 * x * x - (-x).ln() - HALF_LOG_TAU + (1.0 - s * (1.0 - 3.0 * s * (1.0 - 5.0 * s))).ln()
}

/// Half the logarithm of two pi.
const HALF_LOG_TAU: f64 = 0.918_938_533_204_672_8;

/// Moments of a normal distribution cut at its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moments {
    /// Logarithm of the uncut distribution's mass within the bounds.
    pub(crate) log_mass: f64,
    pub(crate) mean: f64,
    pub(crate) variance: f64,
}

impl Moments {
    /// Moments of the normal distribution of this mean and standard deviation.
    pub(crate) fn of(mean: f64, sd: f64, bounds: Bounds) -> Self {
        let (lower, upper) = ((bounds.lower - mean) / sd, (bounds.upper - mean) / sd);
        // Mirrored where the bounds lie above, so that the mass is a difference of lower tails.
        if lower + upper > 0.0 && lower > f64::NEG_INFINITY {
            let Self {
                log_mass,
                mean: mirrored,
                variance,
            } = Self::standard(-upper, -lower);
            return Self {
                log_mass,
                mean: mean - sd * mirrored,
                variance: sd * sd * variance,
            };
        }
        let Self {
            log_mass,
            mean: of,
            variance,
        } = Self::standard(lower, upper);
        Self {
            log_mass,
            mean: mean + sd * of,
            variance: sd * sd * variance,
        }
    }

    /// Moments of the standard normal between bounds that do not lie above zero as a whole.
    fn standard(lower: f64, upper: f64) -> Self {
        let top = log_cdf(upper);
        let log_mass = top + (-(log_cdf(lower) - top).exp()).ln_1p();
        let density = |x: f64| {
            if x.is_finite() {
                (-0.5 * x * x - HALF_LOG_TAU - log_mass).exp()
            } else {
                0.0
            }
        };
        let times = |x: f64| if x.is_finite() { x * density(x) } else { 0.0 };
        let mean = density(lower) - density(upper);
        let variance = 1.0 + times(lower) - times(upper) - mean * mean;
        // Far out the difference cancels; there it falls off like an exponential, within the bounds.
        let width = upper - lower;
        let least = (upper * upper + 2.0).recip().min(width * width / 12.0);
        Self {
            log_mass,
            mean: mean.clamp(lower, upper),
            variance: if upper < -8.0 {
                least
            } else {
                variance.max(1e-3 * least)
            },
        }
    }
}

/// The shortest interval that holds 95 % of a normal distribution cut at its bounds, the values nearest to its mean:
/// about a mean that lies beyond a bound it begins at that bound.
pub(crate) fn credible(mean: f64, sd: f64, bounds: Bounds) -> [f64; 2] {
    let (lower, upper) = ((bounds.lower - mean) / sd, (bounds.upper - mean) / sd);
    let nearest = lower.max(-upper).max(0.0);
    let at = |width: f64| [lower.max(-width), upper.min(width)];
    let share = |width: f64| {
        let [from, to] = at(width);
        mass(from, to) / mass(lower, upper)
    };
    let (mut narrow, mut wide) = (nearest, nearest + FARTHEST);
    if mass(lower, upper) > 0.0 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (narrow + wide);
            if share(middle) < CREDIBLE {
                narrow = middle;
            } else {
                wide = middle;
            }
        }
    } else {
        // So far out that it falls off like an exponential.
        wide = nearest - (1.0 - CREDIBLE).ln() / nearest;
    }
    let [from, to] = at(wide);
    [
        if from == lower {
            bounds.lower
        } else {
            mean + sd * from
        },
        if to == upper {
            bounds.upper
        } else {
            mean + sd * to
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: Bounds = Bounds::FREE;
    const POSITIVE: Bounds = Bounds::POSITIVE;

    fn close(found: [f64; 2], expected: [f64; 2]) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn the_normal_distribution_is_tabulated() {
        assert!((cdf(HALF_WIDTH) - 0.975).abs() < 1e-9);
        assert!((cdf(-1.0) - 0.158_655_253_9).abs() < 1e-9);
        assert_eq!((cdf(f64::NEG_INFINITY), cdf(f64::INFINITY)), (0.0, 1.0));
    }

    #[test]
    fn without_bounds_it_is_the_usual_interval() {
        let half = 2.0 * HALF_WIDTH;
        close(credible(3.0, 2.0, FREE), [3.0 - half, 3.0 + half]);
    }

    /// Half a normal: 95 % lie below 1.96 standard deviations. Far below the bound an exponential of rate mean / sd^2.
    #[test]
    fn about_a_mean_beyond_a_bound_it_begins_there() {
        close(credible(0.0, 1.0, POSITIVE), [0.0, HALF_WIDTH]);
        for mean in [-30.0, -60.0] {
            let [low, high] = credible(mean, 1.0, POSITIVE);
            let exponential = -0.05_f64.ln() / -mean;
            assert!(
                low == 0.0 && (high / exponential - 1.0).abs() < 0.01,
                "{high}"
            );
        }
        // The same on the other side, in other units.
        let negative = Bounds { upper: 0.0, ..FREE };
        close(credible(0.0, 5.0, negative), [-5.0 * HALF_WIDTH, 0.0]);
    }

    /// Against quadrature: a normal between bounds on both sides.
    #[test]
    fn between_two_bounds_it_holds_so_much() {
        let bounds = Bounds {
            lower: -0.3,
            upper: 2.5,
        };
        let [low, high] = credible(0.5, 1.0, bounds);
        let density = |x: f64| (-0.5 * (x - 0.5) * (x - 0.5)).exp();
        let integral = |from: f64, to: f64| -> f64 {
            let step = (to - from) / 1e4;
            (0..10_000)
                .map(|at| density(from + (f64::from(at) + 0.5) * step) * step)
                .sum()
        };
        let held = integral(low, high) / integral(bounds.lower, bounds.upper);
        assert!((held - 0.95).abs() < 1e-6, "{held}");
        assert_eq!(low, bounds.lower);
    }
}
