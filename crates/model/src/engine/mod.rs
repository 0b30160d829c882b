//! Evaluators of a model for one sample at a time, as a simulation needs it: one engine for each architecture, and Candle's
//! own operations as the reference.

mod attention_cache;
mod batched;
mod build;
mod candle_engine;
mod cnode_engine;
mod feature_latent;
mod field_stepper;
mod instructions;
mod interface;
mod kind;
mod latent;
mod lstm_engine;
mod mlp_engine;
mod ode_engine;
mod packed_perceptron;
mod relaxation_engine;
mod sample_ring;
#[cfg(test)]
mod tests;
mod units;

pub use self::{
    interface::{BATCH_SIZE, Engine, SETTLING_STEPS, Scratch, one_by_one},
    kind::{EngineKind, UnknownEngine},
};
