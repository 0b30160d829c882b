//! Evidence of a linear model with normal priors cut at bounds, by expectation propagation.
//!
//! Sources: T. P. Minka, Expectation propagation for approximate Bayesian inference, UAI 2001; J. P. Cunningham, P. Hennig
//! and S. Lacoste-Julien, Gaussian probabilities and expectation propagation, arXiv:1111.6832 (probabilities of boxes).

use nalgebra::{DMatrix, DVector};

use crate::likelihood::truncated_normal::{Bounds, Moments};

/// Passes over all bounds at most.
const PASSES: usize = 60;
/// Largest change of the posterior by one bound that ends them [standard deviations].
const CONVERGED: f64 = 1e-4;
/// Change of the posterior by a bound that is passed over, likewise.
const NEGLIGIBLE: f64 = 1e-7;

/// Posterior of parameters under bounds.
#[derive(Clone, Debug)]
pub(crate) struct Truncated {
    /// Log evidence beyond that of all parameters at zero.
    pub(crate) log_evidence: f64,
    pub(crate) mean: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
}

/// Evidence and posterior of `q - 2 b.z + z.A z` (minus twice a log likelihood) and independent normal priors of mean zero and standard
/// deviations `sd`, cut at `bounds`.
pub(crate) fn evidence(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    sd: &DVector<f64>,
    bounds: &[Bounds],
) -> Option<Truncated> {
    let n = b.len();
    let mut precision = a.clone();
    let mut prior = 0.0;
    for axis in 0..n {
        precision[(axis, axis)] += sd[axis].powi(-2);
        prior -= sd[axis].ln();
        let of = Moments::of(0.0, sd[axis], bounds[axis]);
        prior -= of.log_mass;
    }
    let bounded: Vec<usize> = (0..n)
        .filter(|axis| bounds[*axis] != Bounds::FREE)
        .collect();
    let (mut site_precision, mut site_shift) = (DVector::<f64>::zeros(n), DVector::<f64>::zeros(n));
    let mut site_scale = vec![0.0; n];
    if !bounded.is_empty() {
        let factor = precision.clone().cholesky()?;
        let (mut covariance, mut mean) = (factor.inverse(), factor.solve(b));
        let mut column = DVector::zeros(n);
        for _ in 0..PASSES {
            let mut largest: f64 = 0.0;
            for axis in bounded.iter().copied() {
                let variance = covariance[(axis, axis)];
                let cavity = 1.0 / variance - site_precision[axis];
                if cavity <= 0.0 {
                    continue;
                }
                let shift = mean[axis] / variance - site_shift[axis];
                let centre = shift / cavity;
                if !(centre.is_finite() && cavity.is_finite()) {
                    return None;
                }
                let of = Moments::of(centre, cavity.recip().sqrt(), bounds[axis]);
                let new_precision = (of.variance.recip() - cavity).max(0.0);
                let new_shift = of.mean * (cavity + new_precision) - shift;
                site_scale[axis] = of.log_mass
                    - (0.5 * (cavity / (cavity + new_precision)).ln()
                        + 0.5 * (shift + new_shift).powi(2) / (cavity + new_precision)
                        - 0.5 * shift * centre);
                let change = new_precision - site_precision[axis];
                let push = new_shift - site_shift[axis] - change * mean[axis];
                let size = (change * variance).abs().max(push.abs() * variance.sqrt());
                largest = largest.max(size);
                if size < NEGLIGIBLE {
                    continue;
                }
                // The posterior with the new site, rank one.
                column.copy_from(&covariance.column(axis));
                let less = (1.0 + change * variance).recip();
                mean.axpy(push * less, &column, 1.0);
                covariance.ger(-change * less, &column, &column, 1.0);
                site_precision[axis] = new_precision;
                site_shift[axis] = new_shift;
            }
            if largest < CONVERGED {
                break;
            }
        }
    }
    // Not settled: the last pass is as good as any.
    for axis in 0..n {
        precision[(axis, axis)] += site_precision[axis];
    }
    let factor = precision.cholesky()?;
    let shift = b + &site_shift;
    let mean = factor.solve(&shift);
    let log_determinant: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();
    let log_evidence =
        0.5 * shift.dot(&mean) - log_determinant + prior + site_scale.iter().sum::<f64>();
    let covariance = factor.inverse();
    // The mean of what is cut lies within the bounds: else nothing was found.
    let is_within = |axis: &usize| {
        let slack = covariance[(*axis, *axis)].sqrt();
        let Bounds { lower, upper } = bounds[*axis];
        (lower - slack..=upper + slack).contains(&mean[*axis])
    };
    let is_found = log_evidence.is_finite()
        && mean.iter().all(|value| value.is_finite())
        && bounded.iter().all(is_within);
    is_found.then_some(Truncated {
        log_evidence,
        covariance,
        mean,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use crate::statistics::standard_normal;

    /// Against quadrature over a fine grid, two parameters, one of them positive, one between bounds.
    #[test]
    fn two_correlated_parameters_agree_with_quadrature() {
        let a = DMatrix::from_row_slice(2, 2, &[4.0, 2.5, 2.5, 3.0]);
        let sd = DVector::from_vec(vec![1.0, 0.5]);
        let bounds = [
            Bounds {
                lower: 0.0,
                upper: f64::INFINITY,
            },
            Bounds {
                lower: -0.4,
                upper: 0.7,
            },
        ];
        for b in [[3.0, 1.0], [-3.0, 1.0], [-8.0, -9.0], [0.1, 4.0]] {
            let b = DVector::from_vec(b.to_vec());
            let steps = 2000;
            let (mut top, mut below) = (0.0, 0.0);
            for i in 0..steps {
                for j in 0..steps {
                    let z = DVector::from_vec(vec![
                        6.0 * (f64::from(i) + 0.5) / f64::from(steps),
                        -0.4 + 1.1 * (f64::from(j) + 0.5) / f64::from(steps),
                    ]);
                    let prior = (-0.5 * (z[0].powi(2) + (z[1] / 0.5).powi(2))).exp();
                    top += prior * (b.dot(&z) - 0.5 * (&a * &z).dot(&z)).exp();
                    below += prior;
                }
            }
            let expected: f64 = (top / below).ln();
            let found = evidence(&a, &b, &sd, &bounds).unwrap().log_evidence;
            assert!((found - expected).abs() < 0.02, "{b}: {found} {expected}");
        }
    }

    /// Under the null one-signed amplitudes gain nothing on average: exp(evidence) has mean one.
    #[test]
    fn evidence_of_noise_has_mean_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let n = 6;
        let root = DMatrix::from_fn(n, n, |_, _| 0.4 * standard_normal(&mut rng));
        let a = &root * root.transpose();
        let lower = a.clone().cholesky().unwrap().l();
        let sd = DVector::from_element(n, 0.6);
        let bounds = vec![
            Bounds {
                lower: 0.0,
                upper: f64::INFINITY
            };
            n
        ];
        let draws = 8000;
        let mean = (0..draws)
            .map(|_| {
                let noise = DVector::from_fn(n, |_, _| standard_normal(&mut rng));
                evidence(&a, &(&lower * noise), &sd, &bounds)
                    .unwrap()
                    .log_evidence
                    .exp()
            })
            .sum::<f64>()
            / f64::from(draws);
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
    }

    /// Columns that are nearly alike, pulled far out of their bounds: what does not converge is no evidence, and what is one is less
    /// than the likelihood at its best within the bounds (up to some 1e6 nats; beyond, rounding wins).
    #[test]
    fn an_evidence_is_below_the_best_likelihood() {
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let n = 5;
        let (mut refused, mut found) = (0, 0);
        for round in 0..360 {
            let far = 10.0_f64.powf(0.01 * f64::from(round));
            let shared = DVector::from_fn(8, |_, _| standard_normal(&mut rng));
            let columns = DMatrix::from_fn(8, n, |row, _| {
                far * (shared[row] + 1e-3 * standard_normal(&mut rng))
            });
            let a = columns.tr_mul(&columns);
            let data = DVector::from_fn(8, |_, _| far * standard_normal(&mut rng));
            let b = columns.tr_mul(&data);
            let sd = DVector::from_element(n, 1.0);
            let bounds = vec![
                Bounds {
                    lower: -0.5,
                    upper: 0.5
                };
                n
            ];
            let Some(of) = evidence(&a, &b, &sd, &bounds) else {
                refused += 1;
                continue;
            };
            // Least squares within the bounds, one axis after the other.
            let mut z = DVector::<f64>::zeros(n);
            for _ in 0..20_000 {
                for axis in 0..n {
                    let rest = b[axis] - a.column(axis).dot(&z) + a[(axis, axis)] * z[axis];
                    z[axis] = (rest / a[(axis, axis)]).clamp(-0.5, 0.5);
                }
            }
            let best = b.dot(&z) - 0.5 * (&a * &z).dot(&z);
            let slack = 0.5 + 1e-2 * best.abs();
            assert!(
                of.log_evidence < best + slack,
                "{round}: {} {best}",
                of.log_evidence
            );
            found += 1;
        }
        assert!(found > 200 && refused > 0, "{found} {refused}");
    }

    #[test]
    fn without_bounds_it_is_the_normal_one() {
        let a = DMatrix::from_row_slice(1, 1, &[8.0]);
        let b = DVector::from_vec(vec![4.0]);
        let sd = DVector::from_vec(vec![0.5]);
        let found = evidence(&a, &b, &sd, &[Bounds::FREE]).unwrap();
        let expected = 0.5 * 16.0 / 12.0 - 0.5 * 12.0_f64.ln() - 0.5_f64.ln();
        assert!((found.log_evidence - expected).abs() < 1e-12);
        assert!((found.mean[0] - 4.0 / 12.0).abs() < 1e-12);
    }
}
