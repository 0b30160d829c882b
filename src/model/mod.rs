//! Force models: from recorded motion to the water's force.
//!
//! Time convention: samples k = 0, 1, 2, ... at the sample period. h_k sees x_{k-W+1} .. x_k, the start padded
//! with x_0; one explicit step takes F_k to F_{k+1} with h_k held. Between samples the force is the linear
//! interpolation of F_k and F_{k+1}, both known at t_k. A memoryless model is F_k = g(x_k), held.

pub mod attention;
pub mod attention_ode;
mod candle_engine;
pub mod encoding;
pub mod engine;
pub mod field;
mod fused;
mod kernel;
pub mod mlp;
pub mod normaliser;
mod operations;
pub mod parameters;
pub mod solver;
mod tensor_trajectory;
mod trajectory;

use candle_core::{Device, Tensor};
use candle_nn::VarBuilder;
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use self::{
    attention_ode::{AttentionOde, AttentionOdeConfig},
    encoding::{Encoder, Encoding},
    engine::{Engine, EngineKind, Scratch},
    mlp::{Mlp, MlpConfig},
    normaliser::Normaliser,
    parameters::Parameters,
    solver::Solver,
};
use crate::features::FeatureLayout;

/// Kind and sizes of a model, as they stand in a card: `"kind": "attention-ode", "config": {..}`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "config", rename_all = "kebab-case")]
pub enum ModelConfig {
    /// See [`attention_ode`].
    AttentionOde(AttentionOdeConfig),
    /// See [`mlp`].
    Mlp(MlpConfig),
}

impl ModelConfig {
    /// The kind's name.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::AttentionOde(_) => "attention-ode",
            Self::Mlp(_) => "mlp",
        }
    }

    /// How the attitude enters.
    pub fn encoding(&self) -> Encoding {
        match self {
            Self::AttentionOde(config) => config.encoding,
            Self::Mlp(config) => config.encoding,
        }
    }

    /// W, samples seen.
    pub fn window(&self) -> usize {
        match self {
            Self::AttentionOde(config) => config.window,
            Self::Mlp(_) => 1,
        }
    }

    /// Refuses sizes that cannot be built.
    pub fn check(&self) -> Result<(), ModelError> {
        let fault = match self {
            Self::AttentionOde(config) => config.fault(),
            Self::Mlp(config) => config.fault(),
        };
        fault.map_or(Ok(()), |reason| Err(ModelError::Config { reason }))
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
            ModelConfig::Mlp(config) => Self::Mlp(Mlp::new(config, inputs, outputs, vb)?),
        })
    }

    /// Where its weights are.
    pub fn device(&self) -> &Device {
        match self {
            Self::AttentionOde(ode) => ode.embed.0.device(),
            Self::Mlp(mlp) => mlp.field.layers()[0].0.device(),
        }
    }

    /// z [B, W-1+T, n] and F_0 [B, f] -> F [B, T, f]; an ODE's first force is F_0 itself.
    pub fn forward(
        &self,
        z: &Tensor,
        start: &Tensor,
        solver: Solver,
    ) -> candle_core::Result<Tensor> {
        match self {
            Self::AttentionOde(ode) => {
                // The last sample drives only what comes after the trajectory.
                let samples = z.dim(1)?;
                ode.forward(&z.narrow(1, 0, samples - 1)?.contiguous()?, start, solver)
            }
            Self::Mlp(mlp) => mlp.forward(z),
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
    /// How the ODE is stepped; a memoryless model ignores it.
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

    /// True where the force at a sample depends on the one before.
    pub fn has_memory(&self) -> bool {
        matches!(self.network, Network::AttentionOde(_))
    }

    /// The single-step evaluator.
    pub fn engine(&self, kind: EngineKind) -> Result<Box<dyn Engine>, ModelError> {
        Ok(match kind {
            EngineKind::Fused => Box::new(fused::FusedEngine::new(self)?),
            EngineKind::Candle => Box::new(candle_engine::CandleEngine(self.clone())),
        })
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
        let forces = match &self.network {
            // Without a step there is nothing to integrate.
            Network::AttentionOde(_) if samples == 1 => standard.unsqueeze(1)?,
            network => network.forward(&z, &standard, self.solver)?,
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

    fn layout() -> FeatureLayout {
        FeatureLayout::floating_base(&["a".into(), "b".into()]).expect("valid")
    }

    /// Realistic scales, so that SI and standardised units differ.
    fn normaliser(inputs: usize) -> Normaliser {
        Normaliser {
            input_mean: (0..inputs).map(|i| 0.1 * i as f64).collect(),
            input_std: (0..inputs).map(|i| 0.5 + 0.1 * i as f64).collect(),
            output_mean: vec![10.0, -5.0, 400.0, 0.0, 1.0, 2.0],
            output_std: vec![50.0, 40.0, 200.0, 10.0, 8.0, 6.0],
        }
    }

    fn configs() -> Vec<ModelConfig> {
        let ode = AttentionOdeConfig {
            window: 5,
            embedding: 16,
            latent: 10,
            hidden: vec![33, 64],
            ..AttentionOdeConfig::default()
        };
        let plain = AttentionOdeConfig {
            skip: false,
            encoding: Encoding::Raw,
            ..ode.clone()
        };
        let sum = AttentionOdeConfig {
            field_sees_force: false,
            ..ode.clone()
        };
        vec![
            ModelConfig::AttentionOde(ode),
            ModelConfig::AttentionOde(plain),
            ModelConfig::AttentionOde(sum),
            ModelConfig::Mlp(MlpConfig {
                hidden: vec![33, 64],
                ..MlpConfig::default()
            }),
        ]
    }

    fn model(config: &ModelConfig, solver: Solver) -> ForceModel {
        let inputs = Encoder::new(config.encoding(), &layout()).len();
        let build = |vb: VarBuilder| {
            ForceModel::new(config, &layout(), normaliser(inputs), solver, vb)
                .map_err(|error| candle_core::Error::Msg(error.to_string()))
        };
        Parameters::draw(5, build).expect("built").0
    }

    /// T samples of n features, smooth, without a generator.
    fn motion(samples: usize, n: usize) -> Vec<f64> {
        (0..samples * n)
            .map(|i| (0.1 * (i / n) as f64 + (i % n) as f64).sin())
            .collect()
    }

    /// Largest difference in standard deviations of the output.
    fn difference(a: &[f64], b: &[f64], std: &[f64]) -> f64 {
        a.iter()
            .zip(b)
            .zip(std)
            .map(|((a, b), std)| (a - b).abs() / std)
            .fold(0.0, f64::max)
    }

    #[test]
    fn engines_agree_with_each_other_and_with_whole_trajectories() {
        for config in configs() {
            for solver in Solver::ALL {
                let model = model(&config, solver);
                let (n, f, w, samples) = (model.inputs(), model.outputs(), model.window(), 30);
                let x = motion(samples, n);
                let start = [20.0, 0.0, 300.0, 1.0, -2.0, 3.0];
                let single: Vec<f32> = x.iter().map(|v| *v as f32).collect();
                let whole = model
                    .predict(
                        &Tensor::from_vec(single, (1, samples, n), &Device::Cpu)
                            .expect("shape fits"),
                        &Tensor::new(&[start.map(|v| v as f32)], &Device::Cpu).expect("shape fits"),
                    )
                    .and_then(|t| Ok(t.squeeze(0)?.to_vec2::<f32>()?))
                    .expect("predicted");
                let mut force = start.to_vec();
                let (fused, candle) = (
                    model.engine(EngineKind::Fused).expect("fused"),
                    model.engine(EngineKind::Candle).expect("candle"),
                );
                let mut scratch = Scratch::default();
                for (k, expected) in whole.iter().enumerate() {
                    let window: Vec<f64> = (0..w)
                        .flat_map(|i| x[(k + i).saturating_sub(w - 1) * n..][..n].to_vec())
                        .collect();
                    let (mut now, mut next) = (vec![0.0; f], vec![0.0; f]);
                    fused.sample(&window, &force, &mut now, &mut next, &mut scratch);
                    let (mut other_now, mut other_next) = (vec![0.0; f], vec![0.0; f]);
                    candle.sample(
                        &window,
                        &force,
                        &mut other_now,
                        &mut other_next,
                        &mut scratch,
                    );
                    let std = &model.normaliser.output_std;
                    assert!(
                        difference(&next, &other_next, std) < 1e-5,
                        "{config:?} {next:?} {other_next:?}"
                    );
                    assert!(difference(&now, &other_now, std) < 1e-5);
                    let expected: Vec<f64> = expected.iter().map(|v| f64::from(*v)).collect();
                    assert!(
                        difference(&now, &expected, std) < 2e-5,
                        "{config:?} sample {k}: {now:?} {expected:?}"
                    );
                    force = next;
                }
            }
        }
    }

    #[test]
    fn the_estimate_is_a_fixed_point_and_the_same_in_both_engines() {
        for config in configs() {
            let model = model(&config, Solver::Euler);
            let x = motion(1, model.inputs());
            let mut scratch = Scratch::default();
            let mut settle = |kind| {
                let mut force = vec![0.0; model.outputs()];
                model
                    .engine(kind)
                    .expect("an engine")
                    .estimate(&x, &mut force, &mut scratch);
                force
            };
            let (fused, candle) = (settle(EngineKind::Fused), settle(EngineKind::Candle));
            let std = &model.normaliser.output_std;
            // A running sum does not settle; its rounding grows over the 200 steps.
            assert!(
                difference(&fused, &candle, std) < 1e-3,
                "{fused:?} {candle:?}"
            );
            let sees_force =
                matches!(&config, ModelConfig::AttentionOde(c) if c.field_sees_force && c.skip);
            if sees_force {
                let (mut now, mut next) = (fused.clone(), fused.clone());
                let window = x.repeat(model.window());
                let engine = model.engine(EngineKind::Fused).expect("an engine");
                engine.sample(&window, &fused, &mut now, &mut next, &mut scratch);
                assert!(difference(&next, &fused, std) < 1e-4, "{next:?} {fused:?}");
            }
        }
    }

    #[test]
    fn extreme_and_zero_inputs_stay_finite() {
        for config in configs() {
            for kind in EngineKind::ALL {
                let model = model(&config, Solver::Rk4);
                let engine = model.engine(kind).expect("an engine");
                let (n, f, w) = (engine.inputs(), engine.outputs(), engine.window());
                for value in [0.0, 1e30, -1e300, f64::MAX, f64::INFINITY] {
                    for carried in [0.0, 1e9] {
                        let (mut now, mut next) = (vec![0.0; f], vec![0.0; f]);
                        let mut scratch = Scratch::default();
                        let mut window = vec![value; w * n];
                        // An attitude is a unit quaternion whatever the rest does.
                        for sample in window.chunks_exact_mut(n) {
                            sample[4..8].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
                        }
                        engine.sample(
                            &window,
                            &vec![carried; f],
                            &mut now,
                            &mut next,
                            &mut scratch,
                        );
                        assert!(
                            next.iter().all(|v| v.is_finite()),
                            "{kind} {value}: {next:?}"
                        );
                        engine.estimate(&window[..n], &mut next, &mut scratch);
                        assert!(
                            next.iter().all(|v| v.is_finite()),
                            "{kind} {value}: {next:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn sizes_that_do_not_go_together_are_refused() {
        let config = ModelConfig::AttentionOde(AttentionOdeConfig {
            embedding: 10,
            ..AttentionOdeConfig::default()
        });
        let error = config.check().expect_err("10 is not divisible by 4");
        assert_eq!(
            error.to_string(),
            "model configuration: embedding 10 is not divisible by 4 heads"
        );
        let model = model(&configs()[0], Solver::Euler);
        let x = Tensor::zeros((1, 3, 7), candle_core::DType::F32, &Device::Cpu).expect("zeros");
        let start = Tensor::zeros((1, 6), candle_core::DType::F32, &Device::Cpu).expect("zeros");
        let error = model.predict(&x, &start).expect_err("7 features");
        assert_eq!(
            error.to_string(),
            "x has shape [1, 3, 7], expected [batch, samples, 15]"
        );
    }
}
