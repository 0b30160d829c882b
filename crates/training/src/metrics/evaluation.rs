//! Open-loop errors of a model on recorded inputs, over whole trajectories, against the clean wrench.

use hydro_model::{ForceModel, checkpoint::Checkpoint};
use serde::{Deserialize, Serialize};

use super::{
    errors::{ErrorSums, Errors},
    initial_force::InitialForce,
    prediction::predict_by_network,
};
use crate::{TrainError, dataset::Split};

/// Errors over a split. The first sample of a trajectory is given to the model and does not count.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Names of the axes.
    pub outputs: Vec<String>,
    /// The force at the start.
    pub start: InitialForce,
    /// Number of trajectories.
    pub trajectories: usize,
    /// The errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Evaluates a checkpoint on a split.
///
/// ```no_run
/// use hydro_model::checkpoint::Checkpoint;
/// use hydro_training::{InitialForce, dataset::Dataset, evaluate};
///
/// let checkpoint = Checkpoint::load("models/b1-task2".as_ref())?;
/// let test = Dataset::open("data/task2".as_ref())?.split("test", None)?;
/// let evaluation = evaluate(&checkpoint, &test, InitialForce::Recorded)?;
/// println!("pooled normalised RMSE {:.3}", evaluation.errors.pooled);
/// # Ok::<(), hydro_training::TrainError>(())
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

/// [`evaluate`] without a card.
pub(crate) fn evaluate_model(
    model: &ForceModel,
    outputs: &[String],
    split: &Split,
    start: InitialForce,
) -> Result<Evaluation, TrainError> {
    let mut sums = ErrorSums::new(split.outputs());
    for (trajectory, predicted) in predict_by_network(model, split, start)?.iter().enumerate() {
        sums.add_trajectory(predicted, split, trajectory);
    }
    Ok(Evaluation {
        outputs: outputs.to_vec(),
        start,
        trajectories: split.len(),
        errors: sums.errors(),
    })
}
