//! The standard normal distribution, whole and cut at bounds.

use std::f64::consts::FRAC_1_SQRT_2;

/// Half of the interval that holds 95 %, in standard deviations.
pub(crate) const HALF_WIDTH: f64 = 1.959_963_985;
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

/// Logarithm of [`cdf`], exact in the tail too.
pub(crate) fn log_cdf(x: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_is_tabulated() {
        assert!((cdf(HALF_WIDTH) - 0.975).abs() < 1e-9);
        assert!((cdf(-1.0) - 0.158_655_253_9).abs() < 1e-9);
        assert_eq!((cdf(f64::NEG_INFINITY), cdf(f64::INFINITY)), (0.0, 1.0));
    }
}
