//! A multilayer perceptron with SiLU and an optional linear part, in Candle.
//!
//! y = W_L s(... s(W_1 x + b_1) ...) + b_L + A x, s the SiLU, x [.., inputs] -> y [.., outputs].

use candle_core::{Device, Result, Tensor};
use candle_nn::{Init, VarBuilder};

use super::sizes::PerceptronConfig;

/// The perceptron in Candle.
#[derive(Clone, Debug)]
pub(crate) struct Perceptron {
    config: PerceptronConfig,
    /// Per layer, weight [outputs, inputs] and bias [outputs].
    layers: Vec<(Tensor, Tensor)>,
    /// The learned part of A [outputs, inputs].
    skip: Option<Tensor>,
}

impl Perceptron {
    /// Weights `0.weight`, `0.bias`, ... and `skip.weight`.
    pub(crate) fn new(config: PerceptronConfig, vb: VarBuilder) -> Result<Self> {
        let layers = config
            .layers()
            .iter()
            .enumerate()
            .map(|(index, (inputs, outputs))| {
                let vb = vb.pp(index);
                let bound = 1.0 / (*inputs as f64).sqrt();
                // The gain of He's rule keeps the signal alive through SiLU; the last layer starts small.
                let last = index == config.hidden.len();
                let up = bound * if last { 0.1 } else { 3f64.sqrt() };
                let weight = vb.get_with_hints(
                    (*outputs, *inputs),
                    "weight",
                    Init::Uniform { lo: -up, up },
                )?;
                let bias = vb.get_with_hints(*outputs, "bias", Init::Const(0.0))?;
                Ok((weight, bias))
            })
            .collect::<Result<_>>()?;
        let skip = if config.skip {
            let up = 0.1 / (config.inputs as f64).sqrt();
            let init = Init::Uniform { lo: -up, up };
            Some(
                vb.pp("skip")
                    .get_with_hints((config.outputs, config.inputs), "weight", init)?,
            )
        } else {
            None
        };
        Ok(Self {
            config,
            layers,
            skip,
        })
    }

    /// From the vector of [`Perceptron::flat`], as views of it.
    pub(crate) fn from_flat(config: &PerceptronConfig, flat: &Tensor) -> Result<Self> {
        let mut at = 0;
        let mut take = |count: usize| {
            let part = flat.narrow(0, at, count);
            at += count;
            part
        };
        let mut layers = Vec::new();
        for (inputs, outputs) in config.layers() {
            let weight = take(inputs * outputs)?.reshape((outputs, inputs))?;
            layers.push((weight, take(outputs)?));
        }
        let PerceptronConfig {
            inputs, outputs, ..
        } = *config;
        let skip = if config.skip {
            Some(take(inputs * outputs)?.reshape((outputs, inputs))?)
        } else {
            None
        };
        // The vector holds A with the -1 on its diagonal.
        let config = PerceptronConfig {
            relaxing: false,
            ..config.clone()
        };
        Ok(Self {
            config,
            layers,
            skip,
        })
    }

    /// Its sizes.
    pub(crate) fn config(&self) -> &PerceptronConfig {
        &self.config
    }

    /// Device of the weights.
    pub(crate) fn device(&self) -> &Device {
        self.layers[0].0.device()
    }

    /// Per layer, weight [outputs, inputs] and bias [outputs].
    pub(crate) fn layers(&self) -> &[(Tensor, Tensor)] {
        &self.layers
    }

    /// x [rows, inputs] -> y [rows, outputs].
    pub(crate) fn forward(&self, x: &Tensor) -> Result<Tensor> {
        let mut y = x.clone();
        for (index, (weight, bias)) in self.layers.iter().enumerate() {
            y = y.matmul(&weight.t()?)?.broadcast_add(bias)?;
            if index < self.config.hidden.len() {
                y = y.silu()?;
            }
        }
        match self.linear()? {
            Some(linear) => y + x.matmul(&linear.t()?)?,
            None => Ok(y),
        }
    }

    /// A [outputs, inputs].
    pub(crate) fn linear(&self) -> Result<Option<Tensor>> {
        let Some(learned) = &self.skip else {
            return Ok(None);
        };
        if !self.config.relaxing {
            return Ok(Some(learned.clone()));
        }
        let PerceptronConfig {
            inputs, outputs, ..
        } = self.config;
        let diagonal = (0..inputs * outputs).map(|i| {
            if i / inputs == i % inputs {
                -1.0f64
            } else {
                0.0
            }
        });
        let diagonal = Tensor::from_iter(diagonal, learned.device())?.reshape((outputs, inputs))?;
        Ok(Some((learned + diagonal.to_dtype(learned.dtype())?)?))
    }

    /// All weights in one vector, in the order that [`PackedLayers::new`] reads; gradients flow through it.
    pub(crate) fn flat(&self) -> Result<Tensor> {
        let mut parts = Vec::new();
        for (weight, bias) in &self.layers {
            parts.extend([weight.flatten_all()?, bias.clone()]);
        }
        if let Some(linear) = self.linear()? {
            parts.push(linear.flatten_all()?);
        }
        Tensor::cat(&parts, 0)
    }
}
