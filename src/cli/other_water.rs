//! A checkpoint beside data of another water than it was trained in.

use std::path::Path;

use hydro_model::{checkpoint::Card, water::water_in_words};
use serde_json::Value;

/// The warning that what lies at `place` was made in another water than the checkpoint's training data; nothing where the two
/// are the same.
pub(super) fn other_water(
    card: &Card,
    checkpoint: &Path,
    water: Option<&Value>,
    place: &Path,
) -> Option<String> {
    (card.water.as_ref() != water).then(|| {
        format!(
            "WARNING: ANOTHER WATER. {} was trained in: {};\n{} was made in: {}.\nThe errors are those of a force that the \
             checkpoint was never shown.",
            checkpoint.display(),
            water_in_words(card.water.as_ref()),
            place.display(),
            water_in_words(water)
        )
    })
}
