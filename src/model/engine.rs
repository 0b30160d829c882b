//! One sample at a time: what the simulation asks of a model.

use std::{fmt, str::FromStr};

use thiserror::Error;

/// A model ready to be stepped. Forces are SI [N, N m], features raw SI in the order of the card.
pub trait Engine: Send + Sync + fmt::Debug {
    /// n, features a sample.
    fn inputs(&self) -> usize;

    /// f, force components.
    fn outputs(&self) -> usize;

    /// W >= 1, samples that the model sees.
    fn window(&self) -> usize;

    /// At a sample: `window` holds W * n features, oldest first, and `force` [f] the force carried to this
    /// sample. Writes `now` [f], the force at this sample (`force` itself for an ODE, g(x) for a memoryless
    /// model), and `next` [f], the force at the next one. No locks, no threads; the fused engine does not
    /// allocate once `scratch` has grown.
    fn sample(
        &self,
        window: &[f64],
        force: &[f64],
        now: &mut [f64],
        next: &mut [f64],
        scratch: &mut Scratch,
    );

    /// What the model predicts for a window filled with `x` [n]: the force that the ODE settles to with h
    /// held, from the training mean in at most [`SETTLING_STEPS`], or g(x).
    fn estimate(&self, x: &[f64], force: &mut [f64], scratch: &mut Scratch);
}

/// Steps after which [`Engine::estimate`] takes the force as settled.
pub const SETTLING_STEPS: usize = 200;

/// Change of every component [standard deviations] below which the force has settled.
pub(crate) const SETTLED: f32 = 1e-6;

/// Working memory of an engine; grows on first use.
#[derive(Clone, Debug, Default)]
pub struct Scratch(Vec<f32>);

impl Scratch {
    /// The first `len` numbers, whatever they hold.
    pub(crate) fn take(&mut self, len: usize) -> &mut [f32] {
        if self.0.len() < len {
            self.0.resize(len, 0.0);
        }
        &mut self.0[..len]
    }
}

/// Which implementation evaluates a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum EngineKind {
    /// Our own products, nothing else: the fast one.
    #[default]
    Fused,
    /// Candle at batch 1: the reference.
    Candle,
}

impl EngineKind {
    /// Every kind, for error messages and help texts.
    pub const ALL: [Self; 2] = [Self::Fused, Self::Candle];
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fused => "fused",
            Self::Candle => "candle",
        })
    }
}

/// An engine name that is none.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown engine `{0}`: there are fused and candle")]
pub struct UnknownEngine(pub String);

impl FromStr for EngineKind {
    type Err = UnknownEngine;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.to_string() == name)
            .ok_or_else(|| UnknownEngine(name.to_owned()))
    }
}
