//! Multilayer perceptron with SiLU and an optional linear part: in Candle, packed for products, and over many rows with
//! its derivative.

mod layer;
mod packed;
mod rows;
mod sizes;

pub(crate) use self::{
    layer::Perceptron,
    packed::PackedLayers,
    rows::{PerceptronRows, Tape, Work},
    sizes::PerceptronConfig,
};
