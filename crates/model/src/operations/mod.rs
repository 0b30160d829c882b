//! Differentiable operations of this crate, beside Candle's own.

pub(crate) mod activation_cache;
pub(crate) mod adaptive_trajectory;
pub(crate) mod attention;
mod backend;
pub(crate) mod controlled_trajectory;
mod custom_operation;
pub(crate) mod lstm_layer;
pub(crate) mod relaxation_op;
pub(crate) mod tensor_trajectory;
pub(crate) mod trajectory;

pub(crate) use self::backend::Backend;
