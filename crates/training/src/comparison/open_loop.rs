//! Open loop: wrenches predicted from recorded features, beside the true ones.

use std::convert::Infallible;

use serde::{Deserialize, Serialize};

use crate::{
    dataset::Split,
    metrics::{ErrorSums, Errors},
};

/// Predicts the wrench along a trajectory of a split: `[T, f]`, row after row.
pub type Predict<'a, E> = dyn Fn(&Split, usize) -> Result<Vec<f64>, E> + 'a;

/// Errors of one method on a test split, against the clean wrench.
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
    /// Number of test trajectories.
    pub trajectories: usize,
    /// One row a method.
    pub rows: Vec<OpenLoopRow>,
    /// One trajectory in full.
    pub example: Example,
}

/// Runs methods over a split; `example` is the trajectory that is kept in full. `tick` is called
/// after each method.
///
/// # Errors
/// Whatever a method returns.
pub fn open_loop<E>(
    methods: &[(String, Box<Predict<'_, E>>)],
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
    for (name, predict) in methods {
        let mut sums = ErrorSums::new(axes);
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

/// A method whose trajectories were predicted before.
pub fn precomputed<'a>(trajectories: Vec<Vec<f64>>) -> Box<Predict<'a, Infallible>> {
    Box::new(move |_, trajectory| Ok(trajectories[trajectory].clone()))
}
