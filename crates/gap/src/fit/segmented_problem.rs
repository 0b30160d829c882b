//! Trials cut into segments, the effects that are tried on them, and the uncertain numbers of the nominal.

use hydro_effects::Entry;
use nalgebra::DVector;

use crate::{
    fit::{hypothesis::Point, truncated_normal::Bounds},
    options::Options,
    plant::{Plant, PlantDescription},
    problem::{
        candidates::Candidate,
        channels::{Channels, MeasuredTrial},
        segments::{EstimatedMotion, Segment},
    },
};

/// The data of a fit and what may be fitted to them.
#[derive(Clone)]
pub(crate) struct SegmentedProblem<'a> {
    pub(crate) plant: &'a dyn Plant,
    pub(crate) model: &'a PlantDescription,
    pub(crate) trials: &'a [MeasuredTrial],
    pub(crate) motions: &'a [EstimatedMotion],
    pub(crate) channels: &'a Channels,
    pub(crate) candidates: &'a [Candidate],
    pub(crate) options: &'a Options,
    /// Log prior probability of each candidate among single effects.
    pub(crate) log_shares: Vec<f64>,
    /// Nuisance parameters in use: row of `PlantDescription::nuisances`, and standard deviation of the prior.
    pub(crate) nuisances: Vec<(usize, f64)>,
    pub(crate) segments: Vec<Segment>,
}

impl SegmentedProblem<'_> {
    /// Length of all segments together [s].
    pub(crate) fn seconds(&self) -> f64 {
        let seconds = |segment: &Segment| {
            let times = &self.trials[segment.trial].times;
            times[segment.rows.end - 1] - times[segment.rows.start]
        };
        self.segments.iter().map(seconds).sum()
    }

    /// Length of all segments times the degrees of freedom [s]: proportional to the cost of a rollout of all.
    pub(crate) fn freedom_seconds(&self) -> f64 {
        self.seconds() * self.model.nv as f64
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

    /// Sets nuisance parameters and parameters of a point from units of priors.
    pub(crate) fn set(&self, point: &mut Point, z: &DVector<f64>) {
        point.nuisances = z.rows(0, self.nuisances.len()).into_owned();
        let mut at = self.nuisances.len();
        for (candidate, values) in point.candidates.iter().zip(&mut point.values) {
            for (p, value) in self.candidates[*candidate].parameters.iter().zip(values) {
                *value = (p.null + z[at] * p.prior_sd).clamp(p.lower, p.upper);
                at += 1;
            }
        }
    }

    pub(crate) fn bounds(&self, candidates: &[usize]) -> Vec<Bounds> {
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
}
