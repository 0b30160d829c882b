//! The likelihood at one level of disturbances, and the values that a set has there.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::{
    likelihood::{
        by_trial::{self, Deviation, Deviations, Own},
        directions::{self, Direction},
        filter::Filtered,
        form_error::Beside,
        found::{Found, Held},
        given::Given,
        quadratic::Quadratic,
        truncated_normal::Bounds,
    },
    options::LikelihoodOptions,
    problem::{point::Point, problem::Problem},
    statistics::standard_normal,
};

/// Standard deviations of the disturbances, in their scales.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sizes {
    /// Unmodelled forces.
    pub(crate) force: f64,
    /// Drifts of sensors that declare no noise, over a few rows.
    pub(crate) drift: f64,
    /// Slow drifts of the same sensors.
    pub(crate) slow_drift: f64,
}

/// Number and disturbances of a level, and whether it holds the directions.
type Place = (usize, Sizes, bool);

/// The likelihood at one level of disturbances.
pub(crate) struct Level {
    /// Its place among the levels of the sweep.
    pub(crate) number: usize,
    pub(crate) sizes: Sizes,
    /// True where it holds the directions, so that sets can be searched.
    pub(crate) is_searched: bool,
    /// Likelihood of all parameters: uncertain numbers, errors of form, the point's own, directions.
    pub(crate) whole: Quadratic,
    half_log_determinant: f64,
    columns: Beside,
    /// Likelihood by trial.
    pub(crate) trials: Vec<Arc<Filtered>>,
    given: Mutex<BTreeMap<Vec<usize>, Arc<Given>>>,
}

impl Level {
    /// From the likelihood of every trial.
    pub(crate) fn new(
        number: usize,
        sizes: Sizes,
        is_searched: bool,
        trials: Vec<Filtered>,
        columns: &Beside,
    ) -> Option<Self> {
        let trials = trials.into_iter().map(Arc::new).collect();
        Self::from_trials((number, sizes, is_searched), trials, columns.clone())
    }

    fn from_trials(place: Place, trials: Vec<Arc<Filtered>>, columns: Beside) -> Option<Self> {
        let (gram, half) = sum(&trials)?;
        let mut level = Self::of(place, &gram, half, columns);
        level.trials = trials;
        Some(level)
    }

    /// The level on all trials but one.
    pub(crate) fn without(&self, trial: usize) -> Option<Self> {
        let others: Vec<usize> = (0..self.trials.len()).filter(|at| *at != trial).collect();
        self.drawn(&others)
    }

    /// The level on trials drawn again.
    pub(crate) fn drawn(&self, trials: &[usize]) -> Option<Self> {
        let trials = trials.iter().map(|at| self.trials[*at].clone()).collect();
        let place = (self.number, self.sizes, self.is_searched);
        Self::from_trials(place, trials, self.columns.clone())
    }

    fn of(
        (number, sizes, is_searched): Place,
        gram: &DMatrix<f64>,
        half: f64,
        columns: Beside,
    ) -> Self {
        Self {
            number,
            sizes,
            is_searched,
            whole: Quadratic::from_gram(gram),
            half_log_determinant: half,
            columns,
            trials: Vec::new(),
            given: Mutex::default(),
        }
    }

    /// The level with one of the two errors of a candidate's form `ratio` times as large.
    pub(crate) fn with_form(&self, candidate: usize, error: usize, ratio: f64) -> Self {
        let mut whole = self.whole.clone();
        let forms = self.columns.forms.iter();
        let mut of_candidate = forms.filter(|(of, _)| *of == Some(candidate));
        let scaled: Vec<usize> = of_candidate
            .nth(error)
            .map_or_else(Vec::new, |(_, columns)| columns.clone().collect());
        for column in scaled.iter().copied() {
            whole.b[column] *= ratio;
            whole.a.column_mut(column).scale_mut(ratio);
            whole.a.row_mut(column).scale_mut(ratio);
        }
        let trials = self.trials.iter();
        Self {
            whole,
            columns: self.columns.clone(),
            trials: trials
                .map(|of| Arc::new(of.scaled(&scaled, ratio)))
                .collect(),
            given: Mutex::default(),
            ..*self
        }
    }

    /// The likelihood for sets that hold the same of the point's candidates as `set`. `None` where it is not positive.
    pub(crate) fn given(&self, set: &[usize]) -> Option<Arc<Given>> {
        let present = self.columns.present(set);
        let known = self.given.lock().ok()?.get(&present).cloned();
        if known.is_some() {
            return known;
        }
        let mut columns = self.columns.columns(&present);
        let beside = columns.len();
        columns.extend(self.columns.len()..self.whole.b.len());
        let of = self.whole.select(&columns).marginal(beside)?;
        columns.truncate(beside);
        let given = Arc::new(Given::new(columns, of, self.half_log_determinant));
        let mut all = self.given.lock().ok()?;
        all.insert(present, given.clone());
        Some(given)
    }

    /// The likelihood of some columns for sets that hold the same of the point's candidates as `set`, where some have a value
    /// of each trial's own. `None` where it is not positive.
    pub(crate) fn given_own(&self, set: &[usize], own: &Own, columns: &[usize]) -> Option<Given> {
        if own.is_empty() {
            return Some(self.given(set)?.select(columns));
        }
        self.given_held(set, (own, &Held::new()), columns)
    }

    /// The same where some of what stands beside the set is held.
    pub(crate) fn given_held(
        &self,
        set: &[usize],
        (own, held): (&Own, &Held),
        columns: &[usize],
    ) -> Option<Given> {
        let beside = self.beside(set);
        let (joint, half) = self.joint(&beside, own, columns)?;
        Given::beside(&joint, half, (&beside, held))
    }

    /// The likelihood of what stands beside a set, then of some of its columns, and half its log determinant.
    pub(super) fn joint(
        &self,
        beside: &[usize],
        own: &Own,
        columns: &[usize],
    ) -> Option<(Quadratic, f64)> {
        let all: Vec<usize> = self.places(beside, columns);
        if own.is_empty() {
            return Some((self.whole.select(&all), self.half_log_determinant));
        }
        let directions = deviations(beside.len(), own, columns);
        let mut half = self.half_log_determinant;
        let mut sum: Option<DMatrix<f64>> = None;
        for trial in &self.trials {
            let (gram, _, log) = by_trial::marginal(&select(&trial.gram, &all), &directions)?;
            half += log;
            sum = Some(match sum {
                Some(sum) => sum + gram,
                None => gram,
            });
        }
        Some((Quadratic::from_gram(&sum?), half))
    }

    /// How far a parameter's standard deviation moves the readings, squared, in those of noise and unmodelled forces; zero where the level
    /// does not hold it.
    pub(super) fn moved_by(&self, column: usize) -> f64 {
        let place = self.columns.len() + column;
        self.whole.a.get((place, place)).copied().unwrap_or(0.0)
    }

    /// Columns of what stands beside a set: uncertain numbers, and errors of its form.
    pub(super) fn beside(&self, set: &[usize]) -> Vec<usize> {
        self.columns.columns(&self.columns.present(set))
    }

    /// Places among all parameters: those beside a set, then some columns.
    pub(super) fn places(&self, beside: &[usize], columns: &[usize]) -> Vec<usize> {
        let own = columns.iter().map(|column| self.columns.len() + column);
        beside.iter().copied().chain(own).collect()
    }

    /// Log prior of its disturbances. Without an effect they are small, or all that is missing is outside the catalogue; beside
    /// one they are alike likely, for it leaves what its form is off by.
    pub(crate) fn log_prior(&self, has_effects: bool, options: &LikelihoodOptions) -> f64 {
        let log = |all: &[f64], size: f64, most: f64| {
            if has_effects {
                return -(all.len() as f64).ln();
            }
            let alike = all.iter().filter(|of| (**of <= most) == (size <= most));
            let share = match size <= most {
                true => 1.0 - options.outside,
                false => options.outside,
            };
            (share / alike.count().max(1) as f64).ln()
        };
        log(&options.forces, self.sizes.force, options.negligible_force)
            + log(&options.drifts, self.sizes.drift, options.sensors_own)
            + log(
                &options.slow_drifts,
                self.sizes.slow_drift,
                options.sensors_own,
            )
    }

    /// True where its disturbances are more than what an integrator and sensors may be off by.
    pub(crate) fn is_gap(&self, options: &LikelihoodOptions) -> bool {
        let drift = self.sizes.drift.max(self.sizes.slow_drift);
        self.sizes.force > options.negligible_force || drift > options.sensors_own
    }

    /// Log likelihood that no set exceeds: that of the best values of all parameters.
    pub(crate) fn most(&self) -> f64 {
        let all: Vec<usize> = self.columns.forms.iter().filter_map(|of| of.0).collect();
        let Some(given) = self.given(&all) else {
            return f64::INFINITY;
        };
        given.empty + given.quadratic.most_gain()
    }

    /// Simulated likelihoods in which a found set is true. `None` where the likelihood is not positive, or the trials have
    /// values of their own: simulated likelihoods are of all trials together.
    pub(crate) fn simulator(&self, found: &Found) -> Option<Simulator> {
        if !found.own.is_empty() {
            return None;
        }
        let all: Vec<usize> = (0..self.whole.b.len() - self.columns.len()).collect();
        let given = self.given_held(&found.set, (&found.own, &found.held), &all)?;
        let posterior = &found.posterior;
        Some(Simulator {
            place: (self.number, self.sizes, self.is_searched),
            noise: given.quadratic.root(),
            a: given.quadratic.a.clone(),
            columns: found.columns.clone(),
            mean: posterior.mean.clone(),
            spread: posterior.covariance.clone().cholesky()?.l(),
        })
    }

    /// Standard deviations of the uncertain numbers beside a found set, in those of their priors; `own`: precision of the
    /// priors of the set's columns.
    pub(crate) fn spread(&self, found: &Found, own: &[f64]) -> Option<Vec<f64>> {
        let beside = self.beside(&found.set);
        let mut precision = vec![1.0; beside.len()];
        precision.extend(own);
        let mut joint = self.joint(&beside, &found.own, &found.columns)?.0.a;
        for (axis, precision) in precision.into_iter().enumerate() {
            joint[(axis, axis)] += precision;
        }
        let variances = joint.cholesky()?.inverse().diagonal();
        let numbers = variances.iter().take(self.columns.numbers);
        Some(numbers.map(|variance| variance.max(0.0).sqrt()).collect())
    }

    /// The working point at a found set, and all parameters of the sweep there, trial by trial.
    pub(crate) fn moved(
        &self,
        problem: &Problem<'_>,
        point: &Point,
        directions: &[Direction],
        found: &Found,
    ) -> (Point, Vec<DVector<f64>>) {
        let (z, own) = self.parameters(problem, found);
        let mut next = Point {
            candidates: Vec::new(),
            values: Vec::new(),
            forms: Vec::new(),
            by_trial: Vec::new(),
            nuisances: z.rows(0, problem.nuisances.len()).into_owned(),
        };
        let along = Along {
            problem,
            point,
            directions,
            first: self.columns.len(),
            found,
        };
        for (candidate, _, _, own_size) in &found.members {
            next.candidates.push(*candidate);
            next.values.push(along.values(*candidate, &z));
            let before = point.candidates.iter().position(|of| of == candidate);
            next.forms
                .push(before.map_or([1.0; 2], |row| point.forms[row]));
            let by_trial = match own_size {
                Some(_) => (self.trials.iter().zip(&own))
                    .map(|(trial, z)| (trial.trial, along.values(*candidate, z)))
                    .collect(),
                None => BTreeMap::new(),
            };
            next.by_trial.push(by_trial);
        }
        let of_trials = self.trials.iter().zip(own);
        (
            next,
            of_trials.map(|(of, z)| of.deviations.own(&z)).collect(),
        )
    }

    /// All parameters of the sweep at a found set, common and in each trial; the uncertain numbers and errors of form that go
    /// with them within bounds.
    pub(super) fn parameters(
        &self,
        problem: &Problem<'_>,
        found: &Found,
    ) -> (DVector<f64>, Vec<DVector<f64>>) {
        let mut z = DVector::zeros(self.whole.b.len());
        for (column, value) in found.columns.iter().zip(found.posterior.mean.iter()) {
            z[self.columns.len() + column] = *value;
        }
        let beside = self.beside(&found.set);
        if let Some(best) = self.numbers(problem, &beside, found) {
            for (column, value) in beside.iter().zip(best.iter()) {
                z[*column] = *value;
            }
        }
        let own = self.own(found, &beside, &z);
        (z, own)
    }

    /// What a found set leaves of each trial, as a likelihood of the point's own parameters and directions.
    pub(crate) fn left(&self, problem: &Problem<'_>, found: &Found) -> Vec<Left<'_>> {
        let (_, own) = self.parameters(problem, found);
        let first = self.columns.len();
        let trials = self.trials.iter().zip(own);
        trials.map(|(trial, z)| Left { trial, z, first }).collect()
    }

    /// The best uncertain numbers and errors of form beside a found set, within bounds.
    fn numbers(
        &self,
        problem: &Problem<'_>,
        beside: &[usize],
        found: &Found,
    ) -> Option<DVector<f64>> {
        let (joint, _) = self.joint(beside, &found.own, &found.columns)?;
        let (count, rest) = (beside.len(), found.columns.len());
        let across = joint.a.view((0, count), (count, rest)).into_owned();
        let places: Vec<usize> = (0..count).collect();
        let mut numbers = joint.select(&places);
        numbers.b -= across * &found.posterior.mean;
        let bounds: Vec<Bounds> = number_bounds(problem, count).collect();
        numbers.best(&bounds)
    }

    /// Log likelihood of a found set at its best values within `bounds` and the best uncertain numbers and errors of form beside
    /// it, within theirs.
    pub(crate) fn at_best(
        &self,
        problem: &Problem<'_>,
        found: &Found,
        bounds: impl Iterator<Item = Bounds>,
    ) -> Option<f64> {
        let beside = self.beside(&found.set);
        let (joint, half) = self.joint(&beside, &found.own, &found.columns)?;
        let all: Vec<Bounds> = number_bounds(problem, beside.len()).chain(bounds).collect();
        let z = joint.best(&all)?;
        Some(-0.5 * (joint.q - 2.0 * joint.b.dot(&z) + (&joint.a * &z).dot(&z)) - half)
    }

    /// Some parameters of the only trial, known but for deviations along some directions of these.
    pub(crate) fn deviating(
        &self,
        parameters: &[usize],
        directions: &[Deviation],
        known: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let gram = select(&self.trials.first()?.gram, parameters);
        let (_, deviations, _) = by_trial::marginal(&gram, directions)?;
        Some(deviations.own(known))
    }

    /// All parameters of every trial, those that have a value of each trial's own where the readings of that trial have them.
    fn own(&self, found: &Found, beside: &[usize], z: &DVector<f64>) -> Vec<DVector<f64>> {
        if found.own.is_empty() {
            return vec![z.clone(); self.trials.len()];
        }
        let all = self.places(beside, &found.columns);
        let known = DVector::from_iterator(all.len(), all.iter().map(|at| z[*at]));
        let directions = deviations(beside.len(), &found.own, &found.columns);
        let of_trial = |trial: &Arc<Filtered>| {
            let marginal = by_trial::marginal(&select(&trial.gram, &all), &directions);
            let deviations = marginal.map_or_else(Deviations::default, |of| of.1);
            let mut own = z.clone();
            for (at, value) in all.iter().zip(deviations.own(&known).iter()) {
                own[*at] = *value;
            }
            own
        };
        self.trials.iter().map(of_trial).collect()
    }
}

/// Bounds of so many uncertain numbers and errors of form.
fn number_bounds(problem: &Problem<'_>, count: usize) -> impl Iterator<Item = Bounds> {
    let most = problem.settings.options.likelihood.largest_shift;
    let bounds = Bounds {
        lower: -most,
        upper: most,
    };
    std::iter::repeat_n(bounds, count)
}

/// A trial with all parameters held.
pub(crate) struct Left<'a> {
    trial: &'a Filtered,
    z: DVector<f64>,
    /// First of the point's own parameters and directions.
    first: usize,
}

impl Left<'_> {
    /// Its likelihood in what some columns change.
    pub(crate) fn select(&self, columns: &[usize]) -> Quadratic {
        let gram = &self.trial.gram;
        let at = |column: usize| 1 + self.first + columns[column];
        let known = gram.nrows() - 1;
        Quadratic {
            q: 0.0,
            b: DVector::from_fn(columns.len(), |row, _| {
                let of_others = gram.view((1, at(row)), (known, 1));
                gram[(0, at(row))] - of_others.dot(&self.z)
            }),
            a: DMatrix::from_fn(columns.len(), columns.len(), |row, column| {
                gram[(at(row), at(column))]
            }),
        }
    }
}

/// Values of candidates from parameters of a sweep.
struct Along<'a> {
    problem: &'a Problem<'a>,
    /// The point of the sweep, and the directions that it looked along.
    point: &'a Point,
    directions: &'a [Direction],
    /// First of the point's own parameters.
    first: usize,
    found: &'a Found,
}

impl Along<'_> {
    fn values(&self, candidate: usize, z: &DVector<f64>) -> Vec<f64> {
        let parameters = &self.problem.candidates[candidate].parameters;
        let mut first = self.first;
        let mut values = None;
        for (of, about) in self.point.candidates.iter().zip(&self.point.values) {
            if *of == candidate {
                let own = parameters
                    .iter()
                    .zip(about)
                    .enumerate()
                    .map(|(at, (p, about))| {
                        let about = if p.shapes { *about } else { p.null };
                        (about + z[first + at] * p.prior_sd).clamp(p.lower, p.upper)
                    });
                values = Some(own.collect());
            }
            first += about.len();
        }
        let held = first - self.first;
        values.unwrap_or_else(|| {
            let columns = self.found.columns.iter().filter(|column| **column >= held);
            let along: Vec<(&Direction, f64)> = columns
                .map(|column| (&self.directions[column - held], z[self.first + column]))
                .filter(|(direction, _)| direction.candidate == candidate)
                .collect();
            directions::values(self.problem, candidate, &along)
        })
    }
}

/// Deviations of some of a set's columns, where what stands beside the set comes first.
fn deviations(beside: usize, own: &Own, columns: &[usize]) -> Vec<Deviation> {
    let place = |column: usize| columns.iter().position(|of| *of == column);
    let own = own.iter();
    own.filter_map(|(column, sd)| Some(vec![(beside + place(*column)?, *sd)]))
        .collect()
}

/// A Gram matrix of the residual and a few of the parameters.
fn select(gram: &DMatrix<f64>, parameters: &[usize]) -> DMatrix<f64> {
    let at = |row: usize| match row {
        0 => 0,
        _ => 1 + parameters[row - 1],
    };
    let count = 1 + parameters.len();
    DMatrix::from_fn(count, count, |row, column| gram[(at(row), at(column))])
}

/// Draws likelihoods of trials in which a set is true.
pub(crate) struct Simulator {
    /// That of the level.
    place: Place,
    /// Curvature, and a root of it: the covariance of the slope is the curvature.
    a: DMatrix<f64>,
    noise: DMatrix<f64>,
    /// Columns of the set, their mean, and a root of their covariance.
    columns: Vec<usize>,
    mean: DVector<f64>,
    spread: DMatrix<f64>,
}

impl Simulator {
    pub(crate) fn draw(&self, rng: &mut ChaCha8Rng) -> Level {
        let mut normal = |count: usize| DVector::from_fn(count, |_, _| standard_normal(rng));
        let values = &self.mean + &self.spread * normal(self.mean.len());
        let mut b = &self.noise * normal(self.a.nrows());
        for (column, value) in self.columns.iter().zip(values.iter()) {
            b += self.a.column(*column) * *value;
        }
        let n = self.a.nrows();
        let mut gram = DMatrix::zeros(1 + n, 1 + n);
        gram.view_mut((1, 1), (n, n)).copy_from(&self.a);
        gram.view_mut((1, 0), (n, 1)).copy_from(&b);
        gram.view_mut((0, 1), (1, n)).copy_from(&b.transpose());
        Level::of(self.place, &gram, 0.0, Beside::default())
    }
}

/// Sum of Gram matrices and of half the log determinants.
fn sum(trials: &[Arc<Filtered>]) -> Option<(DMatrix<f64>, f64)> {
    let mut half = 0.0;
    let gram = trials
        .iter()
        .map(|of| {
            half += of.half_log_determinant;
            &of.gram
        })
        .fold(None, |sum: Option<DMatrix<f64>>, gram| match sum {
            Some(sum) => Some(sum + gram),
            None => Some(gram.clone()),
        })?;
    Some((gram, half))
}

#[cfg(test)]
mod tests;
