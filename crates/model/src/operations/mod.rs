//! Differentiable operations on whole trajectories, added to Candle's.
//!
//! Unrolled into Candle's graph, the time loop of a trajectory of 400 samples would be sorted recursively and overflow the
//! stack. Each loop is therefore one custom operation with a backward pass of its own, for the CPU; most have a second
//! implementation in tensor operations for other devices ([`Backend`]).

pub(crate) mod activation_cache;
pub(crate) mod adaptive_trajectory;
pub(crate) mod attention;
mod backend;
pub(crate) mod controlled_trajectory;
mod custom_operation;
pub(crate) mod lstm_layer;
pub(crate) mod relaxation_op;
mod softmax;
pub(crate) mod tensor_trajectory;
pub(crate) mod token_weights;
pub(crate) mod trajectory;

pub(crate) use self::backend::Backend;
