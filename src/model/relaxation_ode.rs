//! Relaxation-ODE: the force relaxes to a target at a rate, both of the motion alone.
//!
//! ```text
//! dF/dt = K(h) (F_inf(h) - F),   K = softplus(kappa) / Dt > 0,   h = [z_k; z_k - z_{k-1}; ..]
//! [F_inf; kappa] = A h + network(h)
//! F_k = F_{k-1} + sigmoid(kappa_k) (F_inf,k - F_{k-1})            the exact step, for 1 - e^(-softplus(x)) = sigmoid(x)
//! ```
//!
//! Ours, not the paper's. For a given motion two forces approach each other at every step, so an error at the start
//! is forgotten and the force cannot drift. K and F_inf do not depend on F: those of a whole trajectory are one
//! product, and what is left is a scan (`relaxation.rs`). The differences of samples let the target hold added
//! mass and what is left of the step's own acceleration.
//!
//! With [`Encoding::Hydrodynamic`] or [`Encoding::Links`] z holds the closed forms of buoyancy, drag and constant added mass,
//! and A their learned coefficients; the network has what they leave.
//!
//! Time: the force at sample k uses the motion up to sample k; until the next sample it is held.

use candle_core::{Result, Tensor};
use candle_nn::{VarBuilder, ops::sigmoid};
use serde::{Deserialize, Serialize};

use super::{
    encoding::Encoding,
    field::{Field, FieldConfig},
    operations::Operations,
    relaxation::relax,
};
use crate::kinematics::Kinematics;

/// Sizes of a Relaxation-ODE.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RelaxationOdeConfig {
    /// W, samples that h sees: the newest, and W - 1 differences of neighbours.
    pub window: usize,
    /// Hidden layers of the network.
    pub hidden: Vec<usize>,
    /// How a sample enters.
    pub encoding: Encoding,
    /// Whether there is the linear part A.
    pub skip: bool,
}

impl Default for RelaxationOdeConfig {
    fn default() -> Self {
        Self {
            window: 2,
            hidden: vec![256; 2],
            encoding: Encoding::Hydrodynamic,
            skip: true,
        }
    }
}

impl RelaxationOdeConfig {
    /// The usual sizes, with the links' motion where it is known.
    pub fn of(kinematics: Option<&Kinematics>) -> Self {
        let usual = Self::default();
        Self {
            encoding: kinematics.map_or(usual.encoding, |links| Encoding::Links(links.clone())),
            ..usual
        }
    }

    /// What is wrong with the sizes, if anything.
    pub(crate) fn fault(&self) -> Option<String> {
        (self.window == 0 || self.hidden.contains(&0))
            .then(|| "window and hidden sizes must be at least 1".to_owned())
    }
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct RelaxationOde {
    pub(crate) window: usize,
    /// h [W n] -> [F_inf; kappa] [2 f].
    pub(crate) field: Field,
}

impl RelaxationOde {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(
        config: &RelaxationOdeConfig,
        inputs: usize,
        outputs: usize,
        vb: VarBuilder,
    ) -> Result<Self> {
        let field = FieldConfig {
            inputs: config.window * inputs,
            outputs: 2 * outputs,
            hidden: config.hidden.clone(),
            skip: config.skip,
            relaxing: false,
        };
        Ok(Self {
            window: config.window,
            field: Field::new(field, vb.pp("field"))?,
        })
    }

    /// z [B, W-1+T, n], F_0 [B, f] -> F [B, T, f]; the first force is F_0 itself.
    pub fn forward(&self, z: &Tensor, start: &Tensor) -> Result<Tensor> {
        self.forward_by(Operations::of(z.device()), z, start)
    }

    fn forward_by(&self, operations: Operations, z: &Tensor, start: &Tensor) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let steps = samples - self.window;
        if steps == 0 {
            return start.unsqueeze(1);
        }
        let lagged = |lag: usize| z.narrow(1, self.window - lag, steps);
        let mut parts = vec![lagged(0)?];
        for lag in 1..self.window {
            parts.push((lagged(lag - 1)? - lagged(lag)?)?);
        }
        let rows = Tensor::cat(&parts, 2)?.reshape((batch * steps, self.window * inputs))?;
        let (share, target) = self.share_and_target(&rows)?;
        let shape = (batch, steps, target.dim(1)?);
        relax(
            operations,
            start,
            &share.reshape(shape)?,
            &target.reshape(shape)?,
        )
    }

    /// h [rows, W n] -> what part of the way a step goes, and where to [rows, f].
    fn share_and_target(&self, h: &Tensor) -> Result<(Tensor, Tensor)> {
        let found = self.field.forward(h)?;
        let width = found.dim(1)? / 2;
        let share = sigmoid(&found.narrow(1, width, width)?.contiguous()?)?;
        Ok((share, found.narrow(1, 0, width)?.contiguous()?))
    }

    /// As [`RelaxationOde::share_and_target`], of one window z [W, n]: [1, f].
    pub(crate) fn single(&self, z: &Tensor) -> Result<(Tensor, Tensor)> {
        let newest = self.window - 1;
        let row = |lag: usize| z.narrow(0, newest - lag, 1);
        let mut parts = vec![row(0)?];
        for lag in 1..self.window {
            parts.push((row(lag - 1)? - row(lag)?)?);
        }
        self.share_and_target(&Tensor::cat(&parts, 1)?)
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};

    use super::*;
    use crate::model::testing::{check_gradient, in_f64, numbers, ramp, weighted};

    fn model(window: usize) -> (RelaxationOde, Vec<(String, Var)>) {
        let config = RelaxationOdeConfig {
            window,
            hidden: vec![9, 7],
            ..RelaxationOdeConfig::default()
        };
        in_f64(|vb| RelaxationOde::new(&config, 4, 2, vb))
    }

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        let (model, vars) = model(2);
        let (z, start) = (ramp(&[3, 1 + 12, 4], 0.53), ramp(&[3, 2], 0.9));
        check_gradient(&vars, || {
            weighted(&model.forward(&z, &start).expect("runs"))
        });
    }

    /// For one motion, whatever the forces at the start: they approach each other at every step.
    #[test]
    fn the_start_is_forgotten() {
        for window in [1, 2, 3] {
            let (model, _) = model(window);
            let z = ramp(&[1, window - 1 + 60, 4], 0.53);
            let run = |value: f64| {
                let start = Tensor::full(value, (1, 2), &Device::Cpu).expect("made");
                numbers(&model.forward(&z, &start).expect("runs"))
            };
            let (a, b) = (run(-50.0), run(80.0));
            assert_eq!((a[0], b[0]), (-50.0, 80.0));
            for k in 1..60 {
                for axis in 0..2 {
                    let apart = |k: usize| (a[2 * k + axis] - b[2 * k + axis]).abs();
                    assert!(apart(k) < apart(k - 1) || apart(k) < 1e-12, "sample {k}");
                }
            }
        }
    }

    #[test]
    fn the_past_alone_decides() {
        let (model, _) = model(2);
        let z = ramp(&[1, 1 + 20, 4], 0.53);
        let start = ramp(&[1, 2], 0.9);
        let before = numbers(&model.forward(&z, &start).expect("runs"));
        // Another future: samples from number 10 on.
        let past = z.narrow(1, 0, 1 + 10).expect("past");
        let changed = Tensor::cat(&[past, ramp(&[1, 10, 4], 2.3)], 1).expect("joined");
        let after = numbers(&model.forward(&changed, &start).expect("runs"));
        assert_eq!(before[..20], after[..20]);
        assert_ne!(before[20..22], after[20..22]);
    }

    #[test]
    fn without_a_step_the_start_is_all_there_is() {
        let (model, _) = model(2);
        let start = ramp(&[1, 2], 0.9);
        let forces = model.forward(&ramp(&[1, 2, 4], 0.5), &start).expect("runs");
        assert_eq!(
            (forces.dims(), numbers(&forces)),
            (&[1, 1, 2][..], numbers(&start))
        );
    }
}
