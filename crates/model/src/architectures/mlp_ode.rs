//! MLP-ODE: the force follows a learned field, driven by a perceptron of the present sample alone.
//!
//! ```text
//! h_k = MLP(z_k),   dF/dt = field([F; h]) / Dt
//! ```
//!
//! The paper's plain neural ODE (section "Models", beside the Attention-ODE): the same equation without attention.

use candle_core::{Result, Tensor};
use candle_nn::VarBuilder;
use serde::{Deserialize, Serialize};

use super::force_ode::{ForceOde, ForceOdeConfig, Method};
use crate::{
    encoding::Encoding,
    operations::Backend,
    perceptron::{Perceptron, PerceptronConfig},
};

/// Sizes of an MLP-ODE.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MlpOdeConfig {
    /// Hidden layers of the perceptron that makes h.
    pub latent_hidden: Vec<usize>,
    /// Length of h; the paper's is the length of the force.
    pub latent: usize,
    /// Hidden layers of the field.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// True if the field reads F besides h.
    pub field_sees_force: bool,
    /// True if the field has a linear part A [F; h], initialised to -F plus small numbers.
    pub skip: bool,
}

impl Default for MlpOdeConfig {
    fn default() -> Self {
        Self {
            latent_hidden: vec![64],
            latent: 64,
            hidden: vec![512; 3],
            encoding: Encoding::Up,
            field_sees_force: true,
            skip: true,
        }
    }
}

impl MlpOdeConfig {
    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        (self.latent == 0 || self.hidden.contains(&0) || self.latent_hidden.contains(&0))
            .then(|| "latent and hidden sizes must be at least 1".to_owned())
    }
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct MlpOde {
    pub(crate) latent: Perceptron,
    pub(crate) ode: ForceOde,
}

impl MlpOde {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(
        config: &MlpOdeConfig,
        inputs: usize,
        outputs: usize,
        vb: VarBuilder,
    ) -> Result<Self> {
        let latent = PerceptronConfig {
            inputs,
            outputs: config.latent,
            hidden: config.latent_hidden.clone(),
            skip: config.skip,
            relaxing: false,
        };
        let ode = ForceOdeConfig {
            latent: config.latent,
            outputs,
            hidden: config.hidden.clone(),
            field_sees_force: config.field_sees_force,
            skip: config.skip,
        };
        Ok(Self {
            latent: Perceptron::new(latent, vb.pp("latent"))?,
            ode: ForceOde::new(ode, &vb)?,
        })
    }

    /// z [B, S, n], F_0 [B, f] -> F [B, S+1, f].
    pub(crate) fn forward(&self, z: &Tensor, start: &Tensor, method: Method) -> Result<Tensor> {
        let (batch, steps, inputs) = z.dims3()?;
        let rows = self.latent.forward(&z.reshape((batch * steps, inputs))?)?;
        let latents = rows.reshape((batch, steps, rows.dim(1)?))?;
        let operations = Backend::for_device(z.device());
        self.ode.integrate(operations, &latents, start, method)
    }
}
