//! A whole trajectory of a controlled differential equation as one differentiable operation.
//!
//! ```text
//! ds/du = Phi(s) X'(u),   s [s], X' [c], Phi a field whose s c outputs are read as a matrix [s, c]
//! ```
//!
//! from sample to sample by one explicit step ([`Tableau`]), X' given at the stages' times. As in [`super::trajectory`]
//! the time loop is one operation with the discrete adjoint of the steps as taken, the backward pass has the states alone and
//! evaluates the stages of a segment again, and the batch is cut into chunks of fixed size. The control is data and has no
//! gradient.

use candle_core::{Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    backend::Backend,
    custom_operation::{BackwardPass, Operation, apply_3, values},
};
use crate::{
    kernel::{Real, sum_in_order},
    perceptron::{Perceptron, PerceptronConfig, PerceptronRows, Tape, Work},
    solver::Tableau,
};

/// Trajectories that a thread integrates together.
const CHUNK: usize = 8;
/// Rows of a tape, at most about.
const ROWS: usize = 128;

/// s_0 [B, s], X' [B, S, stages, c] -> s [B, S+1, s].
pub(crate) fn integrate(
    operations: Backend,
    field: &Perceptron,
    tableau: Tableau,
    start: &Tensor,
    slopes: &Tensor,
) -> Result<Tensor> {
    match operations {
        Backend::Kernels => {
            let operation = Controlled {
                field: field.config().clone(),
                tableau,
            };
            apply_3(operation, [start, slopes, &field.flat()?])
        }
        Backend::Tensors => by_tensors(field, tableau, start, slopes),
    }
}

/// Step by step in Candle's own operations.
fn by_tensors(
    field: &Perceptron,
    tableau: Tableau,
    start: &Tensor,
    slopes: &Tensor,
) -> Result<Tensor> {
    let mut states = vec![start.clone()];
    for k in 0..slopes.dim(1)? {
        let slopes = slopes.narrow(1, k, 1)?.squeeze(1)?;
        states.push(step(field, tableau, &states[k], &slopes)?);
    }
    Tensor::stack(&states, 1)
}

/// s [rows, s] one step on, with X' [rows, stages, c] at its stages, by Candle's own operations.
pub(crate) fn step(
    field: &Perceptron,
    tableau: Tableau,
    state: &Tensor,
    slopes: &Tensor,
) -> Result<Tensor> {
    let (rows, width) = state.dims2()?;
    let channels = slopes.dim(2)?;
    let mut slope = state.zeros_like()?;
    let mut next = state.clone();
    for (stage, (along, weight)) in tableau
        .along_previous
        .iter()
        .zip(tableau.weights)
        .enumerate()
    {
        let matrix = field.forward(&(state + (slope * *along)?)?)?;
        let control = slopes.narrow(1, stage, 1)?.squeeze(1)?.unsqueeze(2)?;
        slope = matrix
            .reshape((rows, width, channels))?
            .matmul(&control.contiguous()?)?
            .squeeze(2)?;
        next = (next + (&slope * *weight)?)?;
    }
    Ok(next)
}

#[derive(Clone, Debug)]
struct Controlled {
    field: PerceptronConfig,
    tableau: Tableau,
}

#[derive(Clone, Copy)]
struct Sizes {
    steps: usize,
    stages: usize,
    channels: usize,
    state: usize,
}

/// Phi X': row by row, [rows, s c] and [rows, c] -> [rows, s].
fn contract<T: Real>(matrices: &[T], slopes: &[T], out: &mut [T], channels: usize) {
    let width = out.len() / (slopes.len() / channels);
    for ((out, matrix), slope) in out
        .chunks_exact_mut(width)
        .zip(matrices.chunks_exact(width * channels))
        .zip(slopes.chunks_exact(channels))
    {
        for (out, row) in out.iter_mut().zip(matrix.chunks_exact(channels)) {
            *out = row.iter().zip(slope).map(|(a, b)| *a * *b).sum();
        }
    }
}

impl Controlled {
    fn sizes(&self, slopes: &Shape) -> Result<Sizes> {
        let (_, steps, stages, channels) = slopes.dims4()?;
        Ok(Sizes {
            steps,
            stages,
            channels,
            state: self.field.inputs,
        })
    }

    /// One chunk: `states` [rows, S+1, s] with the start in place.
    fn forward_chunk<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        states: &mut [T],
        slopes: &[T],
    ) {
        let Sizes {
            steps,
            stages,
            channels,
            state: width,
        } = sizes;
        let rows = states.len() / ((steps + 1) * width);
        let tableau = self.tableau;
        let (mut work, mut matrices) = (Work::default(), Vec::new());
        let mut input = vec![T::default(); rows * width];
        let mut slope = vec![T::default(); rows * width];
        let mut control = vec![T::default(); rows * channels];
        for step in 0..steps {
            let mut change = vec![T::default(); rows * width];
            for (stage, (along, weight)) in tableau
                .along_previous
                .iter()
                .zip(tableau.weights)
                .enumerate()
            {
                for row in 0..rows {
                    let now = &states[(row * (steps + 1) + step) * width..][..width];
                    for (i, now) in now.iter().enumerate() {
                        input[row * width + i] = *now + T::real(*along) * slope[row * width + i];
                    }
                    let at = ((row * steps + step) * stages + stage) * channels;
                    control[row * channels..][..channels]
                        .copy_from_slice(&slopes[at..][..channels]);
                }
                field.evaluate(&input, &mut matrices, &mut work, ());
                contract(&matrices, &control, &mut slope, channels);
                for (change, slope) in change.iter_mut().zip(&slope) {
                    *change += T::real(*weight) * *slope;
                }
            }
            for (row, change) in change.chunks_exact(width).enumerate() {
                let at = (row * (steps + 1) + step) * width;
                for (i, change) in change.iter().enumerate() {
                    states[at + width + i] = states[at + i] + *change;
                }
            }
        }
    }

    /// Gradients of one chunk: of s_0 in the front of `gradient`'s rows; returns those of the weights.
    fn backward_chunk<T: Real>(
        &self,
        field: &PerceptronRows<'_, T>,
        sizes: Sizes,
        (states, slopes): (&[T], &[T]),
        gradient: &mut [T],
    ) -> Vec<T> {
        let Sizes {
            steps,
            stages,
            channels,
            state: width,
        } = sizes;
        let rows = states.len() / ((steps + 1) * width);
        let tableau = self.tableau;
        let length = (ROWS / (rows * stages)).max(1);
        let mut d_weights = vec![T::default(); self.field.count()];
        let (mut work, mut tape) = (Work::default(), Tape::default());
        let (mut matrices, mut slope, mut control) = (Vec::new(), Vec::new(), Vec::new());
        let mut stage_gradient = vec![T::default(); rows * width];
        let mut total = vec![T::default(); rows * width];
        for end in (1..=steps).rev().step_by(length) {
            let first = end.saturating_sub(length);
            let block = (end - first) * rows;
            // The stages again; rows are ordered (stage, step, trajectory).
            tape.resize(&self.field, stages * block);
            control.resize(stages * block * channels, T::default());
            slope.clear();
            slope.resize(block * width, T::default());
            for (stage, along) in tableau.along_previous.iter().enumerate() {
                let input = &mut tape.input[stage * block * width..][..block * width];
                let control = &mut control[stage * block * channels..][..block * channels];
                for index in 0..block {
                    let (step, row) = (first + index / rows, index % rows);
                    let now = &states[(row * (steps + 1) + step) * width..][..width];
                    for (i, now) in now.iter().enumerate() {
                        input[index * width + i] =
                            *now + T::real(*along) * slope[index * width + i];
                    }
                    let at = ((row * steps + step) * stages + stage) * channels;
                    control[index * channels..][..channels]
                        .copy_from_slice(&slopes[at..][..channels]);
                }
                let hidden = (&mut tape.hidden, stage * block, &self.field);
                field.evaluate(input, &mut matrices, &mut work, hidden);
                contract(&matrices, control, &mut slope, channels);
            }
            for step in (first..end).rev() {
                stage_gradient.fill(T::default());
                total.fill(T::default());
                for stage in (0..stages).rev() {
                    let after = tableau.along_previous.get(stage + 1);
                    let along = T::real(after.copied().unwrap_or(0.0));
                    let own = T::real(tableau.weights[stage]);
                    let at = stage * block + (step - first) * rows;
                    for row in 0..rows {
                        let next = &gradient[(row * (steps + 1) + step + 1) * width..][..width];
                        let control = &control[(at + row) * channels..][..channels];
                        let output = &mut tape.output[(at + row) * width * channels..];
                        for (i, out) in output[..width * channels]
                            .chunks_exact_mut(channels)
                            .enumerate()
                        {
                            let upstream = own * next[i] + along * stage_gradient[row * width + i];
                            for (out, control) in out.iter_mut().zip(control) {
                                *out = upstream * *control;
                            }
                        }
                    }
                    field.transpose(&mut tape, at, rows, &mut stage_gradient, &mut work);
                    for (total, part) in total.iter_mut().zip(&stage_gradient) {
                        *total += *part;
                    }
                }
                for (row, total) in total.chunks_exact(width).enumerate() {
                    let at = (row * (steps + 1) + step) * width;
                    for (i, total) in total.iter().enumerate() {
                        let next = gradient[at + width + i];
                        gradient[at + i] += next + *total;
                    }
                }
            }
            field.accumulate(&tape, stages * block, &mut d_weights, &mut work);
        }
        d_weights
    }
}

impl Operation<3> for Controlled {
    const NAME: &'static str = "controlled-trajectory";

    fn shape(&self, [start, slopes, _]: [&Shape; 3]) -> Result<Shape> {
        let sizes = self.sizes(slopes)?;
        Ok((start.dims()[0], sizes.steps + 1, sizes.state).into())
    }

    fn forward<T: Real>(
        &self,
        [start, slopes, flat]: [&[T]; 3],
        [_, shape, _]: [&Shape; 3],
    ) -> Result<Vec<T>> {
        let sizes = self.sizes(shape)?;
        let field = PerceptronRows::new(&self.field, flat, false);
        let row = (sizes.steps + 1) * sizes.state;
        let mut states = vec![T::default(); start.len() / sizes.state * row];
        for (row, start) in states
            .chunks_exact_mut(row)
            .zip(start.chunks_exact(sizes.state))
        {
            row[..sizes.state].copy_from_slice(start);
        }
        states
            .par_chunks_mut(CHUNK * row)
            .zip(slopes.par_chunks(CHUNK * sizes.steps * sizes.stages * sizes.channels))
            .for_each(|(states, slopes)| self.forward_chunk(&field, sizes, states, slopes));
        Ok(states)
    }

    fn backward<T: Real>(&self, pass: &BackwardPass<'_, 3>) -> Result<[Option<Vec<T>>; 3]> {
        let [_, slopes, flat] = pass.arguments;
        let sizes = self.sizes(slopes.shape())?;
        let field = PerceptronRows::new(&self.field, &values::<T>(flat)?, true);
        let (control, states) = (values::<T>(slopes)?, values::<T>(pass.result)?);
        let mut g = values::<T>(pass.gradient)?;
        let row = (sizes.steps + 1) * sizes.state;
        let control_row = sizes.steps * sizes.stages * sizes.channels;
        let parts: Vec<Vec<T>> = g
            .par_chunks_mut(CHUNK * row)
            .zip(states.par_chunks(CHUNK * row))
            .zip(control.par_chunks(CHUNK * control_row))
            .map(|((gradient, states), control)| {
                self.backward_chunk(&field, sizes, (states, control), gradient)
            })
            .collect();
        let d_flat = sum_in_order(parts, self.field.count());
        let d_start = g
            .chunks_exact(row)
            .flat_map(|row| row[..sizes.state].to_vec())
            .collect();
        Ok([Some(d_start), None, Some(d_flat)])
    }
}

#[cfg(test)]
mod tests {
    use candle_core::Var;
    use candle_nn::VarBuilder;

    use super::*;
    use crate::Solver;
    use crate::testing::{in_f64, numbers, ramp, weighted};

    /// Ten trajectories are two chunks; 40 steps are several segments.
    #[test]
    fn the_kernel_agrees_with_candle_step_by_step_with_its_gradients() {
        let config = PerceptronConfig {
            inputs: 3,
            outputs: 3 * 2,
            hidden: vec![7, 5],
            skip: false,
            relaxing: false,
        };
        let build = |vb: VarBuilder| Perceptron::new(config.clone(), vb);
        let (field, vars) = in_f64(build);
        for (solver, stages) in [(Solver::Euler, 1), (Solver::Rk4, 4)] {
            let tableau = solver.tableau().expect("of one step");
            let start = Var::from_tensor(&ramp(&[10, 3], 0.9)).expect("a variable");
            let slopes = (ramp(&[10, 40, stages, 2], 0.53) * 0.2).expect("scaled");
            let run = |operations| {
                let states = integrate(operations, &field, tableau, &start, &slopes).expect("runs");
                let gradients = weighted(&states).backward().expect("derives");
                let mut found = numbers(&states);
                for (name, var) in vars.iter().chain([&("start".to_owned(), start.clone())]) {
                    found.extend(numbers(gradients.get(var).expect(name)));
                }
                found
            };
            let (kernel, tensors) = (run(Backend::Kernels), run(Backend::Tensors));
            assert_eq!(kernel.len(), tensors.len());
            for (a, b) in kernel.iter().zip(&tensors) {
                let bound = 1e-11 * b.abs().max(1.0);
                assert!((a - b).abs() < bound, "{solver}: {a} against {b}");
            }
        }
    }
}
