//! A point of the hypotheses: values of a set of candidate effects and of the uncertain numbers.

use std::collections::BTreeMap;

use hydro_effects::Entry;
use nalgebra::DVector;

use crate::problem::problem::Problem;

/// A set of candidates with values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Rows of `Problem::candidates`.
    pub(crate) candidates: Vec<usize>,
    /// Values of each candidate, in the order of its parameters.
    pub(crate) values: Vec<Vec<f64>>,
    /// Factors on the usual errors of each candidate's form: by levels of its size, and in the terms that it neglects.
    pub(crate) forms: Vec<[f64; 2]>,
    /// The values in each trial, where it differs: by row of `Problem::trials`.
    pub(crate) by_trial: Vec<BTreeMap<usize, Vec<f64>>>,
    /// Nuisance parameters in standard deviations.
    pub(crate) nuisances: DVector<f64>,
}

impl Point {
    /// Its candidates, ascending.
    pub(crate) fn set(&self) -> Vec<usize> {
        let mut set = self.candidates.clone();
        set.sort_unstable();
        set
    }

    /// The point with the values that all trials share.
    pub(crate) fn common(&self) -> Self {
        Self {
            by_trial: vec![BTreeMap::new(); self.values.len()],
            ..self.clone()
        }
    }

    /// A part of the way from the point to another one of the same set.
    pub(crate) fn on_the_way(&self, other: &Self, part: f64) -> Self {
        let between = |from: &[f64], to: &[f64]| -> Vec<f64> {
            let both = from.iter().zip(to);
            both.map(|(a, b)| a + part * (b - a)).collect()
        };
        let values = self.values.iter().zip(&other.values);
        let by_trial = (self.by_trial.iter().zip(&self.values)).zip(&other.by_trial);
        Self {
            values: values.map(|(from, to)| between(from, to)).collect(),
            by_trial: by_trial
                .map(|((from, common), to)| {
                    let of_trial = to.iter().map(|(trial, to)| {
                        (*trial, between(from.get(trial).unwrap_or(common), to))
                    });
                    of_trial.collect()
                })
                .collect(),
            nuisances: &self.nuisances + part * (&other.nuisances - &self.nuisances),
            ..other.clone()
        }
    }

    /// The point as it is in a trial.
    pub(crate) fn in_trial(&self, trial: usize) -> Self {
        let mut own = self.clone();
        for (values, by_trial) in own.values.iter_mut().zip(&self.by_trial) {
            if let Some(of_trial) = by_trial.get(&trial) {
                values.clone_from(of_trial);
            }
        }
        own
    }
}

impl Problem<'_> {
    /// The empty set at the nominal.
    pub(crate) fn origin(&self) -> Point {
        Point {
            candidates: Vec::new(),
            values: Vec::new(),
            forms: Vec::new(),
            by_trial: Vec::new(),
            nuisances: DVector::zeros(self.nuisances.len()),
        }
    }

    pub(crate) fn entries(&self, point: &Point) -> Vec<Entry> {
        point
            .candidates
            .iter()
            .zip(&point.values)
            .flat_map(|(candidate, values)| self.candidates[*candidate].entries(values))
            .collect()
    }

    /// Nuisance parameters of the model at a point.
    pub(crate) fn nuisance_values(&self, point: &Point) -> Vec<f64> {
        let mut nuisances = vec![0.0; self.model.nuisances.len()];
        for ((nuisance, sd), z) in self.nuisances.iter().zip(point.nuisances.iter()) {
            nuisances[*nuisance] = sd * z;
        }
        nuisances
    }

    /// Values of a point in units of priors: nuisance parameters, then parameters.
    pub(crate) fn normalised(&self, point: &Point) -> DVector<f64> {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_way_counts_values_of_trials_too() {
        let from = Point {
            candidates: vec![3],
            values: vec![vec![1.0, 2.0]],
            forms: vec![[1.0; 2]],
            by_trial: vec![BTreeMap::from([(0, vec![1.5, 2.0])])],
            nuisances: DVector::from_vec(vec![0.0, 4.0]),
        };
        let to = Point {
            values: vec![vec![3.0, 2.0]],
            forms: vec![[2.0; 2]],
            by_trial: vec![BTreeMap::from([(0, vec![3.5, 2.0]), (1, vec![5.0, 6.0])])],
            nuisances: DVector::from_vec(vec![1.0, 0.0]),
            ..from.clone()
        };
        let quarter = from.on_the_way(&to, 0.25);
        assert_eq!(quarter.values, [[1.5, 2.0]]);
        // A trial without a value of its own starts from the common one.
        let by_trial = BTreeMap::from([(0, vec![2.0, 2.0]), (1, vec![2.0, 3.0])]);
        assert_eq!(quarter.by_trial, [by_trial]);
        assert_eq!(quarter.nuisances.as_slice(), [0.25, 3.0]);
        assert_eq!(
            (quarter.forms, quarter.candidates),
            (to.forms, to.candidates)
        );
    }
}
