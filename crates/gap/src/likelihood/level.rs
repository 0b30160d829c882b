//! The likelihood at one level of disturbances, and the values that a set has there.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::{
    likelihood::{
        directions::{self, Direction},
        filter::Filtered,
        form_error::Beside,
        found::Found,
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
    /// Of the unmodelled forces.
    pub(crate) force: f64,
    /// Of the drifts of sensors that declare no noise.
    pub(crate) drift: f64,
}

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
    pub(crate) trials: Vec<Filtered>,
    given: Mutex<BTreeMap<Vec<usize>, Arc<Given>>>,
}

/// The likelihood of parameters, uncertain numbers and some errors of form integrated out.
pub(crate) struct Given {
    /// Likelihood of the point's own parameters and directions.
    pub(crate) quadratic: Quadratic,
    /// Log likelihood where they are zero.
    pub(crate) empty: f64,
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
        let (gram, half) = sum(trials.iter())?;
        let place = (number, sizes, is_searched);
        let mut level = Self::of(place, &gram, half, columns.clone());
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
        let (gram, half) = sum(trials.iter().map(|at| &self.trials[*at]))?;
        let place = (self.number, self.sizes, self.is_searched);
        Some(Self::of(place, &gram, half, self.columns.clone()))
    }

    fn of(
        (number, sizes, is_searched): (usize, Sizes, bool),
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
        let columns = of_candidate.nth(error).map(|(_, columns)| columns.clone());
        for column in columns.unwrap_or_default() {
            whole.b[column] *= ratio;
            whole.a.column_mut(column).scale_mut(ratio);
            whole.a.row_mut(column).scale_mut(ratio);
        }
        Self {
            whole,
            columns: self.columns.clone(),
            trials: Vec::new(),
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
        let (quadratic, logs) = self.whole.select(&columns).marginal(beside)?;
        let given = Arc::new(Given {
            empty: -0.5 * quadratic.q - self.half_log_determinant - logs,
            quadratic,
        });
        let mut all = self.given.lock().ok()?;
        all.insert(present, given.clone());
        Some(given)
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
    }

    /// True where its disturbances are more than what an integrator and sensors may be off by.
    pub(crate) fn is_gap(&self, options: &LikelihoodOptions) -> bool {
        self.sizes.force > options.negligible_force || self.sizes.drift > options.sensors_own
    }

    /// Log likelihood that no set exceeds: that of the best values of all parameters.
    pub(crate) fn most(&self) -> f64 {
        let all: Vec<usize> = self.columns.forms.iter().filter_map(|of| of.0).collect();
        let Some(given) = self.given(&all) else {
            return f64::INFINITY;
        };
        given.empty + given.quadratic.most_gain()
    }

    /// Simulated likelihoods in which a found set is true. `None` where the likelihood is not positive.
    pub(crate) fn simulator(&self, found: &Found) -> Option<Simulator> {
        let given = self.given(&found.set)?;
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
        let mut columns = self.columns.columns(&self.columns.present(&found.set));
        let mut precision = vec![1.0; columns.len()];
        let of_set = found.columns.iter();
        columns.extend(of_set.map(|column| self.columns.len() + column));
        precision.extend(own);
        let mut joint = self.whole.select(&columns).a;
        for (axis, precision) in precision.into_iter().enumerate() {
            joint[(axis, axis)] += precision;
        }
        let variances = joint.cholesky()?.inverse().diagonal();
        let numbers = variances.iter().take(self.columns.numbers);
        Some(numbers.map(|variance| variance.max(0.0).sqrt()).collect())
    }

    /// The working point at a found set, and all parameters of the sweep there.
    pub(crate) fn moved(
        &self,
        problem: &Problem<'_>,
        point: &Point,
        directions: &[Direction],
        found: &Found,
    ) -> (Point, DVector<f64>) {
        let nuisances = self.columns.len();
        let own: usize = point.values.iter().map(Vec::len).sum();
        let mut z = DVector::zeros(nuisances + own + directions.len());
        for (column, value) in found.columns.iter().zip(found.posterior.mean.iter()) {
            z[nuisances + column] = *value;
        }
        // The uncertain numbers and errors of form that go with them, within bounds.
        let beside = self.columns.columns(&self.columns.present(&found.set));
        // A level that is not searched has no directions.
        let count = self.whole.b.len() - nuisances;
        let rest = z.rows(nuisances, count).into_owned();
        let across = DMatrix::from_fn(beside.len(), rest.len(), |row, column| {
            self.whole.a[(beside[row], nuisances + column)]
        });
        let mut numbers = self.whole.select(&beside);
        numbers.b -= across * rest;
        let most = problem.settings.options.likelihood.largest_shift;
        let bounds = vec![
            Bounds {
                lower: -most,
                upper: most,
            };
            beside.len()
        ];
        if let Some(best) = numbers.best(&bounds) {
            for (column, value) in beside.iter().zip(best.iter()) {
                z[*column] = *value;
            }
        }
        let mut next = Point {
            candidates: Vec::new(),
            values: Vec::new(),
            forms: Vec::new(),
            nuisances: z.rows(0, problem.nuisances.len()).into_owned(),
        };
        for (candidate, ..) in &found.members {
            let parameters = &problem.candidates[*candidate].parameters;
            let mut first = 0;
            let mut values = None;
            for (row, of) in point.candidates.iter().enumerate() {
                if of == candidate {
                    let own: Vec<f64> = parameters
                        .iter()
                        .enumerate()
                        .map(|(at, p)| {
                            let about = if p.shapes {
                                point.values[row][at]
                            } else {
                                p.null
                            };
                            (about + z[nuisances + first + at] * p.prior_sd).clamp(p.lower, p.upper)
                        })
                        .collect();
                    values = Some(own);
                }
                first += point.values[row].len();
            }
            let values = values.unwrap_or_else(|| {
                let along: Vec<(&Direction, f64)> = found
                    .columns
                    .iter()
                    .filter(|column| **column >= own)
                    .map(|column| (&directions[column - own], z[nuisances + column]))
                    .filter(|(direction, _)| direction.candidate == *candidate)
                    .collect();
                directions::values(problem, *candidate, &along)
            });
            let before = point.candidates.iter().position(|of| of == candidate);
            next.candidates.push(*candidate);
            next.values.push(values);
            next.forms
                .push(before.map_or([1.0; 2], |row| point.forms[row]));
        }
        (next, z)
    }
}

/// Draws likelihoods of trials in which a set is true.
pub(crate) struct Simulator {
    /// Number and disturbances of the level, and whether it holds the directions.
    place: (usize, Sizes, bool),
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
fn sum<'f>(trials: impl Iterator<Item = &'f Filtered>) -> Option<(DMatrix<f64>, f64)> {
    let mut half = 0.0;
    let gram = trials
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
#[allow(clippy::unwrap_used)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::likelihood::truncated_evidence::Truncated;

    /// Slopes of simulated trials have the curvature as covariance about what the values bring, and these the posterior's.
    #[test]
    fn simulated_likelihoods_have_the_moments_of_their_set() {
        let a = DMatrix::from_row_slice(2, 2, &[5.0, 1.0, 1.0, 3.0]);
        let mut gram = DMatrix::zeros(3, 3);
        gram.view_mut((1, 1), (2, 2)).copy_from(&a);
        let sizes = Sizes {
            force: 0.1,
            drift: 0.0,
        };
        let level = Level::of((0, sizes, true), &gram, 0.0, Beside::default());
        let found = Found {
            set: vec![0],
            level: 0,
            members: vec![(0, 0, 0)],
            columns: vec![0],
            mixtures: vec![0.0],
            posterior: Truncated {
                log_evidence: 0.0,
                mean: DVector::from_vec(vec![2.0]),
                covariance: DMatrix::from_element(1, 1, 0.25),
            },
            log_likelihood: 0.0,
            log_posterior: 0.0,
        };
        let simulator = level.simulator(&found).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let draws: Vec<DVector<f64>> = (0..20_000)
            .map(|_| simulator.draw(&mut rng).whole.b.clone())
            .collect();
        let count = draws.len() as f64;
        let mean: DVector<f64> = draws.iter().sum::<DVector<f64>>() / count;
        let covariance: DMatrix<f64> = draws
            .iter()
            .map(|b| (b - &mean) * (b - &mean).transpose())
            .sum::<DMatrix<f64>>()
            / count;
        let column = a.column(0);
        assert!((&mean - 2.0 * column).amax() < 0.1, "{mean}");
        let expected = &a + 0.25 * column * column.transpose();
        assert!(
            (&covariance - &expected).amax() < 0.3,
            "{covariance} {expected}"
        );
    }
}
