//! The memoryless baseline: F_k = g(x_k), a perceptron, held until the next sample.

use candle_core::{Result, Tensor};
use candle_nn::VarBuilder;
use serde::{Deserialize, Serialize};

use crate::{
    encoding::Encoding,
    perceptron::{Perceptron, PerceptronConfig},
};

/// Sizes of the perceptron.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MlpConfig {
    /// Hidden layers.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// True if there is a linear part.
    pub skip: bool,
}

impl Default for MlpConfig {
    fn default() -> Self {
        Self {
            hidden: vec![512; 3],
            encoding: Encoding::Up,
            skip: true,
        }
    }
}

impl MlpConfig {
    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        self.hidden
            .contains(&0)
            .then(|| "hidden sizes must be at least 1".to_owned())
    }
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct Mlp {
    pub(crate) field: Perceptron,
}

impl Mlp {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(config: &MlpConfig, inputs: usize, outputs: usize, vb: VarBuilder) -> Result<Self> {
        let field = PerceptronConfig {
            inputs,
            outputs,
            hidden: config.hidden.clone(),
            skip: config.skip,
            relaxing: false,
        };
        Ok(Self {
            field: Perceptron::new(field, vb.pp("field"))?,
        })
    }

    /// z [B, T, n] -> F [B, T, f].
    pub fn forward(&self, z: &Tensor) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let forces = self.field.forward(&z.reshape((batch * samples, inputs))?)?;
        forces.reshape((batch, samples, self.field.config().outputs))
    }
}
