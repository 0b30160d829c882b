//! CNODE, a neural controlled differential equation: the state follows the changes of the motion.
//!
//! ```text
//! ds = field(s) dX,   s = [F; g],  X = [z; t],   s_0 = [F_0; W_g [F_0; z_0] + b_g]
//! ```
//!
//! The paper's baseline (P. Kidger et al., NeurIPS 2020), with the force as the front of the state, so that F(t_0) is
//! given as to the other ODEs. X is a path through the samples ([`super::control_path`]): a causal one, or the natural cubic
//! spline of the whole trajectory, as in the paper, for trajectories that are known from end to end; a simulation, and
//! every engine, takes the causal one. By Euler's method both are the same: ds = field(s) (X_{k+1} - X_k).
//!
//! The equation does not determine the force at a first sample; a small perceptron of z_0 estimates it.
//!
//! Time: along the causal path the force at sample k uses the motion up to sample k; until the next sample it is held.

use candle_core::{Result, Tensor};
use candle_nn::{Init, VarBuilder};
use serde::{Deserialize, Serialize};

use super::control_path::{CLOCK, Control, causal, natural};
use crate::{
    encoding::Encoding,
    operations::{
        Backend,
        controlled_trajectory::{integrate, step},
    },
    perceptron::{Perceptron, PerceptronConfig},
    solver::{Solver, Tableau},
};

/// Width of the perceptron that estimates a first force.
const ESTIMATE: usize = 64;

/// Bound of the state [standard deviations], applied by every engine but not in training: the equation has no term that
/// brings a state back, so in a long simulation sums of changes would overflow.
pub(crate) const STATE_LIMIT: f64 = 100.0;

/// Sizes of a CNODE.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CnodeConfig {
    /// Length of g, the part of the state beside the force.
    pub hidden_state: usize,
    /// Hidden layers of the field.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// The path of training, of validation and of the errors in the card.
    pub control: Control,
}

impl Default for CnodeConfig {
    fn default() -> Self {
        Self {
            hidden_state: 7,
            hidden: vec![256, 512, 512],
            encoding: Encoding::Up,
            control: Control::Hermite,
        }
    }
}

impl CnodeConfig {
    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        (self.hidden_state == 0 || self.hidden.contains(&0))
            .then(|| "hidden_state and hidden sizes must be at least 1".to_owned())
    }
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct Cnode {
    control: Control,
    /// W_g [g, f + n], b_g [g].
    pub(crate) lift: (Tensor, Tensor),
    /// s [f + g] -> [f + g, n + 1].
    pub(crate) field: Perceptron,
    /// z_0 [n] -> an estimate of F_0 [f].
    pub(crate) estimate: Perceptron,
}

impl Cnode {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(
        config: &CnodeConfig,
        inputs: usize,
        outputs: usize,
        vb: VarBuilder,
    ) -> Result<Self> {
        let state = outputs + config.hidden_state;
        let field = PerceptronConfig {
            inputs: state,
            outputs: state * (inputs + 1),
            hidden: config.hidden.clone(),
            skip: false,
            relaxing: false,
        };
        let estimate = PerceptronConfig {
            inputs,
            outputs,
            hidden: vec![ESTIMATE],
            skip: true,
            relaxing: false,
        };
        let seen = outputs + inputs;
        let up = (3.0 / seen as f64).sqrt();
        let vb_lift = vb.pp("lift");
        Ok(Self {
            control: config.control,
            lift: (
                vb_lift.get_with_hints(
                    (config.hidden_state, seen),
                    "weight",
                    Init::Uniform { lo: -up, up },
                )?,
                vb_lift.get_with_hints(config.hidden_state, "bias", Init::Const(0.0))?,
            ),
            field: Perceptron::new(field, vb.pp("field"))?,
            estimate: Perceptron::new(estimate, vb.pp("estimate"))?,
        })
    }

    /// z [B, 1+T, n] (one sample in front of the trajectory), F_0 [B, f] -> F [B, T, f]; the first force is F_0.
    pub fn forward(&self, z: &Tensor, start: &Tensor, solver: Solver) -> Result<Tensor> {
        let first = z.narrow(1, 1, 1)?.squeeze(1)?;
        let state = self.start(start, &first)?;
        if z.dim(1)? == 2 {
            return start.unsqueeze(1);
        }
        let slopes = self.slopes(z, solver)?;
        let operations = Backend::for_device(z.device());
        let states = integrate(operations, &self.field, stages(solver)?, &state, &slopes)?;
        states.narrow(2, 0, start.dim(1)?)?.contiguous()
    }

    /// Mean square error of the estimated F_0 [B, f] of z [B, 1+T, n]: no weight of the equation takes part.
    pub(crate) fn estimate_loss(&self, z: &Tensor, start: &Tensor) -> Result<Tensor> {
        let first = z.narrow(1, 1, 1)?.squeeze(1)?.contiguous()?;
        (self.estimate.forward(&first)? - start)?.sqr()?.mean_all()
    }

    /// F_0 [rows, f] and z_0 [rows, n] -> s_0 [rows, f + g].
    pub(crate) fn start(&self, force: &Tensor, z: &Tensor) -> Result<Tensor> {
        let seen = Tensor::cat(&[force, z], 1)?;
        let lifted = seen
            .matmul(&self.lift.0.t()?)?
            .broadcast_add(&self.lift.1)?;
        Tensor::cat(&[force, &lifted], 1)
    }

    /// X' at the stages' times: z [B, 1+T, n] -> [B, T-1, stages, n+1]. Data: no gradient goes through it.
    fn slopes(&self, z: &Tensor, solver: Solver) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let nodes = stages(solver)?.along_previous;
        let steps = samples - 2;
        let values = z
            .to_dtype(candle_core::DType::F64)?
            .flatten_all()?
            .to_vec1::<f64>()?;
        let mut slopes = vec![CLOCK; batch * steps * nodes.len() * (inputs + 1)];
        for (z, slopes) in values
            .chunks_exact(samples * inputs)
            .zip(slopes.chunks_exact_mut(steps * nodes.len() * (inputs + 1)))
        {
            for channel in 0..inputs {
                let path: Vec<f64> = z.iter().skip(channel).step_by(inputs).copied().collect();
                let found = match (self.control, solver) {
                    (Control::Natural, Solver::Rk4) => natural(&path[1..], nodes),
                    _ => path
                        .windows(3)
                        .flat_map(|x| nodes.iter().map(|u| causal(solver, [x[0], x[1], x[2]], *u)))
                        .collect(),
                };
                for (row, slope) in slopes.chunks_exact_mut(inputs + 1).zip(found) {
                    row[channel] = slope;
                }
            }
        }
        Tensor::from_vec(slopes, (batch, steps, nodes.len(), inputs + 1), z.device())?
            .to_dtype(z.dtype())
    }

    /// s [1, s] from sample to sample along the causal path, by Candle's own operations: the last three samples z [3, n].
    pub(crate) fn follow(&self, state: &Tensor, z: &Tensor, solver: Solver) -> Result<Tensor> {
        let nodes = stages(solver)?.along_previous;
        let inputs = z.dim(1)?;
        let rows = z.to_dtype(candle_core::DType::F64)?.to_vec2::<f64>()?;
        let mut slopes = vec![CLOCK; nodes.len() * (inputs + 1)];
        for (row, u) in slopes.chunks_exact_mut(inputs + 1).zip(nodes) {
            for (channel, slot) in row[..inputs].iter_mut().enumerate() {
                let x = [rows[0][channel], rows[1][channel], rows[2][channel]];
                *slot = causal(solver, x, *u);
            }
        }
        let slopes = Tensor::from_vec(slopes, (1, nodes.len(), inputs + 1), z.device())?;
        let slopes = slopes.to_dtype(z.dtype())?;
        step(&self.field, stages(solver)?, state, &slopes)
    }
}

/// The stages of a step, whose times are those at which the path is asked for its slope, before any step is taken.
pub(crate) fn stages(solver: Solver) -> Result<Tableau> {
    solver.tableau().ok_or_else(|| {
        candle_core::Error::Msg(format!(
            "solver is {solver}, expected {}: a CNODE's path has its slopes at the times of fixed steps",
            Solver::FIXED.map(|solver| solver.to_string()).join(" or ")
        ))
    })
}

#[cfg(test)]
mod tests {
    use candle_core::Var;

    use super::*;
    use crate::testing::check_gradient;
    use crate::testing::{in_f64, numbers, ramp, weighted};

    const INPUTS: usize = 4;

    fn model(control: Control) -> (Cnode, Vec<(String, Var)>) {
        let config = CnodeConfig {
            hidden_state: 3,
            hidden: vec![9, 7],
            control,
            ..CnodeConfig::default()
        };
        in_f64(|vb| Cnode::new(&config, INPUTS, 2, vb))
    }

    /// One sample in front of 12, small steps.
    fn motion() -> (Tensor, Tensor) {
        let z = (ramp(&[3, 1 + 12, INPUTS], 0.53) * 0.3).expect("scaled");
        (z, ramp(&[3, 2], 0.9))
    }

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        let (z, start) = motion();
        for control in Control::ALL {
            for solver in Solver::FIXED {
                let (model, vars) = model(control);
                check_gradient(&vars, || {
                    let forces = weighted(&model.forward(&z, &start, solver).expect("runs"));
                    let estimate = model.estimate_loss(&z, &start).expect("runs");
                    (forces + estimate).expect("a loss")
                });
            }
        }
    }

    /// Forces of the first trajectory, sample after sample.
    fn forces(model: &Cnode, z: &Tensor, start: &Tensor, solver: Solver) -> Vec<f64> {
        let found = model.forward(z, start, solver).expect("runs");
        numbers(&found.narrow(0, 0, 1).expect("one trajectory"))
    }

    /// Samples from number 6 on are others: the causal path does not know, the natural spline does.
    #[test]
    fn the_causal_path_knows_the_past_alone() {
        let (z, start) = motion();
        let other = (ramp(&[3, 6, INPUTS], 2.3) * 0.3).expect("scaled");
        let changed = z
            .narrow(1, 0, 1 + 6)
            .and_then(|past| Tensor::cat(&[past, other], 1));
        let changed = changed.expect("joined");
        for control in Control::ALL {
            let (model, _) = model(control);
            let before = forces(&model, &z, &start, Solver::Rk4);
            let after = forces(&model, &changed, &start, Solver::Rk4);
            assert_ne!(before[12..14], after[12..14]);
            assert_eq!(before[..12] == after[..12], control == Control::Hermite);
        }
    }

    /// Whole trajectories and steps one by one are the same along the causal path.
    #[test]
    fn steps_one_by_one_give_the_whole_trajectory() {
        let (z, start) = motion();
        let (model, _) = model(Control::Hermite);
        for solver in Solver::FIXED {
            let whole = forces(&model, &z, &start, solver);
            let z = z
                .narrow(0, 0, 1)
                .and_then(|z| z.squeeze(0))
                .expect("one trajectory");
            let begin = start.narrow(0, 0, 1).expect("one trajectory");
            let mut state = model
                .start(&begin, &z.narrow(0, 1, 1).expect("the first sample"))
                .expect("a state");
            let mut found = numbers(&begin);
            for k in 0..11 {
                // The sample in front of the first is the first itself in a simulation, but here another.
                let seen = z.narrow(0, k, 3).expect("three samples");
                state = model.follow(&state, &seen, solver).expect("a step");
                found.extend(&numbers(&state)[..2]);
            }
            assert_eq!(found.len(), whole.len());
            for (found, whole) in found.iter().zip(&whole) {
                assert!((found - whole).abs() < 1e-12, "{solver}: {found} {whole}");
            }
        }
    }

    /// Under Euler's method a constant field follows the increments of the path: F_k = F_0 + C (X_k - X_0).
    #[test]
    fn a_constant_field_follows_the_path_to_its_samples() {
        let (z, start) = motion();
        for control in Control::ALL {
            let (model, vars) = model(control);
            let mut last = Vec::new();
            for (name, var) in &vars {
                if name.starts_with("field.2") {
                    let scale = if name.ends_with("weight") { 0.0 } else { 1.0 };
                    let values = (var.as_tensor() * scale).expect("scaled");
                    var.set(&values).expect("set");
                    if scale > 0.0 {
                        last = numbers(&values);
                    }
                }
            }
            for solver in Solver::FIXED {
                let found = forces(&model, &z, &start, solver);
                let (z, start) = (numbers(&z), numbers(&start));
                for (k, force) in found.chunks_exact(2).enumerate() {
                    for (axis, force) in force.iter().enumerate() {
                        let row = &last[axis * (INPUTS + 1)..][..INPUTS + 1];
                        let moved = |i: usize| z[(1 + k) * INPUTS + i] - z[INPUTS + i];
                        let way: f64 = (0..INPUTS).map(|i| row[i] * moved(i)).sum();
                        let exact = start[axis] + way + row[INPUTS] * CLOCK * k as f64;
                        assert!((force - exact).abs() < 1e-12, "{control} {solver} {k}");
                    }
                }
            }
        }
    }
}
