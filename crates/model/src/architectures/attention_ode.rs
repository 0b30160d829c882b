//! Attention-ODE: the force follows a learned differential equation, driven by a latent that attention makes.
//!
//! ```text
//! h_k   = attention(z_{k-W+1} .. z_k)      of encoded, standardised samples
//! dF/dt = field([F; h]) / Dt               F in standard deviations, Dt the sample period
//! ```
//!
//! C. Wang, A. Liang, F. Han, X. Zeng, Z. Li, D. Fan, J. Kober, "Learning Adaptive Hydrodynamic Models Using
//! Neural ODEs in Complex Conditions". The paper's attention can be read in two ways ([`super::attention_config::Tokens`]): over past samples, or over
//! the numbers of the condition vector. Departures, all by configuration: the latent may be wider than the force, the attitude
//! enters as the up direction, the field may have a linear part that starts out as a relaxation, and the sample at the end of a
//! step may drive it.

use candle_core::{Result, Tensor};
use candle_nn::VarBuilder;

use super::{
    attention_config::{AttentionOdeConfig, Tokens},
    feature_attention::FeatureAttention,
    force_ode::{ForceOde, ForceOdeConfig, Method},
    sample_attention::SampleAttention,
};
use crate::{adjoint::Adjoint, operations::Backend, solver::Solver};

/// The latent's layers.
#[derive(Clone, Debug)]
pub(crate) enum Sight {
    /// See [`super::sample_attention`].
    Samples(SampleAttention),
    /// See [`super::feature_attention`].
    Features(FeatureAttention),
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct AttentionOde {
    config: AttentionOdeConfig,
    pub(crate) sight: Sight,
    pub(crate) ode: ForceOde,
}

impl AttentionOde {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(
        config: &AttentionOdeConfig,
        inputs: usize,
        outputs: usize,
        vb: VarBuilder,
    ) -> Result<Self> {
        let ode = ForceOdeConfig {
            latent: config.latent,
            outputs,
            hidden: config.hidden.clone(),
            field_sees_force: config.field_sees_force,
            skip: config.skip,
        };
        Ok(Self {
            sight: match config.tokens {
                Tokens::Samples => Sight::Samples(SampleAttention::new(config, inputs, &vb)?),
                Tokens::Features => Sight::Features(FeatureAttention::new(config, inputs, &vb)?),
            },
            ode: ForceOde::new(ode, &vb)?,
            config: config.clone(),
        })
    }

    /// Its sizes.
    pub fn config(&self) -> &AttentionOdeConfig {
        &self.config
    }

    /// z [B, W-1+S, n] -> h [B, S, l].
    pub fn latents(&self, z: &Tensor) -> Result<Tensor> {
        self.latents_by(Backend::for_device(z.device()), z)
    }

    fn latents_by(&self, operations: Backend, z: &Tensor) -> Result<Tensor> {
        match &self.sight {
            Sight::Samples(attention) => attention.latents(operations, z),
            Sight::Features(attention) => attention.latents(operations, z),
        }
    }

    /// Weight of each token [B S, H, N] at every sample of z [B, W-1+S, n]: of each lag, or of each number of the window (mean
    /// over the attending numbers), newest sample first.
    pub fn weights(&self, z: &Tensor) -> Result<Tensor> {
        match &self.sight {
            Sight::Samples(attention) => attention.weights(z),
            Sight::Features(attention) => attention.weights(z),
        }
    }

    /// The samples of z [B, W-1+T, n] that drive the steps of a trajectory of T forces, [B, W-1+T-1, n].
    pub(crate) fn driving(&self, z: &Tensor) -> Result<Tensor> {
        z.narrow(1, usize::from(self.config.end_of_step), z.dim(1)? - 1)?
            .contiguous()
    }

    /// z [B, W-1+S, n], F_0 [B, f] -> F [B, S+1, f].
    pub fn forward(
        &self,
        z: &Tensor,
        start: &Tensor,
        solver: Solver,
        adjoint: Adjoint,
    ) -> Result<Tensor> {
        let method = Method {
            solver,
            adjoint,
            derived: true,
        };
        self.run(z, start, method)
    }

    /// z [B, W-1+S, n], F_0 [B, f] -> F [B, S+1, f].
    pub(crate) fn run(&self, z: &Tensor, start: &Tensor, method: Method) -> Result<Tensor> {
        self.forward_by(Backend::for_device(z.device()), z, start, method)
    }

    /// h [B, S, l], F_0 [B, f] -> F [B, S+1, f]: the field alone.
    pub fn integrate(
        &self,
        latents: &Tensor,
        start: &Tensor,
        solver: Solver,
        adjoint: Adjoint,
    ) -> Result<Tensor> {
        let operations = Backend::for_device(latents.device());
        let method = Method {
            solver,
            adjoint,
            derived: true,
        };
        self.ode.integrate(operations, latents, start, method)
    }

    fn forward_by(
        &self,
        operations: Backend,
        z: &Tensor,
        start: &Tensor,
        method: Method,
    ) -> Result<Tensor> {
        let latents = self.latents_by(operations, z)?;
        self.ode.integrate(operations, &latents, start, method)
    }

    /// h [1, l] of one window z [W, n], by Candle's own operations and without threads.
    pub(crate) fn single_latent(&self, z: &Tensor) -> Result<Tensor> {
        match &self.sight {
            Sight::Samples(attention) => attention.single(z),
            Sight::Features(attention) => attention.single(z),
        }
    }
}

#[cfg(test)]
mod tests {
    use candle_core::Var;

    use super::*;
    use crate::testing::check_gradient;
    use crate::testing::{in_f64, numbers, ramp};

    fn small(field_sees_force: bool, skip: bool) -> AttentionOdeConfig {
        AttentionOdeConfig {
            window: 3,
            heads: 2,
            embedding: 8,
            latent: 5,
            hidden: vec![9, 7],
            field_sees_force,
            skip,
            ..AttentionOdeConfig::default()
        }
    }

    fn model(config: &AttentionOdeConfig) -> (AttentionOde, Vec<(String, Var)>) {
        in_f64(|vb| AttentionOde::new(config, 4, 2, vb))
    }

    /// 18 trajectories (two chunks) of 21 steps (several segments).
    fn inputs() -> (Tensor, Var) {
        let start = Var::from_tensor(&ramp(&[18, 2], 0.9)).expect("a variable");
        (ramp(&[18, 2 + 21, 4], 0.53), start)
    }

    fn loss(model: &AttentionOde, z: &Tensor, start: &Tensor, solver: Solver) -> Result<Tensor> {
        let forces = model.forward(z, start, solver, Adjoint::Discrete)?;
        (forces.sqr()? * ramp(forces.dims(), 0.31))?.sum_all()
    }

    #[test]
    fn the_adjoint_agrees_with_candle_on_an_unrolled_graph() {
        for (sees, skip) in [(true, true), (true, false), (false, true)] {
            for solver in Solver::ALL {
                let (model, vars) = model(&small(sees, skip));
                let (z, start) = inputs();
                let ours = loss(&model, &z, &start, solver)
                    .expect("runs")
                    .backward()
                    .expect("derives");

                let latents = model.latents(&z).expect("latents");
                let mut forces = vec![start.as_tensor().clone()];
                for step in 0..21 {
                    let latent = latents
                        .narrow(1, step, 1)
                        .and_then(|h| h.squeeze(1))
                        .expect("one step");
                    forces.push(
                        model
                            .ode
                            .step(&forces[step], &latent, solver)
                            .expect("a step"),
                    );
                }
                let forces = Tensor::stack(&forces, 1).expect("stacked");
                let unrolled =
                    (forces.sqr().expect("squares") * ramp(forces.dims(), 0.31)).expect("weighted");
                let theirs = unrolled
                    .sum_all()
                    .expect("sum")
                    .backward()
                    .expect("derives");

                for (name, var) in vars.iter().chain([&("start".to_owned(), start)]) {
                    let (ours, theirs) = (ours.get(var).expect(name), theirs.get(var).expect(name));
                    let scale = theirs
                        .abs()
                        .and_then(|t| t.flatten_all()?.max(0)?.to_scalar::<f64>());
                    let error = (ours - theirs)
                        .and_then(|t| t.abs()?.flatten_all()?.max(0)?.to_scalar::<f64>());
                    let (scale, error) = (scale.expect("a number"), error.expect("a number"));
                    assert!(
                        error <= 1e-11 * scale.max(1e-3),
                        "{name}, {solver}: {error} of {scale}"
                    );
                }
            }
        }
    }

    /// The backward pass uses the cache; after another forward pass it evaluates again, with the same bits.
    #[test]
    fn kept_activations_are_those_evaluated_again() {
        // Nine trajectories are two small chunks, 18 two large ones, the last of each not full.
        for (rows, skip, solver) in [(9, true, Solver::Euler), (18, false, Solver::Rk4)] {
            let (model, vars) = model(&small(true, skip));
            let (z, start) = (ramp(&[rows, 2 + 21, 4], 0.53), ramp(&[rows, 2], 0.9));
            let start = Var::from_tensor(&start).expect("a variable");
            let gradients = |disturbed: bool| {
                let loss = loss(&model, &z, &start, solver).expect("runs");
                assert!(model.ode.keeps_something(), "nothing is put to the test");
                if disturbed {
                    let other = (start.as_tensor() * 2.0).expect("scaled");
                    model
                        .forward(&z, &other, solver, Adjoint::Discrete)
                        .expect("runs");
                }
                let found = loss.backward().expect("derives");
                let gradient = |var: &Var| numbers(found.get(var).expect("a gradient"));
                vars.iter()
                    .map(|(_, var)| gradient(var))
                    .collect::<Vec<_>>()
            };
            let kept = gradients(false);
            assert!(kept.iter().flatten().any(|value| *value != 0.0));
            assert_eq!(kept, gradients(true), "{solver}");
            // And once more from the memory of the former.
            assert_eq!(kept, gradients(false), "{solver}");
        }
    }

    #[test]
    fn tensor_operations_give_what_the_kernels_give() {
        for (sees, skip) in [(true, true), (true, false), (false, true)] {
            for solver in Solver::FIXED {
                let (model, vars) = model(&small(sees, skip));
                let (z, start) = inputs();
                let run = |operations| {
                    let method = Method {
                        solver,
                        adjoint: Adjoint::Discrete,
                        derived: true,
                    };
                    let forces = model.forward_by(operations, &z, &start, method)?;
                    let loss = (forces.sqr()? * ramp(forces.dims(), 0.31))?.sum_all()?;
                    Ok::<_, candle_core::Error>((forces, loss.backward()?))
                };
                let (kernels, theirs) = run(Backend::Kernels).expect("runs");
                let (tensors, ours) = run(Backend::Tensors).expect("runs");
                let close = |name: &str, ours: &Tensor, theirs: &Tensor| {
                    let largest = |tensor: Result<Tensor>| {
                        tensor
                            .and_then(|t| t.abs()?.flatten_all()?.max(0)?.to_scalar::<f64>())
                            .expect("a number")
                    };
                    let (error, scale) = (largest(ours - theirs), largest(Ok(theirs.clone())));
                    assert!(
                        error <= 1e-11 * scale.max(1e-3),
                        "{name}, {solver}: {error} of {scale}"
                    );
                };
                close("force", &tensors, &kernels);
                for (name, var) in vars.iter().chain([&("start".to_owned(), start.clone())]) {
                    close(
                        name,
                        ours.get(var).expect(name),
                        theirs.get(var).expect(name),
                    );
                }
            }
        }
    }

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        // An adaptive step's length moves with the weights, which its gradient leaves out.
        for solver in Solver::FIXED {
            let (model, vars) = model(&small(true, true));
            let (z, start) = inputs();
            check_gradient(&vars, || loss(&model, &z, &start, solver).expect("runs"));
        }
    }

    #[test]
    fn adaptive_steps_are_for_the_processor_and_the_discrete_adjoint() {
        let (model, _) = model(&small(true, true));
        let (z, start) = inputs();
        let run = |operations, adjoint| {
            let method = Method {
                solver: Solver::DormandPrince,
                adjoint,
                derived: true,
            };
            let error = model.forward_by(operations, &z, &start, method);
            error.expect_err("not for this").to_string()
        };
        let error = run(Backend::Tensors, Adjoint::Discrete);
        assert!(error.contains("dopri5 is for the CPU alone"), "{error}");
        let error = run(Backend::Kernels, Adjoint::Continuous);
        assert!(
            error.contains("the continuous adjoint is not for the solver dopri5"),
            "{error}"
        );
    }

    #[test]
    fn the_past_alone_decides() {
        let (model, _) = model(&small(true, true));
        let (z, start) = inputs();
        let before = model
            .forward(&z, &start, Solver::Euler, Adjoint::Discrete)
            .expect("runs");
        // Another future: samples from step 10 on.
        let changed = Tensor::cat(
            &[z.narrow(1, 0, 12).expect("past"), ramp(&[18, 11, 4], 2.3)],
            1,
        )
        .expect("joined");
        let after = model
            .forward(&changed, &start, Solver::Euler, Adjoint::Discrete)
            .expect("runs");
        let numbers = |t: &Tensor, from, len| {
            t.narrow(1, from, len)
                .and_then(|t| t.flatten_all()?.to_vec1::<f64>())
                .expect("numbers")
        };
        assert_eq!(numbers(&before, 0, 11), numbers(&after, 0, 11));
        assert_ne!(numbers(&before, 11, 1), numbers(&after, 11, 1));
    }
}
