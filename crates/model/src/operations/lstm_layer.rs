//! One layer of a long short-term memory along whole trajectories, as one differentiable operation.
//!
//! ```text
//! [i; f; g; o] = p_k + R h_{k-1}                       p_k = W x_k + b, a product over all samples, made before
//! c_k = sigmoid(f) c_{k-1} + sigmoid(i) tanh(g),   h_k = sigmoid(o) tanh(c_k),   h_{-1} = c_{-1} = 0
//! ```
//!
//! S. Hochreiter and J. Schmidhuber, "Long Short-Term Memory", Neural Computation 9(8), 1997, with the forget gate of
//! F. Gers et al. (2000); the order of the gates is PyTorch's.
//!
//! The forward pass stores h alone. The backward pass computes the gates of all samples again in one product, since every
//! h_{k-1} is known; only the transposed product runs step by step in time. The batch is cut into chunks of fixed size,
//! summed in order, so the result does not depend on the number of threads.

use candle_core::{Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    backend::Backend,
    custom_operation::{BackwardPass, Operation, apply_2, values},
};
use crate::kernel::{Panels, Real, pack_rows, sum_in_order};

/// Trajectories that a thread walks together.
const CHUNK: usize = 8;

/// p [B, T, 4 H], R [4 H, H] -> h [B, T, H].
pub(crate) fn recur(operations: Backend, driven: &Tensor, recurrent: &Tensor) -> Result<Tensor> {
    match operations {
        Backend::Kernels => apply_2(Recurrence, [driven, recurrent]),
        Backend::Tensors => by_tensors(driven, recurrent),
    }
}

/// Sample by sample in Candle's own operations.
fn by_tensors(driven: &Tensor, recurrent: &Tensor) -> Result<Tensor> {
    let (batch, samples, _) = driven.dims3()?;
    let width = recurrent.dim(1)?;
    let zero = Tensor::zeros((batch, width), driven.dtype(), driven.device())?;
    let (mut h, mut c) = (zero.clone(), zero);
    let mut all = Vec::with_capacity(samples);
    for k in 0..samples {
        let gates = (driven.narrow(1, k, 1)?.squeeze(1)? + h.matmul(&recurrent.t()?)?)?;
        (h, c) = cell(&gates, &c)?;
        all.push(h.clone());
    }
    Tensor::stack(&all, 1)
}

/// (h, c) [rows, H] of gates before their activation [rows, 4 H] and the c before.
pub(crate) fn cell(gates: &Tensor, c: &Tensor) -> Result<(Tensor, Tensor)> {
    let width = c.dim(1)?;
    let part = |index: usize| gates.narrow(1, index * width, width)?.contiguous();
    let sigmoid = |index: usize| candle_nn::ops::sigmoid(&part(index)?);
    let c = ((sigmoid(1)? * c)? + (sigmoid(0)? * part(2)?.tanh()?)?)?;
    let h = (sigmoid(3)? * c.tanh()?)?;
    Ok((h, c))
}

/// The activations of rows of gates [rows, 4 H], in place. tanh(x) = 2 sigmoid(2 x) - 1.
pub(crate) fn activate<T: Real>(gates: &mut [T], width: usize, sigmoid: impl FnOnce(&mut [T])) {
    let two = T::real(2.0);
    let tanh = 2 * width..3 * width;
    for row in gates.chunks_exact_mut(4 * width) {
        row[tanh.clone()].iter_mut().for_each(|x| *x *= two);
    }
    sigmoid(gates);
    for row in gates.chunks_exact_mut(4 * width) {
        for x in &mut row[tanh.clone()] {
            *x = two * *x - T::real(1.0);
        }
    }
}

/// tanh of each value, in place.
pub(crate) fn tanh<T: Real>(values: &mut [T], sigmoid: impl FnOnce(&mut [T])) {
    let two = T::real(2.0);
    values.iter_mut().for_each(|x| *x *= two);
    sigmoid(values);
    values.iter_mut().for_each(|x| *x = two * *x - T::real(1.0));
}

struct Recurrence;

#[derive(Clone, Copy)]
struct Sizes {
    samples: usize,
    width: usize,
}

impl Sizes {
    fn from_shapes(driven: &Shape) -> Result<Self> {
        let (_, samples, gates) = driven.dims3()?;
        Ok(Self {
            samples,
            width: gates / 4,
        })
    }
}

/// p of some trajectories [rows, T, 4 H] -> their h [rows, T, H].
fn forward_chunk<T: Real>(sizes: Sizes, recurrent: &Panels<T>, driven: &[T], out: &mut [T]) {
    let Sizes { samples, width } = sizes;
    let rows = out.len() / (samples * width);
    let mut packed = Vec::new();
    let mut gates = vec![T::default(); rows * 4 * width];
    let mut h = vec![T::default(); rows * width];
    let mut c = vec![T::default(); rows * width];
    for k in 0..samples {
        for (row, gates) in gates.chunks_exact_mut(4 * width).enumerate() {
            gates.copy_from_slice(&driven[(row * samples + k) * 4 * width..][..4 * width]);
        }
        if k > 0 {
            pack_rows(&mut packed, &h, (rows, width), (width, 1));
            T::multiply(&mut gates, rows, &packed, recurrent);
        }
        activate(&mut gates, width, T::sigmoid);
        for (gates, c) in gates.chunks_exact(4 * width).zip(c.chunks_exact_mut(width)) {
            for (i, c) in c.iter_mut().enumerate() {
                *c = gates[width + i] * *c + gates[i] * gates[2 * width + i];
            }
        }
        h.copy_from_slice(&c);
        tanh(&mut h, T::sigmoid);
        for (row, h) in h.chunks_exact_mut(width).enumerate() {
            let output = &gates[(4 * row + 3) * width..][..width];
            for (h, output) in h.iter_mut().zip(output) {
                *h *= *output;
            }
            out[(row * samples + k) * width..][..width].copy_from_slice(h);
        }
    }
}

/// Gradients of one chunk: p's in `d_driven`; returns R's [4 H, H].
fn backward_chunk<T: Real>(
    sizes: Sizes,
    (forward, transposed): (&Panels<T>, &Panels<T>),
    [driven, h, gradient]: [&[T]; 3],
    d_driven: &mut [T],
) -> Vec<T> {
    let Sizes { samples, width } = sizes;
    let rows = h.len() / (samples * width);
    let all = samples * rows;
    // Rows are ordered (sample, trajectory).
    let mut before = vec![T::default(); all * width];
    let mut gates = vec![T::default(); all * 4 * width];
    for k in 0..samples {
        for row in 0..rows {
            let at = k * rows + row;
            gates[at * 4 * width..][..4 * width]
                .copy_from_slice(&driven[(row * samples + k) * 4 * width..][..4 * width]);
            if k > 0 {
                before[at * width..][..width]
                    .copy_from_slice(&h[(row * samples + k - 1) * width..][..width]);
            }
        }
    }
    let mut packed = Vec::new();
    pack_rows(&mut packed, &before, (all, width), (width, 1));
    T::multiply(&mut gates, all, &packed, forward);
    activate(&mut gates, width, T::sigmoid);
    let mut c = vec![T::default(); all * width];
    for at in 0..all {
        for i in 0..width {
            let past = if at < rows {
                T::default()
            } else {
                c[(at - rows) * width + i]
            };
            let gate = |index: usize| gates[(4 * at + index) * width + i];
            c[at * width + i] = gate(1) * past + gate(0) * gate(2);
        }
    }
    let mut squashed = c.clone();
    tanh(&mut squashed, T::sigmoid);

    let one = T::real(1.0);
    let mut d_h = vec![T::default(); rows * width];
    let mut d_c = vec![T::default(); rows * width];
    for k in (0..samples).rev() {
        let block = k * rows;
        for row in 0..rows {
            let at = block + row;
            let given = &gradient[(row * samples + k) * width..][..width];
            let gates = &mut gates[at * 4 * width..][..4 * width];
            for i in 0..width {
                let [input, forget, candidate, output] =
                    [0, 1, 2, 3].map(|gate| gates[gate * width + i]);
                let past = if k == 0 {
                    T::default()
                } else {
                    c[(at - rows) * width + i]
                };
                let upstream = given[i] + d_h[row * width + i];
                let squashed = squashed[at * width + i];
                let own = d_c[row * width + i] + upstream * output * (one - squashed * squashed);
                gates[i] = own * candidate * input * (one - input);
                gates[width + i] = own * past * forget * (one - forget);
                gates[2 * width + i] = own * input * (one - candidate * candidate);
                gates[3 * width + i] = upstream * squashed * output * (one - output);
                d_c[row * width + i] = own * forget;
            }
            d_driven[(row * samples + k) * 4 * width..][..4 * width].copy_from_slice(gates);
        }
        let slopes = &gates[block * 4 * width..][..rows * 4 * width];
        pack_rows(&mut packed, slopes, (rows, 4 * width), (4 * width, 1));
        d_h.fill(T::default());
        T::multiply(&mut d_h, rows, &packed, transposed);
    }
    let mut d_recurrent = vec![T::default(); 4 * width * width];
    let mut panels = Panels::default();
    pack_rows(&mut packed, &gates, (4 * width, all), (1, 4 * width));
    panels.pack(&before, all, width, width);
    T::multiply(&mut d_recurrent, 4 * width, &packed, &panels);
    d_recurrent
}

impl Operation<2> for Recurrence {
    const NAME: &'static str = "lstm-layer";

    fn shape(&self, [driven, _]: [&Shape; 2]) -> Result<Shape> {
        let (batch, ..) = driven.dims3()?;
        let Sizes { samples, width } = Sizes::from_shapes(driven)?;
        Ok((batch, samples, width).into())
    }

    fn forward<T: Real>(
        &self,
        [driven, recurrent]: [&[T]; 2],
        [shape, _]: [&Shape; 2],
    ) -> Result<Vec<T>> {
        let sizes = Sizes::from_shapes(shape)?;
        let Sizes { samples, width } = sizes;
        let panels = Panels::transposed(recurrent, width, 4 * width);
        let mut out = vec![T::default(); driven.len() / 4];
        out.par_chunks_mut(CHUNK * samples * width)
            .zip(driven.par_chunks(CHUNK * samples * 4 * width))
            .for_each(|(out, driven)| forward_chunk(sizes, &panels, driven, out));
        Ok(out)
    }

    fn backward<T: Real>(&self, pass: &BackwardPass<'_, 2>) -> Result<[Option<Vec<T>>; 2]> {
        let [driven, recurrent] = pass.arguments;
        let sizes = Sizes::from_shapes(driven.shape())?;
        let Sizes { samples, width } = sizes;
        let weight = values::<T>(recurrent)?;
        let forward = Panels::transposed(&weight, width, 4 * width);
        let transposed = Panels::new(&weight, 4 * width, width);
        let (p, h) = (values::<T>(driven)?, values::<T>(pass.result)?);
        let g = values::<T>(pass.gradient)?;
        let mut d_driven = vec![T::default(); p.len()];
        let row = CHUNK * samples * width;
        let parts: Vec<Vec<T>> = d_driven
            .par_chunks_mut(4 * row)
            .zip(p.par_chunks(4 * row))
            .zip(h.par_chunks(row).zip(g.par_chunks(row)))
            .map(|((d_driven, p), (h, g))| {
                backward_chunk(sizes, (&forward, &transposed), [p, h, g], d_driven)
            })
            .collect();
        let d_recurrent = sum_in_order(parts, weight.len());
        Ok([Some(d_driven), Some(d_recurrent)])
    }
}

#[cfg(test)]
mod tests {
    use candle_core::Var;

    use super::*;
    use crate::testing::numbers;
    use crate::testing::{ramp, weighted};

    /// Ten trajectories are two chunks.
    #[test]
    fn the_kernel_agrees_with_candle_sample_by_sample_with_its_gradients() {
        for samples in [1, 2, 13] {
            let vars = [
                Var::from_tensor(&ramp(&[10, samples, 4 * 3], 0.53)).expect("a variable"),
                Var::from_tensor(&ramp(&[4 * 3, 3], 1.7)).expect("a variable"),
            ];
            let run = |operations| {
                let h = recur(operations, &vars[0], &vars[1]).expect("runs");
                let gradients = weighted(&h).backward().expect("derives");
                let mut found = numbers(&h);
                for var in &vars {
                    found.extend(numbers(gradients.get(var).expect("a gradient")));
                }
                found
            };
            let (kernel, tensors) = (run(Backend::Kernels), run(Backend::Tensors));
            assert_eq!(kernel.len(), tensors.len());
            for (a, b) in kernel.iter().zip(&tensors) {
                assert!((a - b).abs() < 1e-12, "{samples} samples: {a} against {b}");
            }
        }
    }
}
