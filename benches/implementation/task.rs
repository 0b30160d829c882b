//! Tasks of the driver.
//!
//! `training_case` and `ours` are the names that the driver writes.

use std::path::PathBuf;

use hydro_model::Adjoint;
use serde::Deserialize;

use crate::{
    bandwidth::Read,
    engine::{OneSample, WholeTrajectories},
    error::Result,
    implementation::Implementation,
    operation::Operation,
    plain_field::PlainField,
    training_case::{TrainingCase, TrainingFiles},
    trajectories::Trajectories,
    unrolled::Unrolled,
};

/// An implementation and its files.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub(crate) enum Task {
    /// A checkpoint stepped sample by sample by one of our engines over the rows of `inputs` (tensor `x`).
    Engine {
        checkpoint: PathBuf,
        inputs: PathBuf,
        engine: String,
        /// Numbers read between evaluations, to push the weights out of the caches; 0 for none.
        evict: usize,
    },
    /// The same, `batch` whole trajectories at once.
    WholeTrajectories {
        checkpoint: PathBuf,
        inputs: PathBuf,
        engine: String,
        batch: usize,
    },
    /// A perceptron with SiLU as a user of Candle writes it, from the weights of a checkpoint.
    PlainField {
        checkpoint: PathBuf,
        inputs: PathBuf,
    },
    /// Reading `bytes` once: no evaluation that reads its weights can be faster.
    Read { bytes: usize },
    /// Whole trajectories through the network that is trained, `batch` of a [`TrainingCase`]'s.
    Trajectories {
        #[serde(rename = "training_case")]
        case: TrainingFiles,
        batch: usize,
    },
    /// Training steps by our own operation and optimiser.
    #[serde(rename = "ours")]
    Operation {
        #[serde(rename = "training_case")]
        case: TrainingFiles,
        adjoint: Adjoint,
    },
    /// Training steps through Candle's own graph, unrolled.
    Unrolled {
        #[serde(rename = "training_case")]
        case: TrainingFiles,
    },
}

impl Task {
    /// Loads what the task needs.
    pub(crate) fn prepare(self) -> Result<Box<dyn Implementation>> {
        Ok(match self {
            Self::Engine {
                checkpoint,
                inputs,
                engine,
                evict,
            } => Box::new(OneSample::new(&checkpoint, &inputs, &engine, evict)?),
            Self::WholeTrajectories {
                checkpoint,
                inputs,
                engine,
                batch,
            } => Box::new(WholeTrajectories::new(
                &checkpoint,
                &inputs,
                &engine,
                batch,
            )?),
            Self::PlainField { checkpoint, inputs } => {
                Box::new(PlainField::new(&checkpoint, &inputs)?)
            }
            Self::Read { bytes } => Box::new(Read::new(bytes)),
            Self::Trajectories { case, batch } => {
                Box::new(Trajectories::new(TrainingCase::load(case)?, batch))
            }
            Self::Operation { case, adjoint } => {
                Box::new(Operation::new(TrainingCase::load(case)?, adjoint))
            }
            Self::Unrolled { case } => Box::new(Unrolled::new(TrainingCase::load(case)?)),
        })
    }
}
