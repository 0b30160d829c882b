//! Places of a segment's columns: the residual, parameters, and latents.

/// Sizes of a sweep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Degrees of freedom.
    pub(crate) nv: usize,
    /// Channels.
    pub(crate) channels: usize,
    /// Parameters: nuisance parameters, errors of form, the point's own, directions.
    pub(crate) parameters: usize,
    /// Pieces of a segment over which unmodelled forces are constant.
    pub(crate) pieces: usize,
    /// Noisy commands.
    pub(crate) commands: usize,
    /// Channels that drift.
    pub(crate) drifting: usize,
}

impl Layout {
    /// First column of the start's tangent.
    pub(crate) fn start(&self) -> usize {
        1 + self.parameters
    }

    /// First column of the unmodelled forces: piece by piece, one a degree of freedom.
    pub(crate) fn forces(&self) -> usize {
        self.start() + 2 * self.nv
    }

    /// First column of the noise of commands: piece by piece, one a noisy command.
    pub(crate) fn commands(&self) -> usize {
        self.forces() + self.pieces * self.nv
    }

    /// First column of the drifts: at the segment's start, then at the next one's.
    pub(crate) fn drifts(&self) -> usize {
        self.commands() + self.pieces * self.commands
    }

    /// Columns: residual, parameters, start, forces, noise of commands, drifts.
    pub(crate) fn columns(&self) -> usize {
        self.drifts() + 2 * self.drifting
    }
}
