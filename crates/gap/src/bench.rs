//! Trials cut into segments, and what every hypothesis shares: how each segment's readings change with its
//! start and with the uncertain numbers of the nominal ("nuisance parameters").

use std::sync::{OnceLock, atomic::AtomicUsize};

use hydro_effects::Entry;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{
    adequacy::{self, Adequacy},
    candidates::{self, Candidate},
    column::{STEP, quotient},
    error::GapError,
    fit::{Fit, Point},
    information::{Bounds, StartProjection},
    measured::{Channels, Measured},
    resolution,
    shooting::{self, Segment, Trace, Track, WarmUp},
    start,
    watch::Watch,
};
use crate::plant::{Plant, PlantDescription, Simulation};

/// Root mean square of the whitened differences of its readings up to which a cheaper integrator follows the
/// model's own.
const FOLLOWS: f64 = 10.0;
/// Numbers that the fit of all segments moves by no more than this [standard deviations] need no new columns.
const NEAR: f64 = 1.0;
/// Gauss-Newton steps of a start.
const SETTLING: usize = 3;
/// What changes all whitened predictions together by more than this is seen so well that a per cent of it matters.
const WELL_SEEN: f64 = 30.0;
/// What changes all whitened predictions together by less than this, a prior's standard deviation moved, is
/// not seen in the data. Judged on short segments: long ones see several times more.
const UNSEEN: f64 = 0.05;

/// Trials, their segments and what is common to every hypothesis.
pub struct Bench<'a> {
    pub(super) plant: &'a dyn Plant,
    pub(super) model: &'a PlantDescription,
    pub(super) trials: &'a [Measured],
    pub(super) tracks: &'a [Track],
    pub(super) channels: &'a Channels,
    pub(super) candidates: &'a [Candidate],
    /// What the prior gives each of them among single effects, logarithm.
    pub(super) log_shares: Vec<f64>,
    /// Uncertain numbers in use (row of `PlantDescription::nuisances`) and the standard deviation of each.
    pub(super) nuisances: Vec<(usize, f64)>,
    pub(super) segments: Vec<Segment>,
    /// Per segment: factors on the whitened residuals [readings], about the base.
    weights: Vec<Vec<f64>>,
    /// Per segment: projection off its start, and the sensitivity to the nuisance parameters.
    pub(super) shared: Vec<(StartProjection, DMatrix<f32>)>,
    /// Nuisance parameters about which those are taken, in standard deviations.
    pub(super) base: DVector<f64>,
    pub(super) precision: DVector<f64>,
    /// The fit of the empty set; none where the nominal blows up.
    empty: Option<Fit>,
    /// Whether it leaves only noise, once it was asked for.
    adequacy: OnceLock<Adequacy>,
}

impl std::fmt::Debug for Bench<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bench")
            .field("segments", &self.segments.len())
            .finish_non_exhaustive()
    }
}

/// A plant, and the whitened residuals of a segment on it.
pub(super) type Differencing<'p> = (&'p dyn Plant, Vec<f64>);

/// Weights and residuals of a segment [readings].
type Looked = (Vec<f64>, Vec<f64>);

/// What a bench is made of.
#[derive(Clone)]
pub(super) struct Material<'a> {
    pub(super) plant: &'a dyn Plant,
    pub(super) trials: &'a [Measured],
    pub(super) tracks: &'a [Track],
    pub(super) channels: &'a Channels,
    pub(super) candidates: &'a [Candidate],
    /// As in [`Bench`].
    pub(super) nuisances: Vec<(usize, f64)>,
}

impl<'a> Bench<'a> {
    /// Finds how every segment depends on its start and on the nuisance parameters.
    ///
    /// The nominal may be so far off that its sensitivities hold only nearby. So its numbers are fitted to
    /// a few short segments, `first`, and every segment is looked at about what comes out, from a start that
    /// suits it; again where its fit moves the numbers far. An effect that a nuisance parameter imitates is told from it by
    /// their priors alone, so the columns of both must be of one point.
    pub(super) fn new(
        material: Material<'a>,
        first: Vec<Segment>,
        segments: Vec<Segment>,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let nominal = DVector::zeros(material.nuisances.len());
        let mut bench = Self::about(material, nominal, first, "first sensitivities", watch)?;
        if let Some(fit) = bench.fit_far(bench.origin(), watch)? {
            bench.base = fit.point.nuisances;
        }
        bench.forget_unseen(&segments);
        bench.segments = segments;
        bench.settle_starts(watch)?;
        bench.linearise("sensitivities", true, watch)?;
        bench.empty = bench.fit(bench.origin(), watch)?;
        if let Some(fit) = &bench.empty
            && (&fit.point.nuisances - &bench.base).amax() > NEAR
        {
            let point = fit.point.clone();
            bench.base = point.nuisances;
            bench.move_starts(&point.starts)?;
            bench.linearise("sensitivities about the refitted nominal", true, watch)?;
            bench.empty = bench.fit(bench.origin(), watch)?;
        }
        Ok(bench)
    }

    /// Moves every segment's start to where it fits its readings best, the nuisance parameters at their base.
    fn settle_starts(&mut self, watch: &Watch<'_>) -> Result<(), GapError> {
        self.linearise("starts", false, watch)?;
        let settled: Vec<DVector<f64>> = (0..self.segments.len())
            .into_par_iter()
            .map(|at| self.settled_start(at))
            .collect::<Result<_, GapError>>()?;
        self.move_starts(&settled)
    }

    /// A few Gauss-Newton steps, as a tangent.
    fn settled_start(&self, at: usize) -> Result<DVector<f64>, GapError> {
        let projection = self.projection(at);
        let mut simulation = self
            .plant
            .simulation(&self.nuisance_values(&self.origin()), &[])?;
        let mut look = |start: &DVector<f64>| {
            let mut residual = Vec::new();
            let whole = self.shoot(simulation.as_mut(), at, start, &[], &mut residual);
            let cost = residual.iter().map(|value| value * value).sum::<f64>() + self.charge(start);
            whole.then(|| (DMatrix::from_vec(residual.len(), 1, residual), cost))
        };
        let mut start = DVector::zeros(2 * self.model.nv);
        let Some((mut residual, mut cost)) = look(&start) else {
            return Ok(start);
        };
        for _ in 0..SETTLING {
            let next = projection.start(residual, &start);
            match look(&next) {
                Some((then, less)) if less < cost => (start, residual, cost) = (next, then, less),
                _ => break,
            }
        }
        Ok(start)
    }

    /// What the prior of a start charges for a tangent.
    pub(super) fn charge(&self, start: &DVector<f64>) -> f64 {
        start.component_mul(start).dot(&self.precision)
    }

    /// Moves the start of every segment along a tangent.
    fn move_starts(&mut self, tangents: &[DVector<f64>]) -> Result<(), GapError> {
        let mut simulation = self
            .plant
            .simulation(&self.nuisance_values(&self.origin()), &[])?;
        for (segment, tangent) in self.segments.iter_mut().zip(tangents) {
            simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
            simulation.retract(tangent.as_slice());
            segment.qpos = simulation.qpos().to_vec();
            segment.qvel = simulation.qvel().to_vec();
        }
        Ok(())
    }

    /// The same about nuisance parameters that are known, without a fit of the empty set.
    pub(super) fn about(
        material: Material<'a>,
        base: DVector<f64>,
        segments: Vec<Segment>,
        what: &str,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let model = material.plant.description();
        let mut bench = Self {
            plant: material.plant,
            model,
            trials: material.trials,
            tracks: material.tracks,
            channels: material.channels,
            candidates: material.candidates,
            log_shares: candidates::log_shares(material.candidates),
            nuisances: material.nuisances,
            segments,
            weights: Vec::new(),
            shared: Vec::new(),
            base,
            precision: start::arrival_precision(model.nv, start::ARRIVAL),
            empty: None,
            adequacy: OnceLock::new(),
        };
        bench.linearise(what, true, watch)?;
        Ok(bench)
    }

    /// Leaves out the nuisance parameters that no segment sees, where `all` will be looked at.
    fn forget_unseen(&mut self, all: &[Segment]) {
        let seen = (self.shared.iter())
            .map(|(projection, nuisances)| projection.gram(&nuisances.map(f64::from)).diagonal())
            .fold(DVector::zeros(self.nuisances.len()), |sum, more| sum + more);
        let rows = |of: &[Segment]| of.iter().map(|s| s.rows.len()).sum::<usize>() as f64;
        let least = UNSEEN * UNSEEN * rows(&self.segments) / rows(all);
        let kept: Vec<usize> = (0..seen.len()).filter(|at| seen[*at] >= least).collect();
        self.nuisances = kept.iter().map(|at| self.nuisances[*at]).collect();
        self.base = DVector::from_iterator(kept.len(), kept.iter().map(|at| self.base[*at]));
    }

    /// The fit of the empty set.
    ///
    /// # Errors
    /// Where the nominal blows up.
    pub(super) fn empty(&self) -> Result<&Fit, GapError> {
        self.empty.as_ref().ok_or_else(|| self.diverges())
    }

    /// Length of all segments together [s].
    pub(super) fn seconds(&self) -> f64 {
        let seconds = |segment: &Segment| {
            let times = &self.trials[segment.trial].times;
            times[segment.rows.end - 1] - times[segment.rows.start]
        };
        self.segments.iter().map(seconds).sum()
    }

    /// The same times the degrees of freedom: what a rollout of all costs.
    pub(super) fn freedom_seconds(&self) -> f64 {
        self.seconds() * self.model.nv as f64
    }

    /// Whether the empty set leaves only noise.
    ///
    /// # Errors
    /// Where the nominal blows up, or a stop was asked for.
    pub(super) fn empty_adequacy(
        &self,
        seed: u64,
        watch: &Watch<'_>,
    ) -> Result<Adequacy, GapError> {
        if let Some(known) = self.adequacy.get() {
            return Ok(*known);
        }
        let found = adequacy::of(self, self.empty()?, seed, watch)?;
        Ok(*self.adequacy.get_or_init(|| found))
    }

    fn diverges(&self) -> GapError {
        let first = &self.segments[0];
        let trial = &self.trials[first.trial];
        GapError::NominalDiverges {
            trial: trial.name.clone(),
            start: first.start,
            after: 0.0,
            expected: trial.times[first.rows.end - 1] - first.start,
            timestep: self.model.timestep,
        }
    }

    /// Sensitivities of every segment about the base. One whose start or nuisance parameters make the nominal blow up
    /// says nothing reliable and is left out. Without `nuisances` to the starts alone.
    fn linearise(
        &mut self,
        what: &str,
        nuisances: bool,
        watch: &Watch<'_>,
    ) -> Result<(), GapError> {
        let base = self.nuisance_values(&self.origin());
        let looked: Vec<Option<Looked>> = (0..self.segments.len())
            .into_par_iter()
            .map(|at| self.look_alone(at, &base))
            .collect::<Result<_, GapError>>()?;
        let (segments, looked): (Vec<_>, Vec<_>) = self
            .segments
            .iter()
            .cloned()
            .zip(looked)
            .filter_map(|(segment, looked)| Some((segment, looked?)))
            .unzip();
        self.segments = self.or_diverges(segments)?;
        let residuals: Vec<Vec<f64>>;
        (self.weights, residuals) = looked.into_iter().unzip();
        let done = AtomicUsize::new(0);
        let total = self.segments.len();
        let shared: Vec<_> = (0..total)
            .into_par_iter()
            .map(|at| {
                watch.check()?;
                let shared = self.sensitivities(at, nuisances, &residuals[at])?;
                watch.count(what, &done, total);
                Ok(shared)
            })
            .collect::<Result<_, GapError>>()?;
        let kept: Vec<usize> = (0..total).filter(|at| shared[*at].is_some()).collect();
        let segments = kept.iter().map(|at| self.segments[*at].clone()).collect();
        self.weights = kept.iter().map(|at| self.weights[*at].clone()).collect();
        self.segments = self.or_diverges(segments)?;
        self.shared = shared.into_iter().flatten().collect();
        Ok(())
    }

    fn or_diverges(&self, segments: Vec<Segment>) -> Result<Vec<Segment>, GapError> {
        if segments.is_empty() {
            return Err(self.diverges());
        }
        Ok(segments)
    }

    /// What the rows of a segment resolve, and its whitened residuals; none where the nominal blows up.
    fn look_alone(&self, at: usize, base: &[f64]) -> Result<Option<Looked>, GapError> {
        let segment = &self.segments[at];
        let trial = &self.trials[segment.trial];
        let step = self.model.timestep;
        let mut simulation = self.plant.simulation(base, &[])?;
        let mut trace = Trace::default();
        let whole = shooting::run(
            simulation.as_mut(),
            trial,
            segment,
            &self.tracks[segment.trial],
            WarmUp::of(self.model, &[]),
            step,
            Some(&vec![0.0; 2 * self.model.nv]),
            &mut trace,
        );
        if !whole {
            return Ok(None);
        }
        let none = vec![shooting::Correction::NONE; self.model.sensors.len()];
        let mut residual = Vec::new();
        shooting::residuals(
            &trace,
            trial,
            segment,
            self.channels,
            &none,
            step,
            &mut residual,
        );
        start::whiten(self.channels, &mut residual);
        let weights = resolution::weights(&trace, trial, segment, self.channels, step);
        for (value, weight) in residual.iter_mut().zip(&weights) {
            *value *= weight;
        }
        Ok(Some((weights, residual)))
    }

    /// The plant that differences of rollouts about a point are taken on, and the whitened residuals there: the
    /// cheaper one where there is one and it follows the other.
    pub(super) fn differencing(
        &self,
        at: usize,
        point: &Point,
        residual: &[f64],
    ) -> Result<Differencing<'_>, GapError> {
        if let Some(cheaper) = self.plant.cheaper() {
            let entries = self.entries(point);
            let mut simulation = cheaper.simulation(&self.nuisance_values(point), &entries)?;
            let mut before = Vec::new();
            let start = &point.starts[at];
            if self.shoot(simulation.as_mut(), at, start, &entries, &mut before) {
                let apart = before.iter().zip(residual).map(|(a, b)| (a - b).powi(2));
                if apart.sum::<f64>() < FOLLOWS * FOLLOWS * residual.len() as f64 {
                    return Ok((cheaper, before));
                }
            }
        }
        Ok((self.plant, residual.to_vec()))
    }

    /// About the base, where the whitened residuals are `residual`; none where a rollout blew up.
    fn sensitivities(
        &self,
        at: usize,
        nuisances: bool,
        residual: &[f64],
    ) -> Result<Option<(StartProjection, DMatrix<f32>)>, GapError> {
        let origin = self.origin();
        let from = self.differencing(at, &origin, residual)?;
        let (plant, before) = &from;
        let nv = self.model.nv;
        let mut simulation = plant.simulation(&self.nuisance_values(&origin), &[])?;
        let mut sensitivity = DMatrix::zeros(residual.len(), 2 * nv);
        let mut moved = Vec::new();
        for axis in 0..2 * nv {
            let step = start::STEP[axis / nv];
            let mut tangent = DVector::zeros(2 * nv);
            tangent[axis] = step;
            if !self.shoot(simulation.as_mut(), at, &tangent, &[], &mut moved) {
                return Ok(None);
            }
            sensitivity.set_column(axis, &quotient(before, &moved, step));
        }
        let Some(projection) = StartProjection::new(&sensitivity, &self.precision) else {
            return Ok(None);
        };
        let every: Vec<usize> = (0..self.nuisances.len()).collect();
        let nuisances = if nuisances {
            self.nuisance_columns(at, &origin, &every, None, &from)?
        } else {
            DMatrix::zeros(residual.len(), every.len())
        };
        Ok(Some((projection, nuisances)))
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
    pub(super) fn renewed_nuisances(
        &self,
        at: usize,
        known: Option<&DMatrix<f32>>,
        fresh: &[usize],
        point: &Point,
        from: &Differencing<'_>,
    ) -> Result<DMatrix<f32>, GapError> {
        let mut all = known.unwrap_or(&self.shared[at].1).clone();
        let found = self.nuisance_columns(at, point, fresh, Some(&all), from)?;
        for (column, nuisance) in found.column_iter().zip(fresh) {
            all.set_column(*nuisance, &column);
        }
        Ok(all)
    }

    /// Nuisance parameters whose columns are so long that what is wrong in them matters.
    pub(super) fn well_seen(&self) -> Vec<usize> {
        let squares = (self.shared.iter())
            .map(|(_, nuisances)| {
                let square = |column| f64::from(nuisances.column(column).norm_squared());
                DVector::from_fn(nuisances.ncols(), |row, _| square(row))
            })
            .fold(DVector::zeros(self.nuisances.len()), |sum, more| sum + more);
        (0..squares.len())
            .filter(|nuisance| squares[*nuisance] > WELL_SEEN * WELL_SEEN)
            .collect()
    }

    /// Whitened residuals of a segment; false where it blew up.
    pub(super) fn shoot(
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
            self.whiten(at, residual);
        }
        whole
    }

    /// In units of what a reading's noise, and the rows, leave uncertain.
    pub(super) fn whiten(&self, at: usize, residual: &mut [f64]) {
        start::whiten(self.channels, residual);
        for (value, weight) in residual.iter_mut().zip(&self.weights[at]) {
            *value *= weight;
        }
    }

    /// The empty set at the base.
    pub(super) fn origin(&self) -> Point {
        Point {
            candidates: Vec::new(),
            values: Vec::new(),
            nuisances: self.base.clone(),
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

    /// Nuisance parameters of the model at a point.
    pub(super) fn nuisance_values(&self, point: &Point) -> Vec<f64> {
        let mut nuisances = vec![0.0; self.model.nuisances.len()];
        for ((nuisance, sd), z) in self.nuisances.iter().zip(point.nuisances.iter()) {
            nuisances[*nuisance] = sd * z;
        }
        nuisances
    }

    /// Values of a point in units of priors: nuisance parameters, then parameters.
    pub(super) fn normalised(&self, point: &Point) -> DVector<f64> {
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
        let all: Vec<f64> = point.nuisances.iter().copied().chain(parameters).collect();
        DVector::from_vec(all)
    }

    /// Sets nuisance parameters and parameters of a point from units of priors.
    pub(super) fn set(&self, point: &mut Point, z: &DVector<f64>) {
        point.nuisances = z.rows(0, self.nuisances.len()).into_owned();
        let mut at = self.nuisances.len();
        for (candidate, values) in point.candidates.iter().zip(&mut point.values) {
            for (p, value) in self.candidates[*candidate].parameters.iter().zip(values) {
                *value = (p.null + z[at] * p.prior_sd).clamp(p.lower, p.upper);
                at += 1;
            }
        }
    }

    pub(super) fn bounds(&self, candidates: &[usize]) -> Vec<Bounds> {
        let mut bounds = vec![Bounds::FREE; self.nuisances.len()];
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

    /// What is left of the whitened residual of a segment once its start could move.
    pub(super) fn projection(&self, at: usize) -> &StartProjection {
        &self.shared[at].0
    }
}
