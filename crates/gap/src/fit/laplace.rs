//! Laplace evidence: the cost to second order, its optimum within bounds, covariance and evidence, from one Gram matrix.
//!
//! The whitened residual `r` of a segment and the columns `Z` of its changes with every parameter are
//! projected off the start of the segment (a nuisance with a normal prior), and
//! `G = sum over segments of [r Z]^T W [r Z]`, `W = I - H (H^T H + P^-1)^-1 H^T`.
//! Every parameter is in units of its prior's standard deviation, so its prior is a standard normal.

use nalgebra::{DMatrix, DVector};

use crate::fit::truncated_normal::{self, Bounds};

/// A quadratic about the nominal in a few parameters: `q - 2 b.z + z.A z`, and the prior `z.z`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quadratic {
    /// Value at zero.
    pub(crate) q: f64,
    /// Half of the slope, negative.
    pub(crate) b: DVector<f64>,
    /// Curvature.
    pub(crate) a: DMatrix<f64>,
}

/// The best values of a quadratic under its prior.
#[derive(Clone, Debug)]
pub(crate) struct Optimum {
    /// Best values, in units of the priors.
    pub(crate) z: DVector<f64>,
    /// Log evidence relative to the quadratic's value at zero (prior and Occam's factor in).
    pub(crate) log_evidence: f64,
    /// Value of the quadratic and its prior there.
    pub(crate) cost: f64,
    /// Covariance; zero rows where a bound holds a value.
    pub(crate) covariance: DMatrix<f64>,
}

impl Quadratic {
    /// From a Gram matrix whose first row belongs to the residual.
    pub(crate) fn from_gram(gram: &DMatrix<f64>) -> Self {
        let n = gram.nrows() - 1;
        Self {
            q: gram[(0, 0)],
            b: gram.view((1, 0), (n, 1)).column(0).into_owned(),
            a: gram.view((1, 1), (n, n)).into_owned(),
        }
    }

    /// With the variance of the residuals inflated: every squared whitened residual counts `1 / inflation`.
    pub(crate) fn inflated(&self, inflation: f64) -> Self {
        Self {
            q: self.q / inflation,
            b: &self.b / inflation,
            a: &self.a / inflation,
        }
    }

    /// A few of the parameters.
    pub(crate) fn select(&self, columns: &[usize]) -> Self {
        Self {
            q: self.q,
            b: DVector::from_fn(columns.len(), |row, _| self.b[columns[row]]),
            a: DMatrix::from_fn(columns.len(), columns.len(), |row, column| {
                self.a[(columns[row], columns[column])]
            }),
        }
    }

    /// With the first `n` parameters (uncertainties of the nominal) fitted away under their priors.
    pub(crate) fn marginal(&self, n: usize) -> Option<Self> {
        let rest = self.b.len() - n;
        let mut head = self.a.view((0, 0), (n, n)).into_owned();
        for axis in 0..n {
            head[(axis, axis)] += 1.0;
        }
        let factor = head.cholesky()?;
        let cross = self.a.view((0, n), (n, rest)).into_owned();
        let slope = self.b.rows(0, n).into_owned();
        let solved_cross = factor.solve(&cross);
        let solved_slope = factor.solve(&slope);
        Some(Self {
            q: self.q - slope.dot(&solved_slope),
            b: self.b.rows(n, rest) - cross.tr_mul(&solved_slope),
            a: self.a.view((n, n), (rest, rest)) - cross.tr_mul(&solved_cross),
        })
    }

    /// Value without the prior.
    pub(crate) fn at(&self, z: &DVector<f64>) -> f64 {
        self.q - 2.0 * self.b.dot(z) + (&self.a * z).dot(z)
    }

    /// Best values within bounds, by an active set, and Laplace's evidence. The prior is a normal cut at
    /// its bounds.
    pub(crate) fn best(&self, bounds: &[Bounds]) -> Option<Optimum> {
        let n = self.b.len();
        let mut held: Vec<Option<f64>> = vec![None; n];
        let mut z = DVector::zeros(n);
        for _ in 0..2 * n + 2 {
            let free: Vec<usize> = (0..n).filter(|at| held[*at].is_none()).collect();
            let (mean, covariance) = self.conditional(&free, &held)?;
            for at in 0..n {
                z[at] = held[at].unwrap_or(0.0);
            }
            for (row, at) in free.iter().enumerate() {
                z[*at] = mean[row];
            }
            // Hold the worst offender; let go of one that would rather move inwards.
            let worst = free
                .iter()
                .map(|at| {
                    let bound = bounds[*at];
                    let over = (bound.lower - z[*at]).max(z[*at] - bound.upper);
                    (*at, over)
                })
                .filter(|(_, over)| *over > 1e-12)
                .max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((at, _)) = worst {
                held[at] = Some(z[at].clamp(bounds[at].lower, bounds[at].upper));
                continue;
            }
            let slope = &self.b - &self.a * &z - &z;
            let eager = (0..n).find(|at| match held[*at] {
                Some(value) if value <= bounds[*at].lower => slope[*at] > 1e-9,
                Some(_) => slope[*at] < -1e-9,
                None => false,
            });
            match eager {
                Some(at) => held[at] = None,
                None => return Some(self.optimum(z, &free, &covariance, bounds)),
            }
        }
        let free: Vec<usize> = (0..n).filter(|at| held[*at].is_none()).collect();
        let (_, covariance) = self.conditional(&free, &held)?;
        Some(self.optimum(z, &free, &covariance, bounds))
    }

    /// Mean and covariance of the free parameters, the others held.
    fn conditional(
        &self,
        free: &[usize],
        held: &[Option<f64>],
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let precision = DMatrix::from_fn(free.len(), free.len(), |row, column| {
            self.a[(free[row], free[column])] + f64::from(u8::from(row == column))
        });
        let right = DVector::from_fn(free.len(), |row, _| {
            let pull: f64 = held
                .iter()
                .enumerate()
                .filter_map(|(at, value)| value.map(|value| self.a[(free[row], at)] * value))
                .sum();
            self.b[free[row]] - pull
        });
        let factor = precision.cholesky()?;
        Some((factor.solve(&right), factor.inverse()))
    }

    /// Absolute log evidence (up to the constant of the noise), and the best values.
    pub(crate) fn evidence(&self, bounds: &[Bounds]) -> Option<(f64, Optimum)> {
        let best = self.best(bounds)?;
        Some((best.log_evidence - 0.5 * self.q, best))
    }

    /// The 95 % interval of a parameter about its fitted value, cut by its bounds, also where the value lies at one.
    /// Other parameters at their bounds count as known. `form`: standard deviation of the effect's form, added to that of
    /// the fit.
    pub(crate) fn interval(
        &self,
        best: &Optimum,
        bounds: &[Bounds],
        at: usize,
        value: f64,
        form: f64,
    ) -> [f64; 2] {
        let variance = best.covariance[(at, at)];
        if variance > 0.0 {
            return truncated_normal::credible(value, variance.sqrt().hypot(form), bounds[at]);
        }
        // Held: where it would be without its bound, the others that are held where they are.
        let across = self.a.column(at);
        let taken = (&best.covariance * across).dot(&across);
        // No less than the prior's, whatever cancels.
        let precision = (1.0 + self.a[(at, at)] - taken).max(1.0);
        let slope = self.b[at] - across.dot(&best.z) - best.z[at];
        let mean = best.z[at] + slope / precision;
        let [low, high] =
            truncated_normal::credible(mean, precision.recip().sqrt().hypot(form), bounds[at]);
        [low.min(value), high.max(value)]
    }

    fn optimum(
        &self,
        z: DVector<f64>,
        free: &[usize],
        covariance: &DMatrix<f64>,
        bounds: &[Bounds],
    ) -> Optimum {
        let n = z.len();
        let mut whole = DMatrix::zeros(n, n);
        for (row, at) in free.iter().enumerate() {
            for (column, other) in free.iter().enumerate() {
                whole[(*at, *other)] = covariance[(row, column)];
            }
        }
        let half_log_determinant = if free.is_empty() {
            0.0
        } else {
            covariance
                .clone()
                .cholesky()
                .map_or(0.0, |factor| factor.l().diagonal().map(f64::ln).sum())
        };
        let misfit = self.at(&z);
        let mut log_evidence = 0.5 * (self.q - misfit) - 0.5 * z.norm_squared();
        log_evidence += half_log_determinant;
        for (row, at) in free.iter().enumerate() {
            let sd = covariance[(row, row)].sqrt();
            let Bounds { lower, upper } = bounds[*at];
            let posterior = truncated_normal::cdf((upper - z[*at]) / sd)
                - truncated_normal::cdf((lower - z[*at]) / sd);
            let prior = truncated_normal::cdf(upper) - truncated_normal::cdf(lower);
            log_evidence += (posterior.max(1e-3) / prior.max(1e-12)).ln();
        }
        Optimum {
            cost: misfit + z.norm_squared(),
            z,
            log_evidence,
            covariance: whole,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const FREE: Bounds = Bounds::FREE;

    /// One whose first parameter would be negative.
    fn leaning() -> Quadratic {
        Quadratic {
            q: 10.0,
            b: DVector::from_vec(vec![-5.0, 3.0]),
            a: DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]),
        }
    }

    /// The evidence of a linear Gaussian model is known in closed form: log N(r; 0, I + J J^T) less log N(r; 0, I).
    #[test]
    fn the_evidence_is_that_of_a_linear_gaussian_model() {
        let j = DMatrix::from_row_slice(4, 2, &[1.0, 0.5, -2.0, 1.0, 0.3, 3.0, 1.5, -0.7]);
        let r = DVector::from_vec(vec![1.0, -2.0, 4.0, 0.5]);
        let mut columns = DMatrix::zeros(4, 3);
        columns.set_column(0, &r);
        columns.view_mut((0, 1), (4, 2)).copy_from(&j);
        let quadratic = Quadratic::from_gram(&columns.tr_mul(&columns));
        let found = quadratic.best(&[FREE, FREE]).unwrap();
        let covariance = DMatrix::identity(4, 4) + &j * j.transpose();
        let factor = covariance.clone().cholesky().unwrap();
        let log_density =
            -0.5 * r.dot(&factor.solve(&r)) - factor.l().diagonal().map(f64::ln).sum();
        let expected = log_density + 0.5 * r.norm_squared();
        assert!(
            (found.log_evidence - expected).abs() < 1e-6,
            "{found:?} {expected}"
        );
    }

    #[test]
    fn bounds_hold_and_are_let_go_of() {
        let quadratic = leaning();
        let found = quadratic.best(&[Bounds::POSITIVE; 2]).unwrap();
        assert_eq!(found.z[0], 0.0);
        assert!((found.z[1] - 1.0).abs() < 1e-12, "{}", found.z[1]);
    }

    /// Against quadrature of the posterior of two parameters, one of which its bound holds.
    #[test]
    fn what_a_bound_holds_is_uncertain_on_its_other_side() {
        let quadratic = leaning();
        let bounds = [Bounds::POSITIVE, FREE];
        let best = quadratic.best(&bounds).unwrap();
        let [low, high] = quadratic.interval(&best, &bounds, 0, best.z[0], 0.0);
        let density = |x: f64| -> f64 {
            let along = (-1000..1000).map(|y| {
                let z = DVector::from_vec(vec![x, f64::from(y) * 0.005]);
                (-0.5 * (quadratic.at(&z) + z.norm_squared())).exp()
            });
            along.sum()
        };
        let integral = |to: f64| -> f64 {
            (0..1000)
                .map(|at| density((f64::from(at) + 0.5) * to / 1e3) * to)
                .sum()
        };
        let [_, wider] = quadratic.interval(&best, &bounds, 0, best.z[0], 0.4);
        assert!(wider > high + 0.1, "{wider} {high}");
        let held = integral(high) / integral(5.0);
        assert_eq!((best.z[0], low), (0.0, 0.0));
        assert!((held - 0.95).abs() < 1e-4, "{held}");
        // One that is free has the interval that it has beside a known one.
        let [low, high] = quadratic.interval(&best, &bounds, 1, best.z[1], 0.0);
        let alone = quadratic.select(&[1]).best(&[FREE]).unwrap();
        let half = 1.959_964 * alone.covariance[(0, 0)].sqrt();
        assert!((high - best.z[1] - half).abs() < 1e-5 && (best.z[1] - low - half).abs() < 1e-5);
        // What it stands for may be a little different.
        let [low, high] = quadratic.interval(&best, &bounds, 1, best.z[1], 0.4);
        let half = half.hypot(1.959_964 * 0.4);
        assert!((high - best.z[1] - half).abs() < 1e-5 && (best.z[1] - low - half).abs() < 1e-5);
    }

    /// Fitting nuisances away first or with the rest gives the same values.
    #[test]
    fn a_marginal_quadratic_has_the_same_optimum() {
        let columns = DMatrix::from_fn(9, 5, |row, column| ((row * 7 + column * 3) as f64).sin());
        let whole = Quadratic::from_gram(&columns.tr_mul(&columns));
        let all = whole.best(&[FREE; 4]).unwrap();
        let rest = whole.marginal(2).unwrap().best(&[FREE; 2]).unwrap();
        assert!((all.z.rows(2, 2) - &rest.z).norm() < 1e-9);
    }
}
