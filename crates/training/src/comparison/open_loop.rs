//! Open loop: wrenches predicted from recorded features, beside the true ones.

use std::convert::Infallible;

use hydro_frames::{Twist, Wrench};
use hydro_model::{
    BATCH_SIZE, Engine, ModelError, Scratch,
    features::{Feature, FeatureLayout},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    Errors, InitialForce, Sums,
    dataset::Split,
    drag::{Drag, DragFit},
};

/// Predicts the wrench along a trajectory of a split: `[T, f]`, row after row.
pub type Predict<'a, E> = dyn Fn(&Split, usize) -> Result<Vec<f64>, E> + 'a;

/// Errors of one contender on a test split, against the clean wrench.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OpenLoopRow {
    /// Name in the table.
    pub name: String,
    /// The errors; the first sample of a trajectory is given and does not count.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Wrenches along one test trajectory, for plots.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Example {
    /// Sample times [s].
    pub time: Vec<f64>,
    /// Name, and one row a sample of the wrench [N, N m]; the truth first.
    pub wrenches: Vec<(String, Vec<Vec<f64>>)>,
}

/// The open-loop comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OpenLoop {
    /// Names of the axes, `force.x` and so on.
    pub outputs: Vec<String>,
    /// How many test trajectories.
    pub trajectories: usize,
    /// One row a contender.
    pub rows: Vec<OpenLoopRow>,
    /// One trajectory in full.
    pub example: Example,
}

/// Runs contenders over a split; `example` is the trajectory that is kept in full. `tick` is called
/// after each contender.
///
/// # Errors
/// Whatever a contender returns.
pub fn open_loop<E>(
    contenders: &[(String, Box<Predict<'_, E>>)],
    split: &Split,
    outputs: &[String],
    example: usize,
    tick: &dyn Fn(&str),
) -> Result<OpenLoop, E> {
    let axes = split.outputs();
    let row = |row: &[f32]| row.iter().map(|value| f64::from(*value)).collect();
    let truth = split.clean(example).chunks_exact(axes).map(row).collect();
    let mut wrenches = vec![("truth".to_owned(), truth)];
    let mut rows = Vec::new();
    for (name, predict) in contenders {
        let mut sums = Sums::new(axes);
        for trajectory in 0..split.len() {
            let predicted = predict(split, trajectory)?;
            sums.add_trajectory(&predicted, split, trajectory);
            if trajectory == example {
                let rows = predicted.chunks_exact(axes).map(<[f64]>::to_vec);
                wrenches.push((name.clone(), rows.collect()));
            }
        }
        rows.push(OpenLoopRow {
            name: name.clone(),
            errors: sums.errors(),
        });
        tick(name);
    }
    Ok(OpenLoop {
        outputs: outputs.to_vec(),
        trajectories: split.len(),
        rows,
        example: Example {
            time: split.time().iter().map(|t| f64::from(*t)).collect(),
            wrenches,
        },
    })
}

/// Drives an engine along every trajectory, as the plugin would, on all cores: `[M][T * f]`.
///
/// # Errors
/// A split whose samples are not the engine's.
pub fn predict_all(
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

/// A contender whose trajectories were predicted before.
pub fn predicted<'a>(trajectories: Vec<Vec<f64>>) -> Box<Predict<'a, Infallible>> {
    Box::new(move |_, trajectory| Ok(trajectories[trajectory].clone()))
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

/// Base twist and density of a floating base's sample; `None` where the layout does not hold them.
pub fn twist_and_density(layout: &FeatureLayout, sample: &[f32]) -> Option<(Twist, f64)> {
    let triple = |feature: fn(usize) -> Feature| -> Option<[f64; 3]> {
        let at = |axis| Some(f64::from(sample[layout.index_of(&feature(axis))?]));
        Some([at(0)?, at(1)?, at(2)?])
    };
    let twist = Twist {
        angular: triple(Feature::AngularVelocity)?,
        linear: triple(Feature::LinearVelocity)?,
    };
    Some((twist, f64::from(sample[layout.density()?])))
}

/// The wrench without buoyancy of each sample: measured (perturbed) minus exact hydrostatics.
fn without_buoyancy(wrench: &[f32], hydrostatic: &[f32]) -> Wrench {
    let mut values = [0.0; 6];
    for (value, (all, part)) in values.iter_mut().zip(wrench.iter().zip(hydrostatic)) {
        *value = f64::from(*all) - f64::from(*part);
    }
    Wrench::from_array(values)
}

/// The regression of a drag on a training split, buoyancy taken out exactly; `None` where the features
/// hold no twist.
pub fn fit_drag(layout: &FeatureLayout, train: &Split) -> Option<DragFit> {
    let mut fit = DragFit::default();
    for trajectory in 0..train.len() {
        let samples = train.x(trajectory).chunks_exact(train.inputs());
        let wrenches = train.wrench(trajectory).chunks_exact(6);
        let hydrostatics = train.hydrostatic(trajectory).chunks_exact(6);
        for ((sample, wrench), hydrostatic) in samples.zip(wrenches).zip(hydrostatics) {
            let (twist, density) = twist_and_density(layout, sample)?;
            fit.add(&twist, density, &without_buoyancy(wrench, hydrostatic));
        }
    }
    Some(fit)
}

/// The fitted drag as a contender, with exact buoyancy and density.
pub fn drag_contender<'a>(
    drag: &'a Drag,
    layout: &'a FeatureLayout,
) -> Box<Predict<'a, Infallible>> {
    Box::new(move |split, trajectory| {
        let samples = split.x(trajectory).chunks_exact(split.inputs());
        let hydrostatics = split.hydrostatic(trajectory).chunks_exact(6);
        let predicted = samples.zip(hydrostatics).flat_map(|(sample, hydrostatic)| {
            let wrench = twist_and_density(layout, sample)
                .map(|(twist, density)| drag.wrench(&twist, density))
                .unwrap_or_default()
                .to_array();
            let mut sum = [0.0; 6];
            for (sum, (drag, buoyancy)) in sum.iter_mut().zip(wrench.iter().zip(hydrostatic)) {
                *sum = drag + f64::from(*buoyancy);
            }
            sum
        });
        Ok(predicted.collect())
    })
}
