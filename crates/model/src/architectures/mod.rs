//! The models: what makes a force of encoded, standardised samples.

pub(crate) mod attention;
pub mod attention_config;
pub mod attention_ode;
pub(crate) mod bounds;
pub mod cnode;
mod config;
pub mod control_path;
pub(crate) mod feature_attention;
pub(crate) mod force_ode;
pub(crate) mod linear;
pub mod lstm;
pub mod mlp;
pub mod mlp_ode;
mod network;
pub mod relaxation_ode;
pub(crate) mod relaxing_memory;
pub(crate) mod sample_attention;
pub(crate) mod shapes;

pub use self::{
    attention_config::{AttentionOdeConfig, Tokens},
    attention_ode::AttentionOde,
    cnode::{Cnode, CnodeConfig},
    config::ModelConfig,
    control_path::Control,
    lstm::{Lstm, LstmConfig},
    mlp::{Mlp, MlpConfig},
    mlp_ode::{MlpOde, MlpOdeConfig},
    network::Network,
    relaxation_ode::{RelaxationOde, RelaxationOdeConfig},
    shapes::check_count,
};
