//! Parameters that have a value of each trial's own, normally distributed about the one that the trials share.
//!
//! The likelihood of a trial is quadratic in all parameters, so a deviation of its own is integrated out of its Gram matrix
//! in closed form before the trials are added up (random effects: N. M. Laird and J. H. Ware, Biometrics 38, 1982).

use nalgebra::{DMatrix, DVector};

use crate::{plant::Quantity, problem::problem::Problem};

/// Change of the parameters for a deviation of one standard deviation: parameters, and by how much each.
pub(crate) type Deviation = Vec<(usize, f64)>;

/// Columns of a set's parameters that have a value of each trial's own, and the standard deviation about the common value
/// [standard deviations of the prior].
pub(crate) type Own = Vec<(usize, f64)>;

/// Deviations of a trial that were integrated out: what they are expected to be given the common values.
#[derive(Clone, Debug, Default)]
pub(crate) struct Deviations {
    directions: Vec<Deviation>,
    /// From (1, minus the common values) to the deviations, in standard deviations.
    response: DMatrix<f64>,
}

impl Deviations {
    /// The same where the columns of some parameters, that do not deviate, are times a factor.
    pub(crate) fn scale(&mut self, parameters: &[usize], factor: f64) {
        if self.directions.is_empty() {
            return;
        }
        for parameter in parameters {
            self.response.column_mut(1 + parameter).scale_mut(factor);
        }
    }

    /// The parameters of the trial, the common ones known.
    pub(crate) fn own(&self, z: &DVector<f64>) -> DVector<f64> {
        let mut own = z.clone();
        if self.directions.is_empty() {
            return own;
        }
        let mut values = -z.clone().insert_row(0, 0.0);
        values[0] = 1.0;
        let expected = &self.response * values;
        for (direction, size) in self.directions.iter().zip(expected.iter()) {
            for (parameter, amount) in direction {
                own[*parameter] += amount * size;
            }
        }
        own
    }
}

/// Integrates deviations out of a Gram matrix of residual and parameters. Also what they are expected to be, and half the
/// logarithm of the determinant of their posterior precision. `None` where the matrix is not positive.
pub(crate) fn marginal(
    gram: &DMatrix<f64>,
    directions: &[Deviation],
) -> Option<(DMatrix<f64>, Deviations, f64)> {
    let (all, count) = (gram.nrows(), directions.len());
    // Columns of the deviations: sums of those of the parameters.
    let mut across = DMatrix::zeros(all, count);
    for (column, direction) in directions.iter().enumerate() {
        for (parameter, amount) in direction {
            let mut into = across.column_mut(column);
            into.axpy(*amount, &gram.column(1 + parameter), 1.0);
        }
    }
    let mut precision = DMatrix::identity(count, count);
    for (row, direction) in directions.iter().enumerate() {
        for (parameter, amount) in direction {
            let mut into = precision.row_mut(row);
            into += *amount * across.row(1 + parameter);
        }
    }
    let factor = precision.cholesky()?;
    let response = factor.solve(&across.transpose());
    let marginal = gram - &across * &response;
    let half_log_determinant = factor.l_dirty().diagonal().map(f64::ln).sum();
    let deviations = Deviations {
        directions: directions.to_vec(),
        response,
    };
    Some((marginal, deviations, half_log_determinant))
}

/// Directions in which the uncertain numbers of the nominal deviate from trial to trial: the gain of all actuators together.
pub(super) fn uncertain(problem: &Problem<'_>) -> Vec<Deviation> {
    let gain = problem.settings.uncertainty.gain_by_trial;
    let numbers = problem.nuisances.iter().enumerate();
    let gains: Deviation = numbers
        .filter(|(_, (of, _))| problem.model.nuisances[*of].quantity == Quantity::Gain)
        .map(|(at, (_, sd))| (at, gain / sd))
        .collect();
    match gain > 0.0 && !gains.is_empty() {
        true => vec![gains],
        false => Vec::new(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::statistics::standard_normal;

    /// Three trials of nine readings and three parameters. The first two parameters deviate together, the third by itself:
    /// likelihood, common values and deviations are those of one regression with columns of each trial's own.
    #[test]
    fn it_agrees_with_columns_of_each_trials_own() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (trials, rows, parameters) = (3, 9, 3);
        let directions = vec![vec![(0, 0.5), (1, -0.2)], vec![(2, 0.7)]];
        let columns: Vec<DMatrix<f64>> = (0..trials)
            .map(|_| DMatrix::from_fn(rows, 1 + parameters, |_, _| standard_normal(&mut rng)))
            .collect();
        // All at once: common parameters, then the deviations trial by trial, each with a standard normal prior.
        let width = parameters + trials * directions.len();
        let mut design = DMatrix::zeros(trials * rows, width);
        let mut residual = DVector::zeros(trials * rows);
        for (at, of) in columns.iter().enumerate() {
            residual.rows_mut(at * rows, rows).copy_from(&of.column(0));
            let mut block = design.rows_mut(at * rows, rows);
            block
                .columns_mut(0, parameters)
                .copy_from(&of.columns(1, parameters));
            for (number, direction) in directions.iter().enumerate() {
                let mut column = block.column_mut(parameters + at * directions.len() + number);
                for (parameter, amount) in direction {
                    column.axpy(*amount, &of.column(1 + parameter), 1.0);
                }
            }
        }
        let precision = design.tr_mul(&design) + DMatrix::identity(width, width);
        let factor = precision.cholesky().unwrap();
        let best = factor.solve(&design.tr_mul(&residual));
        let misfit = residual.norm_squared() - design.tr_mul(&residual).dot(&best);
        let logs: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();

        let mut whole = DMatrix::zeros(1 + parameters, 1 + parameters);
        let mut half = 0.0;
        let mut deviations = Vec::new();
        for of in &columns {
            let (gram, own, log) = marginal(&of.tr_mul(of), &directions).unwrap();
            whole += gram;
            half += log;
            deviations.push(own);
        }
        let a = whole.view((1, 1), (parameters, parameters)).into_owned();
        let b = whole.view((1, 0), (parameters, 1)).column(0).into_owned();
        let factor = (a + DMatrix::identity(parameters, parameters))
            .cholesky()
            .unwrap();
        let z = factor.solve(&b);
        half += factor.l_dirty().diagonal().map(f64::ln).sum();
        assert!((&z - best.rows(0, parameters)).norm() < 1e-10, "{z}");
        assert!((whole[(0, 0)] - b.dot(&z) - misfit).abs() < 1e-9);
        assert!((half - logs).abs() < 1e-10, "{half} {logs}");
        for (at, of) in deviations.iter().enumerate() {
            let own = of.own(&z);
            let mut expected = z.clone();
            for (number, direction) in directions.iter().enumerate() {
                let size = best[parameters + at * directions.len() + number];
                for (parameter, amount) in direction {
                    expected[*parameter] += amount * size;
                }
            }
            assert!((&own - &expected).norm() < 1e-10, "{own} {expected}");
        }
    }
}
