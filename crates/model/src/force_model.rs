//! A network with its encoding and its units: from features in SI to forces in SI.

use candle_core::{Device, Tensor};
use candle_nn::VarBuilder;

use crate::{
    architectures::{ModelConfig, Network},
    encoding::Encoder,
    error::ModelError,
    features::FeatureLayout,
    normaliser::Normaliser,
    solver::Solver,
};

/// A network with the encoding and the scaling between it and SI units.
#[derive(Clone, Debug)]
pub struct ForceModel {
    /// Features to encoded inputs.
    pub encoder: Encoder,
    /// Encoded inputs and forces to standard deviations, and back.
    pub normaliser: Normaliser,
    /// Architecture and weights.
    pub network: Network,
    /// Method that steps the differential equation; ignored by a model that has none or whose step is exact.
    pub solver: Solver,
    /// Kind and sizes that the network was built from.
    pub config: ModelConfig,
}

impl ForceModel {
    /// Checks that kind, features, normaliser and solver fit together, and builds the network from the weights of `vb`.
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

    /// Features a sample.
    pub fn inputs(&self) -> usize {
        self.encoder.inputs()
    }

    /// Force components, f.
    pub fn outputs(&self) -> usize {
        self.normaliser.output_mean.len()
    }

    /// Samples seen, W.
    pub fn window(&self) -> usize {
        self.config.window()
    }

    /// See [`ModelConfig::predicts_next`].
    pub fn predicts_next(&self) -> bool {
        self.config.predicts_next()
    }

    /// Whole trajectories: features x [B, T, n] and first forces F_0 [B, f] -> F [B, T, f], all SI.
    ///
    /// The window before the first sample is filled with that sample; an ODE's first force is F_0. The computation runs
    /// on the device of the weights; the result is on the CPU.
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
        let forces = if self.config.steps_a_field() && samples == 1 {
            // One sample has no step to integrate.
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

    /// Appends the encoded, standardised samples of `trajectory` (T * n features, SI) to `z`, the first sample `padding`
    /// more times.
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
