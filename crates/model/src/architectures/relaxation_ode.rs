//! Relaxation-ODE: the force is a sum of modes, each relaxing to a target at a rate, both of the motion alone.
//!
//! ```text
//! F = S_1 + .. + S_J,   dS_j/dt = K_j(h) (T_j(h) - S_j),   K_j = softplus(kappa_j) / Dt > 0,   h = [z_k; z_k - z_{k-1}; ..]
//! [T_1 .. T_J; kappa_1 .. kappa_J] = A h + network(h) - [0; .. 0; 0, 2, .. 2 (J - 1)]
//! S_j,k = S_j,k-1 + sigmoid(kappa_j,k) (T_j,k - S_j,k-1)          the exact step, for 1 - e^(-softplus(x)) = sigmoid(x)
//! ```
//!
//! Ours, not the paper's. For a given motion two forces approach each other at every step, so an error at the start
//! is forgotten and the force cannot drift. Rates and targets do not depend on F: those of a whole trajectory are one
//! product, and what is left is a scan (`operations/relaxation_op.rs`). The differences of samples let the target hold added
//! mass and what is left of the step's own acceleration. Several modes are a fading memory of several time scales, as the
//! state-space models of wave radiation forces are (T. Perez and T. I. Fossen, "Time- vs. frequency-domain identification of
//! parametric radiation force models for marine structures at zero speed", MIC 29(1), 2008), but with real rates that the
//! motion sets; each mode begins training five to seven times slower than the one before. At the start the slower modes are
//! taken to have settled, and the first has the rest of F_0; where they had not, that is forgotten at their own rates.
//!
//! With a memory (`relaxing_memory.rs`) targets and rates read its numbers m too: [T; kappa] = A [h; m] + network([h; m]). Then the force
//! need not be a sum of fading parts.
//!
//! With [`Encoding::Hydrodynamic`] or [`Encoding::Links`] z holds the closed forms of buoyancy, drag and constant added mass,
//! and A their learned coefficients; the network has what they leave.
//!
//! Time: the force at sample k uses the motion up to sample k; until the next sample it is held.

use candle_core::{Result, Tensor};
use candle_nn::{VarBuilder, ops::sigmoid};
use serde::{Deserialize, Serialize};

use crate::{
    architectures::relaxing_memory::RelaxingMemory,
    encoding::Encoding,
    kinematics::Kinematics,
    operations::{Backend, relaxation_op::relax},
    perceptron::{Perceptron, PerceptronConfig},
};

/// Sizes of a Relaxation-ODE.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RelaxationOdeConfig {
    /// W, samples that h sees: the newest, and W - 1 differences of neighbours.
    pub window: usize,
    /// Hidden layers of the network.
    pub hidden: Vec<usize>,
    /// Encoding of a sample.
    pub encoding: Encoding,
    /// True if there is a linear part A.
    pub skip: bool,
    /// J, modes whose sum is the force.
    pub modes: usize,
    /// M, numbers of the memory that targets and rates read; absent in a card means none.
    pub memory: usize,
}

impl Default for RelaxationOdeConfig {
    fn default() -> Self {
        Self {
            window: 2,
            hidden: vec![256; 2],
            encoding: Encoding::Hydrodynamic,
            skip: true,
            modes: 1,
            memory: 0,
        }
    }
}

impl RelaxationOdeConfig {
    /// The default sizes, with the closed forms of the links if their kinematics are known.
    pub fn with_kinematics(kinematics: Option<&Kinematics>) -> Self {
        let usual = Self::default();
        Self {
            encoding: kinematics.map_or(usual.encoding, |links| Encoding::Links(links.clone())),
            ..usual
        }
    }

    /// Reason why a model of these sizes cannot be built, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.window == 0 || self.hidden.contains(&0) {
            return Some("window and hidden sizes must be at least 1".to_owned());
        }
        (!(1..=MOST_MODES).contains(&self.modes))
            .then(|| format!("modes is {}, expected from 1 to {MOST_MODES}", self.modes))
    }
}

/// Greatest J. The slowest of five modes starts with about 1/3000 of the way a sample; a slower one would not move within a
/// training window.
const MOST_MODES: usize = 5;

/// Offset subtracted from kappa of mode `mode` (0-based): each mode starts slower than the one before.
pub(crate) fn kappa_offset(mode: usize) -> f32 {
    2.0 * mode as f32
}

/// The model in Candle; all in standardised units.
#[derive(Clone, Debug)]
pub struct RelaxationOde {
    pub(crate) window: usize,
    pub(crate) modes: usize,
    pub(crate) memory: Option<RelaxingMemory>,
    /// h [W n], m [M] -> [T; kappa], kappa as it is before modes are told apart [2 J f].
    pub(crate) field: Perceptron,
}

impl RelaxationOde {
    /// For `inputs` encoded numbers a sample and `outputs` force components.
    pub fn new(
        config: &RelaxationOdeConfig,
        inputs: usize,
        outputs: usize,
        vb: VarBuilder,
    ) -> Result<Self> {
        let h = config.window * inputs;
        let memory = (config.memory > 0)
            .then(|| RelaxingMemory::new(config.memory, h, config.skip, vb.pp("memory")));
        let field = PerceptronConfig {
            inputs: h + config.memory,
            outputs: 2 * config.modes * outputs,
            hidden: config.hidden.clone(),
            skip: config.skip,
            relaxing: false,
        };
        Ok(Self {
            window: config.window,
            modes: config.modes,
            memory: memory.transpose()?,
            field: Perceptron::new(field, vb.pp("field"))?,
        })
    }

    /// z [B, W-1+T, n], F_0 [B, f] -> F [B, T, f]; the first force is F_0, within rounding.
    pub fn forward(&self, z: &Tensor, start: &Tensor) -> Result<Tensor> {
        self.forward_by(Backend::for_device(z.device()), z, start)
    }

    fn forward_by(&self, operations: Backend, z: &Tensor, start: &Tensor) -> Result<Tensor> {
        let (batch, samples, inputs) = z.dims3()?;
        let steps = samples - self.window;
        if steps == 0 {
            return start.unsqueeze(1);
        }
        let rows = batch * (steps + 1);
        let lagged = |lag: usize| z.narrow(1, self.window - 1 - lag, steps + 1);
        let h = differences(self.window, lagged)?.reshape((rows, self.window * inputs))?;
        let h = match &self.memory {
            Some(memory) => Tensor::cat(&[&h, &memory.forward(operations, &h, batch)?], 1)?,
            None => h,
        };
        let (share, target) = self.share_and_target(&h)?;
        let width = target.dim(1)?;
        let per_sample = |rows: Tensor| rows.reshape((batch, steps + 1, width));
        let (share, target) = (per_sample(share)?, per_sample(target)?);
        let begin = self.begin(start, &target.narrow(1, 0, 1)?.squeeze(1)?)?;
        let later = |rows: Tensor| rows.narrow(1, 1, steps);
        let states = relax(operations, &begin, &later(share)?, &later(target)?)?;
        self.force(&states)
    }

    /// h and m [rows, W n + M] -> sigmoid(kappa), the fraction of the way to the target that a step goes, and the target, both
    /// [rows, J f].
    fn share_and_target(&self, h: &Tensor) -> Result<(Tensor, Tensor)> {
        let found = self.field.forward(h)?;
        let width = found.dim(1)? / 2;
        let outputs = width / self.modes;
        let mut kappa = Vec::with_capacity(self.modes);
        for mode in 0..self.modes {
            let own = found.narrow(1, width + mode * outputs, outputs)?;
            kappa.push(own.affine(1.0, -f64::from(kappa_offset(mode)))?);
        }
        let target = found.narrow(1, 0, width)?.contiguous()?;
        Ok((sigmoid(&Tensor::cat(&kappa, 1)?)?, target))
    }

    /// S_0 [B, J f] of F_0 [B, f] and the first targets [B, J f].
    fn begin(&self, force: &Tensor, target: &Tensor) -> Result<Tensor> {
        let outputs = force.dim(1)?;
        let mut states = vec![force.clone()];
        for mode in 1..self.modes {
            let settled = target.narrow(1, mode * outputs, outputs)?;
            states[0] = (&states[0] - &settled)?;
            states.push(settled);
        }
        Tensor::cat(&states, 1)
    }

    /// S [.., J f] -> F [.., f].
    fn force(&self, states: &Tensor) -> Result<Tensor> {
        let last = states.rank() - 1;
        let outputs = states.dim(last)? / self.modes;
        let mut force = states.narrow(last, 0, outputs)?;
        for mode in 1..self.modes {
            force = (force + states.narrow(last, mode * outputs, outputs)?)?;
        }
        Ok(force)
    }

    /// Numbers M of the memory.
    fn numbers(&self) -> usize {
        self.memory.as_ref().map_or(0, |memory| memory.numbers)
    }

    /// Numbers of the state of [`RelaxationOde::start`] where the force has `outputs`.
    pub(crate) fn state_len(&self, outputs: usize) -> usize {
        self.numbers() + (self.modes + 1) * outputs
    }

    /// h [1, W n] of one window z [W, n]; and m [1, M], the first numbers of a state `before` one sample on, or without one settled.
    fn latent_and_memory(
        &self,
        z: &Tensor,
        before: Option<&Tensor>,
    ) -> Result<(Tensor, Option<Tensor>)> {
        let h = self.latent(z)?;
        let Some(memory) = &self.memory else {
            return Ok((h, None));
        };
        let m = match before {
            Some(state) => memory.follow(&state.narrow(1, 0, memory.numbers)?, &h)?,
            None => memory.settled(&h)?,
        };
        Ok((Tensor::cat(&[&h, &m], 1)?, Some(m)))
    }

    /// h [1, W n] of one window z [W, n].
    fn latent(&self, z: &Tensor) -> Result<Tensor> {
        differences(self.window, |lag| z.narrow(0, self.window - 1 - lag, 1))
    }

    /// State [1, M + (J + 1) f] at a first sample with the window z [W, n]: m, S_2 .. S_J, a = 1 and b = 0 of F_0 = a F_0 + b.
    pub(crate) fn start(&self, z: &Tensor) -> Result<Tensor> {
        let (h, memory) = self.latent_and_memory(z, None)?;
        let (_, target) = self.share_and_target(&h)?;
        let outputs = target.dim(1)? / self.modes;
        let settled = target.narrow(1, outputs, (self.modes - 1) * outputs)?;
        let first = target.narrow(1, 0, outputs)?;
        let mut state: Vec<Tensor> = memory.into_iter().collect();
        state.extend([settled, first.ones_like()?, first.zeros_like()?]);
        Tensor::cat(&state, 1)
    }

    /// The state one sample later, with the window z [W, n] that ends there: m, S_2 .. S_J, a and b of F_k = a F_{k-1} + b.
    pub(crate) fn follow(&self, state: &Tensor, z: &Tensor) -> Result<Tensor> {
        let (h, memory) = self.latent_and_memory(z, Some(state))?;
        let state = state.narrow(1, self.numbers(), state.dim(1)? - self.numbers())?;
        let (share, target) = self.share_and_target(&h)?;
        let outputs = target.dim(1)? / self.modes;
        let part = |of: &Tensor, at: usize| of.narrow(1, at * outputs, outputs);
        let first = part(&share, 0)?;
        let (a, mut b) = (first.affine(-1.0, 1.0)?, (&first * part(&target, 0)?)?);
        let mut after: Vec<Tensor> = memory.into_iter().collect();
        for mode in 1..self.modes {
            let before = part(&state, mode - 1)?;
            let step = (part(&share, mode)? * (part(&target, mode)? - &before)?)?;
            let now = (&before + step)?;
            b = ((b + &now)? - (&a * before)?)?;
            after.push(now);
        }
        after.extend([a, b]);
        Tensor::cat(&after, 1)
    }

    /// F_k [1, f] of F_{k-1} and a state of [`RelaxationOde::start`] or [`RelaxationOde::follow`].
    pub(crate) fn step(&self, state: &Tensor, force: &Tensor) -> Result<Tensor> {
        let outputs = force.dim(1)?;
        let map = self.numbers() + (self.modes - 1) * outputs;
        let part = |of: usize| state.narrow(1, map + of * outputs, outputs);
        (part(0)? * force)? + part(1)?
    }

    /// F [1, f] to which a constant window z [W, n] leads.
    pub(crate) fn settled(&self, z: &Tensor) -> Result<Tensor> {
        let (h, _) = self.latent_and_memory(z, None)?;
        self.force(&self.share_and_target(&h)?.1)
    }
}

/// [z_0, z_0 - z_1, ..] of what `lagged` gives so many steps back, side by side.
fn differences(window: usize, lagged: impl Fn(usize) -> Result<Tensor>) -> Result<Tensor> {
    let mut parts = vec![lagged(0)?];
    for lag in 1..window {
        parts.push((lagged(lag - 1)? - lagged(lag)?)?);
    }
    let last = parts[0].rank() - 1;
    Tensor::cat(&parts, last)
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};

    use super::*;
    use crate::testing::check_gradient;
    use crate::testing::{in_f64, numbers, ramp, weighted};

    fn model(window: usize, modes: usize) -> (RelaxationOde, Vec<(String, Var)>) {
        with_memory(window, modes, 0)
    }

    fn with_memory(
        window: usize,
        modes: usize,
        memory: usize,
    ) -> (RelaxationOde, Vec<(String, Var)>) {
        let config = RelaxationOdeConfig {
            window,
            modes,
            memory,
            hidden: vec![9, 7],
            ..RelaxationOdeConfig::default()
        };
        in_f64(|vb| RelaxationOde::new(&config, 4, 2, vb))
    }

    /// h of sample k of motions z of four numbers: the sample after the one before it, and their difference.
    fn in_a_window_of_two(z: &[f64], k: usize) -> Vec<f64> {
        let (before, newest) = (&z[4 * k..][..4], &z[4 * (k + 1)..][..4]);
        let change = newest.iter().zip(before).map(|(new, old)| new - old);
        newest.iter().copied().chain(change).collect()
    }

    #[test]
    fn a_card_that_names_no_modes_has_one_and_no_memory() {
        let config: RelaxationOdeConfig = serde_json::from_str("{\"window\": 3}").expect("parses");
        assert_eq!((config.window, config.modes, config.memory), (3, 1, 0));
    }

    #[test]
    fn the_gradient_agrees_with_finite_differences() {
        for (modes, memory) in [(1, 0), (3, 0), (1, 5)] {
            let (model, vars) = with_memory(2, modes, memory);
            let (z, start) = (ramp(&[3, 1 + 12, 4], 0.53), ramp(&[3, 2], 0.9));
            check_gradient(&vars, || {
                weighted(&model.forward(&z, &start).expect("runs"))
            });
        }
    }

    /// For one motion, whatever the forces at the start: they approach each other at every step.
    #[test]
    fn the_start_is_forgotten() {
        for (window, modes, memory) in [(1, 1, 0), (2, 1, 0), (2, 3, 0), (3, 2, 0), (2, 1, 5)] {
            let (model, _) = with_memory(window, modes, memory);
            let z = ramp(&[1, window - 1 + 60, 4], 0.53);
            let run = |value: f64| {
                let start = Tensor::full(value, (1, 2), &Device::Cpu).expect("made");
                numbers(&model.forward(&z, &start).expect("runs"))
            };
            let (a, b) = (run(-50.0), run(80.0));
            assert!((a[0] + 50.0).abs() < 1e-12 && (b[0] - 80.0).abs() < 1e-12);
            for k in 1..60 {
                for axis in 0..2 {
                    let apart = |k: usize| (a[2 * k + axis] - b[2 * k + axis]).abs();
                    assert!(apart(k) < apart(k - 1) || apart(k) < 1e-12, "sample {k}");
                }
            }
        }
    }

    /// Each mode by itself, sample by sample, and their sum.
    #[test]
    fn the_force_is_the_sum_of_modes_that_relax_each_at_its_own_rate() {
        let (steps, modes, outputs) = (25, 3, 2);
        let (model, _) = model(2, modes);
        let z = ramp(&[1, 1 + steps + 1, 4], 0.53);
        let start = [0.9, -1.7];
        let found = model
            .forward(&z, &Tensor::new(&[start], &Device::Cpu).expect("made"))
            .map(|forces| numbers(&forces))
            .expect("runs");

        let z = numbers(&z);
        let mut states = vec![0.0; modes * outputs];
        for k in 0..=steps {
            let h = in_a_window_of_two(&z, k);
            let h = Tensor::from_vec(h, (1, 8), &Device::Cpu).expect("made");
            let row = numbers(&model.field.forward(&h).expect("runs"));
            let (target, kappa) = row.split_at(modes * outputs);
            for i in 0..modes * outputs {
                let rate = (1.0 + (kappa[i] - 2.0 * (i / outputs) as f64).exp()).ln();
                let kept = if k > 0 { (-rate).exp() } else { 0.0 };
                states[i] = target[i] + kept * (states[i] - target[i]);
            }
            for axis in 0..outputs {
                if k == 0 {
                    states[axis] =
                        start[axis] - states[outputs + axis] - states[2 * outputs + axis];
                }
                let sum: f64 = (0..modes).map(|mode| states[mode * outputs + axis]).sum();
                let error = (found[k * outputs + axis] - sum).abs();
                assert!(error < 1e-12, "sample {k}, axis {axis}: {error}");
            }
        }
    }

    /// The memory sample by sample, each number at its own rate; the force relaxes to what is read from it.
    #[test]
    fn targets_read_a_memory_that_relaxes() {
        let (steps, width, outputs) = (20, 5, 2);
        let (model, _) = with_memory(2, 1, width);
        let z = ramp(&[1, 1 + steps + 1, 4], 0.53);
        let start = [0.9, -1.7];
        let found = model
            .forward(&z, &Tensor::new(&[start], &Device::Cpu).expect("made"))
            .map(|forces| numbers(&forces))
            .expect("runs");
        let z = numbers(&z);
        let (mut memory, mut force) = (vec![0.0; width], start);
        for k in 0..=steps {
            let mut h = in_a_window_of_two(&z, k);
            let row = |field: &Perceptron, h: &[f64]| {
                let h = Tensor::from_slice(h, (1, h.len()), &Device::Cpu).expect("made");
                numbers(&field.forward(&h).expect("runs"))
            };
            let led = row(&model.memory.as_ref().expect("a memory").field, &h);
            for (i, number) in memory.iter_mut().enumerate() {
                let lambda = led[width + i] - 7.0 * i as f64 / width as f64;
                let kept = if k > 0 {
                    1.0 / (1.0 + lambda.exp())
                } else {
                    0.0
                };
                *number = led[i] + kept * (*number - led[i]);
            }
            h.extend(&memory);
            let read = row(&model.field, &h);
            for axis in 0..outputs {
                if k > 0 {
                    let kept = 1.0 / (1.0 + read[outputs + axis].exp());
                    force[axis] = read[axis] + kept * (force[axis] - read[axis]);
                }
                let error = (found[k * outputs + axis] - force[axis]).abs();
                assert!(error < 1e-6, "sample {k}, axis {axis}: {error}");
            }
        }
    }

    #[test]
    fn in_tensor_operations_it_is_the_same() {
        for (modes, memory) in [(1, 0), (3, 0), (1, 5)] {
            let (model, vars) = with_memory(2, modes, memory);
            let (z, start) = (ramp(&[3, 1 + 12, 4], 0.53), ramp(&[3, 2], 0.9));
            let run = |operations| {
                let forces = model.forward_by(operations, &z, &start).expect("runs");
                let gradients = weighted(&forces).backward().expect("derives");
                let mut found = numbers(&forces);
                for (_, var) in &vars {
                    found.extend(numbers(gradients.get(var).expect("a gradient")));
                }
                found
            };
            let (kernels, tensors) = (run(Backend::Kernels), run(Backend::Tensors));
            assert_eq!(kernels.len(), tensors.len());
            for (a, b) in kernels.iter().zip(&tensors) {
                assert!(
                    (a - b).abs() < 1e-10 * (1.0 + a.abs()),
                    "{modes} modes, memory {memory}: {a} against {b}"
                );
            }
        }
    }

    #[test]
    fn the_past_alone_decides() {
        let (model, _) = model(2, 3);
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
        let (model, _) = model(2, 3);
        let start = ramp(&[1, 2], 0.9);
        let forces = model.forward(&ramp(&[1, 2, 4], 0.5), &start).expect("runs");
        assert_eq!(
            (forces.dims(), numbers(&forces)),
            (&[1, 1, 2][..], numbers(&start))
        );
    }
}
