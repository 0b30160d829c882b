//! A training case, the same for every implementation: standardised trajectories, their order, the first weights.

use std::{collections::BTreeMap, path::PathBuf};

use candle_core::{Tensor, Var};
use hydro_model::{AttentionOde, AttentionOdeConfig, Parameters, Solver};
use hydro_training::{AdamW, StepSettings};
use serde::Deserialize;

use crate::{error::Result, files};

/// Files and settings of a [`TrainingCase`].
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrainingFiles {
    /// Tensors `z` [M, T, n], `target` [M, T, f] and `order` [steps, batch].
    pub(crate) data: PathBuf,
    /// First weights, named as in a checkpoint.
    pub(crate) weights: PathBuf,
    pub(crate) model: AttentionOdeConfig,
    pub(crate) solver: Solver,
    /// True: h is given ([`Drive::Latents`]) and the field alone is trained.
    pub(crate) field_alone: bool,
    pub(crate) learning_rate: f64,
    pub(crate) weight_decay: f64,
    pub(crate) clip_norm: f64,
}

/// z [B, W-1+S, n] and the loss's target [B, S+1, f], whose first sample is the start.
pub(crate) struct Batch {
    pub(crate) drive: Drive,
    pub(crate) start: Tensor,
    pub(crate) target: Tensor,
}

/// The input of the field.
pub(crate) enum Drive {
    /// z, through the attention.
    Samples(Tensor),
    /// h itself [B, S, l]: the first numbers of each sample, so that the field is trained alone.
    Latents(Tensor),
}

/// A model with its data and the optimiser's settings.
pub(crate) struct TrainingCase {
    pub(crate) config: AttentionOdeConfig,
    pub(crate) solver: Solver,
    pub(crate) model: AttentionOde,
    pub(crate) parameters: Parameters,
    optimiser: AdamW,
    settings: StepSettings,
    field_alone: bool,
    z: Tensor,
    target: Tensor,
    order: Vec<Vec<u32>>,
    step: usize,
}

impl TrainingCase {
    pub(crate) fn load(files: TrainingFiles) -> Result<Self> {
        let tensors = files::tensors(&files.data)?;
        let (z, target) = (
            files::named(&tensors, "z")?,
            files::named(&tensors, "target")?,
        );
        let (inputs, outputs) = (z.dim(2)?, target.dim(2)?);
        let (model, parameters) =
            Parameters::draw(0, |vb| AttentionOde::new(&files.model, inputs, outputs, vb))?;
        let weights: BTreeMap<String, Tensor> = files::tensors(&files.weights)?;
        parameters.restore(&weights)?;
        Ok(Self {
            config: files.model,
            solver: files.solver,
            model,
            parameters,
            optimiser: AdamW::default(),
            settings: StepSettings {
                learning_rate: files.learning_rate,
                weight_decay: files.weight_decay,
                clip_norm: files.clip_norm,
            },
            field_alone: files.field_alone,
            z: z.clone(),
            target: target.clone(),
            order: files::named(&tensors, "order")?.to_vec2()?,
            step: 0,
        })
    }

    /// Number of trajectories.
    pub(crate) fn trajectories(&self) -> usize {
        self.z.dims()[0]
    }

    /// The trajectories of a step; after the last step come those of the first.
    pub(crate) fn batch(&self, step: usize) -> Result<Batch> {
        self.gather(&self.order[step % self.order.len()])
    }

    /// The trajectories with these indices; the window's past is the first sample.
    pub(crate) fn gather(&self, chosen: &[u32]) -> Result<Batch> {
        let chosen = Tensor::new(chosen, self.z.device())?;
        let target = self.target.index_select(&chosen, 0)?;
        let z = self.z.index_select(&chosen, 0)?;
        // The last sample drives only what comes after the trajectory.
        let z = z.narrow(1, 0, z.dim(1)? - 1)?;
        let drive = if self.field_alone {
            Drive::Latents(z.narrow(2, 0, self.config.latent)?.contiguous()?)
        } else {
            let first = z.narrow(1, 0, 1)?;
            let mut parts = vec![first; self.config.window - 1];
            parts.push(z);
            Drive::Samples(Tensor::cat(&parts, 1)?)
        };
        Ok(Batch {
            drive,
            start: target.narrow(1, 0, 1)?.squeeze(1)?.contiguous()?,
            target,
        })
    }

    /// Loss and the gradient's norm at the present weights, unchanged.
    pub(crate) fn first(
        &self,
        forward: impl Fn(&Self, &Batch) -> Result<Tensor>,
    ) -> Result<Vec<f64>> {
        let batch = self.batch(0)?;
        let loss = mean_square(&forward(self, &batch)?, &batch.target)?;
        let gradients = loss.backward()?;
        let mut square = 0.0;
        for (_, var) in self.parameters.iter() {
            square += squares(&gradients, var)?;
        }
        Ok(vec![f64::from(loss.to_scalar::<f32>()?), square.sqrt()])
    }

    /// One step of the optimiser; the loss before it.
    pub(crate) fn learn(
        &mut self,
        forward: impl Fn(&Self, &Batch) -> Result<Tensor>,
    ) -> Result<f64> {
        let batch = self.batch(self.step)?;
        let loss = mean_square(&forward(self, &batch)?, &batch.target)?;
        let value = f64::from(loss.to_scalar::<f32>()?);
        self.optimiser
            .step(&self.parameters, &loss.backward()?, self.settings)?;
        self.step += 1;
        Ok(value)
    }
}

fn mean_square(forces: &Tensor, target: &Tensor) -> Result<Tensor> {
    Ok((forces - target)?.sqr()?.mean_all()?)
}

fn squares(gradients: &candle_core::backprop::GradStore, var: &Var) -> Result<f64> {
    Ok(match gradients.get(var) {
        Some(gradient) => {
            let square = gradient.to_dtype(candle_core::DType::F64)?.sqr()?;
            square.sum_all()?.to_scalar()?
        }
        None => 0.0,
    })
}
