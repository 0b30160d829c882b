//! The segmented problem linearised about the nominal: how the readings of every segment change with its start and with
//! the nuisance parameters.

use std::sync::OnceLock;

use hydro_effects::Entry;
use nalgebra::{DMatrix, DVector};

use crate::{
    error::GapError,
    fit::{
        hypothesis::{Fit, Point},
        segmented_problem::SegmentedProblem,
        start_projection::StartProjection,
    },
    plant::Simulation,
    rollout::{
        sensor_correction,
        shooting::{self, Trace, WarmUp},
        whitening,
    },
};

/// First-order changes of the whitened predictions about `base`.
#[derive(Clone, Debug)]
pub(crate) struct Sensitivities {
    /// Nuisance parameters about which they are taken, in standard deviations of their priors.
    pub(crate) base: DVector<f64>,
    /// Prior precision of a segment's start, by axis of the tangent [2 nv].
    pub(crate) precision: DVector<f64>,
    /// Factors on the whitened residuals of every segment [readings], for what its rows cannot resolve.
    pub(crate) weights: Vec<Vec<f64>>,
    pub(crate) by_segment: Vec<SegmentSensitivities>,
}

/// First-order changes of the whitened predictions of one segment.
#[derive(Clone, Debug)]
pub(crate) struct SegmentSensitivities {
    /// Projection off the start of the segment.
    pub(crate) start: StartProjection,
    /// Change a standard deviation of each nuisance parameter [readings, nuisance parameters].
    pub(crate) nuisances: DMatrix<f32>,
}

/// Whether a fit leaves only noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Adequacy {
    /// Probability of a deviation as large, were the fit right.
    pub(crate) p_value: f64,
    /// The largest deviation over sensors and scales, in standard deviations.
    pub(crate) deviation: f64,
}

/// A segmented problem with its sensitivities.
pub struct LinearizedProblem<'a> {
    pub(crate) problem: SegmentedProblem<'a>,
    pub(crate) sensitivities: Sensitivities,
    /// The fit of the empty set; `None` where the nominal diverges.
    pub(crate) empty: Option<Fit>,
    /// Whether that fit leaves only noise; computed at the first request.
    pub(crate) empty_adequacy: OnceLock<Adequacy>,
}

impl std::fmt::Debug for LinearizedProblem<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LinearizedProblem")
            .field("segments", &self.problem.segments.len())
            .finish_non_exhaustive()
    }
}

impl LinearizedProblem<'_> {
    /// The fit of the empty set.
    ///
    /// # Errors
    /// The nominal diverges.
    pub(crate) fn empty(&self) -> Result<&Fit, GapError> {
        self.empty.as_ref().ok_or_else(|| self.diverges())
    }

    pub(crate) fn diverges(&self) -> GapError {
        let first = &self.problem.segments[0];
        let trial = &self.problem.trials[first.trial];
        GapError::NominalDiverges {
            trial: trial.name.clone(),
            start: first.start,
            after: 0.0,
            expected: trial.times[first.rows.end - 1] - first.start,
            timestep: self.problem.model.timestep,
        }
    }

    /// Penalty of the prior of a start, for a tangent.
    pub(crate) fn charge(&self, start: &DVector<f64>) -> f64 {
        start
            .component_mul(start)
            .dot(&self.sensitivities.precision)
    }

    /// Whitened residuals of a segment; false where it blew up.
    pub(crate) fn shoot(
        &self,
        simulation: &mut dyn Simulation,
        at: usize,
        start: &DVector<f64>,
        entries: &[Entry],
        residual: &mut Vec<f64>,
    ) -> bool {
        let segment = &self.problem.segments[at];
        let trial = &self.problem.trials[segment.trial];
        let mut trace = Trace::default();
        let whole = shooting::run(
            simulation,
            trial,
            segment,
            &self.problem.motions[segment.trial],
            WarmUp::required(self.problem.model, entries, &self.problem.options.rollout),
            self.problem.model.timestep,
            Some(start.as_slice()),
            &mut trace,
        );
        if whole {
            sensor_correction::residuals(
                &trace,
                trial,
                segment,
                self.problem.channels,
                &sensor_correction::corrections(self.problem.model, entries),
                self.problem.model.timestep,
                residual,
            );
            self.whiten(at, residual);
        }
        whole
    }

    /// Whitens the output errors of a segment and applies the weights of its rows.
    pub(crate) fn whiten(&self, at: usize, residual: &mut [f64]) {
        whitening::whiten(self.problem.channels, residual);
        for (value, weight) in residual.iter_mut().zip(&self.sensitivities.weights[at]) {
            *value *= weight;
        }
    }

    /// The empty set at the base.
    pub(crate) fn origin(&self) -> Point {
        Point {
            candidates: Vec::new(),
            values: Vec::new(),
            nuisances: self.sensitivities.base.clone(),
            starts: vec![DVector::zeros(2 * self.problem.model.nv); self.problem.segments.len()],
        }
    }

    /// Projection of whitened residuals off the start of a segment.
    pub(crate) fn projection(&self, at: usize) -> &StartProjection {
        &self.sensitivities.by_segment[at].start
    }
}
