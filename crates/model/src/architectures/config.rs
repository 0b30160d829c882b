//! Kind and sizes of a model.

use serde::{Deserialize, Serialize};

use super::{
    attention_config::AttentionOdeConfig,
    bounds,
    cnode::{self, CnodeConfig},
    control_path::Control,
    lstm::LstmConfig,
    mlp::MlpConfig,
    mlp_ode::MlpOdeConfig,
    relaxation_ode::RelaxationOdeConfig,
};
use crate::{encoding::Encoding, error::ModelError, features::FeatureLayout, solver::Solver};

/// Kind and sizes of a model, as they stand in a card: `"kind": "attention-ode", "config": {..}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "config", rename_all = "kebab-case")]
pub enum ModelConfig {
    /// See [`super::attention_ode`].
    AttentionOde(AttentionOdeConfig),
    /// See [`super::mlp_ode`].
    MlpOde(MlpOdeConfig),
    /// See [`super::relaxation_ode`].
    RelaxationOde(RelaxationOdeConfig),
    /// See [`super::cnode`].
    Cnode(CnodeConfig),
    /// See [`super::lstm`].
    Lstm(LstmConfig),
    /// See [`super::mlp`].
    Mlp(MlpConfig),
}

impl ModelConfig {
    /// Name of the kind, as in a card.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::AttentionOde(_) => "attention-ode",
            Self::MlpOde(_) => "mlp-ode",
            Self::RelaxationOde(_) => "relaxation-ode",
            Self::Cnode(_) => "cnode",
            Self::Lstm(_) => "lstm",
            Self::Mlp(_) => "mlp",
        }
    }

    /// Encoding of a sample.
    pub fn encoding(&self) -> &Encoding {
        match self {
            Self::AttentionOde(config) => &config.encoding,
            Self::MlpOde(config) => &config.encoding,
            Self::RelaxationOde(config) => &config.encoding,
            Self::Cnode(config) => &config.encoding,
            Self::Lstm(config) => &config.encoding,
            Self::Mlp(config) => &config.encoding,
        }
    }

    /// Samples seen, W, not counting the memory of a recurrent state.
    pub fn window(&self) -> usize {
        match self {
            Self::AttentionOde(config) => config.window,
            Self::RelaxationOde(config) => config.window,
            Self::Cnode(_) => 2,
            Self::MlpOde(_) | Self::Lstm(_) | Self::Mlp(_) => 1,
        }
    }

    /// True if the model steps the force at a sample to the next sample; false if it gives the force at the sample itself.
    pub fn predicts_next(&self) -> bool {
        match self {
            Self::AttentionOde(config) => !config.end_of_step,
            Self::MlpOde(_) => true,
            Self::RelaxationOde(_) | Self::Cnode(_) | Self::Lstm(_) | Self::Mlp(_) => false,
        }
    }

    /// True if a field is stepped from the force, sample by sample.
    pub fn steps_a_field(&self) -> bool {
        matches!(self, Self::AttentionOde(_) | Self::MlpOde(_))
    }

    /// True if predictions of whole trajectories use later samples, which a simulation does not have.
    pub fn needs_the_future(&self) -> bool {
        matches!(self, Self::Cnode(config) if config.control == Control::Natural)
    }

    /// False if training needs kernels that exist for the CPU alone.
    pub fn trains_on_any_device(&self) -> bool {
        !matches!(self, Self::Cnode(_) | Self::Lstm(_))
    }

    /// Refuses sizes that cannot be built.
    pub fn check(&self) -> Result<(), ModelError> {
        let fault = match self {
            Self::AttentionOde(config) => config.fault(),
            Self::MlpOde(config) => config.fault(),
            Self::RelaxationOde(config) => config.fault(),
            Self::Cnode(config) => config.fault(),
            Self::Lstm(config) => config.fault(),
            Self::Mlp(config) => config.fault(),
        };
        let fault = fault.or_else(|| self.too_large());
        fault.map_or(Ok(()), |reason| Err(ModelError::Config { reason }))
    }

    /// The first size beyond its bound.
    fn too_large(&self) -> Option<String> {
        let window = self.window();
        match self {
            Self::AttentionOde(config) => bounds::fault(
                window,
                &[
                    ("heads", config.heads),
                    ("embedding", config.embedding),
                    ("latent", config.latent),
                ],
                &[&config.hidden],
            ),
            Self::MlpOde(config) => bounds::fault(
                window,
                &[("latent", config.latent)],
                &[&config.latent_hidden, &config.hidden],
            ),
            Self::RelaxationOde(RelaxationOdeConfig { hidden, memory, .. }) => {
                bounds::fault(window, &[("memory", *memory)], &[hidden])
            }
            Self::Lstm(LstmConfig { hidden, .. }) | Self::Mlp(MlpConfig { hidden, .. }) => {
                bounds::fault(window, &[], &[hidden])
            }
            Self::Cnode(config) => bounds::fault(
                window,
                &[("hidden_state", config.hidden_state)],
                &[&config.hidden],
            ),
        }
    }

    /// Refuses features that the encoding cannot use.
    pub fn check_features(&self, layout: &FeatureLayout) -> Result<(), ModelError> {
        let fault = self.encoding().fault(layout).or_else(|| match self {
            Self::AttentionOde(config) => config.too_many_tokens(layout),
            _ => None,
        });
        fault.map_or(Ok(()), |reason| Err(ModelError::Config { reason }))
    }

    /// Refuses a solver that cannot step this model. A model without a differential equation accepts any.
    pub fn check_solver(&self, solver: Solver) -> Result<(), ModelError> {
        match self {
            Self::Cnode(_) => {
                cnode::stages(solver)
                    .map(|_| ())
                    .map_err(|error| ModelError::Config {
                        reason: error.to_string(),
                    })
            }
            _ => Ok(()),
        }
    }
}
