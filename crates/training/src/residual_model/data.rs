//! A wrench along trials, and its trajectories to train on and to validate with.

use hydro_model::features::FeatureLayout;

use crate::dataset::Trajectory;

/// Samples of a trajectory at most, and at least.
pub(super) const SAMPLES: usize = 100;
pub(super) const LEAST_SAMPLES: usize = 20;

/// Least ratio of a component's mean square to that of its error for it to be learned.
const STANDS_OUT: f64 = 2.0;

/// Part of the trials that validate.
const VALIDATION: f64 = 0.25;

/// The wrench along one trial.
#[derive(Clone, Debug)]
pub struct RecordedWrench {
    /// Features of every sample, SI [T, n].
    pub x: Vec<f32>,
    /// Wrench of every sample [N, N m], in the base's frame about its origin [T].
    pub wrench: Vec<[f64; 6]>,
    /// Its standard deviation [T].
    pub sd: Vec<[f64; 6]>,
}

/// A missing wrench along trials, and settings for learning it.
#[derive(Clone, Debug)]
pub struct ResidualData {
    /// Columns of `x`.
    pub features: FeatureLayout,
    /// Their units.
    pub feature_units: Vec<String>,
    /// Time between samples [s].
    pub sample_period: f64,
    /// The wrench, trial by trial.
    pub recorded: Vec<RecordedWrench>,
    /// Seed of weights and order of the data.
    pub seed: u64,
    /// Command that the card states.
    pub command: String,
}

/// True where a component is more than its own error.
pub(super) fn stands_out(data: &ResidualData, axis: usize) -> bool {
    let sum = |of: &dyn Fn(&RecordedWrench) -> f64| data.recorded.iter().map(of).sum::<f64>();
    let square = |rows: &[[f64; 6]]| rows.iter().map(|row| row[axis] * row[axis]).sum::<f64>();
    let (wrench, error) = (sum(&|of| square(&of.wrench)), sum(&|of| square(&of.sd)));
    wrench > STANDS_OUT * error
}

/// Trajectories to train on and to validate with.
pub(super) struct Splits {
    pub(super) samples: usize,
    pub(super) train: Vec<Trajectory>,
    pub(super) validation: Vec<Trajectory>,
}

/// Whole trials validate; of a single one, its end does. None where nothing is long enough.
pub(super) fn splits(data: &ResidualData, axes: &[usize]) -> Option<Splits> {
    let lengths = || data.recorded.iter().map(|of| of.wrench.len());
    let longest = lengths().max()?;
    let alone = data.recorded.len() < 2;
    let whole = if alone { longest / 3 } else { longest };
    let samples = SAMPLES.min(whole);
    if samples < LEAST_SAMPLES {
        return None;
    }
    let cut: Vec<Vec<Trajectory>> = data
        .recorded
        .iter()
        .map(|of| trajectories(of, data.features.len(), axes, samples))
        .filter(|cut| !cut.is_empty())
        .collect();
    let (train, validation) = if cut.len() < 2 {
        let mut only = cut.into_iter().next()?;
        let last = ((VALIDATION * only.len() as f64).ceil() as usize).max(1);
        let validation = only.split_off(only.len().checked_sub(last)?);
        (only, validation)
    } else {
        let held = ((VALIDATION * cut.len() as f64).round() as usize).max(1);
        let mut train = cut;
        let validation = train.split_off(train.len() - held);
        (train.concat(), validation.concat())
    };
    (!train.is_empty() && !validation.is_empty()).then_some(Splits {
        samples,
        train,
        validation,
    })
}

/// A trial cut into trajectories of equal length; a short rest overlaps the one before.
fn trajectories(of: &RecordedWrench, n: usize, axes: &[usize], samples: usize) -> Vec<Trajectory> {
    let rows = of.wrench.len();
    let Some(last) = rows.checked_sub(samples) else {
        return Vec::new();
    };
    let mut starts: Vec<usize> = (0..=last).step_by(samples).collect();
    if starts
        .last()
        .is_some_and(|start| last - start > samples / 2)
    {
        starts.push(last);
    }
    starts
        .into_iter()
        .map(|start| Trajectory {
            x: of.x[start * n..(start + samples) * n].to_vec(),
            wrench: of.wrench[start..start + samples]
                .iter()
                .flat_map(|row| axes.iter().map(|axis| row[*axis] as f32))
                .collect(),
        })
        .collect()
}
