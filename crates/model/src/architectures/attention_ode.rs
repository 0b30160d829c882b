//! Attention-ODE: the force follows a learned differential equation, driven by a latent that attention makes.
//!
//! ```text
//! h_k   = attention(z_{k-W+1} .. z_k)      of encoded, standardised samples
//! dF/dt = field([F; h]) / Dt               F in standard deviations, Dt the sample period
//! ```
//!
//! C. Wang, A. Liang, F. Han, X. Zeng, Z. Li, D. Fan, J. Kober, "Learning Adaptive Hydrodynamic Models Using
//! Neural ODEs in Complex Conditions". The paper's attention can be read in two ways ([`Tokens`]): over past samples, or over
//! the numbers of the condition vector. Departures, all by configuration: the latent may be wider than the force, the attitude
//! enters as the up direction, the field may have a linear part that starts out as a relaxation, and the sample at the end of a
//! step may drive it.

use candle_core::{Result, Tensor};
use candle_nn::{Init, VarBuilder};
use serde::{Deserialize, Serialize};

use super::{
    feature_attention::{FeatureAttention, MOST_TOKENS},
    force_ode::{ForceOde, ForceOdeConfig, Method},
    sample_attention::SampleAttention,
};
use crate::{
    adjoint::Adjoint,
    encoding::{Encoder, Encoding},
    features::FeatureLayout,
    operations::Backend,
    solver::Solver,
};

/// Tokens of the attention.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Tokens {
    /// The samples of the window: the newest attends to the past ([`super::sample_attention`]).
    #[default]
    Samples,
    /// The encoded numbers of the window, each a token: the condition vector is compressed, as the paper says it
    /// ([`super::feature_attention`]).
    Features,
}

/// Sizes of an Attention-ODE.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AttentionOdeConfig {
    /// W, samples of the past that h sees, the newest included.
    pub window: usize,
    /// Attention heads.
    pub heads: usize,
    /// E, length of a sample's embedding; the heads divide it.
    pub embedding: usize,
    /// Length of h; the paper's is the length of the force.
    pub latent: usize,
    /// Hidden layers of the field.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// True if the field reads F besides h; if not, the force is a running sum (the paper writes both).
    pub field_sees_force: bool,
    /// True if the field has a linear part A [F; h], initialised to -F plus small numbers.
    pub skip: bool,
    /// What attends to what. A card without it is of a model whose samples do.
    #[serde(skip_serializing_if = "is_default")]
    pub tokens: Tokens,
    /// True if the sample at its end drives a step, F_{k+1} = F_k + dt f(F_k, h_{k+1}); false if the sample at its start
    /// does, which delays the force by a sample. A card without it says false.
    #[serde(skip_serializing_if = "is_default")]
    pub end_of_step: bool,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Default for AttentionOdeConfig {
    fn default() -> Self {
        Self {
            window: 8,
            heads: 4,
            embedding: 64,
            latent: 64,
            hidden: vec![512; 3],
            encoding: Encoding::Up,
            field_sees_force: true,
            skip: true,
            tokens: Tokens::Samples,
            end_of_step: false,
        }
    }
}

impl AttentionOdeConfig {
    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        let sizes = [self.window, self.heads, self.embedding, self.latent];
        if sizes.contains(&0) || self.hidden.contains(&0) {
            return Some(
                "window, heads, embedding, latent and hidden sizes must be at least 1".to_owned(),
            );
        }
        (!self.embedding.is_multiple_of(self.heads)).then(|| {
            format!(
                "embedding {} is not divisible by {} heads",
                self.embedding, self.heads
            )
        })
    }

    /// Reason why the numbers of a window cannot all be tokens, if they are to be.
    pub(super) fn too_many_tokens(&self, layout: &FeatureLayout) -> Option<String> {
        let numbers = Encoder::new(&self.encoding, layout).len();
        let count = self.window.saturating_mul(numbers);
        (self.tokens == Tokens::Features && count > MOST_TOKENS).then(|| {
            format!(
                "attention over features has {count} tokens ({} samples of {numbers} encoded numbers), expected {MOST_TOKENS} \
                 at most: choose encoding raw or up, or a smaller window",
                self.window
            )
        })
    }
}

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

    /// Mean weight of each token `[H][..]` over all samples of z [B, W-1+S, n]: of each lag, or of each number of the window,
    /// newest sample first.
    pub fn mean_weights(&self, z: &Tensor) -> Result<Vec<Vec<f64>>> {
        match &self.sight {
            Sight::Samples(attention) => attention.mean_weights(z),
            Sight::Features(attention) => attention.mean_weights(z),
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

/// x [rows, inputs] -> x W^T + b.
pub(super) fn affine(x: &Tensor, (weight, bias): &(Tensor, Tensor)) -> Result<Tensor> {
    x.matmul(&weight.t()?)?.broadcast_add(bias)
}

/// Weights `name.*` of a linear layer, drawn so that its outputs have `gain` times the deviation of its inputs.
pub(super) fn linear(
    vb: &VarBuilder,
    name: &str,
    inputs: usize,
    outputs: usize,
    gain: f64,
) -> Result<(Tensor, Tensor)> {
    let up = gain * (3.0 / inputs as f64).sqrt();
    let vb = vb.pp(name);
    let weight = vb.get_with_hints((outputs, inputs), "weight", Init::Uniform { lo: -up, up })?;
    Ok((
        weight,
        vb.get_with_hints(outputs, "bias", Init::Const(0.0))?,
    ))
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
