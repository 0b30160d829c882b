//! The medium that a robot moves in.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The medium around a robot, the thinnest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Medium {
    /// A vacuum, or air too thin to be felt.
    #[default]
    None,
    /// Air: drag, lift and wind, but no added mass and no buoyancy worth telling.
    Air,
    /// Water.
    Water,
}

impl fmt::Display for Medium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "none",
            Self::Air => "air",
            Self::Water => "water",
        })
    }
}
