//! Errors of a model on recorded inputs: open loop, over whole trajectories, against the clean wrench.

mod attention;
mod errors;
mod evaluation;
mod initial_force;
mod prediction;
mod yardsticks;

pub(crate) use self::evaluation::evaluate_model;
pub use self::{
    attention::{Ablation, AttentionUse, attention_use, mean_attention},
    errors::{ErrorSums, Errors},
    evaluation::{Evaluation, evaluate},
    initial_force::{InitialForce, UnknownInitialForce},
    prediction::{predict, predict_by_engine, predict_by_network},
    yardsticks::Yardstick,
};
