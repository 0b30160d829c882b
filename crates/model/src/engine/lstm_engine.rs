//! Engine of the LSTM. Memory: h and c of every layer, then the force of the linear part (standardised), if there is one.

use candle_core::Result;
use pulp::Arch;

use super::{
    interface::{Engine, Scratch},
    packed_perceptron::{Precision, Weight},
    units::Units,
};
use crate::{
    architectures::Lstm,
    force_model::ForceModel,
    kernel::{Panels, multiply_row, sigmoid},
    operations::lstm_layer::{activate, tanh},
};

/// [W R]^T and b of a layer.
#[derive(Clone, Debug)]
struct Layer {
    inputs: usize,
    width: usize,
    weight: Weight,
    bias: Vec<f32>,
}

/// The engine; see the module.
#[derive(Clone, Debug)]
pub(super) struct LstmEngine {
    arch: Arch,
    units: Units,
    layers: Vec<Layer>,
    /// W_o^T and b_o, always in f32.
    output: (Panels<f32>, Vec<f32>),
    /// A^T, always in f32.
    skip: Option<Panels<f32>>,
}

impl LstmEngine {
    pub(super) fn new(
        model: &ForceModel,
        lstm: &Lstm,
        precision: Precision,
        arch: Arch,
    ) -> Result<Self> {
        let layers = lstm.layers.iter().enumerate().map(|(index, layer)| {
            let width = layer.width();
            let inputs = layer.input.dim(1)?;
            let both = candle_core::Tensor::cat(&[&layer.input, &layer.recurrent], 1)?;
            let both = both.flatten_all()?.to_vec1::<f32>()?;
            let panels = Panels::transposed(&both, inputs + width, 4 * width);
            let weight = Weight::new(panels, precision).map_err(|beyond| {
                candle_core::Error::Msg(format!(
                    "layer {index} of the LSTM: {beyond}; the engine `fused` holds it"
                ))
            })?;
            Ok(Layer {
                inputs,
                width,
                weight,
                bias: layer.bias.to_vec1::<f32>()?,
            })
        });
        let (weight, bias) = &lstm.output;
        let (outputs, depth) = weight.dims2()?;
        let read = weight.flatten_all()?.to_vec1::<f32>()?;
        let skip = match &lstm.skip {
            Some(linear) => {
                let (outputs, inputs) = linear.dims2()?;
                let linear = linear.flatten_all()?.to_vec1::<f32>()?;
                Some(Panels::transposed(&linear, inputs, outputs))
            }
            None => None,
        };
        Ok(Self {
            arch,
            units: Units::from_model(model),
            layers: layers.collect::<Result<_>>()?,
            output: (
                Panels::transposed(&read, depth, outputs),
                bias.to_vec1::<f32>()?,
            ),
            skip,
        })
    }

    /// h and c of every layer.
    fn state_len(&self) -> usize {
        self.layers.iter().map(|layer| 2 * layer.width).sum()
    }

    /// The most that a layer takes of something.
    fn most(&self, of: impl Fn(&Layer) -> usize) -> usize {
        self.layers.iter().map(of).max().unwrap_or(0)
    }

    /// Longest input of a layer, its h behind it.
    fn input_len(&self) -> usize {
        self.most(|layer| layer.inputs + layer.width)
    }

    /// Numbers of scratch: a layer's input, its gates, its new h, what its product takes; and a force.
    fn scratch(&self) -> usize {
        let of_layer = |layer: &Layer| 5 * layer.width + layer.weight.scratch();
        self.input_len() + self.most(of_layer) + self.output.1.len()
    }
}

impl Engine for LstmEngine {
    fn inputs(&self) -> usize {
        self.units.features()
    }

    fn outputs(&self) -> usize {
        self.output.1.len()
    }

    fn memory_len(&self) -> usize {
        self.state_len() + self.skip.as_ref().map_or(0, |_| self.outputs())
    }

    fn start(&self, x: &[f64], _: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        memory.fill(0.0);
        self.observe(x, memory, scratch);
    }

    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch) {
        let (input, rest) = scratch.take(self.scratch()).split_at_mut(self.input_len());
        self.units.encode(x, input);
        let (mut memory, linear) = memory.split_at_mut(self.state_len());
        if let Some(skip) = &self.skip {
            let force = &mut rest[..linear.len()];
            force.fill(0.0);
            multiply_row(self.arch, force, &input[..self.units.encoded()], skip);
            for (slot, force) in linear.iter_mut().zip(force.iter()) {
                *slot = f64::from(*force);
            }
        }
        for layer in &self.layers {
            let (own, others) = memory.split_at_mut(2 * layer.width);
            memory = others;
            let (h, c) = own.split_at_mut(layer.width);
            let (gates, rest) = rest.split_at_mut(4 * layer.width);
            let (new, work) = rest.split_at_mut(layer.width);
            for (slot, h) in input[layer.inputs..].iter_mut().zip(h.iter()) {
                *slot = *h as f32;
            }
            gates.copy_from_slice(&layer.bias);
            let seen = &input[..layer.inputs + layer.width];
            layer.weight.multiply_row(self.arch, gates, seen, work);
            activate(gates, layer.width, |values| sigmoid(self.arch, values));
            for (i, (c, new)) in c.iter_mut().zip(new.iter_mut()).enumerate() {
                let gate = |index: usize| gates[index * layer.width + i];
                *new = gate(1) * *c as f32 + gate(0) * gate(2);
                *c = f64::from(*new);
            }
            tanh(new, |values| sigmoid(self.arch, values));
            for ((h, new), output) in h
                .iter_mut()
                .zip(new.iter_mut())
                .zip(&gates[3 * layer.width..])
            {
                *new *= *output;
                *h = f64::from(*new);
            }
            input[..layer.width].copy_from_slice(new);
        }
    }

    fn sample(
        &self,
        memory: &[f64],
        _: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    ) {
        let width = self.layers.last().map_or(0, |layer| layer.width);
        let (h, rest) = scratch.take(self.scratch()).split_at_mut(width);
        let force = &mut rest[..now.len()];
        let (state, linear) = memory.split_at(self.state_len());
        let last = state.len() - 2 * width;
        for (slot, h) in h.iter_mut().zip(&state[last..]) {
            *slot = *h as f32;
        }
        force.copy_from_slice(&self.output.1);
        for (force, linear) in force.iter_mut().zip(linear) {
            *force += *linear as f32;
        }
        multiply_row(self.arch, force, h, &self.output.0);
        self.units.to_si(force.iter().copied(), now);
        next.copy_from_slice(now);
    }
}
