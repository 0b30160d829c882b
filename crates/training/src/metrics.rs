//! Errors of a model on recorded inputs: open loop, over whole trajectories, against the clean wrench.

use std::{fmt, str::FromStr};

use candle_core::{Device, Tensor};
use hydro_model::{EngineKind, ForceModel, Scratch, checkpoint::Checkpoint, normaliser::Moments};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::TrainError;
use crate::dataset::Split;

/// Trajectories integrated together; more would only take memory.
const TOGETHER: usize = 32;

/// The force from which a trajectory is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InitialForce {
    /// The recorded, perturbed one.
    #[default]
    Recorded,
    /// The clean one.
    Clean,
    /// What the model predicts for a window filled with the first sample.
    Estimate,
    /// None at all.
    Zero,
}

impl InitialForce {
    /// Every choice, for error messages and help texts.
    pub const ALL: [Self; 4] = [Self::Recorded, Self::Clean, Self::Estimate, Self::Zero];
}

impl fmt::Display for InitialForce {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Recorded => "recorded",
            Self::Clean => "clean",
            Self::Estimate => "estimate",
            Self::Zero => "zero",
        })
    }
}

/// A name that is none.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown initial force `{0}`: there are recorded, clean, estimate and zero")]
pub struct UnknownInitialForce(pub String);

impl FromStr for InitialForce {
    type Err = UnknownInitialForce;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|choice| choice.to_string() == name)
            .ok_or_else(|| UnknownInitialForce(name.to_owned()))
    }
}

/// Errors of predicted wrenches against the clean ones, axis by axis and pooled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean absolute error of each axis [N, N m].
    pub mae: Vec<f64>,
    /// Root mean square error of each axis [N, N m].
    pub rmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench.
    pub nrmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench without its hydrostatic part.
    pub nrmse_hydrodynamic: Vec<f64>,
    /// Root mean square error against the perturbed wrench [N, N m].
    pub rmse_perturbed: Vec<f64>,
    /// Mean over axes of the absolute error in standard deviations of the clean wrench.
    pub pooled_mae: f64,
    /// Root mean square over axes of `nrmse`.
    pub pooled: f64,
    /// Root mean square over axes of `nrmse_hydrodynamic`.
    pub pooled_hydrodynamic: f64,
}

/// Errors over a split. The first sample of a trajectory is given to the model and does not count.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Names of the axes.
    pub outputs: Vec<String>,
    /// The force at the start.
    pub start: InitialForce,
    /// How many trajectories.
    pub trajectories: usize,
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Evaluates a checkpoint on a split.
///
/// ```no_run
/// use hydro_plugin::{checkpoint::Checkpoint, dataset::Dataset, training::{InitialForce, evaluate}};
///
/// let checkpoint = Checkpoint::load("models/b1-task2".as_ref())?;
/// let test = Dataset::open("data/task2".as_ref())?.split("test", None)?;
/// let evaluation = evaluate(&checkpoint, &test, InitialForce::Recorded)?;
/// println!("pooled normalised RMSE {:.3}", evaluation.errors.pooled);
/// # Ok::<(), hydro_plugin::training::TrainError>(())
/// ```
pub fn evaluate(
    checkpoint: &Checkpoint,
    split: &Split,
    start: InitialForce,
) -> Result<Evaluation, TrainError> {
    evaluate_model(
        &checkpoint.model(None)?,
        &checkpoint.card.outputs,
        split,
        start,
    )
}

/// The wrenches that a model predicts along one trajectory of a split, [T, f] in SI, for plots.
pub fn predict(
    model: &ForceModel,
    split: &Split,
    trajectory: usize,
    start: InitialForce,
) -> Result<Vec<f32>, TrainError> {
    check(model, split)?;
    predict_range(model, split, trajectory..trajectory + 1, start)
}

/// The wrenches that a model predicts along every trajectory of a split, `[M][T * f]` in SI, by its network: also of one
/// that needs samples to come.
pub fn predict_split(
    model: &ForceModel,
    split: &Split,
    start: InitialForce,
) -> Result<Vec<Vec<f64>>, TrainError> {
    check(model, split)?;
    let size = split.samples() * split.outputs();
    let mut forces = Vec::with_capacity(split.len());
    for first in (0..split.len()).step_by(TOGETHER) {
        let range = first..split.len().min(first + TOGETHER);
        let predicted = predict_range(model, split, range, start)?;
        forces.extend(predicted.chunks_exact(size).map(|forces| {
            let forces = forces.iter().map(|value| f64::from(*value));
            forces.collect::<Vec<_>>()
        }));
    }
    Ok(forces)
}

fn check(model: &ForceModel, split: &Split) -> Result<(), TrainError> {
    let (found, expected) = (
        (split.inputs(), split.outputs()),
        (model.inputs(), model.outputs()),
    );
    if split.is_empty() {
        return Err(TrainError::Split {
            split: "evaluated",
            reason: "is empty".to_owned(),
        });
    }
    if found != expected {
        return Err(TrainError::Split {
            split: "evaluated",
            reason: format!(
                "has {} features and {} force components, the model {} and {}",
                found.0, found.1, expected.0, expected.1
            ),
        });
    }
    Ok(())
}

/// [trajectories, T, f].
fn predict_range(
    model: &ForceModel,
    split: &Split,
    range: std::ops::Range<usize>,
    start: InitialForce,
) -> Result<Vec<f32>, TrainError> {
    let (batch, samples, n, f) = (
        range.len(),
        split.samples(),
        split.inputs(),
        split.outputs(),
    );
    let x: Vec<f32> = range
        .clone()
        .flat_map(|i| split.x(i).iter().copied())
        .collect();
    let begin: Vec<f32> = match start {
        InitialForce::Recorded => range
            .flat_map(|i| split.wrench(i)[..f].iter().copied())
            .collect(),
        InitialForce::Clean => range
            .flat_map(|i| split.clean(i)[..f].iter().copied())
            .collect(),
        InitialForce::Zero => vec![0.0; batch * f],
        InitialForce::Estimate => {
            let engine = model.engine(EngineKind::Fused)?;
            let (mut scratch, mut force) = (Scratch::default(), vec![0.0; f]);
            let mut found = Vec::with_capacity(batch * f);
            for i in range {
                let first: Vec<f64> = split.x(i)[..n].iter().map(|v| f64::from(*v)).collect();
                engine.estimate(&first, &mut force, &mut scratch);
                found.extend(force.iter().map(|v| *v as f32));
            }
            found
        }
    };
    let x = Tensor::from_vec(x, (batch, samples, n), &Device::Cpu)?;
    let begin = Tensor::from_vec(begin, (batch, f), &Device::Cpu)?;
    Ok(model.predict(&x, &begin)?.flatten_all()?.to_vec1::<f32>()?)
}

/// [`evaluate`] without a card.
pub(super) fn evaluate_model(
    model: &ForceModel,
    outputs: &[String],
    split: &Split,
    start: InitialForce,
) -> Result<Evaluation, TrainError> {
    let mut sums = Sums::new(split.outputs());
    for (trajectory, predicted) in predict_split(model, split, start)?.iter().enumerate() {
        sums.add_trajectory(predicted, split, trajectory);
    }
    Ok(Evaluation {
        outputs: outputs.to_vec(),
        start,
        trajectories: split.len(),
        errors: sums.errors(),
    })
}

/// Running sums, axis by axis; trajectories are added as they are predicted.
#[derive(Clone, Debug)]
pub struct Sums {
    count: f64,
    absolute: Vec<f64>,
    square: Vec<f64>,
    square_perturbed: Vec<f64>,
    clean: Moments,
    hydrodynamic: Moments,
}

impl Sums {
    /// For wrenches of `axes` components.
    pub fn new(axes: usize) -> Self {
        Self {
            count: 0.0,
            absolute: vec![0.0; axes],
            square: vec![0.0; axes],
            square_perturbed: vec![0.0; axes],
            clean: Moments::new(axes),
            hydrodynamic: Moments::new(axes),
        }
    }

    /// Adds a predicted trajectory [T, f], all samples but the first, which is given.
    pub fn add_trajectory(&mut self, predicted: &[f64], split: &Split, trajectory: usize) {
        let f = split.outputs();
        let [clean, hydrostatic, perturbed] = [
            split.clean(trajectory),
            split.hydrostatic(trajectory),
            split.wrench(trajectory),
        ];
        for k in 1..split.samples() {
            let row = |values: &[f32]| -> Vec<f64> {
                let row = &values[k * f..][..f];
                row.iter().map(|value| f64::from(*value)).collect()
            };
            self.add(
                &predicted[k * f..][..f],
                &row(clean),
                &row(hydrostatic),
                &row(perturbed),
            );
        }
    }

    fn add(&mut self, predicted: &[f64], clean: &[f64], hydrostatic: &[f64], perturbed: &[f64]) {
        self.count += 1.0;
        for (axis, value) in predicted.iter().enumerate() {
            let error = value - clean[axis];
            self.absolute[axis] += error.abs();
            self.square[axis] += error * error;
            self.square_perturbed[axis] += (value - perturbed[axis]).powi(2);
        }
        self.clean.add(clean);
        let hydrodynamic: Vec<f64> = clean
            .iter()
            .zip(hydrostatic)
            .map(|(all, part)| all - part)
            .collect();
        self.hydrodynamic.add(&hydrodynamic);
    }

    /// The errors of everything added.
    pub fn errors(&self) -> Errors {
        let mean = |sums: &[f64]| -> Vec<f64> { sums.iter().map(|sum| sum / self.count).collect() };
        let root = |sums: &[f64]| -> Vec<f64> { mean(sums).into_iter().map(f64::sqrt).collect() };
        let over = |errors: &[f64], scale: &[f64]| -> Vec<f64> {
            errors
                .iter()
                .zip(scale)
                .map(|(error, scale)| error / scale)
                .collect()
        };
        let pool = |values: &[f64]| {
            (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
        };
        let (mae, rmse) = (mean(&self.absolute), root(&self.square));
        let scale = self.clean.std();
        let nrmse = over(&rmse, &scale);
        let nrmse_hydrodynamic = over(&rmse, &self.hydrodynamic.std());
        Errors {
            pooled_mae: over(&mae, &scale).iter().sum::<f64>() / mae.len() as f64,
            pooled: pool(&nrmse),
            pooled_hydrodynamic: pool(&nrmse_hydrodynamic),
            rmse_perturbed: root(&self.square_perturbed),
            mae,
            rmse,
            nrmse,
            nrmse_hydrodynamic,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_definition() {
        let mut sums = Sums::new(1);
        // Clean 0, 2, 4: deviation sqrt(8/3). Hydrodynamic part 0, 1, 2: sqrt(2/3). Errors 1, -1, 2; perturbed by 1.
        for (predicted, clean, hydrostatic) in [(1.0, 0.0, 0.0), (1.0, 2.0, 1.0), (6.0, 4.0, 2.0)] {
            sums.add(&[predicted], &[clean], &[hydrostatic], &[clean + 1.0]);
        }
        let found = sums.errors();
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-12, "{got} {want}");
        close(found.mae[0], 4.0 / 3.0);
        close(found.rmse[0], 2f64.sqrt());
        close(found.pooled, 2f64.sqrt() / (8f64 / 3.0).sqrt());
        close(found.pooled_hydrodynamic, 2f64.sqrt() / (2f64 / 3.0).sqrt());
        close(found.pooled_mae, 4.0 / 3.0 / (8f64 / 3.0).sqrt());
        close(found.rmse_perturbed[0], (5f64 / 3.0).sqrt());
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for choice in InitialForce::ALL {
            assert_eq!(choice.to_string().parse(), Ok(choice));
        }
        assert!("one".parse::<InitialForce>().is_err());
    }
}
