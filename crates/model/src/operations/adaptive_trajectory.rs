//! A whole trajectory of the force by adaptive steps ([`crate::solver::dormand_prince`]) as one differentiable operation.
//!
//! As in [`super::trajectory`] the time loop is one operation with its own derivative, the discrete adjoint of the
//! steps as they were taken. Their lengths are held fixed: the gradient leaves out that another force would have led to
//! other lengths (which changes the force by less than the tolerance; torchdiffeq leaves it out too).
//!
//! ```text
//! g = dL/dF';   for stages i = last .. first:  u_i = s (b_i g + sum_{j>i} a_ji v_j (part of F)),   v_i = J_i^T u_i
//! dL/dF = g + sum_i v_i (part of F),   dL/dh_k += sum_i v_i (part of h)
//! ```
//!
//! The forward pass records the trajectory, the length and the starting force of every step: f + 2 numbers a step, little
//! beside one hidden layer. From these the backward pass evaluates the stages again, several samples at once, and walks
//! them in reverse.
//!
//! The batch is cut into chunks as there; within a chunk the products are over the trajectories that have not reached the
//! end of the sample period.

use std::{any::Any, ops::Range, sync::OnceLock};

use candle_core::{Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    custom_operation::{BackwardPass, Operation, apply_3, values},
    trajectory::{Sizes, chunk},
};
use crate::{
    kernel::{Real, sum_in_order},
    perceptron::{PerceptronConfig, PerceptronRows, Tape, Work},
    solver::dormand_prince::{A, B, Clock, Period, STAGES, WEIGHED, lean},
};

/// Steps of a chunk's trajectories whose activations are held at a time, at most; or those of one sample, if more.
const SEGMENT: usize = 64;

/// The operation: F_0 [B, f], h [B, S, l], weights of a field of [F; h] (flat) -> F [B, S+1, f].
pub(crate) struct AdaptiveTrajectory {
    field: PerceptronConfig,
    /// A `Vec<Taken<T>>` with one entry a chunk, set by the forward pass.
    taken: OnceLock<Box<dyn Any + Send + Sync>>,
}

/// Steps taken by the trajectories of a chunk, those of each trajectory in order.
struct Taken<T> {
    /// Number of steps up to the end of each sample period [S].
    until: Vec<usize>,
    /// Trajectory and length of each step.
    steps: Vec<(usize, T)>,
    /// F at their starts [steps, f].
    forces: Vec<T>,
}

impl<T> Taken<T> {
    /// Steps of the sample periods from `first` to before `end`.
    fn range(&self, first: usize, end: usize) -> Range<usize> {
        let until = |sample: usize| sample.checked_sub(1).map_or(0, |last| self.until[last]);
        until(first)..until(end)
    }

    /// The longest run of steps that ends at `end`, not before `begin`, with at most one step of each trajectory.
    fn round(&self, begin: usize, end: usize) -> Range<usize> {
        let mut from = end - 1;
        while from > begin && self.steps[from - 1].0 < self.steps[from].0 {
            from -= 1;
        }
        from..end
    }

    /// The first of the sample periods before `end` that fill a segment.
    fn segment(&self, end: usize) -> usize {
        let mut first = end - 1;
        while first > 0 && self.range(first - 1, end).len() <= SEGMENT {
            first -= 1;
        }
        first
    }
}

/// Buffers of the way back.
struct Back<T> {
    tape: Tape<T>,
    work: Work<T>,
    out: Vec<T>,
    /// k of a segment [WEIGHED, steps, f].
    slopes: Vec<T>,
    /// v of a round, stage by stage [rows, inputs].
    through: Vec<Vec<T>>,
    /// dL/dF where the walk stands [rows, f].
    after: Vec<T>,
}

impl AdaptiveTrajectory {
    /// For a field that is given the force.
    pub(crate) fn new(field: PerceptronConfig) -> Self {
        Self {
            field,
            taken: OnceLock::new(),
        }
    }

    /// Applies the operation.
    pub(crate) fn apply(self, start: &Tensor, latent: &Tensor, weights: &Tensor) -> Result<Tensor> {
        apply_3(self, [start, latent, weights])
    }

    /// One chunk: `forces` [rows, S+1, f] with the start in place, h [rows, S, l].
    fn forward_chunk<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        forces: &mut [T],
        latent: &[T],
    ) -> Taken<T> {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let rows = forces.len() / ((steps + 1) * force);
        let inputs = self.field.inputs;
        let (mut work, mut out) = (Work::default(), Vec::new());
        let mut now: Vec<T> = forces
            .chunks_exact((steps + 1) * force)
            .flat_map(|row| row[..force].to_vec())
            .collect();
        let mut input = vec![T::default(); rows * inputs];
        let mut slopes = vec![T::default(); STAGES * rows * force];
        let mut clocks = vec![Clock::default(); rows];
        let mut taken = Taken {
            until: Vec::with_capacity(steps),
            steps: Vec::new(),
            forces: Vec::new(),
        };
        for step in 0..steps {
            for (row, input) in input.chunks_exact_mut(inputs).enumerate() {
                input[force..].copy_from_slice(&latent[(row * steps + step) * width..][..width]);
            }
            let period = Period {
                force: &mut now,
                input: &mut input,
                slopes: &mut slopes,
                clocks: &mut clocks,
            };
            let evaluate = |x: &[T], y: &mut [T]| {
                field.evaluate(x, &mut out, &mut work, ());
                y.copy_from_slice(&out);
            };
            period.run(evaluate, |row, length, force| {
                taken.steps.push((row, length));
                taken.forces.extend_from_slice(force);
            });
            taken.until.push(taken.steps.len());
            for (row, now) in now.chunks_exact(force).enumerate() {
                forces[(row * (steps + 1) + step + 1) * force..][..force].copy_from_slice(now);
            }
        }
        taken
    }

    /// One chunk of the adjoint: gradients of F_0 (into the front of `gradient`'s rows), of h, of the weights.
    fn backward_chunk<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        (taken, latent): (&Taken<T>, &[T]),
        gradient: &mut [T],
        d_latent: &mut [T],
    ) -> Vec<T> {
        let Sizes { steps, force, .. } = sizes;
        let row = (steps + 1) * force;
        let mut d_weights = vec![T::default(); self.field.count()];
        let mut back = Back {
            tape: Tape::default(),
            work: Work::default(),
            out: Vec::new(),
            slopes: Vec::new(),
            through: vec![Vec::new(); WEIGHED],
            after: vec![T::default(); gradient.len() / row * force],
        };
        let mut end = steps;
        while end > 0 {
            let first = taken.segment(end);
            let segment = taken.range(first, end);
            self.stages_again(field, sizes, (taken, latent), (first, end), &mut back);
            for sample in (first..end).rev() {
                let at = (sample + 1) * force;
                for (after, gradient) in back
                    .after
                    .chunks_exact_mut(force)
                    .zip(gradient.chunks_exact(row))
                {
                    after.copy_from_slice(&gradient[at..][..force]);
                }
                let Range { start, mut end } = taken.range(sample, sample + 1);
                while end > start {
                    let round = taken.round(start, end);
                    end = round.start;
                    self.step_back(
                        field,
                        sizes,
                        taken,
                        (&segment, round, sample),
                        d_latent,
                        &mut back,
                    );
                }
                for (after, gradient) in back
                    .after
                    .chunks_exact(force)
                    .zip(gradient.chunks_exact_mut(row))
                {
                    for (gradient, after) in gradient[at - force..].iter_mut().zip(after) {
                        *gradient += *after;
                    }
                }
            }
            let rows = WEIGHED * segment.len();
            field.accumulate(&back.tape, rows, &mut d_weights, &mut back.work);
            end = first;
        }
        d_weights
    }

    /// The stages of all steps of the samples from `first` to before `end`; rows are ordered (stage, step).
    fn stages_again<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        (taken, latent): (&Taken<T>, &[T]),
        (first, end): (usize, usize),
        back: &mut Back<T>,
    ) {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let Back {
            tape,
            work,
            out,
            slopes,
            ..
        } = back;
        let inputs = self.field.inputs;
        let segment = taken.range(first, end);
        let (begin, count) = (segment.start, segment.len());
        tape.resize(&self.field, WEIGHED * count);
        slopes.resize(WEIGHED * count * force, T::default());
        for (stage, a) in A.iter().enumerate().take(WEIGHED) {
            let input = &mut tape.input[stage * count * inputs..][..count * inputs];
            for sample in first..end {
                for step in taken.range(sample, sample + 1) {
                    let (row, length) = taken.steps[step];
                    let at = step - begin;
                    let (x, h) = input[at * inputs..][..inputs].split_at_mut(force);
                    h.copy_from_slice(&latent[(row * steps + sample) * width..][..width]);
                    let now = &taken.forces[step * force..][..force];
                    lean(x, now, (a, length), &slopes[at * force..], count * force);
                }
            }
            let hidden = (&mut tape.hidden, stage * count, &self.field);
            field.evaluate(input, out, work, hidden);
            slopes[stage * count * force..][..count * force].copy_from_slice(out);
        }
    }

    /// Derives the steps of a `round`, which are among those of the `segment` on the tape and of one sample period:
    /// takes dL/dF from their ends to their starts, and adds to dL/dh.
    fn step_back<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        taken: &Taken<T>,
        (segment, round, sample): (&Range<usize>, Range<usize>, usize),
        d_latent: &mut [T],
        back: &mut Back<T>,
    ) {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let Back {
            tape,
            work,
            through,
            after,
            ..
        } = back;
        let inputs = self.field.inputs;
        for stage in (0..WEIGHED).rev() {
            let at = stage * segment.len() + round.start - segment.start;
            let upstream = &mut tape.output[at * force..][..round.len() * force];
            for ((index, upstream), (row, length)) in upstream
                .chunks_exact_mut(force)
                .enumerate()
                .zip(&taken.steps[round.clone()])
            {
                for (i, upstream) in upstream.iter_mut().enumerate() {
                    let mut sum = T::real(B[stage]) * after[row * force + i];
                    for later in stage + 1..WEIGHED {
                        sum += T::real(A[later][stage]) * through[later][index * inputs + i];
                    }
                    *upstream = *length * sum;
                }
            }
            field.transpose(tape, at, round.len(), &mut through[stage], work);
        }
        for (index, (row, _)) in taken.steps[round].iter().enumerate() {
            let after = &mut after[row * force..][..force];
            let d_latent = &mut d_latent[(row * steps + sample) * width..][..width];
            for through in &*through {
                let (force_part, latent_part) = through[index * inputs..][..inputs].split_at(force);
                for (sum, part) in after.iter_mut().zip(force_part) {
                    *sum += *part;
                }
                for (sum, part) in d_latent.iter_mut().zip(latent_part) {
                    *sum += *part;
                }
            }
        }
    }
}

impl Operation<3> for AdaptiveTrajectory {
    const NAME: &'static str = "adaptive-force-trajectory";

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
        let (row, chunk) = ((steps + 1) * force, chunk(start.len() / force));
        let mut forces = vec![T::default(); start.len() / force * row];
        for (row, start) in forces.chunks_exact_mut(row).zip(start.chunks_exact(force)) {
            row[..force].copy_from_slice(start);
        }
        let taken: Vec<Taken<T>> = forces
            .par_chunks_mut(chunk * row)
            .zip(latent.par_chunks(chunk * steps * width))
            .map(|(forces, latent)| self.forward_chunk(&field, sizes, forces, latent))
            .collect();
        // An operation is applied once, so nothing is there yet.
        self.taken.get_or_init(|| Box::new(taken));
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
        let Some(taken) = self
            .taken
            .get()
            .and_then(|taken| taken.downcast_ref::<Vec<Taken<T>>>())
        else {
            candle_core::bail!("{} has had no forward pass", Self::NAME);
        };
        let field = PerceptronRows::new(&self.field, &values::<T>(flat)?, true);
        let (h, mut g) = (values::<T>(latent)?, values::<T>(pass.gradient)?);
        let mut d_latent = vec![T::default(); h.len()];
        let row = (steps + 1) * force;
        let chunk = chunk(g.len() / row);
        let parts: Vec<Vec<T>> = g
            .par_chunks_mut(chunk * row)
            .zip(d_latent.par_chunks_mut(chunk * steps * width))
            .zip(taken.par_iter().zip(h.par_chunks(chunk * steps * width)))
            .map(|((gradient, d_latent), given)| {
                self.backward_chunk(&field, sizes, given, gradient, d_latent)
            })
            .collect();
        let d_flat = sum_in_order(parts, self.field.count());
        let d_start = g
            .chunks_exact(row)
            .flat_map(|row| row[..force].to_vec())
            .collect();
        Ok([Some(d_start), Some(d_latent), Some(d_flat)])
    }
}

#[cfg(test)]
mod tests;
