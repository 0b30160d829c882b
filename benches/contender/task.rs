//! What the driver asks for.

use std::path::PathBuf;

use hydro_model::{Adjoint, AttentionOdeConfig, Solver};
use serde::Deserialize;

use crate::{
    block::Contender,
    engine::{OneSample, WholeTrajectories},
    error::Result,
    lesson::Lesson,
    ours::Ours,
    plain::PlainField,
    read::Read,
    trajectories::Trajectories,
    unrolled::Unrolled,
};

/// A contender and its files.
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
    /// Likewise, `batch` whole trajectories at once.
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
    /// Whole trajectories through the network that is trained, `batch` of a [`Lesson`]'s.
    Trajectories { lesson: LessonFiles, batch: usize },
    /// Training steps by our own operation and optimiser.
    Ours {
        lesson: LessonFiles,
        adjoint: Adjoint,
    },
    /// Training steps through Candle's own graph, unrolled.
    Unrolled { lesson: LessonFiles },
}

/// Where a [`Lesson`] lies.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LessonFiles {
    /// Tensors `z` [M, T, n], `target` [M, T, f] and `order` [steps, batch].
    pub(crate) data: PathBuf,
    /// First weights, named as in a checkpoint.
    pub(crate) weights: PathBuf,
    pub(crate) model: AttentionOdeConfig,
    pub(crate) solver: Solver,
    /// True: h is given ([`crate::lesson::Drive::Latents`]) and the field alone is trained.
    pub(crate) field_alone: bool,
    pub(crate) learning_rate: f64,
    pub(crate) weight_decay: f64,
    pub(crate) clip_norm: f64,
}

impl Task {
    /// Loads what the task needs.
    pub(crate) fn prepare(self) -> Result<Box<dyn Contender>> {
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
            Self::Trajectories { lesson, batch } => {
                Box::new(Trajectories::new(Lesson::load(lesson)?, batch))
            }
            Self::Ours { lesson, adjoint } => Box::new(Ours::new(Lesson::load(lesson)?, adjoint)),
            Self::Unrolled { lesson } => Box::new(Unrolled::new(Lesson::load(lesson)?)),
        })
    }
}
