//! Gauss-Newton fit of a hypothesis by multiple shooting.
//!
//! Effect parameters, nuisance parameters and the start of every segment are fitted together to whitened output errors. It
//! is a chord method: a rollout costs as much as a column of the sensitivities, so columns are kept as long as steps bring
//! the expected decrease of the cost. Sensitivities to starts are never renewed; those to nuisance parameters are where
//! these have moved far, or where renewed columns of the effects do not help.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    fit::{
        finite_difference::{Differencing, STEP, inward},
        hypothesis::{Columns, Fit, Point, midway, moved, stale},
        laplace::Quadratic,
        linearized_problem::{LinearizedProblem, SegmentSensitivities},
        payload,
    },
    progress::Watch,
};

/// Rejected steps before the one at which the columns of all nuisance parameters are made anew.
const RENEW_ALL_AFTER: usize = 1;
/// Halvings of a step that leads uphill.
const HALVINGS: usize = 3;

impl LinearizedProblem<'_> {
    /// Fits a set of candidates from a first point.
    ///
    /// # Errors
    /// The plant refuses it, or a stop was asked for. `None` where the first rollout diverges.
    pub(crate) fn fit(&self, first: Point, watch: &Watch<'_>) -> Result<Option<Fit>, GapError> {
        self.descend(first, true, watch)
    }

    /// The same from a distant point, without renewing the sensitivities at the end.
    pub(crate) fn fit_roughly(
        &self,
        first: Point,
        watch: &Watch<'_>,
    ) -> Result<Option<Fit>, GapError> {
        self.descend(first, false, watch)
    }

    fn descend(
        &self,
        first: Point,
        exact: bool,
        watch: &Watch<'_>,
    ) -> Result<Option<Fit>, GapError> {
        let options = &self.problem.options.fit;
        let mut evaluations = options.evaluations;
        let Some(residuals) = self.evaluate(&first)? else {
            return Ok(None);
        };
        let fresh = stale(
            &first.nuisances,
            &self.sensitivities.base,
            options.stale_shift,
        );
        let known = vec![None; self.problem.segments.len()];
        let columns = self.columns(&first, &residuals, known, &fresh)?;
        let about = moved(&self.sensitivities.base, &first.nuisances, &fresh);
        let mut fit = self.assemble(first, residuals, columns, about);
        if exact && !fit.correlated(options.correlated).is_empty() {
            fit = self.renewed(fit, false)?;
        }
        // Decrease of the cost by the steps since the columns were made; `None` before the first step.
        let mut since: Option<f64> = None;
        // Rejected steps so far. The first renews the columns of the effects and of correlated nuisance parameters, the
        // second all, which in a large model costs more than everything else. Without effects only the second remains.
        let nuisances_only = fit.point.candidates.is_empty();
        let mut rejected_steps = usize::from(nuisances_only);
        loop {
            watch.check()?;
            let Some(best) = fit.quadratic().best(&fit.bounds) else {
                return Ok(Some(fit));
            };
            let promised = fit.cost() - best.cost;
            let little = options.converged + options.converged_relative * fit.cost();
            if promised < little || evaluations == 0 {
                if evaluations == 0
                    || !exact
                    || (since.unwrap_or(0.0) <= options.stale_decrease
                        && !fit.is_stale(options.stale_shift))
                {
                    return Ok(Some(fit));
                }
                fit = self.renewed(fit, false)?;
                since = None;
                continue;
            }
            let (found, used) = self.downhill(&fit, &best.z, evaluations)?;
            evaluations -= used;
            let Some((point, residuals)) = found else {
                if since.is_none() && rejected_steps > 0 {
                    return Ok(Some(fit));
                }
                fit = self.renewed(fit, nuisances_only || rejected_steps == RENEW_ALL_AFTER)?;
                since = None;
                rejected_steps += 1;
                continue;
            };
            let columns = std::mem::take(&mut fit.columns);
            let next = self.assemble(point, residuals, columns, fit.about.clone());
            let gained = fit.cost() - next.cost();
            fit = next;
            if gained < little && since.is_none() && !fit.is_stale(options.stale_shift) {
                return Ok(Some(fit));
            }
            since = Some(since.unwrap_or(0.0) + gained);
            if gained < little.max(options.trusted * promised) {
                fit = self.renewed(fit, nuisances_only || rejected_steps == RENEW_ALL_AFTER)?;
                since = None;
                rejected_steps += 1;
            }
        }
    }

    /// A point downhill: the one that the linearisation leads to, or part of the way. Returns how many
    /// points were looked at.
    #[expect(clippy::type_complexity)]
    fn downhill(
        &self,
        fit: &Fit,
        z: &DVector<f64>,
        left: usize,
    ) -> Result<(Option<(Point, Vec<Vec<f64>>)>, usize), GapError> {
        let mut straight = self.step(fit, z);
        for used in 1..=left.min(HALVINGS + 1) {
            let point =
                payload::at_their_moments(self.problem.candidates, &fit.point, straight.clone());
            if let Some(residuals) = self.evaluate(&point)?
                && self.cost(&point, &residuals) < fit.cost()
            {
                return Ok((Some((point, residuals)), used));
            }
            straight = midway(&fit.point, &straight);
        }
        Ok((None, left.min(HALVINGS + 1)))
    }

    /// The fit with sensitivities about its point: those of the nuisance parameters too that are far from where theirs were
    /// made or correlated to an effect, or of all if asked for.
    fn renewed(&self, fit: Fit, all: bool) -> Result<Fit, GapError> {
        let fresh: Vec<usize> = if all {
            (0..self.problem.nuisances.len()).collect()
        } else {
            let options = &self.problem.options.fit;
            let stale = stale(&fit.point.nuisances, &fit.about, options.stale_shift);
            let correlated = fit.correlated(options.correlated);
            let either =
                |nuisance: &usize| stale.contains(nuisance) || correlated.contains(nuisance);
            (0..self.problem.nuisances.len()).filter(either).collect()
        };
        let known = fit.columns.into_iter().map(|of| of.nuisances).collect();
        let columns = self.columns(&fit.point, &fit.residuals, known, &fresh)?;
        let about = moved(&fit.about, &fit.point.nuisances, &fresh);
        Ok(self.assemble(fit.point, fit.residuals, columns, about))
    }

    /// The point that the linearisation about a fit leads to.
    fn step(&self, fit: &Fit, z: &DVector<f64>) -> Point {
        let mut next = fit.point.clone();
        self.problem.set(&mut next, z);
        let change = self.problem.normalised(&next) - self.problem.normalised(&fit.point);
        let nuisances = self.problem.nuisances.len();
        next.starts = (0..self.problem.segments.len())
            .into_par_iter()
            .map(|at| {
                let SegmentSensitivities {
                    start: projection,
                    nuisances: shared,
                } = &self.sensitivities.by_segment[at];
                let columns = &fit.columns[at];
                let nuisance_columns = columns.nuisances.as_ref().unwrap_or(shared);
                let readings = &fit.residuals[at];
                let mut residual = DMatrix::from_column_slice(readings.len(), 1, readings);
                residual -= nuisance_columns.map(f64::from) * change.rows(0, nuisances);
                residual -=
                    columns.own.map(f64::from) * change.rows(nuisances, change.len() - nuisances);
                projection.start(residual, &fit.point.starts[at])
            })
            .collect();
        next
    }

    /// Whitened residuals at a point; none where a segment blows up.
    fn evaluate(&self, point: &Point) -> Result<Option<Vec<Vec<f64>>>, GapError> {
        let entries = self.problem.entries(point);
        let nuisances = self.problem.nuisance_values(point);
        let blown = AtomicBool::new(false);
        let residuals: Vec<Option<Vec<f64>>> = (0..self.problem.segments.len())
            .into_par_iter()
            .map(|at| {
                if blown.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                // Values that the plant refuses, or under which it blows up, have no likelihood.
                if let Ok(mut simulation) = self.problem.plant.simulation(&nuisances, &entries) {
                    let mut residual = Vec::new();
                    let start = &point.starts[at];
                    if self.shoot(simulation.as_mut(), at, start, &entries, &mut residual) {
                        return Ok(Some(residual));
                    }
                }
                blown.store(true, Ordering::Relaxed);
                Ok(None)
            })
            .collect::<Result<_, GapError>>()?;
        Ok(residuals.into_iter().collect())
    }

    /// [`Fit::cost`] of a point; none where it blows up.
    pub(crate) fn cost_at(&self, point: &Point) -> Result<Option<f64>, GapError> {
        let residuals = self.evaluate(point)?;
        Ok(residuals.map(|residuals| self.cost(point, &residuals)))
    }

    fn cost(&self, point: &Point, residuals: &[Vec<f64>]) -> f64 {
        let misfit: f64 = residuals.iter().flatten().map(|value| value * value).sum();
        misfit + self.problem.normalised(point).norm_squared() + self.arrival(point)
    }

    fn arrival(&self, point: &Point) -> f64 {
        let charge = |start| self.charge(start);
        point.starts.iter().map(charge).sum()
    }

    /// Change of the whitened predictions of every segment about a point. `known`: columns of the nuisance parameters, none
    /// for the shared ones; those of `fresh` are made anew.
    fn columns(
        &self,
        point: &Point,
        residuals: &[Vec<f64>],
        known: Vec<Option<DMatrix<f32>>>,
        fresh: &[usize],
    ) -> Result<Vec<Columns>, GapError> {
        known
            .into_par_iter()
            .enumerate()
            .map(|(at, mut nuisances)| {
                if point.candidates.is_empty() && fresh.is_empty() {
                    let own = DMatrix::zeros(residuals[at].len(), 0);
                    return Ok(Columns { own, nuisances });
                }
                let from = self.differencing(at, point, &residuals[at])?;
                let own = self.own_columns(at, point, &from)?;
                if !fresh.is_empty() {
                    nuisances = Some(self.renewed_nuisances(
                        at,
                        nuisances.as_ref(),
                        fresh,
                        point,
                        &from,
                    )?);
                }
                Ok(Columns {
                    own: own.map(|value| value as f32),
                    nuisances,
                })
            })
            .collect()
    }

    /// The quadratic about zero that residuals and columns at a point make.
    fn assemble(
        &self,
        point: Point,
        residuals: Vec<Vec<f64>>,
        columns: Vec<Columns>,
        about: DVector<f64>,
    ) -> Fit {
        let z = self.problem.normalised(&point);
        let grams: Vec<DMatrix<f64>> = (0..self.problem.segments.len())
            .into_par_iter()
            .map(|at| {
                let own = columns[at].own.map(f64::from);
                self.gram(
                    at,
                    &point,
                    &z,
                    &residuals[at],
                    columns[at].nuisances.as_ref(),
                    &own,
                )
            })
            .collect();
        let mut by_trial: Vec<Option<DMatrix<f64>>> = vec![None; self.problem.trials.len()];
        for (segment, gram) in self.problem.segments.iter().zip(grams) {
            match &mut by_trial[segment.trial] {
                Some(sum) => *sum += gram,
                empty => *empty = Some(gram),
            }
        }
        let misfit = residuals.iter().flatten().map(|value| value * value).sum();
        // A missing reading was made an exact zero by the whitening.
        let readings = residuals
            .iter()
            .flatten()
            .filter(|value| **value != 0.0)
            .count();
        Fit {
            quadratics: by_trial
                .iter()
                .flatten()
                .map(Quadratic::from_gram)
                .collect(),
            bounds: self.problem.bounds(&point.candidates),
            misfit,
            penalty: z.norm_squared(),
            arrival: self.arrival(&point),
            residuals,
            columns,
            about,
            readings,
            point,
        }
    }

    /// Gram matrix of (residual carried back to zero, nuisance parameters, columns), off the start.
    pub(crate) fn gram(
        &self,
        at: usize,
        point: &Point,
        z: &DVector<f64>,
        residual: &[f64],
        nuisance_columns: Option<&DMatrix<f32>>,
        columns: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let SegmentSensitivities {
            start: projection,
            nuisances: shared,
        } = &self.sensitivities.by_segment[at];
        let nuisance_columns = nuisance_columns.unwrap_or(shared);
        let nuisances = self.problem.nuisances.len();
        let mut all = DMatrix::zeros(residual.len(), 1 + nuisances + columns.ncols());
        all.column_mut(0).copy_from_slice(residual);
        all.view_mut((0, 1), nuisance_columns.shape())
            .copy_from(&nuisance_columns.map(f64::from));
        all.view_mut((0, 1 + nuisances), columns.shape())
            .copy_from(columns);
        let carried =
            all.columns(1, z.len()) * z + projection.sensitivity.map(f64::from) * &point.starts[at];
        let mut first = all.column_mut(0);
        first += carried;
        projection.gram(&all)
    }

    /// Change of the whitened prediction with each of a point's own parameters, a prior's standard
    /// deviation each.
    fn own_columns(
        &self,
        at: usize,
        point: &Point,
        from: &Differencing<'_>,
    ) -> Result<DMatrix<f64>, GapError> {
        let count = point.values.iter().map(Vec::len).sum();
        let mut columns = DMatrix::zeros(from.1.len(), count);
        let mut column = 0;
        for (row, candidate) in point.candidates.iter().enumerate() {
            for (parameter, p) in self.problem.candidates[*candidate]
                .parameters
                .iter()
                .enumerate()
            {
                let value = point.values[row][parameter];
                let step = inward(value, STEP * p.prior_sd, p.upper) / p.prior_sd;
                let moved = |step: f64| {
                    let mut moved = point.clone();
                    moved.values[row][parameter] += step * p.prior_sd;
                    moved
                };
                let found = self.slope(at, &moved, step, None, from)?;
                columns.set_column(column, &found);
                column += 1;
            }
        }
        Ok(columns)
    }
}
