//! LSTM: layers of long short-term memory read the motion, a linear layer gives the force.
//!
//! ```text
//! h^1_k = layer_1(z_0 .. z_k),  h^2_k = layer_2(h^1_0 .. h^1_k), ..     F_k = W_o h_k + b_o + A z_k
//! ```
//!
//! The paper's recurrent baseline (2 layers of 256, without A). F_0 is not an input, and the state before the first sample
//! is zero. Since |h| < 1, without A the force is bounded: no drag then slows a robot that is faster than those of the
//! training data.

use candle_core::{Result, Tensor};
use candle_nn::{Init, VarBuilder};
use serde::{Deserialize, Serialize};

use crate::{
    encoding::Encoding,
    operations::{
        Backend,
        lstm_layer::{cell, recur},
    },
};

/// Sizes of an LSTM.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LstmConfig {
    /// Width of each layer.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// True if there is a linear part A; absent in a card means false.
    #[serde(default)]
    pub skip: bool,
}

impl Default for LstmConfig {
    fn default() -> Self {
        Self {
            hidden: vec![256; 2],
            encoding: Encoding::Up,
            skip: true,
        }
    }
}

impl LstmConfig {
    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        (self.hidden.is_empty() || self.hidden.contains(&0))
            .then(|| "an LSTM has at least one layer, and each a width of at least 1".to_owned())
    }
}

/// Weights of a layer; rows of the gates i, f, g, o in this order.
#[derive(Clone, Debug)]
pub(crate) struct Layer {
    /// W [4 H, inputs].
    pub(crate) input: Tensor,
    /// R [4 H, H].
    pub(crate) recurrent: Tensor,
    /// [4 H].
    pub(crate) bias: Tensor,
}

impl Layer {
    /// H.
    pub(crate) fn width(&self) -> usize {
        self.recurrent.dims()[1]
    }
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct Lstm {
    pub(crate) layers: Vec<Layer>,
    /// W_o [f, H], b_o [f].
    pub(crate) output: (Tensor, Tensor),
    /// A [f, n].
    pub(crate) skip: Option<Tensor>,
}

impl Lstm {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(config: &LstmConfig, inputs: usize, outputs: usize, vb: VarBuilder) -> Result<Self> {
        let mut layers = Vec::new();
        let mut depth = inputs;
        for (index, &width) in config.hidden.iter().enumerate() {
            let vb = vb.pp(format!("layer.{index}"));
            let up = 1.0 / (width as f64).sqrt();
            let uniform = Init::Uniform { lo: -up, up };
            layers.push(Layer {
                input: vb.get_with_hints((4 * width, depth), "input.weight", uniform)?,
                recurrent: vb.get_with_hints((4 * width, width), "recurrent.weight", uniform)?,
                bias: vb.get_with_hints(4 * width, "bias", uniform)?,
            });
            depth = width;
        }
        let up = 1.0 / (depth as f64).sqrt();
        let skip = if config.skip {
            let up = 0.1 / (inputs as f64).sqrt();
            let uniform = Init::Uniform { lo: -up, up };
            let vb = vb.pp("skip");
            Some(vb.get_with_hints((outputs, inputs), "weight", uniform)?)
        } else {
            None
        };
        let vb = vb.pp("output");
        let uniform = Init::Uniform { lo: -up, up };
        Ok(Self {
            layers,
            output: (
                vb.get_with_hints((outputs, depth), "weight", uniform)?,
                vb.get_with_hints(outputs, "bias", Init::Const(0.0))?,
            ),
            skip,
        })
    }

    /// z [B, T, n] -> F [B, T, f].
    pub fn forward(&self, z: &Tensor) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let operations = Backend::for_device(z.device());
        let mut x = z.clone();
        for layer in &self.layers {
            let rows = x.reshape((batch * samples, x.dim(2)?))?;
            let driven = rows
                .matmul(&layer.input.t()?)?
                .broadcast_add(&layer.bias)?
                .reshape((batch, samples, 4 * layer.width()))?;
            x = recur(operations, &driven, &layer.recurrent)?;
        }
        let rows = x.reshape((batch * samples, x.dim(2)?))?;
        self.read(&rows, &z.reshape((batch * samples, inputs))?)?
            .reshape((batch, samples, self.output.1.dim(0)?))
    }

    /// h [rows, H] of the last layer and the samples z [rows, n] -> F [rows, f].
    pub(crate) fn read(&self, h: &Tensor, z: &Tensor) -> Result<Tensor> {
        let force = h
            .matmul(&self.output.0.t()?)?
            .broadcast_add(&self.output.1)?;
        match &self.skip {
            Some(linear) => force + z.matmul(&linear.t()?)?,
            None => Ok(force),
        }
    }

    /// Length of the memory: h and c of every layer.
    pub(crate) fn memory_len(&self) -> usize {
        self.layers.iter().map(|layer| 2 * layer.width()).sum()
    }

    /// Takes one sample z [1, n] into the memory [h^1; c^1; h^2; ..] by Candle's own operations.
    pub(crate) fn observe(&self, z: &Tensor, memory: &mut [f64]) -> Result<()> {
        let mut x = z.clone();
        let mut rest = memory;
        for layer in &self.layers {
            let width = layer.width();
            let (own, tail) = rest.split_at_mut(2 * width);
            rest = tail;
            let state = Tensor::from_slice(own, (2, width), z.device())?.to_dtype(z.dtype())?;
            let (h, c) = (state.narrow(0, 0, 1)?, state.narrow(0, 1, 1)?);
            let gates = (x.matmul(&layer.input.t()?)? + h.matmul(&layer.recurrent.t()?)?)?
                .broadcast_add(&layer.bias)?;
            let (h, c) = cell(&gates, &c)?;
            let now = Tensor::cat(&[&h, &c], 0)?.to_dtype(candle_core::DType::F64)?;
            own.copy_from_slice(&now.flatten_all()?.to_vec1::<f64>()?);
            x = h;
        }
        Ok(())
    }
}
