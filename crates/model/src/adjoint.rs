//! The gradient of a trajectory, taken through the solver in one of two ways.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Gradient that training follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Adjoint {
    /// Gradient of the steps as they were taken: exact up to rounding.
    #[default]
    Discrete,
    /// Gradient of the differential equation: da/dt = -J^T a solved backward in time with the same method, from the
    /// known force at each sample (R. Chen, Y. Rubanova, J. Bettencourt, D. Duvenaud, "Neural Ordinary
    /// Differential Equations", arXiv:1806.07366, section 2). It differs from the gradient of
    /// the computed steps: for Euler's method at first order in the step.
    Continuous,
}

impl Adjoint {
    /// Every kind, for error messages and help texts.
    pub const ALL: [Self; 2] = [Self::Discrete, Self::Continuous];
}

impl fmt::Display for Adjoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Continuous => "continuous",
        })
    }
}

/// A name that is not that of an adjoint.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown adjoint `{0}`: there are discrete and continuous")]
pub struct UnknownAdjoint(pub String);

impl FromStr for Adjoint {
    type Err = UnknownAdjoint;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|adjoint| adjoint.to_string() == name)
            .ok_or_else(|| UnknownAdjoint(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{DType, Device, Result, Tensor, Var};
    use candle_nn::VarBuilder;

    use super::*;
    use crate::{
        operations::{
            activation_cache::{ActivationCache, Mark},
            trajectory::Trajectory,
        },
        parameters::Parameters,
        perceptron::{Perceptron, PerceptronConfig},
        solver::Solver,
        testing::ramp,
    };

    const FORCE: usize = 2;
    const LATENT: usize = 3;
    /// More than a thread integrates together.
    const ROWS: usize = 18;

    /// A field in f64 whose slope is `step` times that of a fixed one.
    fn field(step: f64, skip: bool) -> Perceptron {
        let config = PerceptronConfig {
            inputs: FORCE + LATENT,
            outputs: FORCE,
            hidden: vec![7, 5],
            skip,
            relaxing: false,
        };
        let build = |vb: VarBuilder| Perceptron::new(config.clone(), vb);
        let (_, drawn) = Parameters::draw(3, build).expect("drawn");
        let tensors = drawn.iter().enumerate().map(|(i, (name, var))| {
            let scale = if name.starts_with(['2', 's']) {
                step
            } else {
                1.0
            };
            let values = ramp(var.dims(), 0.37 + i as f64).affine(scale, 0.0);
            (name.to_owned(), values.expect("scaled"))
        });
        let vb = VarBuilder::from_tensors(tensors.collect(), DType::F64, &Device::Cpu);
        build(vb).expect("built")
    }

    fn trajectory(field: &Perceptron, solver: Solver, adjoint: Adjoint) -> Trajectory {
        Trajectory {
            field: field.config().clone(),
            tableau: solver.stages(true).expect("of one step"),
            field_sees_force: true,
            adjoint,
            cache: Some(ActivationCache::default()),
            mark: Mark::default(),
        }
    }

    /// Gradients of F_0, h and the weights of a loss that weighs every sample.
    fn gradients(
        field: &Perceptron,
        latent: &Tensor,
        solver: Solver,
        adjoint: Adjoint,
    ) -> Result<[Tensor; 3]> {
        let start = Var::from_tensor(&ramp(&[ROWS, FORCE], 0.9))?;
        let (latent, flat) = (Var::from_tensor(latent)?, Var::from_tensor(&field.flat()?)?);
        let forces = trajectory(field, solver, adjoint).apply(&start, &latent, &flat)?;
        let loss = (&forces * loss_weights(&forces)?)?.sum_all()?;
        let gradients = loss.backward()?;
        let of = |var: &Var| {
            gradients
                .get(var)
                .cloned()
                .ok_or(candle_core::Error::Msg("none".into()))
        };
        Ok([of(&start)?, of(&latent)?, of(&flat)?])
    }

    fn loss_weights(forces: &Tensor) -> Result<Tensor> {
        ramp(forces.dims(), 0.31).affine(1.0, 0.3)
    }

    fn distance(a: &Tensor, b: &Tensor) -> f64 {
        (a - b)
            .and_then(|d| d.sqr()?.sum_all()?.sqrt()?.to_scalar::<f64>())
            .expect("a number")
    }

    /// The same equations, stage by stage, each product with J^T and each gradient of the weights taken by Candle.
    fn by_candle(field: &Perceptron, latent: &Tensor, solver: Solver) -> Result<[Tensor; 3]> {
        let flat = Var::from_tensor(&field.flat()?)?;
        let field = &Perceptron::from_flat(field.config(), &flat)?;
        let mut d_flat = flat.zeros_like()?;
        let steps = latent.dim(1)?;
        let tableau = solver.tableau().expect("of one step");
        let start = ramp(&[ROWS, FORCE], 0.9);
        let forces =
            trajectory(field, solver, Adjoint::Discrete).apply(&start, latent, &flat.detach())?;
        let weights = loss_weights(&forces)?;
        let mut adjoint = weights.narrow(1, steps, 1)?.squeeze(1)?;
        let mut latents = Vec::new();
        for step in (0..steps).rev() {
            let end = forces.narrow(1, step + 1, 1)?.squeeze(1)?;
            let h = latent.narrow(1, step, 1)?.squeeze(1)?;
            let (mut slope, mut through) = (end.zeros_like()?, end.zeros_like()?);
            let (mut change, mut d_latent) = (end.zeros_like()?, h.zeros_like()?);
            for (along, weight) in tableau.along_previous.iter().zip(tableau.weights) {
                let force = Var::from_tensor(&(&end - (&slope * *along)?)?)?;
                let h = Var::from_tensor(&h)?;
                let y = field.forward(&Tensor::cat(&[force.as_tensor(), h.as_tensor()], 1)?)?;
                let upstream = (&adjoint + (&through * *along)?)?;
                let found = (&y * &upstream)?.sum_all()?.backward()?;
                let missing = || candle_core::Error::Msg("none".into());
                through = found.get(&force).ok_or_else(missing)?.clone();
                slope = y.detach();
                change = (change + (&through * *weight)?)?;
                d_latent = (d_latent + (found.get(&h).ok_or_else(missing)? * *weight)?)?;
                d_flat = (d_flat + (found.get(&flat).ok_or_else(missing)? * *weight)?)?;
            }
            latents.push(d_latent);
            adjoint = ((adjoint + change)? + weights.narrow(1, step, 1)?.squeeze(1)?)?;
        }
        latents.reverse();
        Ok([adjoint, Tensor::stack(&latents, 1)?, d_flat])
    }

    #[test]
    fn the_continuous_adjoint_solves_its_equation() {
        for (skip, solver) in [
            (false, Solver::Euler),
            (true, Solver::Euler),
            (true, Solver::Rk4),
        ] {
            let (field, latent) = (field(0.3, skip), ramp(&[ROWS, 21, LATENT], 0.53));
            let ours = gradients(&field, &latent, solver, Adjoint::Continuous).expect("derives");
            let theirs = by_candle(&field, &latent, solver).expect("derives");
            for (what, (ours, theirs)) in
                ["F_0", "h", "weights"].iter().zip(ours.iter().zip(&theirs))
            {
                let error = distance(ours, theirs);
                let scale = distance(theirs, &theirs.zeros_like().expect("zeros"));
                assert!(
                    error < 1e-12 * scale.max(1.0),
                    "{what}, {solver}: {error} of {scale}"
                );
            }
        }
    }

    /// On finer grids the two adjoints approach each other at the method's order.
    #[test]
    fn the_adjoints_agree_in_the_limit_of_small_steps() {
        let difference = |solver, times: usize| {
            let field = field(1.0 / times as f64, false);
            // h held over whole samples, each cut in `times` steps.
            let latent = ramp(&[ROWS, 6, 1, LATENT], 0.53)
                .broadcast_as((ROWS, 6, times, LATENT))
                .and_then(|h| h.reshape((ROWS, 6 * times, LATENT)))
                .expect("repeated");
            let start = |adjoint| {
                let start = Var::from_tensor(&ramp(&[ROWS, FORCE], 0.9)).expect("a variable");
                let forces = trajectory(&field, solver, adjoint)
                    .apply(&start, &latent, &field.flat().expect("flat"))
                    .expect("runs");
                let last = forces.narrow(1, 6 * times, 1).expect("the last");
                let loss = (last.sqr().expect("squares") * 0.5).expect("halved");
                let gradients = loss.sum_all().expect("sum").backward().expect("derives");
                gradients.get(&start).expect("a gradient").clone()
            };
            distance(&start(Adjoint::Discrete), &start(Adjoint::Continuous))
        };
        for (solver, order, coarse) in [(Solver::Euler, 1.0, 16), (Solver::Rk4, 4.0, 4)] {
            let (one, two) = (difference(solver, coarse), difference(solver, 2 * coarse));
            let observed = (one / two).log2();
            assert!(
                (observed - order).abs() < 0.35,
                "{solver}: {one} and {two}, order {observed}"
            );
        }
    }

    #[test]
    fn names_are_read_back_and_others_refused() {
        for adjoint in Adjoint::ALL {
            assert_eq!(adjoint.to_string().parse(), Ok(adjoint));
        }
        let error = "exact".parse::<Adjoint>().expect_err("no such adjoint");
        assert_eq!(
            error.to_string(),
            "unknown adjoint `exact`: there are discrete and continuous"
        );
    }
}
