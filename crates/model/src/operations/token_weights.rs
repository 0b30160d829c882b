//! Mean attention weights of tokens that are linear in one number each, as one differentiable operation.
//!
//! ```text
//! score_ij = z_i z_j P_ij + z_i Q_ij + z_j U_ij + V_ij,   weight_j = mean_i softmax_j(score_i)_j
//! ```
//!
//! for every row z [N] and head. The kernel holds one row of scores at a time and evaluates it again in the backward pass;
//! tensor operations hold the squares of all rows. z is data: it has no gradient.

use candle_core::{D, Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    backend::Backend,
    custom_operation::{BackwardPass, Operation, apply_2, values},
    softmax::softmax,
};
use crate::kernel::{Real, dot, sum_in_order};

/// Rows whose gradients of the tables are summed by one thread. A constant, so that the sums have one order everywhere.
const CHUNK: usize = 64;

/// z [R, N], tables [4, H, N, N] -> weights [R, H, N].
pub(crate) fn token_weights(backend: Backend, z: &Tensor, tables: &Tensor) -> Result<Tensor> {
    match backend {
        Backend::Kernels => apply_2(TokenWeights, [z, tables]),
        Backend::Tensors => by_tensors(z, tables),
    }
}

fn by_tensors(z: &Tensor, tables: &Tensor) -> Result<Tensor> {
    let (rows, count) = z.dims2()?;
    let (down, along) = (
        z.reshape((rows, 1, count, 1))?,
        z.reshape((rows, 1, 1, count))?,
    );
    let table = |index: usize| tables.narrow(0, index, 1);
    let steep = (along.broadcast_mul(&table(0)?)?.broadcast_add(&table(1)?))?;
    let flat = (along.broadcast_mul(&table(2)?)?.broadcast_add(&table(3)?))?;
    let scores = (steep.broadcast_mul(&down)? + flat)?;
    let largest = scores.detach().max_keepdim(D::Minus1)?;
    let powers = scores.broadcast_sub(&largest)?.exp()?;
    let weights = powers.broadcast_div(&powers.sum_keepdim(D::Minus1)?)?;
    weights.sum(2)? / count as f64
}

/// The kernel.
struct TokenWeights;

/// The tables of one head, [N, N] each.
struct Head<'a, T> {
    tables: [&'a [T]; 4],
}

impl<'a, T: Real> Head<'a, T> {
    fn all(tables: &'a [T], heads: usize, count: usize) -> Vec<Self> {
        let square = count * count;
        let of = |index: usize, head: usize| &tables[(index * heads + head) * square..][..square];
        (0..heads)
            .map(|head| Self {
                tables: [0, 1, 2, 3].map(|index| of(index, head)),
            })
            .collect()
    }

    /// Softmax weights of token `i` of z.
    fn weights(&self, z: &[T], i: usize, weights: &mut [T]) {
        let count = z.len();
        let [p, q, u, v] = self.tables.map(|table| &table[i * count..][..count]);
        let own = z[i];
        for (j, weight) in weights.iter_mut().enumerate() {
            *weight = z[j] * (own * p[j] + u[j]) + (own * q[j] + v[j]);
        }
        softmax(weights);
    }
}

impl Operation<2> for TokenWeights {
    const NAME: &'static str = "token-weights";

    fn shape(&self, [z, tables]: [&Shape; 2]) -> Result<Shape> {
        let ((rows, count), (_, heads, ..)) = (z.dims2()?, tables.dims4()?);
        Ok((rows, heads, count).into())
    }

    fn forward<T: Real>(
        &self,
        [z, tables]: [&[T]; 2],
        [shape, of_tables]: [&Shape; 2],
    ) -> Result<Vec<T>> {
        let ((rows, count), (_, heads, ..)) = (shape.dims2()?, of_tables.dims4()?);
        let heads = Head::all(tables, heads, count);
        let share = T::real(1.0 / count as f64);
        let mut out = vec![T::default(); rows * heads.len() * count];
        out.par_chunks_mut(heads.len() * count)
            .zip(z.par_chunks(count))
            .for_each(|(out, z)| {
                let mut weights = vec![T::default(); count];
                for (head, out) in heads.iter().zip(out.chunks_exact_mut(count)) {
                    for i in 0..count {
                        head.weights(z, i, &mut weights);
                        for (out, weight) in out.iter_mut().zip(&weights) {
                            *out += share * *weight;
                        }
                    }
                }
            });
        Ok(out)
    }

    fn backward<T: Real>(&self, pass: &BackwardPass<'_, 2>) -> Result<[Option<Vec<T>>; 2]> {
        let [z, tables] = pass.arguments;
        let (count, heads) = (z.dim(1)?, tables.dim(1)?);
        let (z, tables) = (values::<T>(z)?, values::<T>(tables)?);
        let upstream = values::<T>(pass.gradient)?;
        let square = count * count;
        let share = T::real(1.0 / count as f64);
        let each = Head::all(&tables, heads, count);
        let parts: Vec<Vec<T>> = z
            .par_chunks(CHUNK * count)
            .zip(upstream.par_chunks(CHUNK * heads * count))
            .map(|(z, upstream)| {
                let mut d_tables = vec![T::default(); 4 * heads * square];
                let mut weights = vec![T::default(); count];
                for (z, upstream) in z
                    .chunks_exact(count)
                    .zip(upstream.chunks_exact(heads * count))
                {
                    for (index, (head, gradient)) in
                        each.iter().zip(upstream.chunks_exact(count)).enumerate()
                    {
                        for i in 0..count {
                            head.weights(z, i, &mut weights);
                            // Through the softmax: ds = w (dw - sum w dw).
                            let mean = dot(&weights, gradient);
                            for (weight, gradient) in weights.iter_mut().zip(gradient) {
                                *weight *= share * (*gradient - mean);
                            }
                            for (which, by) in [z[i], z[i], T::real(1.0), T::real(1.0)]
                                .into_iter()
                                .enumerate()
                            {
                                let row = (which * heads + index) * square + i * count;
                                let d_row = &mut d_tables[row..][..count];
                                if which % 2 == 0 {
                                    for ((d, score), z) in d_row.iter_mut().zip(&weights).zip(z) {
                                        *d += by * *score * *z;
                                    }
                                } else {
                                    for (d, score) in d_row.iter_mut().zip(&weights) {
                                        *d += by * *score;
                                    }
                                }
                            }
                        }
                    }
                }
                d_tables
            })
            .collect();
        Ok([None, Some(sum_in_order(parts, tables.len()))])
    }
}
