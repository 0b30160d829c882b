//! The interface of every engine, and what the engines share.

use std::fmt;

use crate::error::ModelError;

/// A model ready to be stepped. Forces are SI [N, N m], features raw SI in the order of the card.
///
/// What the model must know of the past is a slice of numbers that the caller keeps (the plugin: in MuJoCo's own
/// state), so an engine is immutable and shared by any number of simulations. No locks, no threads. In
/// [`Engine::start`], [`Engine::observe`] and [`Engine::sample`] the fused engine does not allocate once `scratch` has
/// grown.
pub trait Engine: Send + Sync + fmt::Debug {
    /// n, features a sample.
    fn inputs(&self) -> usize;

    /// f, force components.
    fn outputs(&self) -> usize;

    /// How many numbers of memory a simulation keeps.
    fn memory_len(&self) -> usize;

    /// The memory at a first sample `x` [n], where the force is `force` [f]: of a past in which every sample was that
    /// one, or of none.
    fn start(&self, x: &[f64], force: &[f64], memory: &mut [f64], scratch: &mut Scratch);

    /// Takes the next sample `x` [n] into the memory.
    fn observe(&self, x: &[f64], memory: &mut [f64], scratch: &mut Scratch);

    /// At the newest sample, where `force` [f] was carried to: writes `now` [f], the force at this sample, and `next`
    /// [f], what is carried to the next one. A model that predicts the next force has `force` itself now; the others
    /// give the force at this sample, and hold it.
    fn sample(
        &self,
        memory: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    );

    /// What the model predicts for a past in which every sample was `x` [n]: the force that the ODE settles to with h
    /// held, from the training mean in at most [`SETTLING_STEPS`]; what it gives for a first sample; or, of a CNODE,
    /// which settles nowhere, what it learned of first samples beside the rest. By itself, what it gives for a first sample.
    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch) {
        let mut memory = vec![0.0; self.memory_len()];
        self.start(x, &[], &mut memory, scratch);
        let mut next = vec![0.0; force.len()];
        self.sample(&memory, &[], force, &mut next, scratch);
    }

    /// Whole trajectories of one length: `x` [B, T, n] and the forces carried to the first samples, `start` [B, f],
    /// -> the forces at the samples [B, T, f]. The past of the first sample is that sample. Some engines step them
    /// together, which gives the same numbers and is faster.
    ///
    /// # Errors
    /// Numbers that are not whole trajectories.
    fn trajectories(
        &self,
        x: &[f64],
        start: &[f64],
        scratch: &mut Scratch,
    ) -> Result<Vec<f64>, ModelError> {
        one_by_one(self, x, start, scratch)
    }
}

/// [`Engine::trajectories`], a sample at a time as a simulation asks for them.
///
/// # Errors
/// Numbers that are not whole trajectories.
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

/// Samples of a trajectory that are one product, where no force feeds back into what is multiplied.
pub(super) const BLOCK: usize = 256;

/// Trajectories that are best given to [`Engine::trajectories`] at a time.
pub const BATCH_SIZE: usize = 16;

/// T of [`Engine::trajectories`].
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

/// Steps after which [`Engine::estimate`] takes the force as settled.
pub const SETTLING_STEPS: usize = 200;

/// Change of every component [standard deviations] below which the force has settled.
pub(super) const SETTLED: f32 = 1e-6;

/// Working memory of an engine; grows on first use.
#[derive(Clone, Debug, Default)]
pub struct Scratch(Vec<f32>);

impl Scratch {
    /// The first `len` numbers, whatever they hold.
    pub(super) fn take(&mut self, len: usize) -> &mut [f32] {
        if self.0.len() < len {
            self.0.resize(len, 0.0);
        }
        &mut self.0[..len]
    }
}
