//! Simulated residuals of a right hypothesis: noise and error of form, less what starts, nuisance parameters and effects
//! absorb of them to first order.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::{
    discrepancy::noise_model::Noise,
    fit::{hypothesis::Fit, linearized_problem::LinearizedProblem},
    statistics::standard_normal,
};

/// Residuals that are drawn as a fit would leave them.
pub(crate) struct SimulatedResiduals<'a> {
    linearized: &'a LinearizedProblem<'a>,
    fit: &'a Fit,
    pub(crate) draws: usize,
    /// Error of the effects' forms, as a part of what each does.
    form_error: f64,
    seed: u64,
    /// The fit's own parameters, in standard deviations of their priors.
    z: DVector<f64>,
    /// Posterior precision of nuisance parameters and effect parameters, starts projected out.
    precision: Cholesky<f64, Dyn>,
}

impl<'a> SimulatedResiduals<'a> {
    /// `None` where the curvature of the fit is not positive.
    pub(crate) fn new(
        linearized: &'a LinearizedProblem<'a>,
        fit: &'a Fit,
        draws: usize,
        form_error: f64,
        seed: u64,
    ) -> Option<Self> {
        let nuisances = linearized.problem.nuisances.len();
        let all = linearized.problem.normalised(&fit.point);
        let mut precision = fit.quadratic().a;
        for axis in 0..precision.nrows() {
            precision[(axis, axis)] += 1.0;
        }
        Some(Self {
            linearized,
            fit,
            draws,
            form_error,
            seed,
            z: all.rows(nuisances, all.len() - nuisances).into_owned(),
            precision: precision.cholesky()?,
        })
    }

    /// Nuisance parameters and parameters that fit each draw best [parameters, draws], in standard deviations of their priors.
    pub(crate) fn absorbed(&self, noise: &[Noise]) -> DMatrix<f64> {
        let slopes: Vec<DMatrix<f64>> = (0..self.linearized.problem.segments.len())
            .into_par_iter()
            .map(|at| self.columns(at).transpose() * self.draw(at, noise))
            .collect();
        let none = || DMatrix::zeros(self.precision.l_dirty().nrows(), self.draws);
        let slope = slopes.into_iter().reduce(|a, b| a + b);
        self.precision.solve(&slope.unwrap_or_else(none))
    }

    /// Each draw in one segment after the fit [readings, draws].
    pub(crate) fn remaining(
        &self,
        at: usize,
        noise: &[Noise],
        absorbed: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let taken = self
            .linearized
            .projection(at)
            .project(&(self.columns(at) * absorbed));
        self.draw(at, noise) - taken
    }

    /// Columns of nuisance parameters and of the fit's own parameters.
    fn columns(&self, at: usize) -> DMatrix<f64> {
        let shared = &self.linearized.sensitivities.by_segment[at].nuisances;
        let of = &self.fit.columns[at];
        let nuisances = of.nuisances.as_ref().unwrap_or(shared);
        let mut all = DMatrix::zeros(nuisances.nrows(), nuisances.ncols() + of.own.ncols());
        all.view_mut((0, 0), nuisances.shape())
            .copy_from(&nuisances.map(f64::from));
        all.view_mut((0, nuisances.ncols()), of.own.shape())
            .copy_from(&of.own.map(f64::from));
        all
    }

    /// The draws, the same at every call, projected off the start.
    fn draw(&self, at: usize, noise: &[Noise]) -> DMatrix<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(at as u64);
        let drawn = self.noisy(at, noise, &mut rng);
        self.linearized.projection(at).project(&drawn)
    }

    /// Noise and errors of form of one segment [readings, draws]; zero where there is no reading.
    fn noisy(&self, at: usize, noise: &[Noise], rng: &mut ChaCha8Rng) -> DMatrix<f64> {
        let present = &self.fit.residuals[at];
        let width = noise.len();
        let rows = present.len() / width;
        let contributions = if self.form_error > 0.0 {
            self.contributions(at)
        } else {
            Vec::new()
        };
        let form_rows = self.linearized.problem.options.discrepancy.form_error_rows;
        let mut all = DMatrix::zeros(present.len(), self.draws);
        let mut before = vec![0.0; width];
        for mut column in all.column_iter_mut() {
            for (value, of) in before.iter_mut().zip(noise) {
                *value = of.sd * standard_normal(rng);
            }
            for row in 0..rows {
                for (channel, of) in noise.iter().enumerate() {
                    let fresh = of.sd
                        * (1.0 - of.correlation * of.correlation).sqrt()
                        * standard_normal(rng);
                    before[channel] = of.correlation * before[channel] + fresh;
                    column[row * width + channel] = before[channel];
                }
            }
            for contribution in &contributions {
                let knots: Vec<f64> = (0..rows / form_rows + 2)
                    .map(|_| self.form_error * standard_normal(rng))
                    .collect();
                for row in 0..rows {
                    let (knot, part) =
                        (row / form_rows, (row % form_rows) as f64 / form_rows as f64);
                    let error = knots[knot] * (1.0 - part) + knots[knot + 1] * part;
                    for place in row * width..(row + 1) * width {
                        column[place] += error * contribution[place];
                    }
                }
            }
            for (value, present) in column.iter_mut().zip(present) {
                if *present == 0.0 {
                    *value = 0.0;
                }
            }
        }
        all
    }

    /// Contribution of every effect of the fit to the whitened predictions.
    fn contributions(&self, at: usize) -> Vec<DVector<f64>> {
        let own = self.fit.columns[at].own.map(f64::from);
        let mut first = 0;
        let values = self.fit.point.values.iter();
        values
            .map(|values| {
                let range = first..first + values.len();
                first = range.end;
                own.columns(range.start, range.len()) * self.z.rows(range.start, range.len())
            })
            .collect()
    }
}
