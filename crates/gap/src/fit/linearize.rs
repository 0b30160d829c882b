//! The linearisation about the nominal, repeated where the data move its nuisance parameters far.

use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    fit::{
        linearized_problem::{LinearizedProblem, Sensitivities},
        segmented_problem::SegmentedProblem,
    },
    problem::{candidates, problem::Problem, segments::Segment},
    progress::Watch,
    rollout::state_estimation,
};

/// Gauss-Newton steps of a start.
const SETTLING: usize = 3;

impl Problem<'_> {
    /// Cuts the trials into segments and finds their sensitivities.
    pub fn linearize(&self, watch: &Watch<'_>) -> Result<LinearizedProblem<'_>, GapError> {
        let options = &self.settings.options;
        let problem = self
            .segmented(self.segments(options.segments.first_length, options.segments.first_most));
        let segments = &options.segments;
        let seconds = segments.most_freedom_seconds / self.plant.description().nv.max(1) as f64;
        let most = segments
            .most
            .min((seconds / segments.length).ceil() as usize);
        LinearizedProblem::new(problem, self.segments(segments.length, most), watch)
    }

    /// The problem on some segments, with all uncertain numbers of the nominal.
    pub(crate) fn segmented(&self, segments: Vec<Segment>) -> SegmentedProblem<'_> {
        let options = &self.settings.options;
        let model = self.plant.description();
        let uncertainty = &self.settings.uncertainty;
        let nuisances = (model.nuisances.iter().enumerate())
            .map(|(at, nuisance)| {
                (
                    at,
                    uncertainty.standard_deviation(nuisance, &options.candidates),
                )
            })
            .filter(|(_, sd)| *sd > 0.0)
            .collect();
        let candidates = &self.candidates;
        SegmentedProblem {
            plant: self.plant,
            model,
            trials: &self.trials,
            motions: &self.motions,
            channels: &self.channels,
            candidates,
            options,
            log_shares: candidates::log_shares(candidates, options.candidates.elaborate_form),
            nuisances,
            segments,
        }
    }
}

impl<'a> LinearizedProblem<'a> {
    /// Linearises every segment with respect to its start and the nuisance parameters.
    ///
    /// Sensitivities hold only near the point where they are computed, and the nominal may be far off. Therefore its
    /// nuisance parameters are first fitted to a few short segments, and all `segments` are linearised about that fit, each
    /// from a start that suits it; once more where the fit to all moves the nuisance parameters far. Only the priors tell an
    /// effect from a nuisance parameter that imitates it, so the sensitivities to both must be computed at one point.
    pub(crate) fn new(
        problem: SegmentedProblem<'a>,
        segments: Vec<Segment>,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let nominal = DVector::zeros(problem.nuisances.len());
        let mut linearized = Self::about(problem, nominal, "first sensitivities", watch)?;
        if let Some(fit) = linearized.fit_roughly(linearized.origin(), watch)? {
            linearized.sensitivities.base = fit.point.nuisances;
        }
        linearized.forget_unseen(&segments);
        linearized.problem.segments = segments;
        linearized.settle_starts(watch)?;
        linearized.compute_sensitivities("sensitivities", true, watch)?;
        linearized.empty = linearized.fit(linearized.origin(), watch)?;
        if let Some(fit) = &linearized.empty
            && (&fit.point.nuisances - &linearized.sensitivities.base).amax()
                > linearized.problem.options.fit.relinearized_shift
        {
            let point = fit.point.clone();
            linearized.sensitivities.base = point.nuisances;
            linearized.move_starts(&point.starts)?;
            linearized.compute_sensitivities(
                "sensitivities about the refitted nominal",
                true,
                watch,
            )?;
            linearized.empty = linearized.fit(linearized.origin(), watch)?;
        }
        Ok(linearized)
    }

    /// Linearised about known nuisance parameters, without a fit of the empty set.
    pub(crate) fn about(
        problem: SegmentedProblem<'a>,
        base: DVector<f64>,
        what: &str,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let precision = state_estimation::arrival_precision(
            problem.model.nv,
            problem.options.states.arrival_sd,
        );
        let mut linearized = Self {
            problem,
            sensitivities: Sensitivities {
                base,
                precision,
                weights: Vec::new(),
                by_segment: Vec::new(),
            },
            empty: None,
            empty_adequacy: OnceLock::new(),
        };
        linearized.compute_sensitivities(what, true, watch)?;
        Ok(linearized)
    }

    /// Moves every segment's start to where it fits its readings best, the nuisance parameters at their base.
    fn settle_starts(&mut self, watch: &Watch<'_>) -> Result<(), GapError> {
        self.compute_sensitivities("starts", false, watch)?;
        let settled: Vec<DVector<f64>> = (0..self.problem.segments.len())
            .into_par_iter()
            .map(|at| self.settled_start(at))
            .collect::<Result<_, GapError>>()?;
        self.move_starts(&settled)
    }

    /// A few Gauss-Newton steps, as a tangent.
    fn settled_start(&self, at: usize) -> Result<DVector<f64>, GapError> {
        let projection = self.projection(at);
        let mut simulation = self
            .problem
            .plant
            .simulation(&self.problem.nuisance_values(&self.origin()), &[])?;
        let mut evaluate = |start: &DVector<f64>| {
            let mut residual = Vec::new();
            let whole = self.shoot(simulation.as_mut(), at, start, &[], &mut residual);
            let cost = residual.iter().map(|value| value * value).sum::<f64>() + self.charge(start);
            whole.then(|| (DMatrix::from_vec(residual.len(), 1, residual), cost))
        };
        let mut start = DVector::zeros(2 * self.problem.model.nv);
        let Some((mut residual, mut cost)) = evaluate(&start) else {
            return Ok(start);
        };
        for _ in 0..SETTLING {
            let next = projection.start(residual, &start);
            match evaluate(&next) {
                Some((then, less)) if less < cost => (start, residual, cost) = (next, then, less),
                _ => break,
            }
        }
        Ok(start)
    }

    /// Moves the start of every segment along a tangent.
    fn move_starts(&mut self, tangents: &[DVector<f64>]) -> Result<(), GapError> {
        let mut simulation = self
            .problem
            .plant
            .simulation(&self.problem.nuisance_values(&self.origin()), &[])?;
        for (segment, tangent) in self.problem.segments.iter_mut().zip(tangents) {
            simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
            simulation.retract(tangent.as_slice());
            segment.qpos = simulation.qpos().to_vec();
            segment.qvel = simulation.qvel().to_vec();
        }
        Ok(())
    }

    /// Leaves out the nuisance parameters that hardly change any reading; `all`: the segments to be linearised next.
    fn forget_unseen(&mut self, all: &[Segment]) {
        let seen = (self.sensitivities.by_segment.iter())
            .map(|of| of.start.gram(&of.nuisances.map(f64::from)).diagonal())
            .fold(DVector::zeros(self.problem.nuisances.len()), |sum, more| {
                sum + more
            });
        let rows = |of: &[Segment]| of.iter().map(|s| s.rows.len()).sum::<usize>() as f64;
        let undetermined = self.problem.options.fit.undetermined;
        let least = undetermined * undetermined * rows(&self.problem.segments) / rows(all);
        let kept: Vec<usize> = (0..seen.len()).filter(|at| seen[*at] >= least).collect();
        self.problem.nuisances = kept.iter().map(|at| self.problem.nuisances[*at]).collect();
        self.sensitivities.base = DVector::from_iterator(
            kept.len(),
            kept.iter().map(|at| self.sensitivities.base[*at]),
        );
    }
}
