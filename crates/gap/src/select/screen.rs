//! The screen: what every candidate would change about a fit, to first order.

use std::sync::atomic::AtomicUsize;

use hydro_effects as effects;
use hydro_effects::{Entry, Parameter, Part};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    fit::{
        finite_difference::{Differencing, STEP, inward, quotient},
        hypothesis::{Fit, Point},
        laplace::Quadratic,
        linearized_problem::LinearizedProblem,
        segmented_problem::SegmentedProblem,
    },
    progress::Watch,
    rollout::{
        sensor_correction,
        shooting::{self, Trace, WarmUp},
    },
};

/// The phase of an oscillation. Two amplitudes a quarter turn apart represent any phase, so they count as one choice.
pub(crate) const PHASE: &str = "phase";
/// A direction of the screen: one parameter of one candidate, with the others at `base`.
#[derive(Clone, Debug)]
pub(crate) struct Direction {
    pub(crate) candidate: usize,
    pub(crate) parameter: usize,
    /// Values of the candidate about which it is looked at.
    pub(crate) base: Vec<f64>,
    /// Step in the parameter's unit.
    pub(crate) step: f64,
    /// True where the step goes off a null that has no derivatives.
    pub(crate) secant: bool,
}

/// Columns of every candidate about a fit: (nuisance parameters, the fit's own parameters, directions).
#[derive(Debug)]
pub(crate) struct Screen {
    pub(crate) quadratic: Quadratic,
    pub(crate) directions: Vec<Direction>,
    /// Parameters before the directions: nuisance parameters and the fit's own.
    pub(crate) before: usize,
}

impl SegmentedProblem<'_> {
    /// Directions of a candidate: its amplitudes, for several shapes where it has any (a frequency says
    /// nothing while the amplitude is zero, so a few are tried).
    pub(crate) fn directions(&self, candidate: usize) -> Vec<Direction> {
        let options = &self.options.screen;
        let of = &self.candidates[candidate];
        let mut bases = vec![of.null()];
        for (at, p) in of.parameters.iter().enumerate() {
            let factors: &[f64] = match p.name.as_str() {
                "frequency" => &options.frequency_factors,
                "rate" | "length" => &options.shape_factors,
                _ => continue,
            };
            bases = factors
                .iter()
                .flat_map(|factor| {
                    bases.iter().map(move |base| {
                        let mut base = base.clone();
                        base[at] = (base[at] * factor).clamp(p.lower, p.upper);
                        base
                    })
                })
                .collect();
        }
        let is_point_mass = effects::effect(of.effect).is_point_mass();
        let shapes = |(_, p): &(usize, &Parameter)| p.shapes;
        let all = || of.parameters.iter().enumerate();
        for (at, p) in all().filter(|of| is_point_mass && shapes(of)) {
            for place in options.payload_places {
                let mut base = of.null();
                base[at] += place * p.prior_sd;
                bases.push(base);
            }
        }
        if let Some(at) = of.parameters.iter().position(|p| p.name == PHASE) {
            bases = bases
                .into_iter()
                .flat_map(|base| {
                    let mut quarter = base.clone();
                    quarter[at] += std::f64::consts::FRAC_PI_2;
                    [base, quarter]
                })
                .collect();
        }
        let amplitudes: Vec<(usize, f64)> = all()
            .filter(|of| !shapes(of))
            .map(|(parameter, p)| {
                // A start off the null: there the effect has no derivative, and a secant stands for it.
                let step = if p.start == p.null {
                    inward(p.null, STEP * p.prior_sd, p.upper)
                } else {
                    p.start - p.null
                };
                (parameter, step)
            })
            .collect();
        bases
            .iter()
            .flat_map(|base| {
                amplitudes.iter().map(|(parameter, step)| Direction {
                    candidate,
                    parameter: *parameter,
                    base: base.clone(),
                    step: *step,
                    // Where it sits is given, so a mass has a slope.
                    secant: !is_point_mass
                        && of.parameters[*parameter].start != of.parameters[*parameter].null,
                })
            })
            .collect()
    }
}

impl LinearizedProblem<'_> {
    /// Looks along every direction about a fit.
    pub(crate) fn screen(
        &self,
        fit: &Fit,
        directions: Vec<Direction>,
        watch: &Watch<'_>,
    ) -> Result<Screen, GapError> {
        let done = AtomicUsize::new(0);
        let count = self.problem.segments.len();
        let total = self.screened();
        let z = self.problem.normalised(&fit.point);
        let entries = self.problem.entries(&fit.point);
        // Only columns taken at one point separate an effect from a nuisance parameter that imitates it: those of
        // well-determined ones are taken here.
        let seen = self.well_seen();
        let grams: Vec<DMatrix<f64>> = (0..total)
            .into_par_iter()
            .map(|among| {
                let at = among * count / total;
                let residual = &fit.residuals[at];
                let own = fit.columns[at].own.map(f64::from);
                let trace = self.trace(at, &fit.point, &entries)?;
                let from = self.differencing(at, &fit.point, residual)?;
                let mut columns = DMatrix::zeros(residual.len(), own.ncols() + directions.len());
                columns.view_mut((0, 0), own.shape()).copy_from(&own);
                let looked: Vec<DVector<f64>> = directions
                    .par_iter()
                    .map(|direction| {
                        watch.check()?;
                        self.along(at, fit, direction, &trace, &from)
                    })
                    .collect::<Result<_, GapError>>()?;
                for (column, found) in looked.iter().enumerate() {
                    columns.set_column(own.ncols() + column, found);
                }
                let mut padded = DVector::zeros(z.len() + directions.len());
                padded.rows_mut(0, z.len()).copy_from(&z);
                let known = fit.columns[at].nuisances.as_ref();
                let nuisance_columns =
                    self.renewed_nuisances(at, known, &seen, &fit.point, &from)?;
                let gram = self.gram(
                    at,
                    &fit.point,
                    &padded,
                    residual,
                    Some(&nuisance_columns),
                    &columns,
                );
                watch.count("screening effects", &done, total);
                Ok(gram)
            })
            .collect::<Result<_, GapError>>()?;
        let whole = grams
            .into_iter()
            .reduce(|a, b| a + b)
            .unwrap_or_else(|| DMatrix::zeros(1, 1));
        // As if every segment had been looked at.
        let whole = whole * (count as f64 / total.max(1) as f64);
        Ok(Screen {
            quadratic: Quadratic::from_gram(&whole),
            directions,
            before: z.len(),
        })
    }

    /// Number of segments that are screened.
    fn screened(&self) -> usize {
        let options = &self.problem.options.screen;
        let all = self.problem.seconds();
        let most = options
            .length
            .min(options.freedom_seconds / self.problem.model.nv.max(1) as f64);
        let part = (most / all.max(f64::MIN_POSITIVE)).min(1.0);
        ((part * self.problem.segments.len() as f64).ceil() as usize).max(1)
    }

    /// Readings of a segment at every step.
    fn trace(&self, at: usize, point: &Point, entries: &[Entry]) -> Result<Trace, GapError> {
        let segment = &self.problem.segments[at];
        let nuisances = self.problem.nuisance_values(point);
        let mut simulation = self.problem.plant.simulation(&nuisances, entries)?;
        let mut trace = Trace::default();
        shooting::run(
            simulation.as_mut(),
            &self.problem.trials[segment.trial],
            segment,
            &self.problem.motions[segment.trial],
            WarmUp::required(self.problem.model, entries, &self.problem.options.rollout),
            self.problem.model.timestep,
            Some(point.starts[at].as_slice()),
            &mut trace,
        );
        Ok(trace)
    }

    fn along(
        &self,
        at: usize,
        fit: &Fit,
        direction: &Direction,
        trace: &Trace,
        from: &Differencing<'_>,
    ) -> Result<DVector<f64>, GapError> {
        let candidate = &self.problem.candidates[direction.candidate];
        let sd = candidate.parameters[direction.parameter].prior_sd;
        let moved = |step: f64| {
            let mut point = fit.point.clone();
            let mut values = direction.base.clone();
            values[direction.parameter] += step * sd;
            point.candidates.push(direction.candidate);
            point.values.push(values);
            point
        };
        let step = direction.step / sd;
        let residual = &fit.residuals[at];
        if !self.is_measurement(direction.candidate) {
            // Off the null, a secant stands for what has no slope.
            return match direction.secant {
                true => self.column(at, &moved(step), step, from),
                false => self.slope(at, &moved, step, None, from),
            };
        }
        let point = moved(step);
        // The motion is the same; only what the sensors say of it changes.
        let segment = &self.problem.segments[at];
        let mut other = Vec::new();
        sensor_correction::residuals(
            trace,
            &self.problem.trials[segment.trial],
            segment,
            self.problem.channels,
            &sensor_correction::corrections(self.problem.model, &self.problem.entries(&point)),
            self.problem.model.timestep,
            &mut other,
        );
        self.whiten(at, &mut other);
        Ok(quotient(residual, &other, step))
    }

    /// True where a candidate changes only what sensors report.
    pub(crate) fn is_measurement(&self, candidate: usize) -> bool {
        let effect = effects::effect(self.problem.candidates[candidate].effect);
        matches!(effect.part(), Part::Sensor(_))
    }
}
