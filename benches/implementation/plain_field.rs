//! A perceptron as a user of Candle writes it: linear layers, one row in, one row out.

use std::{hint::black_box, path::Path, time::Instant};

use candle_core::{Device, Tensor};
use candle_nn::{Linear, Module as _};

use crate::{
    error::Result,
    files,
    implementation::{Block, Implementation},
};

/// Layers with SiLU between them.
pub(crate) struct PlainField {
    layers: Vec<Linear>,
    samples: Vec<Vec<f32>>,
    next: usize,
}

impl PlainField {
    pub(crate) fn new(checkpoint: &Path, inputs: &Path) -> Result<Self> {
        let weights = files::tensors(&checkpoint.join("weights.safetensors"))?;
        let mut layers = Vec::new();
        while let Some(weight) = weights.get(&format!("field.{}.weight", layers.len())) {
            let bias = files::named(&weights, &format!("field.{}.bias", layers.len()))?;
            layers.push(Linear::new(weight.clone(), Some(bias.clone())));
        }
        let samples = files::rows(files::named(&files::tensors(inputs)?, "x")?)?;
        let single = |row: Vec<f64>| row.into_iter().map(|value| value as f32).collect();
        Ok(Self {
            layers,
            samples: samples.into_iter().map(single).collect(),
            next: 0,
        })
    }

    fn evaluate(&self, x: &[f32]) -> Result<Vec<f32>> {
        let mut y = Tensor::from_slice(x, (1, x.len()), &Device::Cpu)?;
        for (index, layer) in self.layers.iter().enumerate() {
            y = layer.forward(&y)?;
            if index + 1 < self.layers.len() {
                y = y.silu()?;
            }
        }
        Ok(y.flatten_all()?.to_vec1()?)
    }
}

impl Implementation for PlainField {
    fn check(&mut self) -> Result<Vec<f64>> {
        let mut found = Vec::new();
        for x in &self.samples {
            found.extend(self.evaluate(x)?.into_iter().map(f64::from));
        }
        Ok(found)
    }

    fn block(&mut self, count: usize) -> Result<Block> {
        let begin = Instant::now();
        for _ in 0..count {
            black_box(self.evaluate(black_box(&self.samples[self.next]))?);
            self.next = (self.next + 1) % self.samples.len();
        }
        Ok(Block::timed(begin.elapsed().as_secs_f64()))
    }
}
