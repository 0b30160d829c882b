//! A checkpoint, or what one is trained on, beside data of another water.

use std::path::Path;

use hydro_model::water::water_in_words;
use serde_json::Value;

/// A folder, and the water that it is of.
pub(super) type Of<'a> = (&'a Path, Option<&'a Value>);

/// The warning that `data` is of another water than what is `trained`; nothing where the two are the same.
pub(super) fn other_water(trained: Of<'_>, data: Of<'_>) -> Option<String> {
    (trained.1 != data.1).then(|| {
        let place = |of: Of<'_>| format!("{}: {}", of.0.display(), water_in_words(of.1));
        format!(
            "WARNING: ANOTHER WATER. Trained in that of {};\ntold the errors in that of {}.\nThey are errors of a force that \
             the model was never shown.",
            place(trained),
            place(data)
        )
    })
}
