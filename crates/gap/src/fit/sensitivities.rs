//! Sensitivities of every segment to its start and to the nuisance parameters, by difference quotients.

use std::sync::atomic::AtomicUsize;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    fit::{
        finite_difference::{Differencing, STEP, quotient},
        hypothesis::Point,
        linearized_problem::{LinearizedProblem, SegmentSensitivities},
        start_projection::StartProjection,
    },
    problem::segments::Segment,
    progress::Watch,
    rollout::{
        resolution,
        sensor_correction::{self, Correction},
        shooting::{self, Trace, WarmUp},
        state_estimation, whitening,
    },
};

/// Weights and residuals of a segment [readings].
type SegmentColumns = (Vec<f64>, Vec<f64>);

impl LinearizedProblem<'_> {
    /// Sensitivities of every segment about the base. One whose start or nuisance parameters make the nominal blow up
    /// says nothing reliable and is left out. Without `nuisances` to the starts alone.
    pub(crate) fn compute_sensitivities(
        &mut self,
        what: &str,
        nuisances: bool,
        watch: &Watch<'_>,
    ) -> Result<(), GapError> {
        let base = self.problem.nuisance_values(&self.origin());
        let columns_by_segment: Vec<Option<SegmentColumns>> = (0..self.problem.segments.len())
            .into_par_iter()
            .map(|at| self.columns_of(at, &base))
            .collect::<Result<_, GapError>>()?;
        let (segments, columns_by_segment): (Vec<_>, Vec<_>) = self
            .problem
            .segments
            .iter()
            .cloned()
            .zip(columns_by_segment)
            .filter_map(|(segment, columns)| Some((segment, columns?)))
            .unzip();
        self.problem.segments = self.or_diverges(segments)?;
        let residuals: Vec<Vec<f64>>;
        (self.sensitivities.weights, residuals) = columns_by_segment.into_iter().unzip();
        let done = AtomicUsize::new(0);
        let total = self.problem.segments.len();
        let shared: Vec<_> = (0..total)
            .into_par_iter()
            .map(|at| {
                watch.check()?;
                let shared = self.segment_sensitivities(at, nuisances, &residuals[at])?;
                watch.count(what, &done, total);
                Ok(shared)
            })
            .collect::<Result<_, GapError>>()?;
        let kept: Vec<usize> = (0..total).filter(|at| shared[*at].is_some()).collect();
        let segments = kept
            .iter()
            .map(|at| self.problem.segments[*at].clone())
            .collect();
        self.sensitivities.weights = kept
            .iter()
            .map(|at| self.sensitivities.weights[*at].clone())
            .collect();
        self.problem.segments = self.or_diverges(segments)?;
        self.sensitivities.by_segment = shared.into_iter().flatten().collect();
        Ok(())
    }

    fn or_diverges(&self, segments: Vec<Segment>) -> Result<Vec<Segment>, GapError> {
        if segments.is_empty() {
            return Err(self.diverges());
        }
        Ok(segments)
    }

    /// Weights and whitened residuals of a segment; `None` where the nominal diverges.
    fn columns_of(&self, at: usize, base: &[f64]) -> Result<Option<SegmentColumns>, GapError> {
        let segment = &self.problem.segments[at];
        let trial = &self.problem.trials[segment.trial];
        let step = self.problem.model.timestep;
        let mut simulation = self.problem.plant.simulation(base, &[])?;
        let mut trace = Trace::default();
        let whole = shooting::run(
            simulation.as_mut(),
            trial,
            segment,
            &self.problem.motions[segment.trial],
            WarmUp::required(self.problem.model, &[], &self.problem.options.rollout),
            step,
            Some(&vec![0.0; 2 * self.problem.model.nv]),
            &mut trace,
        );
        if !whole {
            return Ok(None);
        }
        let none = vec![Correction::NONE; self.problem.model.sensors.len()];
        let mut residual = Vec::new();
        sensor_correction::residuals(
            &trace,
            trial,
            segment,
            self.problem.channels,
            &none,
            step,
            &mut residual,
        );
        whitening::whiten(self.problem.channels, &mut residual);
        let weights = resolution::weights(
            &trace,
            trial,
            segment,
            self.problem.channels,
            step,
            self.problem.options.rollout.unresolved,
        );
        for (value, weight) in residual.iter_mut().zip(&weights) {
            *value *= weight;
        }
        Ok(Some((weights, residual)))
    }

    /// About the base, where the whitened residuals are `residual`; none where a rollout blew up.
    fn segment_sensitivities(
        &self,
        at: usize,
        nuisances: bool,
        residual: &[f64],
    ) -> Result<Option<SegmentSensitivities>, GapError> {
        let origin = self.origin();
        let from = self.differencing(at, &origin, residual)?;
        let (plant, before) = &from;
        let nv = self.problem.model.nv;
        let mut simulation = plant.simulation(&self.problem.nuisance_values(&origin), &[])?;
        let mut sensitivity = DMatrix::zeros(residual.len(), 2 * nv);
        let mut moved = Vec::new();
        for axis in 0..2 * nv {
            let step = state_estimation::STEP[axis / nv];
            let mut tangent = DVector::zeros(2 * nv);
            tangent[axis] = step;
            if !self.shoot(simulation.as_mut(), at, &tangent, &[], &mut moved) {
                return Ok(None);
            }
            sensitivity.set_column(axis, &quotient(before, &moved, step));
        }
        let Some(projection) = StartProjection::new(&sensitivity, &self.sensitivities.precision)
        else {
            return Ok(None);
        };
        let every: Vec<usize> = (0..self.problem.nuisances.len()).collect();
        let nuisances = if nuisances {
            self.nuisance_columns(at, &origin, &every, None, &from)?
        } else {
            DMatrix::zeros(residual.len(), every.len())
        };
        Ok(Some(SegmentSensitivities {
            start: projection,
            nuisances,
        }))
    }

    /// Change of the whitened predictions of a segment with some nuisance parameters, a standard deviation each; `known`: what was
    /// found elsewhere.
    fn nuisance_columns(
        &self,
        at: usize,
        point: &Point,
        which: &[usize],
        known: Option<&DMatrix<f32>>,
        from: &Differencing<'_>,
    ) -> Result<DMatrix<f32>, GapError> {
        let found: Vec<DVector<f32>> = which
            .par_iter()
            .map(|nuisance| {
                let moved = |step: f64| {
                    let mut moved = point.clone();
                    moved.nuisances[*nuisance] += step;
                    moved
                };
                let length = known.map(|known| f64::from(known.column(*nuisance).norm()));
                let found = self.slope(at, &moved, STEP, length, from)?;
                Ok(found.map(|value| value as f32))
            })
            .collect::<Result<_, GapError>>()?;
        let mut columns = DMatrix::zeros(from.1.len(), which.len());
        for (column, found) in found.iter().enumerate() {
            columns.set_column(column, found);
        }
        Ok(columns)
    }

    /// Columns of all nuisance parameters: those of `known`, or the shared ones, with those of `fresh` made anew.
    pub(crate) fn renewed_nuisances(
        &self,
        at: usize,
        known: Option<&DMatrix<f32>>,
        fresh: &[usize],
        point: &Point,
        from: &Differencing<'_>,
    ) -> Result<DMatrix<f32>, GapError> {
        let mut all = known
            .unwrap_or(&self.sensitivities.by_segment[at].nuisances)
            .clone();
        let found = self.nuisance_columns(at, point, fresh, Some(&all), from)?;
        for (column, nuisance) in found.column_iter().zip(fresh) {
            all.set_column(*nuisance, &column);
        }
        Ok(all)
    }

    /// Nuisance parameters whose columns are so long that what is wrong in them matters.
    pub(crate) fn well_seen(&self) -> Vec<usize> {
        let squares = (self.sensitivities.by_segment.iter())
            .map(|SegmentSensitivities { nuisances, .. }| {
                let square = |column| f64::from(nuisances.column(column).norm_squared());
                DVector::from_fn(nuisances.ncols(), |row, _| square(row))
            })
            .fold(DVector::zeros(self.problem.nuisances.len()), |sum, more| {
                sum + more
            });
        let least = self.problem.options.fit.well_determined;
        (0..squares.len())
            .filter(|nuisance| squares[*nuisance] > least * least)
            .collect()
    }
}
