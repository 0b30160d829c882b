//! The field's layers, evaluated for one row or for many, with weights in f32 or in halves.

use std::borrow::Cow;

use candle_core::Result;
use pulp::Arch;

use crate::{
    kernel::{
        BeyondHalf, HalfPanels, Panels, multiply_row, multiply_row_half, multiply_rows, pack_rows,
        silu,
    },
    perceptron::{PackedLayers, Perceptron, PerceptronConfig},
};

/// Precision of stored weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Precision {
    Single,
    Half,
}

/// W^T of a layer.
#[derive(Clone, Debug)]
pub(super) enum Weight {
    Single(Panels<f32>),
    Half(HalfPanels),
}

impl Weight {
    pub(super) fn new(
        panels: Panels<f32>,
        precision: Precision,
    ) -> std::result::Result<Self, BeyondHalf> {
        Ok(match precision {
            Precision::Single => Self::Single(panels),
            Precision::Half => Self::Half(HalfPanels::new(&panels)?),
        })
    }

    fn columns(&self) -> usize {
        match self {
            Self::Single(panels) => panels.columns(),
            Self::Half(panels) => panels.columns(),
        }
    }

    pub(super) fn multiply_row(&self, arch: Arch, y: &mut [f32], x: &[f32]) {
        match self {
            Self::Single(panels) => multiply_row(arch, y, x, panels),
            Self::Half(panels) => multiply_row_half(arch, y, x, panels),
        }
    }

    fn widened(&self) -> Cow<'_, Panels<f32>> {
        match self {
            Self::Single(panels) => Cow::Borrowed(panels),
            Self::Half(panels) => Cow::Owned(panels.widened()),
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
    layers: Vec<(Cow<'a, Panels<f32>>, &'a [f32])>,
    skip: Option<&'a Panels<f32>>,
}

/// Buffers of [`Batched::evaluate`].
#[derive(Debug, Default)]
pub(super) struct Buffers {
    packed: Vec<f32>,
    values: Vec<f32>,
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
        2 * self.width()
    }

    /// y [outputs] of x [inputs].
    pub(super) fn evaluate(&self, arch: Arch, x: &[f32], y: &mut [f32], scratch: &mut [f32]) {
        let (mut source, mut target) = scratch.split_at_mut(self.width());
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
            weight.multiply_row(arch, out, input);
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
                .map(|(weight, bias)| (weight.widened(), bias.as_slice()))
                .collect(),
            skip: self.skip.as_ref(),
        }
    }
}

impl Batched<'_> {
    /// Y [rows, outputs] of X [rows, inputs]; each row as [`PackedPerceptron::evaluate`] gives it, bit for bit.
    pub(super) fn evaluate(&self, arch: Arch, x: &[f32], y: &mut [f32], buffers: &mut Buffers) {
        let Buffers { packed, values } = buffers;
        let inputs = self.config.inputs;
        let rows = x.len() / inputs;
        pack_rows(packed, x, (rows, inputs), (inputs, 1));
        if let Some((last, hidden)) = self.layers.split_last() {
            for (weight, bias) in hidden {
                let width = weight.columns();
                values.clear();
                values.extend((0..rows).flat_map(|_| bias.iter().copied()));
                multiply_rows(arch, values, rows, packed, weight);
                silu(arch, values);
                pack_rows(packed, values, (rows, width), (width, 1));
            }
            let (weight, bias) = last;
            for y in y.chunks_exact_mut(weight.columns()) {
                y.copy_from_slice(bias);
            }
            multiply_rows(arch, y, rows, packed, weight);
        }
        if let Some(skip) = self.skip {
            pack_rows(packed, x, (rows, inputs), (inputs, 1));
            multiply_rows(arch, y, rows, packed, skip);
        }
    }
}
