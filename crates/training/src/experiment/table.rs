//! Rows of the tables, mean and spread over seeds, and orderings, from the results of all jobs.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    claims::CLAIMS,
    cost::Cost,
    entries::Entry,
    examination::{Examination, Noisy, Swimming},
    job::JobResult,
    mean_sd::MeanSd,
    ordering::{Ordering, ordering},
    task::Experiment,
};
use crate::{
    comparison::{BOUND, ORACLE, within},
    metrics::Errors,
};

/// Name of a figure in [`Row::values`].
pub type Metric = String;

/// One model with one solver on one data set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the data set.
    pub data: String,
    /// [`Entry::id`].
    pub entry: String,
    /// [`Entry::label`].
    pub label: String,
    /// Numbers in the weights; None where no seed was trained.
    pub parameters: Option<usize>,
    /// Largest learning rate.
    pub learning_rate: f64,
    /// False where it stands beside the others, not among them: whole trajectories are predicted with samples to come.
    pub competes: bool,
    /// Seeds that were trained.
    pub seeds: Vec<u64>,
    /// Mean and spread by name.
    pub values: BTreeMap<Metric, MeanSd>,
    /// Time for 400 samples.
    pub cost: Option<Cost>,
    /// Time since the start [s] and nRMSE there, mean over seeds.
    pub by_horizon: Vec<(f64, f64)>,
    /// nRMSE under noise, mean over seeds.
    pub noise: Vec<Noisy>,
    /// Attention weight by head and lag of the first seed.
    pub attention: Option<Vec<Vec<f64>>>,
    /// The force of the first seed along the first test trajectory, one row a sample.
    pub example: Vec<Vec<f32>>,
}

/// One that is not trained, in closed loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Name in the table.
    pub label: String,
    /// Its results in closed loop.
    pub swimming: Swimming,
}

impl Reference {
    /// As a row of the closed loop's table, in no contest.
    pub fn row(&self) -> Row {
        let values = closed_loop_figures(&self.swimming).into_iter();
        Row {
            label: self.label.clone(),
            values: values
                .filter_map(|(name, value)| Some((name, MeanSd::from_values(&[value?])?)))
                .collect(),
            ..Row::default()
        }
    }
}

/// Rows and orderings of some results.
pub fn summarise(
    experiment: Experiment,
    entries: &[Entry],
    results: &[JobResult],
    costs: &BTreeMap<String, Vec<Cost>>,
    references: &[Reference],
) -> (Vec<Row>, Vec<Ordering>) {
    let oracle = references.iter().find(|of| of.label == ORACLE);
    let oracle = oracle.map(|oracle| &oracle.swimming);
    let (mut rows, mut orderings) = (Vec::new(), Vec::new());
    for data in experiment.data() {
        let of = |entry: &str| -> Vec<&JobResult> {
            let mut found: Vec<_> = results
                .iter()
                .filter(|result| result.job.data == *data && result.job.entry == entry)
                .collect();
            found.sort_by_key(|result| result.job.seed);
            found
        };
        let costs = costs.get(*data).map_or(&[][..], Vec::as_slice);
        rows.extend(entries.iter().map(|entry| {
            let cost = costs.iter().find(|cost| cost.entry == entry.id);
            row(data, entry, &of(entry.id), cost, oracle)
        }));
        let label = |id: &str| {
            let entry = entries.iter().find(|entry| entry.id == id);
            entry.map_or_else(|| id.to_owned(), |entry| entry.label.to_owned())
        };
        let errors = |id: &str| -> Vec<Vec<f64>> {
            let found = of(id).into_iter();
            found
                .map(|result| result.examination.detail.by_trajectory.clone())
                .collect()
        };
        orderings.extend(CLAIMS.iter().filter_map(|(better, worse)| {
            ordering(
                data,
                (&label(better), &errors(better)),
                (&label(worse), &errors(worse)),
            )
        }));
    }
    (rows, orderings)
}

fn row(
    data: &str,
    entry: &Entry,
    results: &[&JobResult],
    cost: Option<&Cost>,
    oracle: Option<&Swimming>,
) -> Row {
    let mut all: BTreeMap<Metric, Vec<f64>> = BTreeMap::new();
    for result in results {
        for (name, value) in figures(result, oracle) {
            all.entry(name).or_default().push(value);
        }
    }
    let mean = |pick: &dyn Fn(&Examination) -> Vec<(f64, f64)>| -> Vec<(f64, f64)> {
        let curves: Vec<Vec<(f64, f64)>> = results
            .iter()
            .map(|result| pick(&result.examination))
            .collect();
        let Some(first) = curves.first() else {
            return Vec::new();
        };
        (0..first.len())
            .map(|at| {
                let sum: f64 = curves
                    .iter()
                    .filter_map(|curve| curve.get(at))
                    .map(|p| p.1)
                    .sum();
                (first[at].0, sum / curves.len() as f64)
            })
            .collect()
    };
    let noise = mean(&|of| {
        of.noise
            .iter()
            .map(|noisy| (noisy.level, noisy.nrmse))
            .collect()
    });
    let first = results.first().map(|result| &result.examination);
    Row {
        data: data.to_owned(),
        entry: entry.id.to_owned(),
        label: entry.label.to_owned(),
        parameters: results.first().map(|result| result.parameters),
        learning_rate: entry.learning_rates.on(data),
        competes: !entry.model.needs_the_future(),
        seeds: results.iter().map(|result| result.job.seed).collect(),
        values: all
            .into_iter()
            .filter_map(|(name, values)| Some((name, MeanSd::from_values(&values)?)))
            .collect(),
        cost: cost.cloned(),
        by_horizon: mean(&|of| of.detail.by_horizon.clone()),
        noise: noise
            .into_iter()
            .map(|(level, nrmse)| Noisy { level, nrmse })
            .collect(),
        attention: first.and_then(|of| of.attention.clone()),
        example: results
            .iter()
            .map(|result| &result.examination.example)
            .find(|example| !example.is_empty())
            .cloned()
            .unwrap_or_default(),
    }
}

/// Every figure of one job, by name.
fn figures(result: &JobResult, oracle: Option<&Swimming>) -> Vec<(Metric, f64)> {
    let seen = &result.examination;
    let mut found: Vec<(Metric, f64)> = Vec::new();
    let mut put = |name: &str, value: Option<f64>| {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            found.push((name.to_owned(), value));
        }
    };
    let start = |name: &str| seen.starts.get(name);
    if let Some(errors) = start("clean") {
        let (force, torque) = halves(errors);
        put("nrmse", Some(errors.pooled));
        put("nrmse_hydrodynamic", Some(errors.pooled_hydrodynamic));
        put("nmae", Some(errors.pooled_mae));
        put("mae_force", mean(&errors.mae[force.clone()]));
        put("rmse_force", mean(&errors.rmse[force]));
        put("mae_torque", mean(&errors.mae[torque.clone()]));
        put("rmse_torque", mean(&errors.rmse[torque]));
        let perturbed = errors.rmse_perturbed.iter().map(|error| error * error);
        let count = errors.rmse_perturbed.len() as f64;
        put(
            "rmse_perturbed",
            Some((perturbed.sum::<f64>() / count).sqrt()),
        );
    }
    put("mae", Some(seen.detail.pooled_si.0));
    put("rmse", Some(seen.detail.pooled_si.1));
    put(
        "nrmse_estimate",
        start("estimate").map(|errors| errors.pooled),
    );
    put("nrmse_zero", start("zero").map(|errors| errors.pooled));
    put("first_force", Some(seen.estimate_error));
    put("fluctuation", seen.fluctuation);
    put("work_error", seen.energy.map(|energy| energy.work_error));
    put("power_error", seen.energy.map(|energy| energy.power_error));
    put("gives", seen.energy.map(|energy| energy.gives));
    put("gives_truth", seen.energy.map(|energy| energy.gives_truth));
    for noisy in &seen.noise {
        put(&format!("noise.{}", noisy.level), Some(noisy.nrmse));
    }
    for beyond in &seen.beyond {
        put(
            &format!("beyond.{}", beyond.name),
            Some(beyond.errors.pooled),
        );
    }
    for (name, value) in seen.swimming.iter().flat_map(closed_loop_figures) {
        put(&name, value);
    }
    let peaks = |of: Option<&Swimming>| of.and_then(|swimming| swimming.peaks);
    let bounded = peaks(seen.swimming.as_ref())
        .zip(peaks(oracle))
        .map(|(ours, oracle)| within(&ours, &oracle, BOUND));
    put(
        "bounded_as_oracle",
        bounded.map(|is| f64::from(u8::from(is))),
    );
    put("train_seconds", Some(result.training.seconds));
    put("peak_memory", result.training.peak_memory_mib);
    found
}

/// Figures of the closed loop, by name; None of what blew up.
fn closed_loop_figures(swimming: &Swimming) -> Vec<(Metric, Option<f64>)> {
    let mut found = vec![
        ("diverged".to_owned(), Some(swimming.diverged as f64)),
        ("runs".to_owned(), Some(swimming.runs as f64)),
        (
            "bounded".to_owned(),
            swimming.bounded.map(|bounded| f64::from(u8::from(bounded))),
        ),
    ];
    for (at, horizon) in swimming.horizons.iter().enumerate() {
        found.push((format!("position.{horizon}"), swimming.position[at]));
        found.push((format!("attitude.{horizon}"), swimming.attitude[at]));
    }
    for (at, name) in ["speed", "rate", "force", "torque"].iter().enumerate() {
        let peak = swimming.peaks.and_then(|peaks| peaks[at]);
        found.push((format!("peak.{name}"), peak));
    }
    found
}

/// Which axes are forces and which torques: a wrench has three of each, anything else is force.
pub(super) fn halves(errors: &Errors) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
    let axes = errors.mae.len();
    let forces = if axes == 6 { 3 } else { axes };
    (0..forces, forces..axes)
}

pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
#[path = "tests/table.rs"]
mod tests;
