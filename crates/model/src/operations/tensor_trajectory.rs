//! The operation of [`super::trajectory`] in tensor operations, for devices that its kernels do not run on.
//!
//! The same time loop and the same discrete adjoint, whole batch at a time. Neither leaves a graph: forward walks
//! tensors that are cut off from it, backward evaluates the stages of a segment of steps again, all steps at once,
//! then walks the segment back in time and takes the gradients of the weights as one product a segment. What is
//! held besides forces and latents is bounded by the segment.
//!
//! The forces are computed before, outside the graph, and attached to it with their derivative
//! ([`super::custom_operation::attach`]).

use candle_core::{DType, Result, Tensor};
use candle_nn::ops::sigmoid;

use super::{
    custom_operation::{BackwardPass, Derivative, attach},
    trajectory::Trajectory,
};
use crate::{
    adjoint::Adjoint,
    perceptron::Perceptron,
    solver::{
        Tableau,
        dormand_prince::{A, Clock, ERROR, norm},
    },
};

/// Steps times stages whose activations are held at a time.
const SEGMENT: usize = 64;

/// F' [rows, f] one step after F [rows, f] with h [rows, l] held.
pub(crate) fn step(
    field: &Perceptron,
    sees_force: bool,
    tableau: Tableau,
    force: &Tensor,
    latent: &Tensor,
) -> Result<Tensor> {
    let mut slope: Option<Tensor> = None;
    let mut next = force.clone();
    for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
        let input = stage_input(sees_force, force, latent, slope.as_ref(), *along)?;
        let found = field.forward(&input)?;
        next = (next + (&found * *weight)?)?;
        slope = Some(found);
    }
    Ok(next)
}

/// F' [rows, f] one sample period after F [rows, f] with h [rows, l] held, by as many steps as each row asks for, of a
/// field that is given the force. A gradient through it takes their lengths as given.
pub(crate) fn period(field: &Perceptron, force: &Tensor, latent: &Tensor) -> Result<Tensor> {
    let rows = (0..force.dim(0)?)
        .map(|row| row_period(field, &force.narrow(0, row, 1)?, &latent.narrow(0, row, 1)?));
    Tensor::cat(&rows.collect::<Result<Vec<_>>>()?, 0)
}

/// [`period`] of one row.
fn row_period(field: &Perceptron, force: &Tensor, latent: &Tensor) -> Result<Tensor> {
    let slope = |force: &Tensor| field.forward(&Tensor::cat(&[force, latent], 1)?);
    let weigh = |weights: &[f64], slopes: &[Tensor], step: f64| {
        let mut sum = force.zeros_like()?;
        for (weight, slope) in weights.iter().zip(slopes) {
            sum = (sum + (slope * *weight)?)?;
        }
        sum * step
    };
    let numbers = |tensor: &Tensor| tensor.to_dtype(DType::F64)?.flatten_all()?.to_vec1::<f64>();
    let mut clock = Clock::start(0);
    let mut force = force.clone();
    let mut slopes = vec![slope(&force)?];
    while !clock.is_over() {
        let step = clock.step();
        slopes.truncate(1);
        let mut next = force.clone();
        for a in &A[1..] {
            next = (&force + weigh(a, &slopes, step)?)?;
            slopes.push(slope(&next)?);
        }
        let error = numbers(&weigh(&ERROR, &slopes, step)?)?;
        let ends = numbers(&force)?.into_iter().zip(numbers(&next)?);
        let components = ends
            .zip(error)
            .map(|((now, next), error)| (now, next, error));
        if clock.judge(norm(components)) {
            force = next;
            slopes.rotate_right(1);
        }
    }
    Ok(force)
}

/// [F + along slope; h], or h alone [rows, inputs].
fn stage_input(
    sees_force: bool,
    force: &Tensor,
    latent: &Tensor,
    slope: Option<&Tensor>,
    along: f64,
) -> Result<Tensor> {
    if !sees_force {
        return latent.contiguous();
    }
    let inner = match slope {
        Some(slope) => (force + (slope * along)?)?,
        None => force.clone(),
    };
    Tensor::cat(&[&inner, latent], 1)
}

/// A stage of all steps of a segment; rows are ordered (step, trajectory).
struct Stage {
    /// [rows, inputs].
    input: Tensor,
    /// Per hidden layer silu(z) and silu'(z) [rows, width].
    hidden: Vec<(Tensor, Tensor)>,
    /// Per layer dL/dz (of the last: dL/dy) [trajectories, width] of each step, the newest first.
    upstream: Vec<Vec<Tensor>>,
}

impl Stage {
    /// Evaluates the field at `input`; the stage and y [rows, outputs].
    fn evaluate(field: &Perceptron, input: Tensor) -> Result<(Self, Tensor)> {
        let layers = field.layers();
        let last = layers.len() - 1;
        let mut hidden = Vec::with_capacity(last);
        let mut y = input.clone();
        for (index, (weight, bias)) in layers.iter().enumerate() {
            y = y.matmul(&weight.t()?)?.broadcast_add(bias)?;
            if index < last {
                // silu = z s, silu' = s + z s (1 - s), s the sigmoid.
                let s = sigmoid(&y)?;
                let activation = (&y * &s)?;
                let slope = (&s + (&activation * s.affine(-1.0, 1.0)?)?)?;
                y = activation.clone();
                hidden.push((activation, slope));
            }
        }
        if let Some(linear) = field.linear()? {
            y = (y + input.matmul(&linear.t()?)?)?;
        }
        let upstream = vec![Vec::new(); layers.len()];
        Ok((
            Self {
                input,
                hidden,
                upstream,
            },
            y,
        ))
    }

    /// J^T (dL/dy) [trajectories, inputs] at a step, the `index`-th of the segment.
    fn transpose(&mut self, field: &Perceptron, index: usize, upstream: Tensor) -> Result<Tensor> {
        let rows = upstream.dim(0)?;
        let skipped = match field.linear()? {
            Some(linear) => Some(upstream.matmul(&linear)?),
            None => None,
        };
        let mut d = upstream;
        for (layer, (weight, _)) in field.layers().iter().enumerate().rev() {
            let below = d.matmul(weight)?;
            self.upstream[layer].push(d);
            d = match layer.checked_sub(1) {
                Some(hidden) => (below * self.hidden[hidden].1.narrow(0, index * rows, rows)?)?,
                None => below,
            };
        }
        match skipped {
            Some(skipped) => d + skipped,
            None => Ok(d),
        }
    }
}

/// Gradients of the weights over all rows of all stages, in the order of [`Perceptron::flat`].
fn weight_gradient(field: &Perceptron, stages: &[Stage]) -> Result<Tensor> {
    let last = field.layers().len() - 1;
    let upstream = |layer: usize| {
        let in_time = stages
            .iter()
            .flat_map(|stage| stage.upstream[layer].iter().rev());
        Tensor::cat(&in_time.collect::<Vec<_>>(), 0)
    };
    let entering = |layer: usize| {
        let of = |stage: &Stage| match layer.checked_sub(1) {
            Some(hidden) => stage.hidden[hidden].0.clone(),
            None => stage.input.clone(),
        };
        Tensor::cat(&stages.iter().map(of).collect::<Vec<_>>(), 0)
    };
    let mut parts = Vec::new();
    for layer in 0..=last {
        let d = upstream(layer)?;
        parts.push(d.t()?.matmul(&entering(layer)?)?.flatten_all()?);
        parts.push(d.sum(0)?);
    }
    if field.config().skip {
        parts.push(upstream(last)?.t()?.matmul(&entering(0)?)?.flatten_all()?);
    }
    Tensor::cat(&parts, 0)
}

impl Trajectory {
    /// [`Trajectory::apply`] on any device.
    pub(crate) fn apply_by_tensors(
        self,
        start: &Tensor,
        latent: &Tensor,
        weights: &Tensor,
    ) -> Result<Tensor> {
        if self.adjoint != Adjoint::Discrete {
            candle_core::bail!("the {} adjoint is for the CPU alone", self.adjoint);
        }
        let forces = self.integrate(&start.detach(), &latent.detach(), &weights.detach())?;
        attach(self, forces, [start, latent, weights])
    }

    /// F [B, S+1, f], row by row in memory of its own.
    fn integrate(&self, start: &Tensor, latent: &Tensor, flat: &Tensor) -> Result<Tensor> {
        let field = Perceptron::from_flat(&self.field, flat)?;
        let latent = latent.transpose(0, 1)?.contiguous()?;
        let mut forces = vec![start.clone()];
        for index in 0..latent.dim(0)? {
            let (now, latent) = (&forces[index], latent.get(index)?);
            let next = step(&field, self.field_sees_force, self.tableau, now, &latent)?;
            forces.push(next);
        }
        Tensor::stack(&forces, 1)?.force_contiguous()
    }

    /// The stages of the steps from `first` to before `end`, of F [S+1, B, f] and h [S, B, l].
    fn stages_again(
        &self,
        field: &Perceptron,
        forces: &Tensor,
        latent: &Tensor,
        (first, end): (usize, usize),
    ) -> Result<Vec<Stage>> {
        let rows = |tensor: &Tensor| tensor.narrow(0, first, end - first)?.flatten(0, 1);
        let (forces, latent) = (rows(forces)?, rows(latent)?);
        let mut slope: Option<Tensor> = None;
        let mut stages = Vec::new();
        for along in self.tableau.along_previous {
            let sees = self.field_sees_force;
            let input = stage_input(sees, &forces, &latent, slope.as_ref(), *along)?;
            let (stage, found) = Stage::evaluate(field, input)?;
            stages.push(stage);
            slope = Some(found);
        }
        Ok(stages)
    }

    /// sum_i s_i [B, inputs] of one step, the `index`-th of the segment, from dL/dF at its end.
    fn step_back(
        &self,
        field: &Perceptron,
        stages: &mut [Stage],
        index: usize,
        after: &Tensor,
    ) -> Result<Tensor> {
        let tableau = self.tableau;
        let mut later: Option<(Tensor, f64)> = None;
        let mut total: Option<Tensor> = None;
        for (number, stage) in stages.iter_mut().enumerate().rev() {
            let mut upstream = (after * tableau.weights[number])?;
            if let (true, Some((later, along))) = (self.field_sees_force, &later) {
                upstream = (upstream + (later.narrow(1, 0, self.field.outputs)? * *along)?)?;
            }
            let found = stage.transpose(field, index, upstream)?;
            total = Some(match total {
                Some(sum) => (sum + &found)?,
                None => found.clone(),
            });
            later = Some((found, tableau.along_previous[number]));
        }
        total.ok_or_else(|| candle_core::Error::Msg("a method without stages".to_owned()))
    }
}

impl Derivative for Trajectory {
    const NAME: &'static str = "integrated-force-trajectory";

    /// The gradients of F_0 [B, f], h [B, S, l] and the weights from that of F [B, S+1, f].
    fn backward(&self, pass: &BackwardPass<'_, 3>) -> Result<[Tensor; 3]> {
        let [_, latent, flat] = pass.arguments;
        let field = Perceptron::from_flat(&self.field, &flat.detach())?;
        let by_time = |tensor: &Tensor| tensor.detach().transpose(0, 1)?.contiguous();
        let (latent, forces, gradient) = (
            by_time(latent)?,
            by_time(pass.result)?,
            by_time(pass.gradient)?,
        );
        let (steps, _, width) = latent.dims3()?;
        let f = self.field.outputs;
        let sees = if self.field_sees_force { f } else { 0 };
        let length = (SEGMENT / self.tableau.weights.len()).max(1);

        // dL/dF of the step's end, all that comes later included.
        let mut after = gradient.get(steps)?;
        let mut d_latent = Vec::with_capacity(steps);
        let mut d_flat: Option<Tensor> = None;
        for end in (1..=steps).rev().step_by(length) {
            let first = end.saturating_sub(length);
            let mut stages = self.stages_again(&field, &forces, &latent, (first, end))?;
            for step in (first..end).rev() {
                let total = self.step_back(&field, &mut stages, step - first, &after)?;
                d_latent.push(total.narrow(1, sees, width)?);
                after = (after + gradient.get(step)?)?;
                if self.field_sees_force {
                    after = (after + total.narrow(1, 0, f)?)?;
                }
            }
            let part = weight_gradient(&field, &stages)?;
            d_flat = Some(match d_flat {
                Some(sum) => (sum + part)?,
                None => part,
            });
        }
        d_latent.reverse();
        let d_flat = match d_flat {
            Some(sum) => sum,
            None => flat.zeros_like()?,
        };
        Ok([after, Tensor::stack(&d_latent, 1)?, d_flat])
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};

    use super::*;
    use crate::{
        operations::activation_cache::{ActivationCache, Mark},
        perceptron::PerceptronConfig,
        solver::Solver,
    };

    /// Force, latent, trajectories (two chunks of the kernels) and steps (several segments).
    const SIZE: [usize; 4] = [2, 5, 18, SEGMENT + 11];

    /// Numbers in (-scale, scale) without a generator.
    fn ramp(shape: &[usize], step: f64, scale: f64) -> Tensor {
        let count: usize = shape.iter().product();
        let values = (0..count).map(|i| scale * ((i + 1) as f64 * step).sin());
        Tensor::from_vec(values.collect(), shape, &Device::Cpu).expect("shape fits")
    }

    fn operation(
        solver: Solver,
        field_sees_force: bool,
        skip: bool,
        hidden: &[usize],
    ) -> Trajectory {
        let [f, l, ..] = SIZE;
        let field = PerceptronConfig {
            inputs: l + if field_sees_force { f } else { 0 },
            outputs: f,
            hidden: hidden.to_vec(),
            skip,
            relaxing: false,
        };
        Trajectory {
            field,
            tableau: solver.stages(field_sees_force).expect("of one step"),
            field_sees_force,
            adjoint: Adjoint::Discrete,
            cache: Some(ActivationCache::default()),
            mark: Mark::default(),
        }
    }

    /// F_0, h and weights of a field that pulls the force back, or hardly pushes it, so that it stays moderate.
    fn arguments(operation: &Trajectory, dtype: DType) -> [Var; 3] {
        let [f, l, batch, steps] = SIZE;
        let inputs = operation.field.inputs;
        let pulls = operation.field.skip && operation.field_sees_force;
        let scale = if operation.field_sees_force && !pulls {
            0.1
        } else {
            0.25
        };
        let mut flat: Vec<f64> = ramp(&[operation.field.count()], 0.77, scale)
            .to_vec1()
            .expect("numbers");
        if pulls {
            let linear = flat.len() - inputs * f;
            for axis in 0..f {
                flat[linear + axis * (inputs + 1)] -= 0.8;
            }
        }
        let flat = Tensor::new(flat, &Device::Cpu).expect("a vector");
        let latent = ramp(&[batch, steps, l], 0.53, 1.0);
        [ramp(&[batch, f], 0.9, 1.0), latent, flat].map(|tensor| {
            Var::from_tensor(&tensor.to_dtype(dtype).expect("converted")).expect("a variable")
        })
    }

    /// Largest difference and largest number of two tensors.
    fn difference(ours: &Tensor, theirs: &Tensor) -> (f64, f64) {
        let largest = |tensor: Result<Tensor>| {
            tensor
                .and_then(|t| {
                    t.to_dtype(DType::F64)?
                        .abs()?
                        .flatten_all()?
                        .max(0)?
                        .to_scalar()
                })
                .expect("a number")
        };
        assert_eq!(ours.dims(), theirs.dims());
        (largest(ours - theirs), largest(Ok(theirs.clone())))
    }

    /// Forces, and gradients of a loss that weighs every force differently, by both ways.
    fn compare(operation: &Trajectory, dtype: DType, tolerance: f64) {
        let [start, latent, flat] = &arguments(operation, dtype);
        let loss = |forces: &Tensor| {
            let weights = ramp(forces.dims(), 0.31, 1.0).to_dtype(dtype)?;
            (forces.sqr()? * weights)?.sum_all()?.backward()
        };
        let tensors = operation.clone().apply_by_tensors(start, latent, flat);
        let kernels = operation.clone().apply(start, latent, flat);
        let (tensors, kernels) = (tensors.expect("runs"), kernels.expect("runs"));
        let close = |name: &str, (error, scale): (f64, f64)| {
            assert!(scale > 1e-2 && scale < 1e9, "{name}: {scale} says nothing");
            assert!(
                error <= tolerance * scale,
                "{operation:?} {name}: {error} of {scale}"
            );
        };
        close("force", difference(&tensors, &kernels));
        let (ours, theirs) = (
            loss(&tensors).expect("derives"),
            loss(&kernels).expect("derives"),
        );
        for (name, var) in [("start", start), ("latent", latent), ("weights", flat)] {
            let (ours, theirs) = (ours.get(var).expect(name), theirs.get(var).expect(name));
            close(name, difference(ours, theirs));
        }
    }

    #[test]
    fn values_and_gradients_are_those_of_the_kernels() {
        for solver in Solver::FIXED {
            for (sees, skip) in [(true, true), (true, false), (false, true), (false, false)] {
                for hidden in [&[9, 7][..], &[6], &[]] {
                    compare(&operation(solver, sees, skip, hidden), DType::F64, 1e-11);
                }
            }
        }
    }

    #[test]
    fn single_precision_gives_the_same_to_its_rounding() {
        for solver in Solver::FIXED {
            compare(&operation(solver, true, true, &[9, 7]), DType::F32, 2e-5);
        }
    }

    #[test]
    fn a_long_trajectory_leaves_no_graph_to_overflow_the_stack() {
        let operation = operation(Solver::Euler, true, true, &[3]);
        let [start, latent, flat] = &arguments(&operation, DType::F64);
        let start = Var::from_tensor(&start.narrow(0, 0, 1).expect("one")).expect("a variable");
        let latent = latent
            .narrow(0, 0, 1)
            .and_then(|one| one.repeat((1, 160, 1)));
        let latent = Var::from_tensor(&latent.expect("repeated")).expect("a variable");
        let forces = operation.apply_by_tensors(&start, &latent, flat);
        let forces = forces.expect("runs");
        assert_eq!(forces.dims(), [1, 160 * SIZE[3] + 1, 2]);
        let gradients = forces.sum_all().and_then(|loss| loss.backward());
        assert!(gradients.expect("derives").get(flat).is_some());
    }
}
