//! The interface of every engine, and what the engines share.

use std::fmt;

use crate::error::ModelError;

/// A model ready to be stepped. Forces are SI [N, N m], features raw SI in the order of the card.
///
/// All memory of the past is a slice of numbers owned by the caller (the plugin has it in MuJoCo's state), so an engine
/// is immutable and serves any number of simulations, without locks or threads. In
/// [`Engine::start`], [`Engine::observe`] and [`Engine::sample`] the fused engine does not allocate once `scratch` has
/// grown.
pub trait Engine: Send + Sync + fmt::Debug {
    /// Features a sample, n.
    fn inputs(&self) -> usize;

    /// Force components, f.
    fn outputs(&self) -> usize;

    /// Length of the memory of one simulation.
    fn memory_len(&self) -> usize;

    /// Writes the memory at a first sample `x` [n] with the force `force` [f]. The window before it is filled with `x`; a
    /// recurrent state is empty.
    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], scratch: &mut Scratch);

    /// Takes the next sample `x` [n] into the memory.
    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch);

    /// Forces at the newest sample, given `force` [f], the `next` of the sample before. Writes `now` [f], the force at this
    /// sample, and `next` [f], the input of the next call. A model that predicts the next force has `now = force`; any
    /// other model computes the force at this sample and holds it, `next = now`.
    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    );

    /// Estimate of the force [f] at a first sample `x` [n]. Attention-ODE and MLP-ODE: the force that the equation settles
    /// to with h held, from the training mean in at most [`SETTLING_STEPS`]. Relaxation-ODE: its target. CNODE, which
    /// does not settle: the output of a perceptron trained for it. Default: the force at a first sample.
    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        self.start(x, &[], &mut memory, scratch);
        let mut next = vec![0.0; force.len()];
        self.sample(&memory, &[], force, &mut next, scratch);
    }

    /// Whole trajectories of one length: features `x` [B, T, n] and first forces `start` [B, f] -> forces [B, T, f]. The
    /// window before the first sample is filled with it. Some engines step a batch at a time: the same numbers, faster.
    ///
    /// # Errors
    /// If the lengths of `x` and `start` are not those of whole trajectories.
    fn trajectories(
        &self,
        x: &[f64],
        start: &[f64],
        scratch: &mut Scratch,
    ) -> Result<Vec<f64>, ModelError> {
        one_by_one(self, x, start, scratch)
    }
}

/// [`Engine::trajectories`] one sample at a time, as in a simulation.
///
/// # Errors
/// If the lengths of `x` and `start` are not those of whole trajectories.
pub fn one_by_one(
    engine: &(impl Engine + ?Sized),
    x: &[f64],
    start: &[f64],
    scratch: &mut Scratch,
) -> Result<Vec<f64>, ModelError> {
    let (inputs, outputs) = (engine.inputs(), engine.outputs());
    let samples = samples(engine, x, start)?;
    let mut memory = vec![0.0; engine.memory_len()];
    let (mut now, mut next) = (vec![0.0; outputs], vec![0.0; outputs]);
    let mut forces = Vec::with_capacity(samples * start.len());
    let mut carried = vec![0.0; outputs];
    for (x, start) in x
        .chunks_exact((samples * inputs).max(1))
        .zip(start.chunks_exact(outputs))
    {
        carried.copy_from_slice(start);
        engine.start(&x[..inputs], &carried, &mut memory, scratch);
        for (index, x) in x.chunks_exact(inputs).enumerate() {
            if index > 0 {
                engine.observe(x, &mut memory, scratch);
            }
            engine.sample(&memory, &carried, &mut now, &mut next, scratch);
            forces.extend_from_slice(&now);
            carried.copy_from_slice(&next);
        }
    }
    Ok(forces)
}

/// Samples in one matrix product, in models whose products do not depend on the force.
pub(super) const BLOCK: usize = 256;

/// Trajectories that [`Engine::trajectories`] steps at a time.
pub const BATCH_SIZE: usize = 16;

/// T of [`Engine::trajectories`], from the lengths of its arguments.
pub(super) fn samples(
    engine: &(impl Engine + ?Sized),
    x: &[f64],
    start: &[f64],
) -> Result<usize, ModelError> {
    let (inputs, outputs) = (engine.inputs(), engine.outputs());
    let shape = |what, found: &[f64], expected| ModelError::Shape {
        what,
        found: vec![found.len()],
        expected,
    };
    if !start.len().is_multiple_of(outputs) {
        return Err(shape(
            "the initial force",
            start,
            format!("[batch * {outputs}]"),
        ));
    }
    let batch = start.len() / outputs;
    if batch == 0 && x.is_empty() {
        return Ok(0);
    }
    if batch == 0 || !x.len().is_multiple_of(batch * inputs) {
        return Err(shape("x", x, format!("[{batch} * samples * {inputs}]")));
    }
    Ok(x.len() / (batch * inputs))
}

/// Steps after which [`Engine::estimate`] stops.
pub const SETTLING_STEPS: usize = 200;

/// The force has settled when no component changes by more than this in a step [standard deviations].
pub(super) const SETTLED: f32 = 1e-6;

/// Working memory of an engine; grows on first use.
#[derive(Clone, Debug, Default)]
pub struct Scratch(Vec<f32>);

impl Scratch {
    /// The first `len` numbers; their values are arbitrary.
    pub(super) fn take(&mut self, len: usize) -> &mut [f32] {
        if self.0.len() < len {
            self.0.resize(len, 0.0);
        }
        &mut self.0[..len]
    }
}
