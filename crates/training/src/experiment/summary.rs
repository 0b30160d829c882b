//! What all jobs say together: rows with mean and spread over seeds, curves, orderings.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{
    cost::Cost,
    examination::{Examination, Noisy, Swimming},
    ordering::{Ordering, order},
    plan::{Budget, Entry, Experiment, JobId},
};
use crate::{
    Errors, TrainConfig,
    comparison::{BOUND, ORACLE, within},
};

/// Of a job's result.
pub const SCHEMA: &str = "hydro-compare-job/1";

/// One job, done.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct JobResult {
    /// [`SCHEMA`].
    pub schema: String,
    /// Which one.
    pub job: JobId,
    /// Its data set's manifest.
    pub data_sha256: String,
    /// What else it was examined on, by name: sha256 of rollouts and of sets outside the training range.
    pub examined_on: BTreeMap<String, String>,
    /// How it was trained.
    pub settings: TrainConfig,
    /// Numbers in the weights.
    pub parameters: usize,
    /// What training took.
    pub training: TrainingNote,
    /// What the model shows.
    pub examination: Examination,
}

/// What training took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainingNote {
    /// Passes over the training split.
    pub epochs: usize,
    /// Wall clock over all epochs [s], with `threads` threads; other jobs may have run beside it.
    pub seconds: f64,
    /// Threads.
    pub threads: usize,
    /// Greatest resident memory of the process, data and all [MiB]; None where the system does not say.
    pub peak_memory_mib: Option<f64>,
    /// Best pooled nRMSE on the validation split; None where none was a number.
    pub validation: Option<f64>,
}

/// Mean and standard deviation over seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanSd {
    /// Mean.
    pub mean: f64,
    /// Standard deviation; 0 of one seed.
    pub sd: f64,
    /// How many seeds have a value.
    pub count: usize,
}

impl MeanSd {
    /// Of some values; None without any.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let sd = (square / count.saturating_sub(1).max(1) as f64).sqrt();
        (count > 0).then_some(Self { mean, sd, count })
    }
}

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

/// The whole of an experiment.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// Which one.
    pub experiment: Experiment,
    /// The command that made it.
    pub command: String,
    /// What everybody was given, by data set.
    pub budgets: BTreeMap<String, Budget>,
    /// Data sets by name: sha256 of the manifest.
    pub data: BTreeMap<String, String>,
    /// Names of the force components.
    pub outputs: Vec<String>,
    /// Rows, data set after data set.
    pub rows: Vec<Row>,
    /// Whom the closed loop is measured by: rivals, and the true wrench.
    pub references: Vec<Reference>,
    /// Claims, the paper's and ours.
    pub orderings: Vec<Ordering>,
    /// Of the first test trajectory, by data set.
    pub truth: BTreeMap<String, Truth>,
}

/// One that is not trained, in closed loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Name in the table.
    pub label: String,
    /// What it does.
    pub swimming: Swimming,
}

impl Reference {
    /// As a row of the closed loop's table, in no contest.
    pub fn row(&self) -> Row {
        let values = swum(&self.swimming).into_iter();
        Row {
            label: self.label.clone(),
            values: values
                .filter_map(|(name, value)| Some((name, MeanSd::of(&[value?])?)))
                .collect(),
            ..Row::default()
        }
    }
}

/// A trajectory that predictions are drawn beside.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Sample times [s].
    pub time: Vec<f32>,
    /// The true force, one row a sample [N, N m].
    pub force: Vec<Vec<f32>>,
}

/// Who is claimed to be better than whom, by [`Entry::id`]: the paper's orderings, then ours.
const CLAIMS: [(&str, &str); 30] = [
    ("attention-ode-euler", "mlp-ode-euler"),
    ("attention-ode-rk4", "mlp-ode-rk4"),
    ("mlp-ode-rk4", "mlp-ode-euler"),
    ("attention-ode-rk4", "attention-ode-euler"),
    ("relaxation-ode", "mlp-ode-rk4"),
    ("relaxation-ode", "attention-ode-rk4"),
    ("relaxation-ode", "attention-ode-euler"),
    ("relaxation-ode", "cnode-natural-rk4"),
    ("relaxation-ode", "cnode-hermite-rk4"),
    ("relaxation-ode", "lstm"),
    ("relaxation-ode", "mlp"),
    ("relaxation-ode", "mlp-informed"),
    ("relaxation-ode", "mlp-ode-informed"),
    ("relaxation-ode", "attention-ode-informed"),
    ("relaxation-ode", "cnode-informed"),
    ("relaxation-ode", "lstm-informed"),
    ("relaxation-ode-modes", "relaxation-ode"),
    ("relaxation-ode-modes", "mlp-ode-rk4"),
    ("relaxation-ode-modes", "attention-ode-rk4"),
    ("relaxation-ode-modes", "cnode-hermite-rk4"),
    ("relaxation-ode-modes", "lstm"),
    ("relaxation-ode-modes", "mlp"),
    ("relaxation-ode-modes", "mlp-informed"),
    ("relaxation-ode-modes", "mlp-ode-informed"),
    ("relaxation-ode-modes", "attention-ode-informed"),
    ("relaxation-ode-modes", "cnode-informed"),
    ("relaxation-ode-modes", "lstm-informed"),
    ("attention-ode-informed", "mlp-ode-informed"),
    ("attention-ode-informed", "mlp-informed"),
    ("relaxation-ode-raw", "attention-ode-rk4"),
];

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
            order(
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
            .filter_map(|(name, values)| Some((name, MeanSd::of(&values)?)))
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
    for (name, value) in seen.swimming.iter().flat_map(swum) {
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
fn swum(swimming: &Swimming) -> Vec<(Metric, Option<f64>)> {
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
fn halves(errors: &Errors) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
    let axes = errors.mae.len();
    let forces = if axes == 6 { 3 } else { axes };
    (0..forces, forces..axes)
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_spread_are_those_of_the_definition() {
        let spread = MeanSd::of(&[1.0, 2.0, 3.0]).expect("values");
        assert!((spread.mean - 2.0).abs() < 1e-15 && (spread.sd - 1.0).abs() < 1e-15);
        assert_eq!(spread.count, 3);
        let one = MeanSd::of(&[4.0]).expect("a value");
        assert!((one.mean - 4.0).abs() < 1e-15 && one.sd.abs() < 1e-15);
        assert_eq!(MeanSd::of(&[]), None);
    }

    #[test]
    fn claims_are_about_entries() {
        let entries = super::super::plan::entries(6, None);
        for (better, worse) in CLAIMS {
            for id in [better, worse] {
                assert!(entries.iter().any(|entry| entry.id == id), "{id}");
            }
        }
    }
}
