//! A whole trajectory of the force by adaptive steps ([`super::adaptive`]) as one differentiable operation.
//!
//! As in [`super::trajectory`] the time loop is one operation with its own derivative, the discrete adjoint of the
//! steps as they were taken. How long they were is taken as given: that another force would have led to other lengths
//! is no part of the gradient (it changes the force by less than the tolerance, and torchdiffeq leaves it out too).
//!
//! ```text
//! g = dL/dF';   for stages i = last .. first:  u_i = s (b_i g + sum_{j>i} a_ji v_j (part of F)),   v_i = J_i^T u_i
//! dL/dF = g + sum_i v_i (part of F),   dL/dh_k += sum_i v_i (part of h)
//! ```
//!
//! The way forward keeps whose every step was, its length and the force at its start: of every trajectory and sample as
//! many times f + 2 numbers as steps were taken, little beside one hidden layer. From these the way back evaluates the
//! stages again, those of several samples at once, and walks them in reverse.
//!
//! The batch is cut in chunks as there; within a chunk the products are over the trajectories that still have a step to
//! take.

use std::{any::Any, ops::Range, sync::OnceLock};

use candle_core::{CpuStorage, CustomOp3, DType, Layout, Result, Shape, Tensor};
use rayon::prelude::*;

use super::{
    adaptive::{A, B, Clock, Period, STAGES, WEIGHED, lean},
    field::FieldConfig,
    field_rows::{FieldRows, Tape, Work},
    kernel::{Real, sum_in_order},
    trajectory::{Sizes, chunk},
    typed::{in_either_precision, numbers},
};

/// Steps of a chunk's trajectories whose activations are held at a time, at most; or those of one sample, if more.
const SEGMENT: usize = 64;

/// The operation: F_0 [B, f], h [B, S, l], weights of a field of [F; h] (flat) -> F [B, S+1, f].
pub(crate) struct AdaptiveTrajectory {
    field: FieldConfig,
    /// A `Vec<Taken<T>>`, a chunk each, once the way forward is gone.
    taken: OnceLock<Box<dyn Any + Send + Sync>>,
}

/// The steps that a chunk's trajectories took, each one's in their order.
struct Taken<T> {
    /// How many there were up to the end of each sample period [S].
    until: Vec<usize>,
    /// Whose, and how long.
    steps: Vec<(usize, T)>,
    /// F at their starts [steps, f].
    forces: Vec<T>,
}

impl<T> Taken<T> {
    /// Steps of the sample periods from `first` to before `end`.
    fn of(&self, first: usize, end: usize) -> Range<usize> {
        let until = |sample: usize| sample.checked_sub(1).map_or(0, |last| self.until[last]);
        until(first)..until(end)
    }

    /// The last steps before `end`, back to `begin`, that are of one trajectory each.
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
        while first > 0 && self.of(first - 1, end).len() <= SEGMENT {
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
    pub(crate) fn new(field: FieldConfig) -> Self {
        Self {
            field,
            taken: OnceLock::new(),
        }
    }

    /// Applies the operation.
    pub(crate) fn apply(self, start: &Tensor, latent: &Tensor, weights: &Tensor) -> Result<Tensor> {
        start
            .contiguous()?
            .apply_op3(&latent.contiguous()?, weights, self)
    }

    /// One chunk: `forces` [rows, S+1, f] with the start in place, h [rows, S, l].
    fn forward_chunk<T: Real>(
        &self,
        field: &FieldRows<'_, T>,
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

    /// F [B, S+1, f].
    fn run<T: Real>(&self, start: &[T], latent: &[T], flat: &[T], sizes: Sizes) -> Vec<T> {
        let Sizes {
            steps,
            force,
            latent: width,
        } = sizes;
        let field = FieldRows::new(&self.field, flat, false);
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
        forces
    }

    /// One chunk of the adjoint: gradients of F_0 (into the front of `gradient`'s rows), of h, of the weights.
    fn backward_chunk<T: Real>(
        &self,
        field: &FieldRows<'_, T>,
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
            let segment = taken.of(first, end);
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
                let Range { start, mut end } = taken.of(sample, sample + 1);
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
        field: &FieldRows<'_, T>,
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
        let segment = taken.of(first, end);
        let (begin, count) = (segment.start, segment.len());
        tape.resize(&self.field, WEIGHED * count);
        slopes.resize(WEIGHED * count * force, T::default());
        for (stage, a) in A.iter().enumerate().take(WEIGHED) {
            let input = &mut tape.input[stage * count * inputs..][..count * inputs];
            for sample in first..end {
                for step in taken.of(sample, sample + 1) {
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
        field: &FieldRows<'_, T>,
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
                let (of_force, of_latent) = through[index * inputs..][..inputs].split_at(force);
                for (sum, part) in after.iter_mut().zip(of_force) {
                    *sum += *part;
                }
                for (sum, part) in d_latent.iter_mut().zip(of_latent) {
                    *sum += *part;
                }
            }
        }
    }

    fn backward<T: Real>(
        &self,
        [start, latent, flat, gradient]: [&Tensor; 4],
    ) -> Result<(Tensor, Tensor, Tensor)> {
        let sizes = Sizes::of(start.shape(), latent.shape())?;
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
            candle_core::bail!("{} was not gone forward", self.name());
        };
        let values = |tensor: &Tensor| tensor.flatten_all()?.to_vec1::<T>();
        let field = FieldRows::new(&self.field, &values(flat)?, true);
        let (h, mut g) = (values(latent)?, values(gradient)?);
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
        let d_start: Vec<T> = g
            .chunks_exact(row)
            .flat_map(|row| row[..force].to_vec())
            .collect();
        let device = start.device();
        Ok((
            Tensor::from_vec(d_start, start.shape(), device)?,
            Tensor::from_vec(d_latent, latent.shape(), device)?,
            Tensor::from_vec(d_flat, flat.shape(), device)?,
        ))
    }
}

impl CustomOp3 for AdaptiveTrajectory {
    fn name(&self) -> &'static str {
        "adaptive-force-trajectory"
    }

    fn cpu_fwd(
        &self,
        s1: &CpuStorage,
        l1: &Layout,
        s2: &CpuStorage,
        l2: &Layout,
        s3: &CpuStorage,
        l3: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let sizes = Sizes::of(l1.shape(), l2.shape())?;
        let shape = Shape::from((l1.dims()[0], sizes.steps + 1, sizes.force));
        let storage = in_either_precision!(
            self,
            s1,
            self.run(numbers(s1, l1)?, numbers(s2, l2)?, numbers(s3, l3)?, sizes)
        );
        Ok((storage, shape))
    }

    fn bwd(
        &self,
        start: &Tensor,
        latent: &Tensor,
        flat: &Tensor,
        _: &Tensor,
        gradient: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let tensors = [start, latent, flat, gradient];
        let (d_start, d_latent, d_flat) = match start.dtype() {
            DType::F64 => self.backward::<f64>(tensors)?,
            _ => self.backward::<f32>(tensors)?,
        };
        Ok((Some(d_start), Some(d_latent), Some(d_flat)))
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};

    use super::*;
    use crate::field::Field;
    use crate::{
        kept::Mark,
        solver::Solver,
        tensor_trajectory::period,
        testing::{numbers, ramp, weighted},
        trajectory::Trajectory,
    };

    const FORCE: usize = 2;
    const LATENT: usize = 3;
    /// Two chunks, the second one not full.
    const ROWS: usize = 18;
    const STEPS: usize = 5;

    fn config() -> FieldConfig {
        FieldConfig {
            inputs: FORCE + LATENT,
            outputs: FORCE,
            hidden: vec![7, 5],
            skip: true,
            relaxing: false,
        }
    }

    /// F_0, h, and weights of a field that pulls the force back within a fraction of a period: steps are many, and of
    /// many lengths.
    fn arguments() -> [Var; 3] {
        let mut flat = numbers(&(ramp(&[config().count()], 0.77) * 0.8).expect("scaled"));
        let linear = flat.len() - FORCE * config().inputs;
        for axis in 0..FORCE {
            flat[linear + axis * (config().inputs + 1)] -= 6.0;
        }
        let flat = Tensor::new(flat, &Device::Cpu).expect("a vector");
        let latent = (ramp(&[ROWS, STEPS, LATENT], 0.53) * 4.0).expect("scaled");
        [ramp(&[ROWS, FORCE], 0.9), latent, flat]
            .map(|tensor| Var::from_tensor(&tensor).expect("a variable"))
    }

    fn forces(start: &Tensor, latent: &Tensor, flat: &Tensor) -> Tensor {
        let operation = AdaptiveTrajectory::new(config());
        operation.apply(start, latent, flat).expect("runs")
    }

    fn gradients(loss: &Tensor, vars: &[Var; 3]) -> [Vec<f64>; 3] {
        let found = loss.backward().expect("derives");
        vars.each_ref()
            .map(|var| numbers(found.get(var).expect("a gradient")))
    }

    #[test]
    fn the_adjoint_agrees_with_candle_on_an_unrolled_graph() {
        let vars = arguments();
        let [start, latent, flat] = &vars;
        let ours = forces(start, latent, flat);
        let field = Field::from_flat(&config(), flat).expect("a field");
        let mut unrolled = vec![start.as_tensor().clone()];
        for step in 0..STEPS {
            let h = latent.narrow(1, step, 1).and_then(|h| h.squeeze(1));
            unrolled.push(period(&field, &unrolled[step], &h.expect("one step")).expect("runs"));
        }
        let theirs = Tensor::stack(&unrolled, 1).expect("stacked");
        let close = |what: &str, ours: &[f64], theirs: &[f64]| {
            let scale = theirs.iter().fold(1e-3f64, |most, v| most.max(v.abs()));
            assert_eq!(ours.len(), theirs.len());
            for (a, b) in ours.iter().zip(theirs) {
                assert!((a - b).abs() < 1e-10 * scale, "{what}: {a} against {b}");
            }
        };
        close("forces", &numbers(&ours), &numbers(&theirs));
        let (ours, theirs) = (
            gradients(&weighted(&ours), &vars),
            gradients(&weighted(&theirs), &vars),
        );
        for (what, (ours, theirs)) in ["F_0", "h", "weights"].iter().zip(ours.iter().zip(&theirs)) {
            close(what, ours, theirs);
        }
    }

    /// The steps that were taken, of the first chunk, with other numbers; a loss that weighs every force otherwise.
    fn replay(taken: &Taken<f64>, [start, latent, flat]: &[Vec<f64>; 3], weights: &[f64]) -> f64 {
        let config = config();
        let field = FieldRows::new(&config, flat, false);
        let mut now = start.clone();
        let (mut work, mut out) = (Work::default(), Vec::new());
        let weigh = |now: &[f64], sample: usize| -> f64 {
            now.iter()
                .enumerate()
                .map(|(i, force)| {
                    let at = (i / FORCE * (STEPS + 1) + sample) * FORCE + i % FORCE;
                    weights[at] * force * force
                })
                .sum()
        };
        let mut loss = weigh(&now, 0);
        for sample in 0..STEPS {
            for (row, length) in &taken.steps[taken.of(sample, sample + 1)] {
                let h = &latent[(row * STEPS + sample) * LATENT..][..LATENT];
                let before = now[row * FORCE..][..FORCE].to_vec();
                let mut slopes = vec![0.0; WEIGHED * FORCE];
                for (stage, a) in A.iter().enumerate().take(WEIGHED) {
                    let mut input = vec![0.0; FORCE];
                    lean(&mut input, &before, (a, *length), &slopes, FORCE);
                    input.extend_from_slice(h);
                    field.evaluate(&input, &mut out, &mut work, ());
                    slopes[stage * FORCE..][..FORCE].copy_from_slice(&out);
                }
                let after = &mut now[row * FORCE..][..FORCE];
                lean(after, &before, (&B, *length), &slopes, FORCE);
            }
            loss += weigh(&now, sample + 1);
        }
        loss
    }

    /// Of the lengths taken, which are held: so the differences are those of what the gradient is of.
    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        const FEW: usize = 5;
        let few = arguments().map(|var| {
            let part = if var.rank() > 1 {
                var.narrow(0, 0, FEW).expect("some rows")
            } else {
                var.as_tensor().clone()
            };
            Var::from_tensor(&part.force_contiguous().expect("rows")).expect("a variable")
        });
        let values = few.each_ref().map(|var| numbers(var));
        let operation = AdaptiveTrajectory::new(config());
        let sizes = Sizes::of(few[0].shape(), few[1].shape()).expect("sizes");
        let found = operation.run(&values[0], &values[1], &values[2], sizes);
        let taken = operation.taken.get().expect("gone forward");
        let taken = &taken.downcast_ref::<Vec<Taken<f64>>>().expect("in f64")[0];
        assert!(taken.steps.len() > 2 * FEW * STEPS, "{}", taken.steps.len());

        let forces = forces(&few[0], &few[1], &few[2]);
        assert_eq!(numbers(&forces), found);
        let weights = numbers(&ramp(forces.dims(), 0.31));
        let gradient = gradients(&weighted(&forces), &few);
        for (which, gradient) in gradient.iter().enumerate() {
            for index in (0..gradient.len()).step_by(7) {
                let at = |shift: f64| {
                    let mut moved = values.clone();
                    moved[which][index] += shift;
                    replay(taken, &moved, &weights)
                };
                let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
                let error = (slope - gradient[index]).abs();
                assert!(
                    error < 1e-7 * slope.abs().max(1.0),
                    "{which}, {index}: {slope} against {}",
                    gradient[index]
                );
            }
        }
    }

    /// Classical Runge-Kutta with 200 steps a period, every h held over as many.
    #[test]
    fn forces_are_those_of_many_small_steps_to_the_tolerance() {
        const TIMES: usize = 200;
        let [start, latent, flat] = arguments();
        let ours = numbers(&forces(&start, &latent, &flat));
        // f / TIMES: the last layer, its bias and the linear part.
        let mut slow = numbers(&flat);
        let last = slow.len() - FORCE * (5 + 1 + config().inputs);
        for weight in &mut slow[last..] {
            *weight /= TIMES as f64;
        }
        let operation = Trajectory {
            field: config(),
            tableau: Solver::Rk4.tableau().expect("of one step"),
            field_sees_force: true,
            adjoint: crate::Adjoint::Discrete,
            kept: None,
            mark: Mark::default(),
        };
        let held = latent
            .reshape((ROWS, STEPS, 1, LATENT))
            .and_then(|h| h.broadcast_as((ROWS, STEPS, TIMES, LATENT)))
            .and_then(|h| h.reshape((ROWS, STEPS * TIMES, LATENT)));
        let slow = Tensor::new(slow, &Device::Cpu).expect("a vector");
        let fine = operation.apply(&start, &held.expect("repeated"), &slow);
        let fine = numbers(&fine.expect("runs"));
        let mut worst = 0.0f64;
        for (row, ours) in ours.chunks_exact((STEPS + 1) * FORCE).enumerate() {
            for (i, ours) in ours.iter().enumerate() {
                let (sample, axis) = (i / FORCE, i % FORCE);
                let exact = fine[(row * (STEPS * TIMES + 1) + sample * TIMES) * FORCE + axis];
                worst = worst.max((ours - exact).abs() / exact.abs().max(1.0));
            }
        }
        assert!(worst < 2e-4 && worst > 1e-9, "{worst}");
    }

    /// Alone, among others, in single precision, and by whatever threads.
    #[test]
    fn a_trajectory_does_not_see_its_neighbours() {
        let single = arguments().map(|var| {
            let tensor = var.to_dtype(DType::F32).expect("rounded");
            Var::from_tensor(&tensor).expect("a variable")
        });
        let [start, latent, flat] = &single;
        let bits = |tensor: &Tensor| {
            tensor
                .flatten_all()
                .and_then(|t| t.to_vec1::<f32>())
                .expect("numbers")
        };
        let whole = bits(&forces(start, latent, flat));
        let row = (STEPS + 1) * FORCE;
        for index in 0..ROWS {
            let own = |tensor: &Tensor| tensor.narrow(0, index, 1).expect("a row");
            let alone = bits(&forces(&own(start), &own(latent), flat));
            assert_eq!(alone, whole[index * row..][..row]);
        }
        let run = || {
            let forces = forces(start, latent, flat);
            let weights = ramp(forces.dims(), 0.31).to_dtype(DType::F32);
            let loss = (forces.sqr().expect("squares") * weights.expect("rounded"))
                .and_then(|t| t.sum_all()?.backward())
                .expect("derives");
            let found = single.each_ref();
            found.map(|var| bits(loss.get(var).expect("a gradient")))
        };
        let [one, many] = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(run)
        });
        assert_eq!(one, many);

        let double = numbers(&{
            let [start, latent, flat] = arguments();
            forces(&start, &latent, &flat)
        });
        for (single, double) in whole.iter().zip(double) {
            let error = (f64::from(*single) - double).abs();
            assert!(error < 2e-4 * double.abs().max(1.0), "{single} {double}");
        }
    }
}
