//! The Attention-ODE in Candle's own operations alone, as a user of Candle writes it.

use candle_core::{D, Tensor};
use candle_nn::{Linear, Module as _, ops::softmax};
use hydro_model::{AttentionOdeConfig, Parameters, Solver};

use crate::error::Result;

/// Layers that share the variables of the parameters.
pub(crate) struct PlainModel {
    config: AttentionOdeConfig,
    embed: Linear,
    qkv: Linear,
    lag_bias: Tensor,
    mix: Linear,
    latent: Linear,
    field: Vec<Linear>,
}

impl PlainModel {
    pub(crate) fn new(config: &AttentionOdeConfig, parameters: &Parameters) -> Result<Self> {
        if config.skip || !config.field_sees_force {
            return Err("the plain model has no linear part and sees the force".into());
        }
        let named = |name: &str| {
            parameters
                .iter()
                .find(|(known, _)| *known == name)
                .map(|(_, var)| var.as_tensor().clone())
                .ok_or_else(|| format!("no weight `{name}`"))
        };
        let linear = |name: &str| -> Result<Linear> {
            let bias = named(&format!("{name}.bias"))?;
            Ok(Linear::new(named(&format!("{name}.weight"))?, Some(bias)))
        };
        Ok(Self {
            embed: linear("embed")?,
            qkv: linear("attention.qkv")?,
            lag_bias: named("attention.lag_bias")?,
            mix: linear("mix")?,
            latent: linear("latent")?,
            field: (0..=config.hidden.len())
                .map(|index| linear(&format!("field.{index}")))
                .collect::<Result<_>>()?,
            config: config.clone(),
        })
    }

    /// z [B, W-1+S, n] -> h [B, S, l].
    pub(crate) fn latents(&self, z: &Tensor) -> Result<Tensor> {
        let AttentionOdeConfig {
            window,
            heads,
            embedding,
            ..
        } = self.config;
        let (batch, samples, _) = z.dims3()?;
        let (steps, depth) = (samples + 1 - window, embedding / heads);
        let embeddings = self.embed.forward(z)?;
        let qkv = self.qkv.forward(&embeddings)?;
        // Part 0 q, 1 k, 2 v, ending `lag` samples ago: [B, S, H, d].
        let part = |index: usize, lag: usize| -> Result<Tensor> {
            let part = qkv.narrow(2, index * embedding, embedding)?;
            let part = part.narrow(1, window - 1 - lag, steps)?;
            Ok(part.reshape((batch, steps, heads, depth))?)
        };
        let query = part(0, 0)?;
        let mut scores = Vec::with_capacity(window);
        let mut values = Vec::with_capacity(window);
        for lag in 0..window {
            let product = (&query * part(1, lag)?)?.sum(D::Minus1)?;
            let slopes: Vec<f32> = (0..heads)
                .map(|head| lag as f32 * 4f32.powi(1 - head as i32))
                .collect();
            let slopes = Tensor::new(slopes, z.device())?;
            let bias = (self.lag_bias.narrow(1, lag, 1)?.squeeze(1)? - slopes)?;
            scores.push((product / (depth as f64).sqrt())?.broadcast_add(&bias)?);
            values.push(part(2, lag)?);
        }
        let weights = softmax(&Tensor::stack(&scores, D::Minus1)?, D::Minus1)?;
        let values = Tensor::stack(&values, 3)?; // [B, S, H, W, d]
        let attended = weights.unsqueeze(4)?.broadcast_mul(&values)?.sum(3)?;
        let attended = attended.reshape((batch, steps, embedding))?;
        let newest = embeddings.narrow(1, window - 1, steps)?;
        let mixed = (newest + self.mix.forward(&attended)?)?;
        Ok(self.latent.forward(&mixed)?)
    }

    /// h [B, S, l], F_0 [B, f] -> F [B, S+1, f], step by step.
    pub(crate) fn integrate(
        &self,
        latents: &Tensor,
        start: &Tensor,
        solver: Solver,
    ) -> Result<Tensor> {
        let mut forces = vec![start.clone()];
        for step in 0..latents.dim(1)? {
            let latent = latents.narrow(1, step, 1)?.squeeze(1)?;
            let force = &forces[step];
            let next = match solver {
                Solver::Euler => (force + self.field(force, &latent)?)?,
                Solver::DormandPrince => {
                    return Err(format!("the plain model knows no {solver}").into());
                }
                Solver::Rk4 => {
                    let one = self.field(force, &latent)?;
                    let two = self.field(&(force + (&one * 0.5)?)?, &latent)?;
                    let three = self.field(&(force + (&two * 0.5)?)?, &latent)?;
                    let four = self.field(&(force + &three)?, &latent)?;
                    let inner = ((two + three)? * 2.0)?;
                    (force + (((one + inner)? + four)? / 6.0)?)?
                }
            };
            forces.push(next);
        }
        Ok(Tensor::stack(&forces, 1)?)
    }

    fn field(&self, force: &Tensor, latent: &Tensor) -> Result<Tensor> {
        let mut y = Tensor::cat(&[force, latent], 1)?;
        for (index, layer) in self.field.iter().enumerate() {
            y = layer.forward(&y)?;
            if index + 1 < self.field.len() {
                y = y.silu()?;
            }
        }
        Ok(y)
    }
}
