//! The network of a model, whichever its kind.

use candle_core::{Device, Tensor};
use candle_nn::VarBuilder;

use super::{
    attention_ode::AttentionOde, cnode::Cnode, config::ModelConfig, force_ode::Method, lstm::Lstm,
    mlp::Mlp, mlp_ode::MlpOde, relaxation_ode::RelaxationOde,
};
use crate::{adjoint::Adjoint, solver::Solver};

/// The network of a model, in standardised units.
#[derive(Clone, Debug)]
pub enum Network {
    /// See [`super::attention_ode`].
    AttentionOde(AttentionOde),
    /// See [`super::mlp_ode`].
    MlpOde(MlpOde),
    /// See [`super::relaxation_ode`].
    RelaxationOde(RelaxationOde),
    /// See [`super::cnode`].
    Cnode(Cnode),
    /// See [`super::lstm`].
    Lstm(Lstm),
    /// See [`super::mlp`].
    Mlp(Mlp),
}

impl Network {
    /// A network for `inputs` encoded numbers a sample and `outputs` force components; used in training and in loading.
    pub fn new(
        config: &ModelConfig,
        inputs: usize,
        outputs: usize,
        vb: VarBuilder,
    ) -> candle_core::Result<Self> {
        Ok(match config {
            ModelConfig::AttentionOde(config) => {
                Self::AttentionOde(AttentionOde::new(config, inputs, outputs, vb)?)
            }
            ModelConfig::MlpOde(config) => Self::MlpOde(MlpOde::new(config, inputs, outputs, vb)?),
            ModelConfig::RelaxationOde(config) => {
                Self::RelaxationOde(RelaxationOde::new(config, inputs, outputs, vb)?)
            }
            ModelConfig::Cnode(config) => Self::Cnode(Cnode::new(config, inputs, outputs, vb)?),
            ModelConfig::Lstm(config) => Self::Lstm(Lstm::new(config, inputs, outputs, vb)?),
            ModelConfig::Mlp(config) => Self::Mlp(Mlp::new(config, inputs, outputs, vb)?),
        })
    }

    /// Device of the weights.
    pub fn device(&self) -> &Device {
        match self {
            Self::AttentionOde(network) => network.ode.field.device(),
            Self::MlpOde(network) => network.ode.field.device(),
            Self::RelaxationOde(network) => network.field.device(),
            Self::Cnode(network) => network.field.device(),
            Self::Lstm(network) => network.output.0.device(),
            Self::Mlp(network) => network.field.device(),
        }
    }

    /// z [B, W-1+T, n] and F_0 [B, f] -> F [B, T, f]; an ODE's first force is F_0 itself.
    pub fn forward(
        &self,
        z: &Tensor,
        start: &Tensor,
        solver: Solver,
    ) -> candle_core::Result<Tensor> {
        let method = Method {
            solver,
            adjoint: Adjoint::Discrete,
            derived: false,
        };
        self.run(z, start, method)
    }

    /// [`Network::forward`] for training, with a choice of the gradient. Models that do not predict the next force ignore
    /// the choice: their gradient is that of the steps as taken.
    pub fn forward_with(
        &self,
        z: &Tensor,
        start: &Tensor,
        solver: Solver,
        adjoint: Adjoint,
    ) -> candle_core::Result<Tensor> {
        let method = Method {
            solver,
            adjoint,
            derived: true,
        };
        self.run(z, start, method)
    }

    /// Mean square error of the estimated first force, an additional training loss; `None` for a model whose estimate
    /// ([`crate::Engine::estimate`]) has no weights of its own.
    pub fn estimate_loss(&self, z: &Tensor, start: &Tensor) -> candle_core::Result<Option<Tensor>> {
        match self {
            Self::Cnode(network) => network.estimate_loss(z, start).map(Some),
            _ => Ok(None),
        }
    }

    fn run(&self, z: &Tensor, start: &Tensor, method: Method) -> candle_core::Result<Tensor> {
        // The last sample drives only the step beyond the end of the trajectory.
        let seen = || z.narrow(1, 0, z.dim(1)? - 1)?.contiguous();
        match self {
            Self::AttentionOde(network) => network.run(&network.driving(z)?, start, method),
            Self::MlpOde(network) => network.forward(&seen()?, start, method),
            Self::RelaxationOde(network) => network.forward(z, start),
            Self::Cnode(network) => network.forward(z, start, method.solver),
            Self::Lstm(network) => network.forward(z),
            Self::Mlp(network) => network.forward(z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::architectures::{AttentionOdeConfig, CnodeConfig, LstmConfig, MlpOdeConfig};
    use crate::{encoding::Encoding, parameters::Parameters};

    /// 35 features as they are, 6 force components; the paper's hidden layers, heads and widths.
    #[test]
    fn the_papers_sizes_have_its_parameter_counts_within_five_per_cent() {
        let raw = Encoding::Raw;
        let models = [
            (
                ModelConfig::MlpOde(MlpOdeConfig {
                    latent: 6,
                    encoding: raw.clone(),
                    skip: false,
                    ..MlpOdeConfig::default()
                }),
                530_628,
            ),
            (
                ModelConfig::AttentionOde(AttentionOdeConfig {
                    latent: 6,
                    encoding: raw.clone(),
                    skip: false,
                    ..AttentionOdeConfig::default()
                }),
                554_934,
            ),
            (
                ModelConfig::Cnode(CnodeConfig {
                    encoding: raw.clone(),
                    ..CnodeConfig::default()
                }),
                636_626,
            ),
            (
                ModelConfig::Lstm(LstmConfig {
                    encoding: raw.clone(),
                    skip: false,
                    ..LstmConfig::default()
                }),
                828_422,
            ),
        ];
        for (config, paper) in models {
            let build = |vb: VarBuilder| Network::new(&config, 35, 6, vb);
            let (_, parameters) = Parameters::draw(0, build).expect("drawn");
            let share = parameters.count() as f64 / f64::from(paper);
            assert!(
                (share - 1.0).abs() < 0.05,
                "{}: {} parameters, the paper has {paper}",
                config.kind(),
                parameters.count()
            );
        }
    }
}
