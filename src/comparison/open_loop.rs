//! Open loop: wrenches predicted from recorded features, beside the true ones.

use std::convert::Infallible;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::{
    dataset::Split,
    drag::{Drag, DragFit},
    features::{Feature, FeatureLayout},
    frames::{Twist, Wrench},
    model::{Engine, Scratch},
};

/// Where an ODE's force starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Start {
    /// The true force at the first sample, as in the paper.
    True,
    /// What the model itself predicts for a window filled with the first sample, as in the plugin.
    Estimate,
}

/// Predicts the wrench along a trajectory of a split: `[T, f]`, row after row.
pub type Predict<'a, E> = dyn Fn(&Split, usize) -> Result<Vec<f64>, E> + 'a;

/// Errors of one contender on a test split, against the clean wrench.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OpenLoopRow {
    /// Name in the table.
    pub name: String,
    /// Mean absolute error of each axis [N, N m].
    pub mae: Vec<f64>,
    /// Root mean square error of each axis [N, N m].
    pub rmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench.
    pub nrmse: Vec<f64>,
    /// `rmse` over the standard deviation of the axis's clean wrench without its hydrostatic part.
    pub nrmse_hydrodynamic: Vec<f64>,
    /// Root mean square over axes of `nrmse`.
    pub pooled: f64,
    /// Root mean square over axes of `nrmse_hydrodynamic`.
    pub pooled_hydrodynamic: f64,
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

/// Sums of errors and of the truth's moments, axis by axis; predictions are added as they come.
#[derive(Clone, Debug)]
pub struct Accumulator {
    axes: usize,
    count: f64,
    absolute: Vec<f64>,
    square: Vec<f64>,
    clean: Moments,
    hydrodynamic: Moments,
}

/// Running mean and sum of squared deviations (Welford), axis by axis.
#[derive(Clone, Debug)]
struct Moments {
    count: f64,
    mean: Vec<f64>,
    deviation: Vec<f64>,
}

impl Moments {
    fn new(axes: usize) -> Self {
        Self {
            count: 0.0,
            mean: vec![0.0; axes],
            deviation: vec![0.0; axes],
        }
    }

    fn add(&mut self, row: impl Iterator<Item = f64>) {
        self.count += 1.0;
        for (axis, value) in row.enumerate() {
            let from_old_mean = value - self.mean[axis];
            self.mean[axis] += from_old_mean / self.count;
            self.deviation[axis] += from_old_mean * (value - self.mean[axis]);
        }
    }

    fn standard_deviations(&self) -> Vec<f64> {
        let variance = |sum: &f64| (sum / self.count).sqrt();
        self.deviation.iter().map(variance).collect()
    }
}

impl Accumulator {
    /// For wrenches of `axes` components.
    pub fn new(axes: usize) -> Self {
        Self {
            axes,
            count: 0.0,
            absolute: vec![0.0; axes],
            square: vec![0.0; axes],
            clean: Moments::new(axes),
            hydrodynamic: Moments::new(axes),
        }
    }

    /// Adds one sample: predicted, clean and hydrostatic wrench.
    pub fn add(&mut self, predicted: &[f64], clean: &[f64], hydrostatic: &[f64]) {
        self.count += 1.0;
        for axis in 0..self.axes {
            let error = predicted[axis] - clean[axis];
            self.absolute[axis] += error.abs();
            self.square[axis] += error * error;
        }
        self.clean.add(clean.iter().copied());
        self.hydrodynamic
            .add(clean.iter().zip(hydrostatic).map(|(all, part)| all - part));
    }

    /// The errors of everything added.
    pub fn row(&self, name: &str) -> OpenLoopRow {
        let mean = |sums: &[f64]| -> Vec<f64> { sums.iter().map(|sum| sum / self.count).collect() };
        let rmse: Vec<f64> = mean(&self.square).iter().map(|v| v.sqrt()).collect();
        let over =
            |scale: Vec<f64>| -> Vec<f64> { rmse.iter().zip(scale).map(|(e, s)| e / s).collect() };
        let pool = |values: &[f64]| {
            (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
        };
        let nrmse = over(self.clean.standard_deviations());
        let nrmse_hydrodynamic = over(self.hydrodynamic.standard_deviations());
        OpenLoopRow {
            name: name.to_owned(),
            mae: mean(&self.absolute),
            pooled: pool(&nrmse),
            pooled_hydrodynamic: pool(&nrmse_hydrodynamic),
            rmse,
            nrmse,
            nrmse_hydrodynamic,
        }
    }
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
    let table = |values: &[f32]| -> Vec<Vec<f64>> {
        let row = |row: &[f32]| row.iter().map(|value| f64::from(*value)).collect();
        values.chunks_exact(axes).map(row).collect()
    };
    let mut wrenches = vec![("truth".to_owned(), table(split.clean(example)))];
    let mut rows = Vec::new();
    for (name, predict) in contenders {
        let mut sums = Accumulator::new(axes);
        for trajectory in 0..split.len() {
            let predicted = predict(split, trajectory)?;
            let predicted: Vec<Vec<f64>> =
                predicted.chunks_exact(axes).map(<[f64]>::to_vec).collect();
            let clean = table(split.clean(trajectory));
            let hydrostatic = table(split.hydrostatic(trajectory));
            for ((predicted, clean), hydrostatic) in predicted.iter().zip(&clean).zip(&hydrostatic)
            {
                sums.add(predicted, clean, hydrostatic);
            }
            if trajectory == example {
                wrenches.push((name.clone(), predicted));
            }
        }
        rows.push(sums.row(name));
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

/// Steps an engine along every trajectory, as the plugin would, on all cores: `[M][T * f]`.
pub fn predict_all(engine: &dyn Engine, split: &Split, start: Start) -> Vec<Vec<f64>> {
    (0..split.len())
        .into_par_iter()
        .map_init(Scratch::default, |scratch, trajectory| {
            predict(engine, split, trajectory, start, scratch)
        })
        .collect()
}

/// A contender whose trajectories were predicted before.
pub fn predicted<'a>(trajectories: Vec<Vec<f64>>) -> Box<Predict<'a, Infallible>> {
    Box::new(move |_, trajectory| Ok(trajectories[trajectory].clone()))
}

fn predict(
    engine: &dyn Engine,
    split: &Split,
    trajectory: usize,
    start: Start,
    scratch: &mut Scratch,
) -> Vec<f64> {
    let (inputs, outputs) = (engine.inputs(), engine.outputs());
    let x: Vec<f64> = split
        .x(trajectory)
        .iter()
        .map(|value| f64::from(*value))
        .collect();
    let mut window = x[..inputs].repeat(engine.window());
    let mut carried: Vec<f64> = match start {
        Start::True => split.clean(trajectory)[..outputs]
            .iter()
            .map(|v| f64::from(*v))
            .collect(),
        Start::Estimate => {
            let mut force = vec![0.0; outputs];
            engine.estimate(&x[..inputs], &mut force, scratch);
            force
        }
    };
    let (mut now, mut next) = (vec![0.0; outputs], vec![0.0; outputs]);
    let mut forces = Vec::with_capacity(split.samples() * outputs);
    for sample in x.chunks_exact(inputs) {
        window.copy_within(inputs.., 0);
        let newest = window.len() - inputs;
        window[newest..].copy_from_slice(sample);
        engine.sample(&window, &carried, &mut now, &mut next, scratch);
        forces.extend_from_slice(&now);
        carried.copy_from_slice(&next);
    }
    forces
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_definition() {
        let mut sums = Accumulator::new(1);
        // Clean 0, 2, 4: standard deviation sqrt(8/3). Hydrodynamic part 0, 1, 2: sqrt(2/3). Errors 1, -1, 2.
        for (predicted, clean, hydrostatic) in [(1.0, 0.0, 0.0), (1.0, 2.0, 1.0), (6.0, 4.0, 2.0)] {
            sums.add(&[predicted], &[clean], &[hydrostatic]);
        }
        let row = sums.row("model");
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-12, "{got} {want}");
        close(row.mae[0], 4.0 / 3.0);
        close(row.rmse[0], 2f64.sqrt());
        close(row.pooled, 2f64.sqrt() / (8f64 / 3.0).sqrt());
        close(row.pooled_hydrodynamic, 2f64.sqrt() / (2f64 / 3.0).sqrt());
    }
}
