//! A whole trajectory of the force as one differentiable operation.
//!
//! F_{k+1} = F_k + Phi(F_k, h_k), k = 0 .. S-1, with Phi one explicit step of the field ([`Tableau`]).
//! Unrolled into Candle's graph, 400 steps would be sorted recursively and overflow the stack; here the
//! time loop is one operation with its own derivative, the discrete adjoint of the method:
//!
//! ```text
//! g = dL/dF_{k+1};   for stages i = last .. first:  u_i = b_i g + a_{i+1,i} s_{i+1},  s_i = J_i^T u_i
//! dL/dF_k += g + sum_i s_i (part of F),   dL/dh_k = sum_i s_i (part of h)
//! ```
//!
//! The continuous adjoint ([`Adjoint::Continuous`]) solves da/dt = -J^T a backward over each step instead, from the
//! force at its end, with F backward in time as well:
//!
//! ```text
//! F^i = F_{k+1} - a_{i,i-1} f(F^{i-1}, h_k),  u_i = g + a_{i,i-1} s_{i-1},  s_i = J(F^i)^T u_i    i = first .. last
//! dL/dF_k += g + sum_i b_i s_i (part of F),   dL/dh_k = sum_i b_i s_i (part of h)
//! ```
//!
//! A field that is not given the force makes a running sum, whose products are batched over the whole time, both ways.
//!
//! If they fit, the inputs of the hidden activations are cached in the forward pass for the backward pass
//! ([`super::activation_cache`]). Otherwise the backward pass has the forces alone and evaluates the stages of a segment of
//! steps again, all steps at once, since every F_k is known: the same numbers, bit for bit, in memory that does not grow
//! with the number of steps. Only the transposed products run step by step in time; the gradients of the weights are
//! products over all rows of a segment.
//!
//! The batch is cut into chunks whose gradients are summed in order. The size of the batch alone determines the chunks, so
//! the result does not depend on the number of threads. The products over rows are [`PerceptronRows`]'s.

use candle_core::{Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    activation_cache::{ActivationCache, Mark, fits},
    custom_operation::{BackwardPass, Operation, apply_3, values},
};
use crate::{
    adjoint::Adjoint,
    kernel::{Real, sum_in_order},
    perceptron::{PerceptronConfig, PerceptronRows, Tape, Work},
    solver::Tableau,
};

/// Steps times stages whose activations are held at a time: with 16 rows each, one block of the kernel.
const SEGMENT: usize = 16;

/// Terms of a running sum that are one product.
const BLOCK: usize = 16 * SEGMENT;

/// Trajectories that a thread integrates together: enough to share each reading of the weights, few enough that a
/// small batch still makes work for two threads. Of the batch alone, so that the sums have one order everywhere.
pub(super) fn chunk(batch: usize) -> usize {
    if batch > 16 { 16 } else { 8 }
}

/// The operation: F_0 [B, f], h [B, S, l], weights of the field (flat) -> F [B, S+1, f].
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    pub(crate) field: PerceptronConfig,
    /// Method of a step.
    pub(crate) tableau: Tableau,
    /// True if the field reads [F; h], false if h alone.
    pub(crate) field_sees_force: bool,
    pub(crate) adjoint: Adjoint,
    /// Cache of hidden layers for the backward pass; `None` if no gradient will be computed.
    pub(crate) cache: Option<ActivationCache>,
    /// Owner of the cached layers, set by [`Trajectory::apply`].
    pub(crate) mark: Mark,
}

/// Sizes of one call.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    pub(super) steps: usize,
    pub(super) force: usize,
    pub(super) latent: usize,
}

impl Sizes {
    /// Sizes from the shapes of F_0 [B, f] and h [B, S, l].
    pub(super) fn from_shapes(start: &Shape, latent: &Shape) -> Result<Self> {
        let (_, force) = start.dims2()?;
        let (_, steps, latent) = latent.dims3()?;
        Ok(Self {
            steps,
            force,
            latent,
        })
    }
}

impl Trajectory {
    /// Applies the operation.
    pub(crate) fn apply(
        mut self,
        start: &Tensor,
        latent: &Tensor,
        weights: &Tensor,
    ) -> Result<Tensor> {
        self.mark = Mark::new();
        apply_3(self, [start, latent, weights])
    }

    /// Columns of the field's input that hold the force.
    fn force_columns(&self) -> usize {
        if self.field_sees_force {
            self.field.outputs
        } else {
            0
        }
    }

    /// Numbers cached for one trajectory: hidden layers and slope of every stage of every step.
    fn cached_len(&self, steps: usize) -> usize {
        let stages = self.tableau.weights.len();
        steps * stages * (self.field.hidden.iter().sum::<usize>() + self.field.outputs)
    }

    /// The cache, if the backward pass of `batch` trajectories can use it. The continuous adjoint has other stages than the
    /// forward pass, and a running sum is one product in either pass.
    fn usable_cache(&self, batch: usize, steps: usize) -> Option<&ActivationCache> {
        let worth = self.field_sees_force
            && self.adjoint == Adjoint::Discrete
            && fits(batch * self.cached_len(steps));
        self.cache.as_ref().filter(|_| worth)
    }

    /// One chunk: `forces` [rows, S+1, f] with the start in place, h [rows, S, l]; `cache` receives the hidden layers.
    fn forward_chunk<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        (forces, mut cache): (&mut [T], Option<&mut Vec<T>>),
        latent: &[T],
    ) {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let rows = forces.len() / ((steps + 1) * force);
        let sees = self.force_columns();
        let tableau = self.tableau;
        let (mut work, mut slope) = (Work::default(), vec![T::default(); rows * force]);
        let mut input = vec![T::default(); rows * self.field.inputs];
        if let Some(cache) = &mut cache {
            cache.clear();
            cache.reserve_exact(rows * self.cached_len(steps));
        }
        for step in 0..steps {
            let mut change = vec![T::default(); rows * force];
            for (row, input) in input.chunks_exact_mut(self.field.inputs).enumerate() {
                input[sees..].copy_from_slice(&latent[(row * steps + step) * width..][..width]);
            }
            for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
                for (row, input) in input.chunks_exact_mut(self.field.inputs).enumerate() {
                    let now = &forces[(row * (steps + 1) + step) * force..][..force];
                    for (i, slot) in input[..sees].iter_mut().enumerate() {
                        *slot = now[i] + T::real(*along) * slope[row * force + i];
                    }
                }
                match &mut cache {
                    Some(cache) => {
                        field.evaluate(&input, &mut slope, &mut work, &mut **cache);
                        cache.extend_from_slice(&slope);
                    }
                    None => field.evaluate(&input, &mut slope, &mut work, ()),
                }
                for (change, slope) in change.iter_mut().zip(&slope) {
                    *change += T::real(*weight) * *slope;
                }
            }
            for (row, change) in change.chunks_exact(force).enumerate() {
                let at = (row * (steps + 1) + step) * force;
                for (i, change) in change.iter().enumerate() {
                    forces[at + force + i] = forces[at + i] + *change;
                }
            }
        }
    }

    /// [`Trajectory::forward_chunk`] of a field that is not given the force: a running sum, its terms one product.
    fn forward_sum<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        forces: &mut [T],
        latent: &[T],
    ) {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let (mut work, mut slopes) = (Work::default(), Vec::new());
        for (forces, latent) in forces
            .chunks_exact_mut((steps + 1) * force)
            .zip(latent.chunks_exact(steps * width))
        {
            for (part, latent) in latent.chunks(BLOCK * width).enumerate() {
                field.evaluate(latent, &mut slopes, &mut work, ());
                let first = part * BLOCK * force;
                for (i, slope) in slopes.iter().enumerate() {
                    forces[first + i + force] = forces[first + i] + *slope;
                }
            }
        }
    }

    /// One chunk of the adjoint: gradients of F_0 (into the front of `gradient`'s rows), of h, of the weights. `cache`
    /// is what [`Trajectory::forward_chunk`] left, if it is still there.
    fn backward_chunk<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        (forces, latent, cache): (&[T], &[T], Option<&Vec<T>>),
        gradient: &mut [T],
        d_latent: &mut [T],
    ) -> Vec<T> {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let rows = forces.len() / ((steps + 1) * force);
        let inputs = self.field.inputs;
        let sees = self.force_columns();
        let tableau = self.tableau;
        let stages = tableau.weights.len();
        let length = (SEGMENT / stages).max(1);
        // The end of a step from which its stages start, and their direction.
        let (from, sign) = match self.adjoint {
            Adjoint::Discrete => (0, 1.0),
            Adjoint::Continuous => (1, -1.0),
        };
        let row_len = self.cached_len(1) / stages;
        let mut d_weights = vec![T::default(); self.field.count()];
        let mut work = Work::default();
        let mut slope = Vec::new();
        let mut stage_gradient = vec![T::default(); rows * inputs];
        let mut total = vec![T::default(); rows * inputs];
        let mut tape = Tape::default();

        for end in (1..=steps).rev().step_by(length) {
            let first = end.saturating_sub(length);
            let count = end - first;
            let block = count * rows;

            // The stages, all steps of the segment at once; rows are ordered (stage, step, trajectory).
            tape.resize(&self.field, stages * block);
            for (stage, along) in tableau.along_previous.iter().enumerate() {
                let input = &mut tape.input[stage * block * inputs..][..block * inputs];
                for (index, input) in input.chunks_exact_mut(inputs).enumerate() {
                    let (step, row) = (first + index / rows, index % rows);
                    input[sees..].copy_from_slice(&latent[(row * steps + step) * width..][..width]);
                    let now = &forces[(row * (steps + 1) + step + from) * force..][..force];
                    for (i, slot) in input[..sees].iter_mut().enumerate() {
                        let before = if stage == 0 {
                            T::default()
                        } else {
                            slope[index * force + i]
                        };
                        *slot = now[i] + T::real(*along * sign) * before;
                    }
                }
                if let Some(cache) = cache {
                    slope.clear();
                    for step in first..end {
                        let at = (stage * count + step - first) * rows;
                        let found =
                            &cache[(step * stages + stage) * rows * row_len..][..rows * row_len];
                        slope.extend_from_slice(tape.hidden.recall(&self.field, at, rows, found));
                    }
                } else {
                    let hidden = (&mut tape.hidden, stage * block, &self.field);
                    field.evaluate(input, &mut slope, &mut work, hidden);
                }
            }
            if cache.is_some() {
                tape.hidden.activate();
            }

            if sees == 0 {
                self.walk_sum(sizes, (first, end), gradient, &mut tape.output);
                field.transpose(&mut tape, 0, block, &mut stage_gradient, &mut work);
                for (index, part) in stage_gradient.chunks_exact(width).enumerate() {
                    let (step, row) = (first + index / rows, index % rows);
                    d_latent[(row * steps + step) * width..][..width].copy_from_slice(part);
                }
                field.accumulate(&tape, block, &mut d_weights, &mut work);
                continue;
            }
            // Back in time, step by step.
            for step in (first..end).rev() {
                stage_gradient.fill(T::default());
                total.fill(T::default());
                for turn in 0..stages {
                    // What this stage's slope is multiplied by: the step's weight for it, and, through the stage
                    // that was derived before, what its own slope takes part in.
                    let (stage, own, along) = match self.adjoint {
                        Adjoint::Discrete => {
                            let stage = stages - 1 - turn;
                            let after = tableau.along_previous.get(stage + 1);
                            (stage, tableau.weights[stage], after.copied().unwrap_or(0.0))
                        }
                        Adjoint::Continuous => {
                            let before = turn.checked_sub(1).map_or(1.0, |b| tableau.weights[b]);
                            let weight = tableau.weights[turn];
                            // The gradient at hand is b_{i-1} s_{i-1}, and b_i u_i is wanted.
                            (turn, weight, weight * tableau.along_previous[turn] / before)
                        }
                    };
                    let at = stage * block + (step - first) * rows;
                    let upstream = &mut tape.output[at * force..][..rows * force];
                    for (row, upstream) in upstream.chunks_exact_mut(force).enumerate() {
                        let next = &gradient[(row * (steps + 1) + step + 1) * force..][..force];
                        for (i, upstream) in upstream.iter_mut().enumerate() {
                            let through = stage_gradient[row * inputs + i];
                            *upstream = T::real(own) * next[i] + T::real(along) * through;
                        }
                    }
                    field.transpose(&mut tape, at, rows, &mut stage_gradient, &mut work);
                    for (total, part) in total.iter_mut().zip(&stage_gradient) {
                        *total += *part;
                    }
                }
                for (row, total) in total.chunks_exact(inputs).enumerate() {
                    d_latent[(row * steps + step) * width..][..width]
                        .copy_from_slice(&total[sees..]);
                    let at = (row * (steps + 1) + step) * force;
                    for i in 0..force {
                        let next = gradient[at + force + i];
                        gradient[at + i] += next + total[i];
                    }
                }
            }
            field.accumulate(&tape, stages * block, &mut d_weights, &mut work);
        }
        d_weights
    }

    /// A running sum back in time: dL/dy of a segment's rows (step, trajectory) is dL/dF of all that comes later.
    fn walk_sum<T: Real>(
        &self,
        Sizes { steps, force, .. }: Sizes,
        (first, end): (usize, usize),
        gradient: &mut [T],
        output: &mut [T],
    ) {
        let row = (steps + 1) * force;
        let rows = gradient.len() / row;
        for (index, gradient) in gradient.chunks_exact_mut(row).enumerate() {
            for step in (first..end).rev() {
                let (now, next) = gradient[step * force..].split_at_mut(force);
                for (now, next) in now.iter_mut().zip(&next[..force]) {
                    *now += *next;
                }
                output[((step - first) * rows + index) * force..][..force]
                    .copy_from_slice(&next[..force]);
            }
        }
    }
}

impl Operation<3> for Trajectory {
    const NAME: &'static str = "force-trajectory";

    fn shape(&self, [start, latent, _]: [&Shape; 3]) -> Result<Shape> {
        let sizes = Sizes::from_shapes(start, latent)?;
        Ok((start.dims()[0], sizes.steps + 1, sizes.force).into())
    }

    fn forward<T: Real>(
        &self,
        [start, latent, flat]: [&[T]; 3],
        [start_shape, latent_shape, _]: [&Shape; 3],
    ) -> Result<Vec<T>> {
        let sizes = Sizes::from_shapes(start_shape, latent_shape)?;
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let field = PerceptronRows::new(&self.field, flat, false);
        let batch = start.len() / force;
        let (row, chunk) = ((steps + 1) * force, chunk(batch));
        let mut forces = vec![T::default(); start.len() / force * row];
        for (row, start) in forces.chunks_exact_mut(row).zip(start.chunks_exact(force)) {
            row[..force].copy_from_slice(start);
        }
        let chunks = forces
            .par_chunks_mut(chunk * row)
            .zip(latent.par_chunks(chunk * steps * width));
        if let Some(slot) = self.usable_cache(batch, steps) {
            let mut cache = slot.memory::<T>(batch.div_ceil(chunk));
            chunks
                .zip(&mut cache)
                .for_each(|((forces, latent), cache)| {
                    self.forward_chunk(&field, sizes, (forces, Some(cache)), latent);
                });
            slot.put(Some(self.mark), cache);
        } else if self.field_sees_force {
            chunks.for_each(|(forces, latent)| {
                self.forward_chunk(&field, sizes, (forces, None), latent);
            });
        } else {
            chunks.for_each(|(forces, latent)| self.forward_sum(&field, sizes, forces, latent));
        }
        Ok(forces)
    }

    fn backward<T: Real>(&self, pass: &BackwardPass<'_, 3>) -> Result<[Option<Vec<T>>; 3]> {
        let [start, latent, flat] = pass.arguments;
        let sizes = Sizes::from_shapes(start.shape(), latent.shape())?;
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let field = PerceptronRows::new(&self.field, &values::<T>(flat)?, true);
        let (h, f) = (values::<T>(latent)?, values::<T>(pass.result)?);
        let mut g = values::<T>(pass.gradient)?;
        let mut d_latent = vec![T::default(); h.len()];
        let row = (steps + 1) * force;
        let chunk = chunk(g.len() / row);
        let slot = self.cache.as_ref();
        let cache = slot.and_then(|slot| slot.take::<T>(self.mark));
        let cached_chunk = |index: usize| cache.as_ref().map(|chunks| &chunks[index]);
        let parts: Vec<Vec<T>> = g
            .par_chunks_mut(chunk * row)
            .zip(d_latent.par_chunks_mut(chunk * steps * width))
            .zip(
                f.par_chunks(chunk * row)
                    .zip(h.par_chunks(chunk * steps * width)),
            )
            .enumerate()
            .map(|(index, ((gradient, d_latent), (forces, latent)))| {
                let given = (forces, latent, cached_chunk(index));
                self.backward_chunk(&field, sizes, given, gradient, d_latent)
            })
            .collect();
        // A second backward evaluates again: the memory is reused by the next step, the numbers are not.
        if let (Some(slot), Some(cache)) = (slot, cache) {
            slot.put(None, cache);
        }
        let d_flat = sum_in_order(parts, self.field.count());
        let d_start = g
            .chunks_exact(row)
            .flat_map(|row| row[..force].to_vec())
            .collect();
        Ok([Some(d_start), Some(d_latent), Some(d_flat)])
    }
}
