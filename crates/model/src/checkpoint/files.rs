//! Names inside a checkpoint's folder, and the schema of its card.

/// The schema that this version writes and reads.
pub const SCHEMA: &str = "hydro-checkpoint/1";

/// The weights.
pub(super) const WEIGHTS: &str = "weights.safetensors";

/// The card.
pub(super) const CARD: &str = "card.json";
