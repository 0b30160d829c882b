//! The fit of a hypothesis by multiple shooting.
//!
//! A hypothesis is a set of effects. Its parameters, the nuisance parameters and the start of every segment are fitted
//! together by Gauss-Newton on whitened output errors, a chord method: a rollout costs as much as a column,
//! so columns are kept as long as steps bring what they promise. Starts keep the sensitivities of the
//! bench, and so do nuisance parameters unless they go far or fresh columns of the effects do not help.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{
    bench::{Bench, Differencing},
    column::{STEP, inward},
    error::GapError,
    information::{Bounds, Optimum, Quadratic},
    payload,
    watch::Watch,
};

/// A nuisance parameter farther than this from where its column was made [standard deviations] needs a new one.
const FAR: f64 = 3.0;
/// A nuisance parameter whose predictions correlate with an effect's by more than this is told from it by what little differs
/// in their columns, so both must be of one point.
const AKIN: f64 = 0.5;
/// Rollouts of all segments at most, columns not counted: most fits need ten, one from a point where a law bends
/// much (a ball's drag over its whole fall) three times as many.
const LOOKS: usize = 40;
/// A change of the cost, reached or promised, that ends a fit: absolute, relative.
const CONVERGED: f64 = 0.05;
const CONVERGED_RELATIVE: f64 = 1e-5;
/// Columns hold as long as a step brings this part of what they promise ...
const TRUSTED: f64 = 0.7;
/// ... and are made anew at the end where the steps since have changed the cost by more than this.
const MOVED: f64 = 2.0;
/// Disappointments before the one at which the columns of all nuisance parameters are made anew.
const ALL_ANEW: usize = 1;
/// Halvings of a step that leads uphill.
const HALVINGS: usize = 3;

/// A set of candidates with values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    /// Rows of `Bench::candidates`.
    pub(super) candidates: Vec<usize>,
    /// Values of each candidate, in the order of its parameters.
    pub(super) values: Vec<Vec<f64>>,
    /// Nuisance parameters in standard deviations.
    pub(super) nuisances: DVector<f64>,
    /// Start of each segment, as a tangent from where the bench has it.
    pub(super) starts: Vec<DVector<f64>>,
}

impl Point {
    /// Its candidates, ascending.
    pub(super) fn set(&self) -> Vec<usize> {
        let mut set = self.candidates.clone();
        set.sort_unstable();
        set
    }

    /// Less its candidate of a row.
    pub(super) fn without(&self, row: usize) -> Self {
        let mut rest = self.clone();
        rest.candidates.remove(row);
        rest.values.remove(row);
        rest
    }
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) point: Point,
    /// About zero in (nuisance parameters, parameters); per trial, so that trials can be drawn again.
    pub(super) quadratics: Vec<Quadratic>,
    pub(super) bounds: Vec<Bounds>,
    /// Squared whitened residuals at the point.
    pub(super) misfit: f64,
    /// What the priors of nuisance parameters and parameters charge for the point.
    pub(super) penalty: f64,
    /// The same of the starts.
    arrival: f64,
    /// Whitened residuals by segment [readings], at the point.
    pub(super) residuals: Vec<Vec<f64>>,
    /// Change of the whitened predictions, by segment.
    pub(super) columns: Vec<Columns>,
    /// Nuisance parameters about which the columns of the nuisance parameters were made.
    about: DVector<f64>,
    /// Readings that count.
    pub(super) readings: usize,
}

/// Change of the whitened predictions of a segment with a point's parameters.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    /// With its own [readings, parameters].
    pub(super) own: DMatrix<f32>,
    /// With the nuisance parameters, where the shared ones do not serve.
    pub(super) nuisances: Option<DMatrix<f32>>,
}

impl Fit {
    pub(super) fn quadratic(&self) -> Quadratic {
        sum(self.quadratics.iter())
    }

    /// Absolute log evidence (up to the constant of the noise) and the optimum, where every squared
    /// residual counts `1 / factor`.
    pub(super) fn evidence(&self, factor: f64) -> Option<(f64, Optimum)> {
        self.quadratic().tempered(factor).evidence(&self.bounds)
    }

    /// What a fit makes least: squared whitened residuals, and what the priors charge.
    pub(super) fn cost(&self) -> f64 {
        self.misfit + self.penalty + self.arrival
    }

    /// Nuisance parameters that predict much the same as one of the effects' parameters.
    fn akin(&self) -> Vec<usize> {
        let (nuisances, all) = (self.point.nuisances.len(), self.bounds.len());
        let a = self.quadratic().a;
        let alike = |nuisance: usize, own: usize| {
            a[(nuisance, own)].powi(2) > AKIN * AKIN * a[(nuisance, nuisance)] * a[(own, own)]
        };
        (0..nuisances)
            .filter(|nuisance| (nuisances..all).any(|own| alike(*nuisance, own)))
            .collect()
    }

    fn is_far(&self) -> bool {
        !far(&self.point.nuisances, &self.about).is_empty()
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

impl Bench<'_> {
    /// Fits a set of candidates from a first point.
    ///
    /// # Errors
    /// Where the plant refuses it, or a stop was asked for. None where it blows up from the start.
    pub(super) fn fit(&self, first: Point, watch: &Watch<'_>) -> Result<Option<Fit>, GapError> {
        self.descend(first, true, watch)
    }

    /// The same from a point that may be far away, without columns about the end.
    pub(super) fn fit_far(&self, first: Point, watch: &Watch<'_>) -> Result<Option<Fit>, GapError> {
        self.descend(first, false, watch)
    }

    fn descend(
        &self,
        first: Point,
        exact: bool,
        watch: &Watch<'_>,
    ) -> Result<Option<Fit>, GapError> {
        let mut looks = LOOKS;
        let Some(residuals) = self.look(&first)? else {
            return Ok(None);
        };
        let fresh = far(&first.nuisances, &self.base);
        let known = vec![None; self.segments.len()];
        let columns = self.columns(&first, &residuals, known, &fresh)?;
        let about = moved(&self.base, &first.nuisances, &fresh);
        let mut fit = self.assemble(first, residuals, columns, about);
        if exact && !fit.akin().is_empty() {
            fit = self.renewed(fit, false)?;
        }
        // What the steps since the columns were made have brought; none: none was made.
        let mut since: Option<f64> = None;
        // Columns that did not hold what they promised were made anew so many times: the effects' and what is akin
        // to them, then all, once; in a large model those of all nuisance parameters cost more than everything else.
        // A fit of nothing but nuisance parameters has no others.
        let alone = fit.point.candidates.is_empty();
        let mut disappointments = usize::from(alone);
        loop {
            watch.check()?;
            let Some(best) = fit.quadratic().best(&fit.bounds) else {
                return Ok(Some(fit));
            };
            let promised = fit.cost() - best.cost;
            let little = CONVERGED + CONVERGED_RELATIVE * fit.cost();
            if promised < little || looks == 0 {
                if looks == 0 || !exact || (since.unwrap_or(0.0) <= MOVED && !fit.is_far()) {
                    return Ok(Some(fit));
                }
                fit = self.renewed(fit, false)?;
                since = None;
                continue;
            }
            let (found, used) = self.downhill(&fit, &best.z, looks)?;
            looks -= used;
            let Some((point, residuals)) = found else {
                if since.is_none() && disappointments > 0 {
                    return Ok(Some(fit));
                }
                fit = self.renewed(fit, alone || disappointments == ALL_ANEW)?;
                since = None;
                disappointments += 1;
                continue;
            };
            let columns = std::mem::take(&mut fit.columns);
            let next = self.assemble(point, residuals, columns, fit.about.clone());
            let gained = fit.cost() - next.cost();
            fit = next;
            if gained < little && since.is_none() && !fit.is_far() {
                return Ok(Some(fit));
            }
            since = Some(since.unwrap_or(0.0) + gained);
            if gained < little.max(TRUSTED * promised) {
                fit = self.renewed(fit, alone || disappointments == ALL_ANEW)?;
                since = None;
                disappointments += 1;
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
            let point = payload::at_their_moments(self.candidates, &fit.point, straight.clone());
            if let Some(residuals) = self.look(&point)?
                && self.cost(&point, &residuals) < fit.cost()
            {
                return Ok((Some((point, residuals)), used));
            }
            straight = midway(&fit.point, &straight);
        }
        Ok((None, left.min(HALVINGS + 1)))
    }

    /// The same fit with columns about its point: those of the nuisance parameters too that are far from where theirs were
    /// made or akin to an effect, or of all if asked for.
    fn renewed(&self, fit: Fit, all: bool) -> Result<Fit, GapError> {
        let fresh: Vec<usize> = if all {
            (0..self.nuisances.len()).collect()
        } else {
            let (far, akin) = (far(&fit.point.nuisances, &fit.about), fit.akin());
            let either = |nuisance: &usize| far.contains(nuisance) || akin.contains(nuisance);
            (0..self.nuisances.len()).filter(either).collect()
        };
        let known = fit.columns.into_iter().map(|of| of.nuisances).collect();
        let columns = self.columns(&fit.point, &fit.residuals, known, &fresh)?;
        let about = moved(&fit.about, &fit.point.nuisances, &fresh);
        Ok(self.assemble(fit.point, fit.residuals, columns, about))
    }

    /// The point that the linearisation about a fit leads to.
    fn step(&self, fit: &Fit, z: &DVector<f64>) -> Point {
        let mut next = fit.point.clone();
        self.set(&mut next, z);
        let change = self.normalised(&next) - self.normalised(&fit.point);
        let nuisances = self.nuisances.len();
        next.starts = (0..self.segments.len())
            .into_par_iter()
            .map(|at| {
                let (projection, shared) = &self.shared[at];
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
    fn look(&self, point: &Point) -> Result<Option<Vec<Vec<f64>>>, GapError> {
        let entries = self.entries(point);
        let nuisances = self.nuisance_values(point);
        let blown = AtomicBool::new(false);
        let residuals: Vec<Option<Vec<f64>>> = (0..self.segments.len())
            .into_par_iter()
            .map(|at| {
                if blown.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                let mut simulation = self.plant.simulation(&nuisances, &entries)?;
                let mut residual = Vec::new();
                let start = &point.starts[at];
                if self.shoot(simulation.as_mut(), at, start, &entries, &mut residual) {
                    return Ok(Some(residual));
                }
                blown.store(true, Ordering::Relaxed);
                Ok(None)
            })
            .collect::<Result<_, GapError>>()?;
        Ok(residuals.into_iter().collect())
    }

    /// [`Fit::cost`] of a point; none where it blows up.
    pub(super) fn cost_at(&self, point: &Point) -> Result<Option<f64>, GapError> {
        let residuals = self.look(point)?;
        Ok(residuals.map(|residuals| self.cost(point, &residuals)))
    }

    fn cost(&self, point: &Point, residuals: &[Vec<f64>]) -> f64 {
        let misfit: f64 = residuals.iter().flatten().map(|value| value * value).sum();
        misfit + self.normalised(point).norm_squared() + self.arrival(point)
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
        let z = self.normalised(&point);
        let grams: Vec<DMatrix<f64>> = (0..self.segments.len())
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
        let mut by_trial: Vec<Option<DMatrix<f64>>> = vec![None; self.trials.len()];
        for (segment, gram) in self.segments.iter().zip(grams) {
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
            bounds: self.bounds(&point.candidates),
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
    pub(super) fn gram(
        &self,
        at: usize,
        point: &Point,
        z: &DVector<f64>,
        residual: &[f64],
        nuisance_columns: Option<&DMatrix<f32>>,
        columns: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let (projection, shared) = &self.shared[at];
        let nuisance_columns = nuisance_columns.unwrap_or(shared);
        let nuisances = self.nuisances.len();
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
            for (parameter, p) in self.candidates[*candidate].parameters.iter().enumerate() {
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

/// Nuisance parameters that are far from where their columns were made.
fn far(nuisances: &DVector<f64>, about: &DVector<f64>) -> Vec<usize> {
    let apart = nuisances - about;
    (0..apart.len())
        .filter(|at| apart[*at].abs() > FAR)
        .collect()
}

/// The point `about`, at `nuisances` along some of its axes.
fn moved(about: &DVector<f64>, nuisances: &DVector<f64>, axes: &[usize]) -> DVector<f64> {
    let mut about = about.clone();
    for axis in axes {
        about[*axis] = nuisances[*axis];
    }
    about
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
        nuisances: 0.5 * (&a.nuisances + &b.nuisances),
        starts: a
            .starts
            .iter()
            .zip(&b.starts)
            .map(|(a, b)| 0.5 * (a + b))
            .collect(),
    }
}
