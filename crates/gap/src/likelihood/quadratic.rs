//! A quadratic form in a few parameters, from the Gram matrix of a residual and of its changes with each.
//!
//! Every parameter is in units of its prior's standard deviation, so its prior is a standard normal.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::likelihood::truncated_normal::Bounds;

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

/// A quadratic in what is left once some parameters are fitted away.
#[derive(Clone, Debug)]
pub(crate) struct Marginal {
    /// In what is left.
    pub(crate) rest: Quadratic,
    /// Half the logarithm of the determinant of the posterior precision of what was fitted away.
    pub(crate) half_log_determinant: f64,
    /// The best values of what was fitted away where the rest is zero.
    pub(crate) at_zero: DVector<f64>,
    /// How far they move, turned round, with what is left [fitted away, left].
    pub(crate) response: DMatrix<f64>,
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

    /// The quadratic in the parameters that are not known: what the known ones do and their priors go into the value at zero.
    pub(crate) fn with_known(&self, known: &[Option<f64>]) -> Self {
        let z = DVector::from_iterator(known.len(), known.iter().map(|of| of.unwrap_or(0.0)));
        let moved = &self.a * &z;
        let rest: Vec<usize> = (0..known.len()).filter(|at| known[*at].is_none()).collect();
        let mut of_rest = self.select(&rest);
        of_rest.q += z.dot(&moved) - 2.0 * self.b.dot(&z) + z.norm_squared();
        of_rest.b -= moved.select_rows(&rest);
        of_rest
    }

    /// With the first `n` parameters (uncertainties of the nominal) fitted away under their priors.
    pub(crate) fn marginal(&self, n: usize) -> Option<Marginal> {
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
        let marginal = Self {
            q: self.q - slope.dot(&solved_slope),
            b: self.b.rows(n, rest) - cross.tr_mul(&solved_slope),
            a: self.a.view((n, n), (rest, rest)) - cross.tr_mul(&solved_cross),
        };
        Some(Marginal {
            rest: marginal,
            half_log_determinant: factor.l_dirty().diagonal().map(f64::ln).sum(),
            at_zero: solved_slope,
            response: solved_cross,
        })
    }

    /// Factor of the curvature, made positive where rounding left it singular.
    pub(crate) fn factor(&self) -> Option<Cholesky<f64, Dyn>> {
        let mut a = self.a.clone();
        for axis in 0..self.b.len() {
            a[(axis, axis)] += 1e-9 * a[(axis, axis)] + f64::MIN_POSITIVE;
        }
        a.cholesky()
    }

    /// A square root of the curvature; what rounding left of negative curvature counts as none.
    pub(crate) fn root(&self) -> DMatrix<f64> {
        let eigen = self.a.clone().symmetric_eigen();
        let sizes = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        eigen.eigenvectors * DMatrix::from_diagonal(&sizes)
    }

    /// Information about the parameters beyond their priors, at most [nat]: the greatest over the parameters' combinations, as if
    /// they were known to be alone.
    pub(crate) fn information(&self) -> f64 {
        0.5 * self.a.trace().max(0.0).ln_1p()
    }

    /// Half the decrease from zero to the least value, no prior counted; infinite where rounding hides it.
    pub(crate) fn most_gain(&self) -> f64 {
        self.factor().map_or(f64::INFINITY, |factor| {
            0.5 * self.b.dot(&factor.solve(&self.b))
        })
    }

    /// Values of the least sum of the quadratic and its prior within bounds, by an active set.
    pub(crate) fn best(&self, bounds: &[Bounds]) -> Option<DVector<f64>> {
        let n = self.b.len();
        let mut held: Vec<Option<f64>> = vec![None; n];
        let mut z = DVector::zeros(n);
        let with_prior = self.with_prior();
        for _ in 0..2 * n + 2 {
            let free: Vec<usize> = (0..n).filter(|at| held[*at].is_none()).collect();
            z = with_prior.least_beside(&held, |of| of.a.clone().cholesky())?;
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
                None => return Some(z),
            }
        }
        Some(z)
    }

    /// The prior counted into the curvature.
    fn with_prior(&self) -> Self {
        let mut with = self.clone();
        for axis in 0..self.b.len() {
            with.a[(axis, axis)] += 1.0;
        }
        with
    }

    /// Values of the least quadratic, no prior counted, where some are known.
    pub(crate) fn best_beside(&self, known: &[Option<f64>]) -> Option<DVector<f64>> {
        self.least_beside(known, Self::factor)
    }

    /// The same, by a factor of the curvature of what is not known.
    fn least_beside(
        &self,
        known: &[Option<f64>],
        factor: impl Fn(&Self) -> Option<Cholesky<f64, Dyn>>,
    ) -> Option<DVector<f64>> {
        let mut z = DVector::from_iterator(known.len(), known.iter().map(|of| of.unwrap_or(0.0)));
        let free: Vec<usize> = (0..known.len()).filter(|at| known[*at].is_none()).collect();
        let slope = &self.b - &self.a * &z;
        let rest = self.select(&free);
        let moved = factor(&rest)?.solve(&slope.select_rows(&free));
        for (at, value) in free.iter().zip(moved.iter()) {
            z[*at] = *value;
        }
        Some(z)
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

    #[test]
    fn bounds_hold_and_are_let_go_of() {
        let quadratic = leaning();
        let found = quadratic.best(&[Bounds::POSITIVE; 2]).unwrap();
        assert_eq!(found[0], 0.0);
        assert!((found[1] - 1.0).abs() < 1e-12, "{}", found[1]);
    }

    /// Beside a known value the rest lies where the slope along it vanishes.
    #[test]
    fn what_is_beside_known_values_is_the_least() {
        let quadratic = leaning();
        let z = quadratic.best_beside(&[None, Some(0.5)]).unwrap();
        assert_eq!(z[1], 0.5);
        // 4 z - 2 (-5) / 2 + 0.5 = 0 along the first.
        assert!((z[0] + 5.5 / 4.0).abs() < 1e-8, "{z}");
    }

    /// Known values are counted in: the quadratic of the rest is that of all where these are known.
    #[test]
    fn known_values_are_counted_in() {
        let quadratic = leaning();
        let rest = quadratic.with_known(&[None, Some(2.0)]);
        let at = |z: f64| {
            let z = DVector::from_vec(vec![z, 2.0]);
            quadratic.q - 2.0 * quadratic.b.dot(&z) + (&quadratic.a * &z).dot(&z) + 4.0
        };
        for z in [0.0, 1.5] {
            let of_rest = rest.q - 2.0 * rest.b[0] * z + rest.a[(0, 0)] * z * z;
            assert!((of_rest - at(z)).abs() < 1e-12, "{z}");
        }
    }

    /// The values fitted away follow those that are left.
    #[test]
    fn what_is_fitted_away_is_known_beside_the_rest() {
        let columns = DMatrix::from_fn(9, 5, |row, column| ((row * 5 + column * 2) as f64).cos());
        let whole = Quadratic::from_gram(&columns.tr_mul(&columns));
        let all = whole.best(&[FREE; 4]).unwrap();
        let marginal = whole.marginal(2).unwrap();
        let away = &marginal.at_zero - &marginal.response * all.rows(2, 2);
        assert!((away - all.rows(0, 2)).norm() < 1e-9);
    }

    /// Fitting nuisances away first or with the rest gives the same values.
    #[test]
    fn a_marginal_quadratic_has_the_same_optimum() {
        let columns = DMatrix::from_fn(9, 5, |row, column| ((row * 7 + column * 3) as f64).sin());
        let whole = Quadratic::from_gram(&columns.tr_mul(&columns));
        let all = whole.best(&[FREE; 4]).unwrap();
        let rest = whole.marginal(2).unwrap().rest.best(&[FREE; 2]).unwrap();
        assert!((all.rows(2, 2) - &rest).norm() < 1e-9);
    }
}
