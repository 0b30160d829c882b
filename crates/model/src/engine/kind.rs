//! Names of the engines.

use std::{fmt, str::FromStr};

use thiserror::Error;

/// Implementation that evaluates a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum EngineKind {
    /// The products of this crate: the fast one.
    #[default]
    Fused,
    /// [`EngineKind::Fused`] with the field's weights rounded to IEEE half precision: half the memory traffic.
    FusedF16,
    /// [`EngineKind::Fused`] with the field's weights and activations in whole numbers of 16 bits: half the traffic, nothing
    /// to widen.
    FusedI16,
    /// Candle at batch 1: the reference.
    Candle,
}

impl EngineKind {
    /// Every kind, for error messages and help texts.
    pub const ALL: [Self; 4] = [Self::Fused, Self::FusedF16, Self::FusedI16, Self::Candle];
}

impl fmt::Display for EngineKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Fused => "fused",
            Self::FusedF16 => "fused-f16",
            Self::FusedI16 => "fused-i16",
            Self::Candle => "candle",
        })
    }
}

/// A name that is not that of an engine.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown engine `{0}`: there are fused, fused-f16, fused-i16 and candle")]
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
