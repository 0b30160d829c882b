//! The differential equation of a force that a latent drives: dF/dt = field([F; h]) / Dt, Dt the sample period.
//!
//! What h is made of is the model's own: attention over the past ([`super::attention_ode`]), a perceptron of the
//! present sample ([`super::mlp_ode`]). All in standardised units.

use candle_core::{Result, Tensor};
use candle_nn::VarBuilder;

use crate::{
    adjoint::Adjoint,
    operations::{
        Backend,
        activation_cache::{ActivationCache, Mark},
        adaptive_trajectory::AdaptiveTrajectory,
        tensor_trajectory::{period, step},
        trajectory::Trajectory,
    },
    perceptron::{Perceptron, PerceptronConfig},
    solver::Solver,
};

/// Sizes of the equation.
#[derive(Clone, Debug)]
pub(crate) struct ForceOdeConfig {
    /// l, length of h.
    pub(crate) latent: usize,
    /// f, force components.
    pub(crate) outputs: usize,
    /// Hidden layers of the field.
    pub(crate) hidden: Vec<usize>,
    /// Whether the field is given F besides h; without it the force is a running sum (the paper writes both).
    pub(crate) field_sees_force: bool,
    /// Whether the field has a linear part A [F; h], with A's start on F being -1.
    pub(crate) skip: bool,
}

/// How a trajectory is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) solver: Solver,
    pub(crate) adjoint: Adjoint,
    /// Whether a gradient will be asked for; what it takes is then kept.
    pub(crate) derived: bool,
}

/// The equation in Candle.
#[derive(Clone, Debug)]
pub(crate) struct ForceOde {
    pub(crate) field: Perceptron,
    pub(crate) field_sees_force: bool,
    kept: ActivationCache,
}

impl ForceOde {
    /// Weights `field.*`.
    pub(crate) fn new(config: ForceOdeConfig, vb: &VarBuilder) -> Result<Self> {
        let sees = config.field_sees_force;
        let field = PerceptronConfig {
            inputs: config.latent + if sees { config.outputs } else { 0 },
            outputs: config.outputs,
            hidden: config.hidden,
            skip: config.skip,
            relaxing: config.skip && sees,
        };
        Ok(Self {
            field: Perceptron::new(field, vb.pp("field"))?,
            field_sees_force: sees,
            kept: ActivationCache::default(),
        })
    }

    /// h [B, S, l], F_0 [B, f] -> F [B, S+1, f].
    pub(crate) fn integrate(
        &self,
        operations: Backend,
        latents: &Tensor,
        start: &Tensor,
        method: Method,
    ) -> Result<Tensor> {
        let weights = self.field.flat()?;
        let Some(tableau) = method.solver.stages(self.field_sees_force) else {
            if operations == Backend::Tensors {
                candle_core::bail!("the solver {} is for the CPU alone", method.solver);
            }
            if method.adjoint != Adjoint::Discrete {
                let Method {
                    solver, adjoint, ..
                } = method;
                candle_core::bail!("the {adjoint} adjoint is not for the solver {solver}");
            }
            let operation = AdaptiveTrajectory::new(self.field.config().clone());
            return operation.apply(start, latents, &weights);
        };
        let operation = Trajectory {
            field: self.field.config().clone(),
            tableau,
            field_sees_force: self.field_sees_force,
            adjoint: method.adjoint,
            kept: method.derived.then(|| self.kept.clone()),
            mark: Mark::default(),
        };
        match operations {
            Backend::Kernels => operation.apply(start, latents, &weights),
            Backend::Tensors => operation.apply_by_tensors(start, latents, &weights),
        }
    }

    /// Whether the layers of some call are kept now.
    #[cfg(test)]
    pub(crate) fn keeps_something(&self) -> bool {
        self.kept.is_owned()
    }

    /// F' [rows, f] one sample period after F [rows, f] with h [rows, l], by Candle's own operations.
    pub(crate) fn step(&self, force: &Tensor, latent: &Tensor, solver: Solver) -> Result<Tensor> {
        match solver.stages(self.field_sees_force) {
            Some(tableau) => step(&self.field, self.field_sees_force, tableau, force, latent),
            None => period(&self.field, force, latent),
        }
    }
}
