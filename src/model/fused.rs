//! A model stepped by our own products: no allocation, no threads, no Candle.
//!
//! The embedding is linear, so the whole path from the window to h folds into two products at load
//! (in f64, once), with z_l the standardised sample `l` steps back:
//!
//! ```text
//! u_j     = (W_k W_e)_j^T (W_q W_e z_0 + ..)_j / sqrt(d)     per head j; what all lags share leaves the softmax alone
//! score_l = u_j . z_l - slope l + bias_l,  m_j = sum_l softmax(score)_l z_l
//! h       = P_0 z_0 + sum_j P_j m_j + c
//! ```

use candle_core::{Result, Tensor};
use nalgebra::{DMatrix, DVector};

use super::{
    ForceModel, Network,
    attention::slope,
    attention_ode::AttentionOde,
    encoding::Encoder,
    engine::{Engine, SETTLED, SETTLING_STEPS, Scratch},
    field::{FieldConfig, Layers},
    kernel::{Panels, dot, multiply_row, silu},
    normaliser::Normaliser,
    solver::Solver,
};

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct FusedEngine {
    encoder: Encoder,
    normaliser: Normaliser,
    field: FieldConfig,
    layers: Layers<f32>,
    /// None for a memoryless model.
    ode: Option<Ode>,
}

#[derive(Clone, Debug)]
struct Ode {
    solver: Solver,
    window: usize,
    heads: usize,
    latent: usize,
    field_sees_force: bool,
    /// z_0 [n] -> u [H n].
    query: (Panels<f32>, Vec<f32>),
    /// [z_0; m_1; ..; m_H] [(1 + H) n] -> h [l].
    output: (Panels<f32>, Vec<f32>),
    /// bias_l - slope l, [H, W] by lag.
    lag_bias: Vec<f32>,
}

fn matrix(tensor: &Tensor) -> Result<DMatrix<f64>> {
    let (rows, columns) = tensor.dims2()?;
    let values = tensor
        .to_dtype(candle_core::DType::F64)?
        .flatten_all()?
        .to_vec1::<f64>()?;
    Ok(DMatrix::from_row_slice(rows, columns, &values))
}

fn vector(tensor: &Tensor) -> Result<DVector<f64>> {
    Ok(DVector::from_vec(
        tensor.to_dtype(candle_core::DType::F64)?.to_vec1::<f64>()?,
    ))
}

/// y = M x + c, packed.
fn packed(matrix: &DMatrix<f64>, offset: &DVector<f64>) -> (Panels<f32>, Vec<f32>) {
    let rows: Vec<f32> = matrix
        .transpose()
        .iter()
        .map(|value| *value as f32)
        .collect();
    let panels = Panels::transposed(&rows, matrix.ncols(), matrix.nrows());
    (panels, offset.iter().map(|value| *value as f32).collect())
}

impl Ode {
    fn new(model: &AttentionOde, solver: Solver) -> Result<Self> {
        let config = model.config();
        let (heads, width) = (config.heads, config.embedding);
        let depth = width / heads;
        let (embed, embed_bias) = (matrix(&model.embed.0)?, vector(&model.embed.1)?);
        let (qkv, qkv_bias) = (
            matrix(&model.attention.weight)?,
            vector(&model.attention.bias)?,
        );
        let (mix, mix_bias) = (matrix(&model.mix.0)?, vector(&model.mix.1)?);
        let (latent, latent_bias) = (matrix(&model.latent.0)?, vector(&model.latent.1)?);
        let inputs = embed.ncols();

        let mut query = DMatrix::zeros(heads * inputs, inputs);
        let mut query_bias = DVector::zeros(heads * inputs);
        let mut output = DMatrix::zeros(config.latent, (1 + heads) * inputs);
        let mut output_bias = &latent * (&embed_bias + mix_bias) + latent_bias;
        output.columns_mut(0, inputs).copy_from(&(&latent * &embed));
        for head in 0..heads {
            let part = |index: usize| qkv.rows(index * width + head * depth, depth);
            let offset = |index: usize| qkv_bias.rows(index * width + head * depth, depth);
            let keys = (part(1) * &embed).transpose() / (depth as f64).sqrt();
            query
                .rows_mut(head * inputs, inputs)
                .copy_from(&(&keys * part(0) * &embed));
            query_bias
                .rows_mut(head * inputs, inputs)
                .copy_from(&(&keys * (part(0) * &embed_bias + offset(0))));
            let values = &latent * mix.columns(head * depth, depth);
            output
                .columns_mut((1 + head) * inputs, inputs)
                .copy_from(&(&values * part(2) * &embed));
            output_bias += &values * (part(2) * &embed_bias + offset(2));
        }
        let learned = model.attention.lag_bias.flatten_all()?.to_vec1::<f32>()?;
        let lag_bias = learned
            .into_iter()
            .enumerate()
            .map(|(i, bias)| bias - (slope(i / config.window) * (i % config.window) as f64) as f32)
            .collect();
        Ok(Self {
            solver,
            window: config.window,
            heads,
            latent: config.latent,
            field_sees_force: config.field_sees_force,
            query: packed(&query, &query_bias),
            output: packed(&output, &output_bias),
            lag_bias,
        })
    }

    /// Numbers of scratch that [`Ode::latent`] takes.
    fn scratch(&self, inputs: usize) -> usize {
        (1 + 2 * self.heads) * inputs + self.window
    }

    /// h of a standardised window, oldest first.
    fn latent(&self, window: &[f32], latent: &mut [f32], scratch: &mut [f32]) {
        let inputs = window.len() / self.window;
        let (queries, rest) = scratch.split_at_mut(self.heads * inputs);
        let (seen, weights) = rest.split_at_mut((1 + self.heads) * inputs);
        let newest = &window[(self.window - 1) * inputs..];
        queries.copy_from_slice(&self.query.1);
        multiply_row(queries, newest, &self.query.0);
        seen[..inputs].copy_from_slice(newest);
        for (head, (query, mean)) in queries
            .chunks_exact(inputs)
            .zip(seen[inputs..].chunks_exact_mut(inputs))
            .enumerate()
        {
            let lag_bias = &self.lag_bias[head * self.window..][..self.window];
            let past = || window.chunks_exact(inputs).rev();
            let mut largest = f32::MIN;
            for ((weight, z), bias) in weights.iter_mut().zip(past()).zip(lag_bias) {
                *weight = dot(query, z) + bias;
                largest = largest.max(*weight);
            }
            let mut sum = 0.0;
            for weight in weights.iter_mut() {
                *weight = (*weight - largest).exp();
                sum += *weight;
            }
            mean.fill(0.0);
            for (weight, z) in weights.iter().zip(past()) {
                for (mean, z) in mean.iter_mut().zip(z) {
                    *mean += weight / sum * z;
                }
            }
        }
        latent.copy_from_slice(&self.output.1);
        multiply_row(latent, seen, &self.output.0);
    }
}

impl FusedEngine {
    pub(crate) fn new(model: &ForceModel) -> Result<Self> {
        let (field, ode) = match &model.network {
            Network::AttentionOde(network) => {
                (&network.field, Some(Ode::new(network, model.solver)?))
            }
            Network::Mlp(network) => (&network.field, None),
        };
        Ok(Self {
            encoder: model.encoder.clone(),
            normaliser: model.normaliser.clone(),
            layers: Layers::new(field.config(), &field.flat()?.to_vec1::<f32>()?),
            field: field.config().clone(),
            ode,
        })
    }

    /// Widest hidden layer.
    fn width(&self) -> usize {
        self.field.hidden.iter().copied().max().unwrap_or(0)
    }

    /// Numbers of scratch in all: window, latent's own, field input, slope, change, force, two layers.
    fn scratch(&self) -> usize {
        let inputs = self.encoder.len();
        let ode = self
            .ode
            .as_ref()
            .map_or(0, |ode| ode.scratch(inputs) + ode.latent);
        self.window() * inputs + ode + self.field.inputs + 3 * self.field.outputs + 2 * self.width()
    }

    /// y of the field's input.
    fn evaluate(&self, input: &[f32], y: &mut [f32], layers: &mut [f32]) {
        let (mut source, mut target) = layers.split_at_mut(self.width());
        let last = self.layers.layers.len() - 1;
        let mut depth = 0;
        for (index, (weight, bias)) in self.layers.layers.iter().enumerate() {
            let x = if index == 0 { input } else { &source[..depth] };
            let out = if index == last {
                &mut *y
            } else {
                &mut target[..weight.columns()]
            };
            out.copy_from_slice(bias);
            multiply_row(out, x, weight);
            if index < last {
                silu(out);
            }
            depth = weight.columns();
            std::mem::swap(&mut source, &mut target);
        }
        if let Some(skip) = &self.layers.skip {
            multiply_row(y, input, skip);
        }
    }

    /// `force` moves on by one step; `input` holds h behind the force's place.
    fn step(
        &self,
        ode: &Ode,
        force: &mut [f32],
        input: &mut [f32],
        slopes: &mut [f32],
        layers: &mut [f32],
    ) {
        let (slope, change) = slopes.split_at_mut(force.len());
        let tableau = ode.solver.tableau();
        slope.fill(0.0);
        change.fill(0.0);
        for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
            if ode.field_sees_force {
                for ((slot, force), slope) in input.iter_mut().zip(force.iter()).zip(slope.iter()) {
                    *slot = force + *along as f32 * slope;
                }
            }
            self.evaluate(input, slope, layers);
            for (change, slope) in change.iter_mut().zip(slope.iter()) {
                *change += *weight as f32 * slope;
            }
        }
        for (force, change) in force.iter_mut().zip(change.iter()) {
            *force += *change;
        }
    }

    /// Standardised force after `steps` at most from `force` (standardised, in place), or g(x).
    fn advance(
        &self,
        samples: impl Iterator<Item = impl AsRef<[f64]>>,
        force: &mut [f64],
        steps: usize,
        scratch: &mut Scratch,
        start: impl Fn(usize, f64) -> f32,
    ) {
        let n = self.encoder.len();
        let scratch = scratch.take(self.scratch());
        let (window, rest) = scratch.split_at_mut(self.window() * n);
        for (x, z) in samples.zip(window.chunks_exact_mut(n)) {
            self.encoder.encode(x.as_ref(), |i, value| {
                z[i] = self.normaliser.input(i, value)
            });
        }
        let (input, rest) = rest.split_at_mut(self.field.inputs);
        let (now, rest) = rest.split_at_mut(self.field.outputs);
        let (slopes, rest) = rest.split_at_mut(2 * self.field.outputs);
        let (layers, rest) = rest.split_at_mut(2 * self.width());
        match &self.ode {
            None => self.evaluate(window, now, layers),
            Some(ode) => {
                let at = if ode.field_sees_force {
                    self.field.outputs
                } else {
                    0
                };
                ode.latent(window, &mut input[at..], &mut rest[..ode.scratch(n)]);
                for (i, (slot, value)) in now.iter_mut().zip(force.iter()).enumerate() {
                    *slot = start(i, *value);
                }
                for _ in 0..steps {
                    self.step(ode, now, input, slopes, layers);
                    // The change of the step is what `step` left behind the slope.
                    if slopes[self.field.outputs..]
                        .iter()
                        .all(|change| change.abs() < SETTLED)
                    {
                        break;
                    }
                }
            }
        }
        for (i, (slot, value)) in force.iter_mut().zip(now.iter()).enumerate() {
            *slot = self.normaliser.to_si(i, *value);
        }
    }
}

impl Engine for FusedEngine {
    fn inputs(&self) -> usize {
        self.encoder.inputs()
    }

    fn outputs(&self) -> usize {
        self.field.outputs
    }

    fn window(&self) -> usize {
        self.ode.as_ref().map_or(1, |ode| ode.window)
    }

    fn sample(
        &self,
        window: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        next.copy_from_slice(force);
        let samples = window.chunks_exact(self.encoder.inputs());
        self.advance(samples, next, 1, scratch, |i, value| {
            self.normaliser.force(i, value)
        });
        now.copy_from_slice(if self.ode.is_some() { force } else { next });
    }

    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let samples = std::iter::repeat_n(x, self.window());
        self.advance(samples, force, SETTLING_STEPS, scratch, |_, _| 0.0);
    }
}
