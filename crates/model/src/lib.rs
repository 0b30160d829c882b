//! Force models: from recorded motion to the water's force.
//!
//! Time convention: samples k = 0, 1, 2, ... at the sample period. h_k sees x_{k-W+1} .. x_k, the start padded
//! with x_0; F_k is stepped to F_{k+1} with h_k held. Between samples the force is the linear
//! interpolation of F_k and F_{k+1}, both known at t_k. The other models give F_k of the motion up to x_k, and hold
//! it: memoryless F_k = g(x_k), the LSTM, the CNODE, and the Relaxation-ODE, whose steps end at sample k.

mod adaptive;
mod adaptive_trajectory;
pub mod adjoint;
pub mod attention;
pub mod attention_ode;
pub mod checkpoint;
pub mod cnode;
pub mod control;
mod controlled;
pub mod document;
pub mod encoding;
pub mod engine;
pub mod envelope;
pub mod features;
pub mod field;
mod field_rows;
mod force_ode;
mod kept;
mod kernel;
pub mod kinematics;
pub mod lstm;
mod lstm_layer;
pub mod mlp;
pub mod mlp_ode;
pub mod normaliser;
mod operations;
pub mod parameters;
mod relaxation;
pub mod relaxation_ode;
pub mod robot;
pub mod solver;
mod tensor_trajectory;
#[cfg(test)]
mod testing;
mod trajectory;
mod typed;

use candle_core::{Device, Tensor};
use candle_nn::VarBuilder;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use self::force_ode::Method;
pub use self::{
    adjoint::Adjoint,
    attention_ode::{AttentionOde, AttentionOdeConfig},
    cnode::{Cnode, CnodeConfig},
    control::Control,
    encoding::{Encoder, Encoding},
    engine::{Engine, EngineKind, Scratch, TOGETHER, one_by_one},
    lstm::{Lstm, LstmConfig},
    mlp::{Mlp, MlpConfig},
    mlp_ode::{MlpOde, MlpOdeConfig},
    normaliser::Normaliser,
    parameters::Parameters,
    relaxation_ode::{RelaxationOde, RelaxationOdeConfig},
    solver::Solver,
};
use crate::features::FeatureLayout;

/// Kind and sizes of a model, as they stand in a card: `"kind": "attention-ode", "config": {..}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "config", rename_all = "kebab-case")]
pub enum ModelConfig {
    /// See [`attention_ode`].
    AttentionOde(AttentionOdeConfig),
    /// See [`mlp_ode`].
    MlpOde(MlpOdeConfig),
    /// See [`relaxation_ode`].
    RelaxationOde(RelaxationOdeConfig),
    /// See [`cnode`].
    Cnode(CnodeConfig),
    /// See [`lstm`].
    Lstm(LstmConfig),
    /// See [`mlp`].
    Mlp(MlpConfig),
}

impl ModelConfig {
    /// The kind's name.
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

    /// How a sample enters.
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

    /// W, samples seen beside what the model remembers itself.
    pub fn window(&self) -> usize {
        match self {
            Self::AttentionOde(config) => config.window,
            Self::RelaxationOde(config) => config.window,
            Self::Cnode(_) => 2,
            Self::MlpOde(_) | Self::Lstm(_) | Self::Mlp(_) => 1,
        }
    }

    /// True where the force at a sample is stepped to the next one by what is known at the former; false where the
    /// model gives the force at the sample itself.
    pub fn predicts_next(&self) -> bool {
        match self {
            Self::AttentionOde(_) | Self::MlpOde(_) => true,
            Self::RelaxationOde(_) | Self::Cnode(_) | Self::Lstm(_) | Self::Mlp(_) => false,
        }
    }

    /// True where whole trajectories are predicted with samples to come, which a simulation does not have.
    pub fn needs_the_future(&self) -> bool {
        matches!(self, Self::Cnode(config) if config.control == Control::Natural)
    }

    /// False where the time loop runs through kernels for the CPU alone.
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
        fault.map_or(Ok(()), |reason| Err(ModelError::Config { reason }))
    }

    /// Refuses features from which a sample cannot be encoded.
    pub fn check_features(&self, layout: &FeatureLayout) -> Result<(), ModelError> {
        let fault = self.encoding().fault(layout);
        fault.map_or(Ok(()), |reason| Err(ModelError::Config { reason }))
    }

    /// Refuses a solver that cannot step this model; one that needs none takes any.
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

/// Why a model could not be built or run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Sizes that do not go together.
    #[error("model configuration: {reason}")]
    Config {
        /// What is wrong.
        reason: String,
    },
    /// A tensor of another shape than the model's.
    #[error("{what} has shape {found:?}, expected {expected}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Its shape.
        found: Vec<usize>,
        /// What the model takes.
        expected: String,
    },
    /// The tensor library's own refusal.
    #[error("tensor operation: {0}")]
    Tensor(String),
}

impl From<candle_core::Error> for ModelError {
    fn from(error: candle_core::Error) -> Self {
        Self::Tensor(error.to_string())
    }
}

/// The network of a model, in standardised units.
#[derive(Clone, Debug)]
pub enum Network {
    /// See [`attention_ode`].
    AttentionOde(AttentionOde),
    /// See [`mlp_ode`].
    MlpOde(MlpOde),
    /// See [`relaxation_ode`].
    RelaxationOde(RelaxationOde),
    /// See [`cnode`].
    Cnode(Cnode),
    /// See [`lstm`].
    Lstm(Lstm),
    /// See [`mlp`].
    Mlp(Mlp),
}

impl Network {
    /// For `inputs` encoded numbers a sample and `outputs` force components; training and loading build alike.
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

    /// Where its weights are.
    pub fn device(&self) -> &Device {
        match self {
            Self::AttentionOde(network) => network.embed.0.device(),
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

    /// [`Network::forward`] for training, with a choice of the gradient; a model that does not predict the next force
    /// has one alone, that of its steps as they are taken.
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

    /// Mean square error of the first force as the model estimates it, to be learned beside the trajectory; None of a
    /// model whose estimate is what it settles to, or gives.
    pub fn estimate_loss(&self, z: &Tensor, start: &Tensor) -> candle_core::Result<Option<Tensor>> {
        match self {
            Self::Cnode(network) => network.estimate_loss(z, start).map(Some),
            _ => Ok(None),
        }
    }

    fn run(&self, z: &Tensor, start: &Tensor, method: Method) -> candle_core::Result<Tensor> {
        // The last sample drives only what comes after the trajectory.
        let seen = || z.narrow(1, 0, z.dim(1)? - 1)?.contiguous();
        match self {
            Self::AttentionOde(network) => network.run(&seen()?, start, method),
            Self::MlpOde(network) => network.forward(&seen()?, start, method),
            Self::RelaxationOde(network) => network.forward(z, start),
            Self::Cnode(network) => network.forward(z, start, method.solver),
            Self::Lstm(network) => network.forward(z),
            Self::Mlp(network) => network.forward(z),
        }
    }
}

/// A network with all that stands between it and SI units.
#[derive(Clone, Debug)]
pub struct ForceModel {
    /// Features to inputs.
    pub encoder: Encoder,
    /// Inputs and forces to standard deviations.
    pub normaliser: Normaliser,
    /// The weights.
    pub network: Network,
    /// How the differential equation is stepped; a model without one, or whose step is exact, ignores it.
    pub solver: Solver,
    /// What it was built from.
    pub config: ModelConfig,
}

impl ForceModel {
    /// From a layout, sizes and weights.
    pub fn new(
        config: &ModelConfig,
        layout: &FeatureLayout,
        normaliser: Normaliser,
        solver: Solver,
        vb: VarBuilder,
    ) -> Result<Self, ModelError> {
        config.check()?;
        config.check_solver(solver)?;
        config.check_features(layout)?;
        let encoder = Encoder::new(config.encoding(), layout);
        let outputs = normaliser.output_mean.len();
        if let Some(reason) = normaliser.fault(encoder.len(), outputs) {
            return Err(ModelError::Config { reason });
        }
        Ok(Self {
            network: Network::new(config, encoder.len(), outputs, vb)?,
            encoder,
            normaliser,
            solver,
            config: config.clone(),
        })
    }

    /// n, features a sample.
    pub fn inputs(&self) -> usize {
        self.encoder.inputs()
    }

    /// f, force components.
    pub fn outputs(&self) -> usize {
        self.normaliser.output_mean.len()
    }

    /// W, samples seen.
    pub fn window(&self) -> usize {
        self.config.window()
    }

    /// See [`ModelConfig::predicts_next`].
    pub fn predicts_next(&self) -> bool {
        self.config.predicts_next()
    }

    /// The single-step evaluator.
    pub fn engine(&self, kind: EngineKind) -> Result<Box<dyn Engine>, ModelError> {
        engine::build(self, kind)
    }

    /// Whole trajectories: x [B, T, n] raw features and F_0 [B, f] -> F [B, T, f], all SI.
    /// The window is padded with the first sample; an ODE's first force is F_0. Computed where the weights are;
    /// the result is on the CPU.
    pub fn predict(&self, x: &Tensor, start: &Tensor) -> Result<Tensor, ModelError> {
        let (n, f) = (self.inputs(), self.outputs());
        let shape = |what, tensor: &Tensor, expected: String| ModelError::Shape {
            what,
            found: tensor.dims().to_vec(),
            expected,
        };
        let (batch, samples) = match x.dims() {
            [batch, samples, inputs] if *inputs == n && *samples > 0 => (*batch, *samples),
            _ => return Err(shape("x", x, format!("[batch, samples, {n}]"))),
        };
        if start.dims() != [batch, f] {
            return Err(shape("the initial force", start, format!("[{batch}, {f}]")));
        }
        let raw = x.flatten_all()?.to_vec1::<f32>()?;
        let begin = start.flatten_all()?.to_vec1::<f32>()?;
        let standard: Vec<f32> = begin
            .iter()
            .enumerate()
            .map(|(i, value)| self.normaliser.force(i % f, f64::from(*value)))
            .collect();
        let padding = self.window() - 1;
        let mut z = Vec::with_capacity(batch * (padding + samples) * self.encoder.len());
        for trajectory in raw.chunks_exact(samples * n) {
            self.encode_padded(trajectory, padding, &mut z);
        }
        let z = Tensor::from_vec(
            z,
            (batch, padding + samples, self.encoder.len()),
            self.network.device(),
        )?;
        let standard = Tensor::from_vec(standard, (batch, f), self.network.device())?;
        let forces = if self.predicts_next() && samples == 1 {
            // Without a step there is nothing to integrate.
            standard.unsqueeze(1)?
        } else {
            self.network.forward(&z, &standard, self.solver)?
        };
        let values: Vec<f32> = forces
            .flatten_all()?
            .to_vec1::<f32>()?
            .into_iter()
            .enumerate()
            .map(|(i, value)| self.normaliser.to_si(i % f, value) as f32)
            .collect();
        Ok(Tensor::from_vec(values, (batch, samples, f), &Device::Cpu)?)
    }

    /// Appends the standardised samples of `trajectory` (T * n raw features) to `z`, the first `padding` times more.
    pub fn encode_padded(&self, trajectory: &[f32], padding: usize, z: &mut Vec<f32>) {
        let mut x = vec![0.0f64; self.inputs()];
        for (index, row) in trajectory.chunks_exact(self.inputs()).enumerate() {
            for (slot, value) in x.iter_mut().zip(row) {
                *slot = f64::from(*value);
            }
            for _ in 0..if index == 0 { padding + 1 } else { 1 } {
                let at = z.len();
                z.resize(at + self.encoder.len(), 0.0);
                self.encoder
                    .encode(&x, |i, value| z[at + i] = self.normaliser.input(i, value));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
