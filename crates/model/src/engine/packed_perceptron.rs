//! The field's layers, evaluated for one row or for many, with weights in f32, in halves or in int16.

use std::borrow::Cow;

use candle_core::Result;
use pulp::Arch;

use crate::{
    kernel::{
        BeyondHalf, HalfPanels, Int16Panels, Panels, multiply_int16, multiply_row,
        multiply_row_half, multiply_rows, pack_rows, silu,
    },
    perceptron::{PackedLayers, Perceptron, PerceptronConfig},
};

/// Precision of stored weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    Single,
    Half,
    /// Activations too.
    Int16,
}

/// W^T of a layer.
#[derive(Clone, Debug)]
pub(super) enum Weight {
    Single(Panels<f32>),
    Half(HalfPanels),
    Int16(Int16Panels),
}

impl Weight {
    pub(super) fn new(
        panels: Panels<f32>,
        precision: Precision,
    ) -> std::result::Result<Self, BeyondHalf> {
        Ok(match precision {
            Precision::Single => Self::Single(panels),
            Precision::Half => Self::Half(HalfPanels::new(&panels)?),
            Precision::Int16 => Self::Int16(Int16Panels::new(&panels)),
        })
    }

    fn columns(&self) -> usize {
        match self {
            Self::Single(panels) => panels.columns(),
            Self::Half(panels) => panels.columns(),
            Self::Int16(panels) => panels.columns(),
        }
    }

    /// Numbers of scratch that [`Weight::multiply_row`] takes.
    pub(super) fn scratch(&self) -> usize {
        match self {
            Self::Single(_) | Self::Half(_) => 0,
            Self::Int16(panels) => panels.scratch(),
        }
    }

    pub(super) fn multiply_row(&self, arch: Arch, y: &mut [f32], x: &[f32], scratch: &mut [f32]) {
        match self {
            Self::Single(panels) => multiply_row(arch, y, x, panels),
            Self::Half(panels) => multiply_row_half(arch, y, x, panels),
            Self::Int16(panels) => multiply_int16(arch, y, x, panels, scratch),
        }
    }

    fn batched(&self) -> BatchedWeight<'_> {
        match self {
            Self::Single(panels) => BatchedWeight::Single(Cow::Borrowed(panels)),
            Self::Half(panels) => BatchedWeight::Single(Cow::Owned(panels.widened())),
            Self::Int16(panels) => BatchedWeight::Int16(panels),
        }
    }
}

/// [`Weight`] for many rows at once.
#[derive(Debug)]
enum BatchedWeight<'a> {
    Single(Cow<'a, Panels<f32>>),
    Int16(&'a Int16Panels),
}

impl BatchedWeight<'_> {
    fn columns(&self) -> usize {
        match self {
            Self::Single(panels) => panels.columns(),
            Self::Int16(panels) => panels.columns(),
        }
    }

    /// Y [rows, outputs] += X [rows, inputs] W^T; `work` is overwritten.
    fn multiply(&self, arch: Arch, rows: usize, y: &mut [f32], x: &[f32], work: &mut Vec<f32>) {
        match self {
            Self::Single(panels) => {
                let inputs = x.len() / rows;
                pack_rows(work, x, (rows, inputs), (inputs, 1));
                multiply_rows(arch, y, rows, work, panels);
            }
            Self::Int16(panels) => {
                work.resize(rows * panels.scratch(), 0.0);
                multiply_int16(arch, y, x, panels, work);
            }
        }
    }
}

/// The layers of a [`Perceptron`], packed.
#[derive(Clone, Debug)]
pub(crate) struct PackedPerceptron {
    pub(super) config: PerceptronConfig,
    /// Per layer W^T and bias.
    layers: Vec<(Weight, Vec<f32>)>,
    /// A^T, always in f32: it is small, and a linear skip carries the force itself.
    skip: Option<Panels<f32>>,
}

/// The layers for many rows at once.
#[derive(Debug)]
pub(super) struct Batched<'a> {
    config: &'a PerceptronConfig,
    layers: Vec<(BatchedWeight<'a>, &'a [f32])>,
    skip: Option<&'a Panels<f32>>,
}

/// Buffers of [`Batched::evaluate`].
#[derive(Debug, Default)]
pub(super) struct Buffers {
    work: Vec<f32>,
    values: Vec<f32>,
    next: Vec<f32>,
}

impl PackedPerceptron {
    pub(super) fn new(field: &Perceptron, precision: Precision) -> Result<Self> {
        let config = field.config();
        let PackedLayers { layers, skip } =
            PackedLayers::new(config, &field.flat()?.to_vec1::<f32>()?);
        let layers = layers
            .into_iter()
            .enumerate()
            .map(|(index, (panels, bias))| {
                let weight = Weight::new(panels, precision).map_err(|beyond| {
                    candle_core::Error::Msg(format!(
                        "layer {index} of the field: {beyond}; the engine `fused` holds it"
                    ))
                })?;
                Ok((weight, bias))
            })
            .collect::<Result<_>>()?;
        Ok(Self {
            config: config.clone(),
            layers,
            skip,
        })
    }

    /// Widest hidden layer.
    fn width(&self) -> usize {
        self.config.hidden.iter().copied().max().unwrap_or(0)
    }

    /// Numbers of scratch that [`PackedPerceptron::evaluate`] takes.
    pub(super) fn scratch(&self) -> usize {
        let products = self.layers.iter().map(|(weight, _)| weight.scratch());
        2 * self.width() + products.max().unwrap_or(0)
    }

    /// y [outputs] of x [inputs].
    pub(super) fn evaluate(&self, arch: Arch, x: &[f32], y: &mut [f32], scratch: &mut [f32]) {
        let width = self.width();
        let (hidden, work) = scratch.split_at_mut(2 * width);
        let (mut source, mut target) = hidden.split_at_mut(width);
        let last = self.layers.len() - 1;
        let mut depth = 0;
        for (index, (weight, bias)) in self.layers.iter().enumerate() {
            let input = if index == 0 { x } else { &source[..depth] };
            let out = if index == last {
                &mut *y
            } else {
                &mut target[..weight.columns()]
            };
            out.copy_from_slice(bias);
            weight.multiply_row(arch, out, input, work);
            if index < last {
                silu(arch, out);
            }
            depth = weight.columns();
            std::mem::swap(&mut source, &mut target);
        }
        if let Some(skip) = &self.skip {
            multiply_row(arch, y, x, skip);
        }
    }

    /// The same layers for many rows; halves are widened once.
    pub(super) fn batched(&self) -> Batched<'_> {
        let layers = self.layers.iter();
        Batched {
            config: &self.config,
            layers: layers
                .map(|(weight, bias)| (weight.batched(), bias.as_slice()))
                .collect(),
            skip: self.skip.as_ref(),
        }
    }
}

impl Batched<'_> {
    /// Y [rows, outputs] of X [rows, inputs]; each row as [`PackedPerceptron::evaluate`] gives it, bit for bit.
    pub(super) fn evaluate(&self, arch: Arch, x: &[f32], y: &mut [f32], buffers: &mut Buffers) {
        let Buffers { work, values, next } = buffers;
        let inputs = self.config.inputs;
        let rows = x.len() / inputs;
        if let Some(((weight, bias), hidden)) = self.layers.split_last() {
            values.clear();
            values.extend_from_slice(x);
            for (weight, bias) in hidden {
                next.clear();
                next.extend((0..rows).flat_map(|_| bias.iter().copied()));
                weight.multiply(arch, rows, next, values, work);
                silu(arch, next);
                std::mem::swap(values, next);
            }
            for y in y.chunks_exact_mut(weight.columns()) {
                y.copy_from_slice(bias);
            }
            weight.multiply(arch, rows, y, values, work);
        }
        if let Some(skip) = self.skip {
            pack_rows(work, x, (rows, inputs), (inputs, 1));
            multiply_rows(arch, y, rows, work, skip);
        }
    }
}
