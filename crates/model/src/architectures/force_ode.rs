//! The differential equation of a force that a latent drives: dF/dt = field([F; h]) / Dt, Dt the sample period.
//!
//! The latent h is attention over a window ([`super::attention_ode`]) or a perceptron of the newest sample
//! ([`super::mlp_ode`]). All quantities are standardised.

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
    /// True if the field reads F besides h; if not, the force is a running sum (the paper writes both).
    pub(crate) field_sees_force: bool,
    /// True if the field has a linear part A [F; h], initialised to -F plus small numbers.
    pub(crate) skip: bool,
}

/// Method of computing a trajectory.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Method {
    pub(crate) solver: Solver,
    pub(crate) adjoint: Adjoint,
    /// True if a gradient will be computed; activations are then cached.
    pub(crate) derived: bool,
}

/// The equation in Candle.
#[derive(Clone, Debug)]
pub(crate) struct ForceOde {
    pub(crate) field: Perceptron,
    pub(crate) field_sees_force: bool,
    cache: ActivationCache,
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
            cache: ActivationCache::default(),
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
            cache: method.derived.then(|| self.cache.clone()),
            mark: Mark::default(),
        };
        match operations {
            Backend::Kernels => operation.apply(start, latents, &weights),
            Backend::Tensors => operation.apply_by_tensors(start, latents, &weights),
        }
    }

    /// True if the layers of a call are cached.
    #[cfg(test)]
    pub(crate) fn keeps_something(&self) -> bool {
        self.cache.is_owned()
    }

    /// F' [rows, f] one sample period after F [rows, f] with h [rows, l], by Candle's own operations.
    pub(crate) fn step(&self, force: &Tensor, latent: &Tensor, solver: Solver) -> Result<Tensor> {
        match solver.stages(self.field_sees_force) {
            Some(tableau) => step(&self.field, self.field_sees_force, tableau, force, latent),
            None => period(&self.field, force, latent),
        }
    }
}
