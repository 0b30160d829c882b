//! Wrenches predicted along the trajectories of a split: by the network, or by an engine as the plugin has it.

use candle_core::{Device, Tensor};
use hydro_model::{BATCH_SIZE, Engine, EngineKind, ForceModel, ModelError, Scratch};
use rayon::prelude::*;

use super::initial_force::InitialForce;
use crate::{TrainError, dataset::Split};

/// Trajectories that the network integrates together; more would only take memory.
const BATCH: usize = 32;

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
pub fn predict_by_network(
    model: &ForceModel,
    split: &Split,
    start: InitialForce,
) -> Result<Vec<Vec<f64>>, TrainError> {
    check(model, split)?;
    let size = split.samples() * split.outputs();
    let mut forces = Vec::with_capacity(split.len());
    for first in (0..split.len()).step_by(BATCH) {
        let range = first..split.len().min(first + BATCH);
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

/// Drives an engine along every trajectory, as the plugin would, on all cores: `[M][T * f]`.
///
/// # Errors
/// A split whose samples are not the engine's.
pub fn predict_by_engine(
    engine: &dyn Engine,
    split: &Split,
    start: InitialForce,
) -> Result<Vec<Vec<f64>>, ModelError> {
    let size = split.samples() * split.outputs();
    let at_a_time = split
        .len()
        .div_ceil(rayon::current_num_threads())
        .clamp(1, BATCH_SIZE);
    let firsts: Vec<usize> = (0..split.len()).step_by(at_a_time).collect();
    let parts = firsts
        .into_par_iter()
        .map_init(Scratch::default, |scratch, first| {
            let range = first..split.len().min(first + at_a_time);
            let x: Vec<f64> = range
                .clone()
                .flat_map(|trajectory| split.x(trajectory))
                .map(|value| f64::from(*value))
                .collect();
            let begin: Vec<f64> = range
                .flat_map(|trajectory| first_force(engine, split, trajectory, start, scratch))
                .collect();
            let forces = engine.trajectories(&x, &begin, scratch)?;
            Ok(forces.chunks_exact(size).map(<[f64]>::to_vec).collect())
        })
        .collect::<Result<Vec<Vec<Vec<f64>>>, ModelError>>()?;
    Ok(parts.into_iter().flatten().collect())
}

/// The force [f] that is carried to a trajectory's first sample.
fn first_force(
    engine: &dyn Engine,
    split: &Split,
    trajectory: usize,
    start: InitialForce,
    scratch: &mut Scratch,
) -> Vec<f64> {
    let (inputs, outputs) = (engine.inputs(), engine.outputs());
    let given = |wrench: &[f32]| wrench[..outputs].iter().map(|v| f64::from(*v)).collect();
    match start {
        InitialForce::Clean => given(split.clean(trajectory)),
        InitialForce::Recorded => given(split.wrench(trajectory)),
        InitialForce::Zero => vec![0.0; outputs],
        InitialForce::Estimate => {
            let x: Vec<f64> = split.x(trajectory)[..inputs]
                .iter()
                .map(|value| f64::from(*value))
                .collect();
            let mut force = vec![0.0; outputs];
            engine.estimate(&x, &mut force, scratch);
            force
        }
    }
}
