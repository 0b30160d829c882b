//! A perceptron of many rows at once with its derivative, without Candle: the products inside the time loops.
//!
//! [`PerceptronRows::evaluate`] writes what the derivative needs to a [`Tape`], [`PerceptronRows::transpose`] walks one set of
//! its rows back through the transposed layers, and [`PerceptronRows::accumulate`] makes the gradients of the weights
//! from all of them, as products over the rows.

use super::{packed::PackedLayers, sizes::PerceptronConfig};
use crate::kernel::{Panels, Real, pack_rows};

/// A field's weights, packed for the way forward and, where asked for, for the way back.
pub(crate) struct PerceptronRows<'a, T> {
    config: &'a PerceptronConfig,
    forward: PackedLayers<T>,
    /// Per layer W, as stored [outputs, inputs].
    backward: Vec<Panels<T>>,
    /// A.
    skip: Option<Panels<T>>,
}

/// Buffers of a pass over the layers.
#[derive(Default)]
pub(crate) struct Work<T> {
    packed: Vec<T>,
    panels: Panels<T>,
    values: Vec<T>,
}

/// Per hidden layer, z (later dL/dz) and silu(z) of a set of rows.
#[derive(Default)]
pub(crate) struct Hidden<T> {
    z: Vec<Vec<T>>,
    activation: Vec<Vec<T>>,
}

/// Receives the values of the hidden layers during an evaluation.
pub(crate) trait Record<T> {
    /// z of a layer, all rows.
    fn z(&mut self, layer: usize, values: &[T]);
    /// silu(z) of a layer, all rows.
    fn activation(&mut self, layer: usize, values: &[T]) {
        let _ = (layer, values);
    }
}

/// Records nothing.
impl<T> Record<T> for () {
    fn z(&mut self, _: usize, _: &[T]) {}
}

/// Writes to [`Hidden`], from the given row on.
impl<T: Real> Record<T> for (&mut Hidden<T>, usize, &PerceptronConfig) {
    fn z(&mut self, layer: usize, values: &[T]) {
        let at = self.1 * self.2.hidden[layer];
        self.0.z[layer][at..][..values.len()].copy_from_slice(values);
    }

    fn activation(&mut self, layer: usize, values: &[T]) {
        let at = self.1 * self.2.hidden[layer];
        self.0.activation[layer][at..][..values.len()].copy_from_slice(values);
    }
}

/// Appends z of layer after layer.
impl<T: Real> Record<T> for &mut Vec<T> {
    fn z(&mut self, _: usize, values: &[T]) {
        self.extend_from_slice(values);
    }
}

impl<T: Real> Hidden<T> {
    /// Takes z of `rows` rows from `at` on out of what a `&mut Vec<T>` recorded of them, and returns the rest.
    pub(crate) fn recall<'a>(
        &mut self,
        field: &PerceptronConfig,
        at: usize,
        rows: usize,
        mut recorded: &'a [T],
    ) -> &'a [T] {
        for (z, width) in self.z.iter_mut().zip(&field.hidden) {
            let (own, rest) = recorded.split_at(rows * width);
            z[at * width..][..own.len()].copy_from_slice(own);
            recorded = rest;
        }
        recorded
    }

    /// silu(z) of all rows.
    pub(crate) fn activate(&mut self) {
        for (activation, z) in self.activation.iter_mut().zip(&self.z) {
            activation.copy_from_slice(z);
            T::silu(activation);
        }
    }
}

/// Values of a set of rows that the derivative needs.
#[derive(Default)]
pub(crate) struct Tape<T> {
    /// x.
    pub(crate) input: Vec<T>,
    pub(crate) hidden: Hidden<T>,
    /// dL/dy.
    pub(crate) output: Vec<T>,
}

impl<'a, T: Real> PerceptronRows<'a, T> {
    /// From the vector of [`super::Perceptron::flat`]; the transposes only where `backward` is asked for.
    pub(crate) fn new(config: &'a PerceptronConfig, flat: &[T], backward: bool) -> Self {
        let mut panels = Vec::new();
        let mut at = 0;
        for (inputs, outputs) in config.layers() {
            if backward {
                panels.push(Panels::new(
                    &flat[at..][..inputs * outputs],
                    outputs,
                    inputs,
                ));
            }
            at += (inputs + 1) * outputs;
        }
        let skip = (backward && config.skip)
            .then(|| Panels::new(&flat[at..], config.outputs, config.inputs));
        Self {
            config,
            forward: PackedLayers::new(config, flat),
            backward: panels,
            skip,
        }
    }

    /// `out` = field of all rows of `input`; `record` is told of the hidden layers.
    pub(crate) fn evaluate(
        &self,
        input: &[T],
        out: &mut Vec<T>,
        work: &mut Work<T>,
        mut record: impl Record<T>,
    ) {
        let rows = input.len() / self.config.inputs;
        let last = self.forward.layers.len() - 1;
        pack_rows(
            &mut work.packed,
            input,
            (rows, self.config.inputs),
            (self.config.inputs, 1),
        );
        for (index, (weight, bias)) in self.forward.layers.iter().enumerate() {
            let width = weight.columns();
            let values = if index == last {
                &mut *out
            } else {
                &mut work.values
            };
            values.clear();
            for _ in 0..rows {
                values.extend_from_slice(bias);
            }
            T::multiply(values, rows, &work.packed, weight);
            if index == last {
                break;
            }
            record.z(index, values);
            T::silu(values);
            record.activation(index, values);
            pack_rows(&mut work.packed, values, (rows, width), (width, 1));
        }
        if let Some(skip) = &self.forward.skip {
            pack_rows(
                &mut work.packed,
                input,
                (rows, self.config.inputs),
                (self.config.inputs, 1),
            );
            T::multiply(out, rows, &work.packed, skip);
        }
    }

    /// `out` = J^T (dL/dy) of `rows` rows from `at` on; leaves dL/dz of the hidden layers in the tape.
    pub(crate) fn transpose(
        &self,
        tape: &mut Tape<T>,
        at: usize,
        rows: usize,
        out: &mut Vec<T>,
        work: &mut Work<T>,
    ) {
        let outputs = self.config.outputs;
        let upstream = &tape.output[at * outputs..][..rows * outputs];
        pack_rows(&mut work.packed, upstream, (rows, outputs), (outputs, 1));
        out.clear();
        out.resize(rows * self.config.inputs, T::default());
        if let Some(skip) = &self.skip {
            T::multiply(out, rows, &work.packed, skip);
        }
        for (layer, weight) in self.backward.iter().enumerate().rev() {
            let columns = weight.columns();
            if layer == 0 {
                T::multiply(out, rows, &work.packed, weight);
                break;
            }
            work.values.clear();
            work.values.resize(rows * columns, T::default());
            T::multiply(&mut work.values, rows, &work.packed, weight);
            let z = &mut tape.hidden.z[layer - 1][at * columns..][..rows * columns];
            T::silu_backward(z, &work.values);
            pack_rows(&mut work.packed, z, (rows, columns), (columns, 1));
        }
    }

    /// Gradients of the weights over all rows of a tape, in the order of [`super::Perceptron::flat`].
    pub(crate) fn accumulate(
        &self,
        tape: &Tape<T>,
        rows: usize,
        d_weights: &mut [T],
        work: &mut Work<T>,
    ) {
        let mut rest = d_weights;
        let last = self.config.hidden.len();
        let mut product = |d: &[T], width: usize, x: &[T], depth: usize, out: &mut [T]| {
            // dW [width, depth] += d^T x over the rows.
            pack_rows(&mut work.packed, d, (width, rows), (1, width));
            work.panels.pack(x, rows, depth, depth);
            T::multiply(out, width, &work.packed, &work.panels);
        };
        for (layer, (depth, width)) in self.config.layers().into_iter().enumerate() {
            let d = if layer == last {
                &tape.output
            } else {
                &tape.hidden.z[layer]
            };
            let x = if layer == 0 {
                &tape.input
            } else {
                &tape.hidden.activation[layer - 1]
            };
            let (weight, tail) = rest.split_at_mut(depth * width);
            let (bias, tail) = tail.split_at_mut(width);
            product(d, width, x, depth, weight);
            for row in d.chunks_exact(width) {
                for (sum, value) in bias.iter_mut().zip(row) {
                    *sum += *value;
                }
            }
            rest = tail;
        }
        if self.config.skip {
            product(
                &tape.output,
                self.config.outputs,
                &tape.input,
                self.config.inputs,
                rest,
            );
        }
    }
}

impl<T: Real> Tape<T> {
    /// Room for `rows` rows, whatever they hold: every number is written before it is read. Memory is kept from
    /// segment to segment, for fresh pages cost more than the products of a small field.
    pub(crate) fn resize(&mut self, field: &PerceptronConfig, rows: usize) {
        self.input.resize(rows * field.inputs, T::default());
        self.output.resize(rows * field.outputs, T::default());
        for layers in [&mut self.hidden.z, &mut self.hidden.activation] {
            layers.resize_with(field.hidden.len(), Vec::new);
            for (values, width) in layers.iter_mut().zip(&field.hidden) {
                values.resize(rows * width, T::default());
            }
        }
    }
}
