//! Unmodelled forces and drifts of sensors, as the filter takes them to be distributed.

/// Prior of the disturbances of a track: unmodelled forces and the noise of commands, piece by piece, and slow drifts of
/// sensors, linear between the starts of the segments.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disturbances {
    /// Standard deviation of the forces, in their scales.
    pub(crate) force: f64,
    /// Correlation of the forces from piece to piece.
    pub(crate) force_correlation: f64,
    /// Number of noisy commands, each of unit standard deviation.
    pub(crate) commands: usize,
    /// Number of channels that drift.
    pub(crate) drifting: usize,
    /// Standard deviation of the drifts, in their scales.
    pub(crate) drift: f64,
    /// Correlation of the drifts from segment to segment.
    pub(crate) drift_correlation: f64,
}

impl Disturbances {
    /// Number of pieces of a segment of so many latents, of which the start has `tangents`.
    pub(crate) fn pieces(self, tangents: usize, latents: usize) -> usize {
        let of_a_piece = tangents / 2 + self.commands;
        (latents - tangents - 2 * self.drifting) / of_a_piece.max(1)
    }
}
