//! From the state before a segment to the segment's latents, sparse as it is.

use nalgebra::DMatrix;

use crate::likelihood::disturbances::Disturbances;

/// How a segment's latents follow from the state before it: its start, the forces of its pieces, an autoregression from the
/// piece before, the noise of its commands, and the drifts at its start and at the next one's.
pub(super) struct Carry {
    prior: Disturbances,
    tangents: usize,
    pieces: usize,
    /// Number of latents.
    pub(super) latents: usize,
}

impl Carry {
    pub(super) fn new(tangents: usize, latents: usize, prior: Disturbances) -> Self {
        Self {
            prior,
            tangents,
            pieces: prior.pieces(tangents, latents),
            latents,
        }
    }

    /// First row of the noise of commands.
    fn commands(&self) -> usize {
        self.tangents + self.pieces * (self.tangents / 2)
    }

    /// First row of the drifts.
    fn drifts(&self) -> usize {
        self.commands() + self.pieces * self.prior.commands
    }

    /// Rows of the latents that follow from a row of the state before, with a factor each.
    fn all(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let (tangents, nv) = (self.tangents, self.tangents / 2);
        let starts = (0..tangents).map(|axis| (axis, axis, 1.0));
        let correlation = self.prior.force_correlation;
        let forces = (0..self.pieces * nv).map(move |at| {
            let (piece, axis) = (at / nv, at % nv);
            let left = correlation.powi(piece as i32 + 1);
            (tangents + at, tangents + axis, left)
        });
        let drifting = match self.prior.drift > 0.0 {
            true => self.prior.drifting,
            false => 0,
        };
        let first = self.drifts();
        let left = self.prior.drift_correlation;
        let drifts = (0..drifting).flat_map(move |channel| {
            let (state, row) = (tangents + nv + channel, first + channel);
            [(row, state, 1.0), (row + drifting, state, left)]
        });
        starts.chain(forces).chain(drifts)
    }

    /// Latents from a state before [state, any] to [latents, any].
    pub(super) fn on(&self, state: &DMatrix<f64>) -> DMatrix<f64> {
        let mut latents = DMatrix::zeros(self.latents, state.ncols());
        let all: Vec<(usize, usize, f64)> = self.all().collect();
        for (mut into, from) in latents.column_iter_mut().zip(state.column_iter()) {
            for (row, state, factor) in &all {
                into[*row] = factor * from[*state];
            }
        }
        latents
    }

    /// The transpose of [`Self::on`]: [latents, any] to [state, any].
    pub(super) fn back(&self, latents: &DMatrix<f64>) -> DMatrix<f64> {
        let nv = self.tangents / 2;
        let size = self.tangents + nv + self.prior.drifting;
        let mut state = DMatrix::zeros(size, latents.ncols());
        let all: Vec<(usize, usize, f64)> = self.all().collect();
        for (mut into, from) in state.column_iter_mut().zip(latents.column_iter()) {
            for (row, state, factor) in &all {
                into[*state] += factor * from[*row];
            }
        }
        state
    }

    /// Square root of the covariance of what is new in the latents.
    pub(super) fn fresh(&self) -> DMatrix<f64> {
        let (nv, pieces, drifting) = (self.tangents / 2, self.pieces, self.prior.drifting);
        let moves = self.prior.drift > 0.0;
        let noisy = pieces * self.prior.commands;
        let sources = pieces * nv + noisy + if moves { drifting } else { 0 };
        let mut fresh = DMatrix::zeros(self.latents, sources);
        let innovation = |sd: f64, correlation: f64| sd * (1.0 - correlation * correlation).sqrt();
        let correlation = self.prior.force_correlation;
        let size = innovation(self.prior.force, correlation);
        for piece in 0..pieces {
            for axis in 0..nv {
                let row = self.tangents + piece * nv + axis;
                for before in 0..=piece {
                    fresh[(row, before * nv + axis)] =
                        size * correlation.powi((piece - before) as i32);
                }
            }
        }
        for at in 0..noisy {
            fresh[(self.commands() + at, pieces * nv + at)] = 1.0;
        }
        if moves {
            let size = innovation(self.prior.drift, self.prior.drift_correlation);
            let first = self.drifts() + drifting;
            for channel in 0..drifting {
                fresh[(first + channel, pieces * nv + noisy + channel)] = size;
            }
        }
        fresh
    }
}
