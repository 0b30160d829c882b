//! The fit of a hypothesis by multiple shooting, and the screen of every candidate about a fit.
//!
//! A hypothesis is a set of effects. Its parameters, the uncertain numbers of the nominal ("knobs") and
//! the start of every segment are fitted together by Gauss-Newton on whitened output errors. Starts and
//! knobs keep the sensitivities of the nominal; effects are differentiated anew about each point.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{
    candidates::Candidate,
    error::GapError,
    information::{Bounds, Optimum, Quadratic, StartProjection},
    measured::{Channels, Measured},
    shooting::{self, Segment, Trace, Track, WarmUp},
    start::{self, whiten},
    watch::Watch,
};
use crate::{
    effects::{self, Entry, Part},
    sim::plant::{Plant, PlantDescription, Simulation},
};

/// Step of a difference quotient, in standard deviations of the prior.
const STEP: f64 = 0.01;
/// The same for a knob.
const KNOB_STEP: f64 = 0.1;
/// Segments that a screen looks at: it only chooses what is fitted to all of them.
const SCREENED: usize = 16;
/// Parameters that shape what amplitudes do.
const SHAPE_NAMES: [&str; 6] = [
    "frequency",
    "rate",
    "length",
    "speed",
    PHASE,
    "vertical_lag",
];
/// The phase of an oscillation: amplitudes at two phases a quarter of a turn apart make any.
pub(super) const PHASE: &str = "phase";
/// Factors on a shape's usual value that are tried.
const SHAPES: [f64; 3] = [1.0 / 3.0, 1.0, 3.0];
/// Factors on a frequency's usual value that are tried.
const FREQUENCIES: [f64; 4] = [0.4, 0.8, 1.6, 3.0];
/// Knobs farther than this from the base (standard deviations, together) get sensitivities of their own.
const FAR: f64 = 2.0;
/// Gauss-Newton steps at most.
const ITERATIONS: usize = 7;
/// The same for the empty set, whose steps are cheap.
const SETTLING: usize = 30;
/// A change of the cost that ends a fit: absolute, relative.
const CONVERGED: f64 = 0.05;
const CONVERGED_RELATIVE: f64 = 1e-5;

/// Trials, their segments and what is common to every hypothesis.
pub struct Bench<'a> {
    pub(super) plant: &'a dyn Plant,
    pub(super) model: &'a PlantDescription,
    pub(super) trials: &'a [Measured],
    pub(super) tracks: &'a [Track],
    pub(super) channels: &'a Channels,
    pub(super) candidates: &'a [Candidate],
    /// Uncertain numbers in use (row of `PlantDescription::knobs`) and the standard deviation of each.
    pub(super) knobs: Vec<(usize, f64)>,
    pub(super) segments: Vec<Segment>,
    /// Per segment: projection off its start, and the sensitivity to the knobs.
    shared: Vec<(StartProjection, DMatrix<f32>)>,
    /// Knobs about which those are taken, in standard deviations.
    base: DVector<f64>,
    pub(super) precision: DVector<f64>,
}

impl std::fmt::Debug for Bench<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bench")
            .field("segments", &self.segments.len())
            .finish_non_exhaustive()
    }
}

/// A set of candidates with values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    /// Rows of `Bench::candidates`.
    pub(super) candidates: Vec<usize>,
    /// Values of each candidate, in the order of its parameters.
    pub(super) values: Vec<Vec<f64>>,
    /// Knobs in standard deviations.
    pub(super) knobs: DVector<f64>,
    /// Start of each segment, as a tangent from its track.
    pub(super) starts: Vec<DVector<f64>>,
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) point: Point,
    /// About zero in (knobs, parameters); per trial, so that trials can be drawn again.
    pub(super) quadratics: Vec<Quadratic>,
    pub(super) bounds: Vec<Bounds>,
    /// Squared whitened residuals at the point.
    pub(super) misfit: f64,
    /// What the priors of knobs and parameters charge for the point.
    pub(super) penalty: f64,
    /// Whitened residuals by segment [readings], at the point.
    pub(super) residuals: Vec<Vec<f64>>,
    /// Change of the whitened predictions with each of the point's own parameters, by segment.
    columns: Vec<DMatrix<f32>>,
    /// The same with the knobs, where these are too far from the base for the shared ones.
    nuisances: Vec<Option<DMatrix<f32>>>,
    /// Readings that count.
    pub(super) readings: usize,
}

impl Fit {
    pub(super) fn quadratic(&self) -> Quadratic {
        sum(self.quadratics.iter())
    }

    /// Absolute log evidence (up to the constant of the noise) and the optimum, where every squared
    /// residual counts `1 / factor`.
    pub(super) fn evidence(&self, factor: f64) -> Option<(f64, Optimum)> {
        let quadratic = self.quadratic().tempered(factor);
        let best = quadratic.best(&self.bounds)?;
        Some((best.log_evidence - 0.5 * quadratic.q, best))
    }
}

/// Sum of quadratics of the same parameters.
pub(super) fn sum<'a>(quadratics: impl Iterator<Item = &'a Quadratic>) -> Quadratic {
    quadratics
        .cloned()
        .reduce(|mut a, b| {
            a.q += b.q;
            a.b += b.b;
            a.a += b.a;
            a
        })
        .unwrap_or(Quadratic {
            q: 0.0,
            b: DVector::zeros(0),
            a: DMatrix::zeros(0, 0),
        })
}

/// What a segment gives at a point: residual, Gram matrix, own columns, and columns of the knobs where these
/// are far from the base.
type Evaluated = (Vec<f64>, DMatrix<f64>, DMatrix<f32>, Option<DMatrix<f32>>);

/// What a screen looks along: one parameter of one candidate, with the others at `base`.
#[derive(Clone, Debug)]
pub(super) struct Direction {
    pub(super) candidate: usize,
    pub(super) parameter: usize,
    /// Values of the candidate about which it is looked at.
    pub(super) base: Vec<f64>,
    /// Step in the parameter's unit.
    pub(super) step: f64,
}

/// Columns of every candidate about a fit: (knobs, the fit's own parameters, directions).
#[derive(Debug)]
pub(super) struct Screen {
    pub(super) quadratic: Quadratic,
    pub(super) directions: Vec<Direction>,
    /// Parameters before the directions: knobs and the fit's own.
    pub(super) before: usize,
}

impl<'a> Bench<'a> {
    /// Cuts the trials and finds how every segment depends on its start and on the knobs.
    #[expect(clippy::too_many_arguments)]
    pub(super) fn new(
        plant: &'a dyn Plant,
        trials: &'a [Measured],
        tracks: &'a [Track],
        channels: &'a Channels,
        candidates: &'a [Candidate],
        knobs: Vec<(usize, f64)>,
        segments: Vec<Segment>,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let model = plant.description();
        let mut bench = Self {
            plant,
            model,
            trials,
            tracks,
            channels,
            candidates,
            base: DVector::zeros(knobs.len()),
            knobs,
            segments,
            shared: Vec::new(),
            precision: start::arrival_precision(model.nv, start::ARRIVAL),
        };
        bench.linearise(watch)?;
        // The nominal may be so far off that its sensitivities hold only nearby: settle, look again.
        if let Some(fit) = bench.settle(watch)? {
            bench.move_to(&fit.point)?;
            bench.linearise(watch)?;
        }
        Ok(bench)
    }

    /// Sensitivities of every segment about the base. One whose start or knobs make the nominal blow up
    /// says nothing reliable and is left out.
    fn linearise(&mut self, watch: &Watch<'_>) -> Result<(), GapError> {
        let done = AtomicUsize::new(0);
        let total = self.segments.len();
        let shared: Vec<_> = (0..total)
            .into_par_iter()
            .map(|at| {
                watch.check()?;
                let shared = self.sensitivities(at)?;
                watch.count("sensitivities", &done, total);
                Ok(shared)
            })
            .collect::<Result<_, GapError>>()?;
        let (segments, shared): (Vec<_>, Vec<_>) = self
            .segments
            .iter()
            .cloned()
            .zip(shared)
            .filter_map(|(segment, shared)| Some((segment, shared?)))
            .unzip();
        if segments.is_empty() {
            let first = &self.segments[0];
            let trial = &self.trials[first.trial];
            return Err(GapError::NominalDiverges {
                trial: trial.name.clone(),
                start: first.start,
                after: 0.0,
                expected: trial.times[first.rows.end - 1] - first.start,
                timestep: self.model.timestep,
            });
        }
        self.segments = segments;
        self.shared = shared;
        Ok(())
    }

    /// Starts and knobs of the empty set, however far they are.
    fn settle(&self, watch: &Watch<'_>) -> Result<Option<Fit>, GapError> {
        self.fit_for(self.origin(), SETTLING, watch)
    }

    /// Makes a point of the empty set the base.
    fn move_to(&mut self, point: &Point) -> Result<(), GapError> {
        self.base.clone_from(&point.knobs);
        let knobs = self.knob_values(point);
        let mut simulation = self.plant.simulation(&knobs, &[])?;
        for (segment, start) in self.segments.iter_mut().zip(&point.starts) {
            simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
            simulation.retract(start.as_slice());
            segment.qpos = simulation.qpos().to_vec();
            segment.qvel = simulation.qvel().to_vec();
        }
        Ok(())
    }

    fn sensitivities(
        &self,
        at: usize,
    ) -> Result<Option<(StartProjection, DMatrix<f32>)>, GapError> {
        let segment = &self.segments[at];
        let trial = &self.trials[segment.trial];
        let none = vec![shooting::Correction::NONE; self.model.sensors.len()];
        let base = self.knob_values(&self.origin());
        let mut simulation = self.plant.simulation(&base, &[])?;
        let origin = DVector::zeros(2 * self.model.nv);
        let mut residual = Vec::new();
        if !self.shoot(simulation.as_mut(), at, &origin, &[], &mut residual) {
            return Ok(None);
        }
        let sensitivity = start::start_sensitivity(
            simulation.as_mut(),
            trial,
            segment,
            &self.tracks[segment.trial],
            WarmUp::of(self.model, &[]),
            self.channels,
            &none,
            self.model,
            &residual,
        );
        let Some(projection) =
            sensitivity.and_then(|matrix| StartProjection::new(&matrix, &self.precision))
        else {
            return Ok(None);
        };
        let nuisances = self.knob_columns(at, &self.origin(), &residual)?;
        Ok(Some((projection, nuisances)))
    }

    /// Change of the whitened predictions of a segment with every knob, a standard deviation each.
    fn knob_columns(
        &self,
        at: usize,
        point: &Point,
        residual: &[f64],
    ) -> Result<DMatrix<f32>, GapError> {
        let mut columns = DMatrix::zeros(residual.len(), self.knobs.len());
        let base = self.knob_values(point);
        let entries = self.entries(point);
        let mut turned = Vec::new();
        for (column, (knob, sd)) in self.knobs.iter().enumerate() {
            let mut knobs = base.clone();
            knobs[*knob] += KNOB_STEP * sd;
            let mut simulation = self.plant.simulation(&knobs, &entries)?;
            let start = &point.starts[at];
            if self.shoot(simulation.as_mut(), at, start, &entries, &mut turned) {
                for (row, (before, turned)) in residual.iter().zip(&turned).enumerate() {
                    columns[(row, column)] = ((before - turned) / KNOB_STEP) as f32;
                }
            }
        }
        Ok(columns)
    }

    /// Whitened residuals of a segment; false where it blew up.
    fn shoot(
        &self,
        simulation: &mut dyn Simulation,
        at: usize,
        start: &DVector<f64>,
        entries: &[Entry],
        residual: &mut Vec<f64>,
    ) -> bool {
        let segment = &self.segments[at];
        let trial = &self.trials[segment.trial];
        let mut trace = Trace::default();
        let whole = shooting::run(
            simulation,
            trial,
            segment,
            &self.tracks[segment.trial],
            WarmUp::of(self.model, entries),
            self.model.timestep,
            Some(start.as_slice()),
            &mut trace,
        );
        if whole {
            shooting::residuals(
                &trace,
                trial,
                segment,
                self.channels,
                &shooting::corrections(self.model, entries),
                self.model.timestep,
                residual,
            );
            whiten(self.channels, residual);
        }
        whole
    }

    /// The empty set at the base.
    pub(super) fn origin(&self) -> Point {
        Point {
            candidates: Vec::new(),
            values: Vec::new(),
            knobs: self.base.clone(),
            starts: vec![DVector::zeros(2 * self.model.nv); self.segments.len()],
        }
    }

    pub(super) fn entries(&self, point: &Point) -> Vec<Entry> {
        point
            .candidates
            .iter()
            .zip(&point.values)
            .flat_map(|(candidate, values)| self.candidates[*candidate].entries(values))
            .collect()
    }

    /// Knobs of the model at a point.
    pub(super) fn knob_values(&self, point: &Point) -> Vec<f64> {
        let mut knobs = vec![0.0; self.model.knobs.len()];
        for ((knob, sd), z) in self.knobs.iter().zip(point.knobs.iter()) {
            knobs[*knob] = sd * z;
        }
        knobs
    }

    /// Values of a point in units of priors: knobs, then parameters.
    fn normalised(&self, point: &Point) -> DVector<f64> {
        let parameters =
            point
                .candidates
                .iter()
                .zip(&point.values)
                .flat_map(|(candidate, values)| {
                    self.candidates[*candidate]
                        .parameters
                        .iter()
                        .zip(values)
                        .map(|(p, value)| (value - p.null) / p.prior_sd)
                });
        let all: Vec<f64> = point.knobs.iter().copied().chain(parameters).collect();
        DVector::from_vec(all)
    }

    /// Sets knobs and parameters of a point from units of priors.
    fn set(&self, point: &mut Point, z: &DVector<f64>) {
        point.knobs = z.rows(0, self.knobs.len()).into_owned();
        let mut at = self.knobs.len();
        for (candidate, values) in point.candidates.iter().zip(&mut point.values) {
            for (p, value) in self.candidates[*candidate].parameters.iter().zip(values) {
                *value = (p.null + z[at] * p.prior_sd).clamp(p.lower, p.upper);
                at += 1;
            }
        }
    }

    pub(super) fn bounds(&self, candidates: &[usize]) -> Vec<Bounds> {
        let free = Bounds {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
        };
        let mut bounds = vec![free; self.knobs.len()];
        for candidate in candidates {
            bounds.extend(
                self.candidates[*candidate]
                    .parameters
                    .iter()
                    .map(|p| Bounds {
                        lower: (p.lower - p.null) / p.prior_sd,
                        upper: (p.upper - p.null) / p.prior_sd,
                    }),
            );
        }
        bounds
    }

    /// Fits a set of candidates from a first point.
    ///
    /// # Errors
    /// Where the plant refuses it, or a stop was asked for. None where it blows up from the start.
    pub(super) fn fit(&self, first: Point, watch: &Watch<'_>) -> Result<Option<Fit>, GapError> {
        self.fit_for(first, ITERATIONS, watch)
    }

    fn fit_for(
        &self,
        first: Point,
        iterations: usize,
        watch: &Watch<'_>,
    ) -> Result<Option<Fit>, GapError> {
        let bounds = self.bounds(&first.candidates);
        let mut point = first;
        let mut best: Option<(f64, Fit)> = None;
        let mut halvings = 0;
        for iteration in 0..iterations {
            watch.check()?;
            let evaluated = self.evaluate(&point, &bounds)?;
            let z = self.normalised(&point);
            let cost = evaluated.as_ref().map_or(f64::INFINITY, |fit| {
                fit.misfit
                    + z.norm_squared()
                    + point
                        .starts
                        .iter()
                        .map(|start| start.component_mul(start).dot(&self.precision))
                        .sum::<f64>()
            });
            match (&best, evaluated) {
                (None, None) => return Ok(None),
                (Some((before, fit)), _) if cost > before + 1e-9 => {
                    // Too far: half way back.
                    if halvings == 3 {
                        break;
                    }
                    halvings += 1;
                    point = midway(&fit.point, &point);
                    continue;
                }
                (before, Some(fit)) => {
                    let small = before.as_ref().is_some_and(|(before, _)| {
                        before - cost < CONVERGED + CONVERGED_RELATIVE * cost
                    });
                    best = Some((cost, fit));
                    if small || iteration + 1 == iterations {
                        break;
                    }
                }
                (Some(_), None) => break,
            }
            let Some((_, fit)) = &best else { break };
            let Some(optimum) = fit.quadratic().best(&bounds) else {
                break;
            };
            point = self.step(fit, &optimum.z);
        }
        Ok(best.map(|(_, fit)| fit))
    }

    /// The point that the linearisation about a fit leads to.
    fn step(&self, fit: &Fit, z: &DVector<f64>) -> Point {
        let mut next = fit.point.clone();
        self.set(&mut next, z);
        let change = self.normalised(&next) - self.normalised(&fit.point);
        let knobs = self.knobs.len();
        next.starts = (0..self.segments.len())
            .into_par_iter()
            .map(|at| {
                let (projection, shared) = &self.shared[at];
                let nuisances = fit.nuisances[at].as_ref().unwrap_or(shared);
                let readings = &fit.residuals[at];
                let mut residual = DMatrix::from_column_slice(readings.len(), 1, readings);
                residual -= nuisances.map(f64::from) * change.rows(0, knobs);
                residual -=
                    fit.columns[at].map(f64::from) * change.rows(knobs, change.len() - knobs);
                // The prior of a start is about its track, not about where it is now.
                residual += projection.sensitivity.map(f64::from) * &fit.point.starts[at];
                projection.start(&residual)
            })
            .collect();
        next
    }

    /// Residuals at a point and the quadratic about zero.
    fn evaluate(&self, point: &Point, bounds: &[Bounds]) -> Result<Option<Fit>, GapError> {
        let entries = self.entries(point);
        let knobs = self.knob_values(point);
        let z = self.normalised(point);
        let blown = AtomicBool::new(false);
        let far = (&point.knobs - &self.base).norm() > FAR;
        let parts: Vec<Option<Evaluated>> = (0..self.segments.len())
            .into_par_iter()
            .map(|at| {
                if blown.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let mut simulation = self.plant.simulation(&knobs, &entries)?;
                let mut residual = Vec::new();
                let start = &point.starts[at];
                if !self.shoot(simulation.as_mut(), at, start, &entries, &mut residual) {
                    blown.store(true, Ordering::Relaxed);
                    return Ok(None);
                }
                let own = self.own_columns(at, point, &entries, &residual)?;
                let nuisances = if far {
                    Some(self.knob_columns(at, point, &residual)?)
                } else {
                    None
                };
                let gram = self.gram(at, point, &z, &residual, nuisances.as_ref(), &own);
                Ok(Some((
                    residual,
                    gram,
                    own.map(|value| value as f32),
                    nuisances,
                )))
            })
            .collect::<Result<_, GapError>>()?;
        let Some(parts) = parts.into_iter().collect::<Option<Vec<_>>>() else {
            return Ok(None);
        };
        let mut grams: Vec<Option<DMatrix<f64>>> = vec![None; self.trials.len()];
        let mut residuals = Vec::with_capacity(parts.len());
        let mut columns = Vec::with_capacity(parts.len());
        let mut nuisances = Vec::with_capacity(parts.len());
        for (segment, (residual, gram, own, knobs)) in self.segments.iter().zip(parts) {
            match &mut grams[segment.trial] {
                Some(sum) => *sum += gram,
                empty => *empty = Some(gram),
            }
            residuals.push(residual);
            columns.push(own);
            nuisances.push(knobs);
        }
        let misfit = residuals.iter().flatten().map(|value| value * value).sum();
        // A missing reading was made an exact zero by the whitening.
        let readings = residuals
            .iter()
            .flatten()
            .filter(|value| **value != 0.0)
            .count();
        Ok(Some(Fit {
            point: point.clone(),
            quadratics: grams.iter().flatten().map(Quadratic::from_gram).collect(),
            bounds: bounds.to_vec(),
            misfit,
            penalty: z.norm_squared(),
            residuals,
            columns,
            nuisances,
            readings,
        }))
    }

    /// Gram matrix of (residual carried back to zero, knobs, columns), off the start.
    fn gram(
        &self,
        at: usize,
        point: &Point,
        z: &DVector<f64>,
        residual: &[f64],
        nuisances: Option<&DMatrix<f32>>,
        columns: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let (projection, shared) = &self.shared[at];
        let nuisances = nuisances.unwrap_or(shared);
        let knobs = self.knobs.len();
        let mut all = DMatrix::zeros(residual.len(), 1 + knobs + columns.ncols());
        all.column_mut(0).copy_from_slice(residual);
        all.view_mut((0, 1), nuisances.shape())
            .copy_from(&nuisances.map(f64::from));
        all.view_mut((0, 1 + knobs), columns.shape())
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
        entries: &[Entry],
        residual: &[f64],
    ) -> Result<DMatrix<f64>, GapError> {
        let count = point.values.iter().map(Vec::len).sum();
        let mut columns = DMatrix::zeros(residual.len(), count);
        if entries.is_empty() {
            return Ok(columns);
        }
        let mut column = 0;
        for (row, candidate) in point.candidates.iter().enumerate() {
            for (parameter, p) in self.candidates[*candidate].parameters.iter().enumerate() {
                let mut moved = point.clone();
                let value = &mut moved.values[row][parameter];
                let step = inward(*value, STEP * p.prior_sd, p.upper);
                *value += step;
                let found = self.column(at, &moved, step / p.prior_sd, residual)?;
                columns.set_column(column, &found);
                column += 1;
            }
        }
        Ok(columns)
    }

    /// Change of the whitened prediction between a residual and a moved point, over a step.
    fn column(
        &self,
        at: usize,
        moved: &Point,
        step: f64,
        residual: &[f64],
    ) -> Result<DVector<f64>, GapError> {
        let entries = self.entries(moved);
        let mut simulation = self.plant.simulation(&self.knob_values(moved), &entries)?;
        let mut other = Vec::new();
        let start = &moved.starts[at];
        if !self.shoot(simulation.as_mut(), at, start, &entries, &mut other) {
            return Ok(DVector::zeros(residual.len()));
        }
        Ok(quotient(residual, &other, step))
    }

    /// Directions of a candidate: its amplitudes, for several shapes where it has any (a frequency says
    /// nothing while the amplitude is zero, so a few are tried).
    pub(super) fn directions(&self, candidate: usize) -> Vec<Direction> {
        let of = &self.candidates[candidate];
        let mut bases = vec![of.null()];
        for (at, p) in of.parameters.iter().enumerate() {
            let factors: &[f64] = match p.name.as_str() {
                "frequency" => &FREQUENCIES,
                "rate" | "length" | "speed" => &SHAPES,
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
        let amplitudes = of.parameters.iter().enumerate();
        let amplitudes: Vec<(usize, f64)> = amplitudes
            .filter(|(_, p)| !SHAPE_NAMES.contains(&p.name.as_str()))
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
                })
            })
            .collect()
    }

    /// Looks along every direction about a fit.
    pub(super) fn screen(
        &self,
        fit: &Fit,
        directions: Vec<Direction>,
        watch: &Watch<'_>,
    ) -> Result<Screen, GapError> {
        let done = AtomicUsize::new(0);
        let count = self.segments.len();
        let total = count.min(SCREENED);
        let z = self.normalised(&fit.point);
        let entries = self.entries(&fit.point);
        let grams: Vec<DMatrix<f64>> = (0..total)
            .into_par_iter()
            .map(|among| {
                let at = among * count / total;
                let residual = &fit.residuals[at];
                let own = fit.columns[at].map(f64::from);
                let trace = self.trace(at, &fit.point, &entries)?;
                let mut columns = DMatrix::zeros(residual.len(), own.ncols() + directions.len());
                columns.view_mut((0, 0), own.shape()).copy_from(&own);
                for (column, direction) in directions.iter().enumerate() {
                    watch.check()?;
                    let found = self.along(at, fit, direction, &trace)?;
                    columns.set_column(own.ncols() + column, &found);
                }
                let mut padded = DVector::zeros(z.len() + directions.len());
                padded.rows_mut(0, z.len()).copy_from(&z);
                let nuisances = fit.nuisances[at].as_ref();
                let gram = self.gram(at, &fit.point, &padded, residual, nuisances, &columns);
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

    /// Readings of a segment at every step.
    fn trace(&self, at: usize, point: &Point, entries: &[Entry]) -> Result<Trace, GapError> {
        let segment = &self.segments[at];
        let knobs = self.knob_values(point);
        let mut simulation = self.plant.simulation(&knobs, entries)?;
        let mut trace = Trace::default();
        shooting::run(
            simulation.as_mut(),
            &self.trials[segment.trial],
            segment,
            &self.tracks[segment.trial],
            WarmUp::of(self.model, entries),
            self.model.timestep,
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
    ) -> Result<DVector<f64>, GapError> {
        let candidate = &self.candidates[direction.candidate];
        let sd = candidate.parameters[direction.parameter].prior_sd;
        let mut point = fit.point.clone();
        let mut values = direction.base.clone();
        values[direction.parameter] += direction.step;
        point.candidates.push(direction.candidate);
        point.values.push(values);
        let step = direction.step / sd;
        let residual = &fit.residuals[at];
        if !self.is_measurement(direction.candidate) {
            return self.column(at, &point, step, residual);
        }
        // The motion is the same; only what the sensors say of it changes.
        let segment = &self.segments[at];
        let mut other = Vec::new();
        shooting::residuals(
            trace,
            &self.trials[segment.trial],
            segment,
            self.channels,
            &shooting::corrections(self.model, &self.entries(&point)),
            self.model.timestep,
            &mut other,
        );
        whiten(self.channels, &mut other);
        Ok(quotient(residual, &other, step))
    }

    /// True where a candidate changes only what sensors report.
    pub(super) fn is_measurement(&self, candidate: usize) -> bool {
        let effect = effects::catalogue::effect(self.candidates[candidate].effect);
        matches!(effect.part(), Part::Sensor(_))
    }

    /// What is left of the whitened residual of a segment once its start and the knobs could move.
    pub(super) fn projection(&self, at: usize) -> &StartProjection {
        &self.shared[at].0
    }
}

/// Change of a prediction a step: minus that of the residual.
fn quotient(before: &[f64], after: &[f64], step: f64) -> DVector<f64> {
    let changes = before.iter().zip(after).map(|(a, b)| (a - b) / step);
    DVector::from_iterator(before.len(), changes)
}

/// A step that does not leave the bounds.
fn inward(value: f64, step: f64, upper: f64) -> f64 {
    if value + step > upper { -step } else { step }
}

/// Half way between two points of the same candidates.
fn midway(a: &Point, b: &Point) -> Point {
    Point {
        candidates: a.candidates.clone(),
        values: a
            .values
            .iter()
            .zip(&b.values)
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect())
            .collect(),
        knobs: 0.5 * (&a.knobs + &b.knobs),
        starts: a
            .starts
            .iter()
            .zip(&b.starts)
            .map(|(a, b)| 0.5 * (a + b))
            .collect(),
    }
}
