//! The sample period of data beside that of what is evaluated on them.

use std::path::Path;

use anyhow::bail;

/// Periods that differ by less, as a part of them, are one.
const SAME: f64 = 1e-6;

/// A folder, and its sample period [s].
pub(super) type Of<'a> = (&'a Path, f64);

/// Refuses data of another sample period than what is `trained`.
pub(super) fn check_sample_period(trained: Of<'_>, data: Of<'_>) -> anyhow::Result<()> {
    if (trained.1 - data.1).abs() <= SAME * trained.1 {
        return Ok(());
    }
    bail!(
        "{}: sample_period is {} s, but that of {} is {} s: their samples do not stand for each other",
        data.0.display(),
        data.1,
        trained.0.display(),
        trained.1
    )
}
