//! Which implementation evaluates a model, by its name.

use std::{fmt, str::FromStr};

use thiserror::Error;

/// Which implementation evaluates a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum EngineKind {
    /// Our own products, nothing else: the fast one.
    #[default]
    Fused,
    /// The same with the field's weights rounded to IEEE halves: half the memory to read a step.
    FusedF16,
    /// Candle at batch 1: the reference.
    Candle,
}

impl EngineKind {
    /// Every kind, for error messages and help texts.
    pub const ALL: [Self; 3] = [Self::Fused, Self::FusedF16, Self::Candle];
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fused => "fused",
            Self::FusedF16 => "fused-f16",
            Self::Candle => "candle",
        })
    }
}

/// An engine name that is none.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown engine `{0}`: there are fused, fused-f16 and candle")]
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
