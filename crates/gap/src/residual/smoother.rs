//! The base wrench along one trial: starts and wrenches of all windows together, by damped Gauss-Newton.
//!
//! A window has to end where the next one starts, so a wrench is seen by everything that comes after it,
//! not by its own few readings alone; between windows the wrench is a random walk.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    problem::{
        channels::Measured,
        segments::{Segment, Track},
    },
    progress::Watch,
    residual::{
        chain::{Chain, Solved},
        windows::{Ground, Ran, Slopes},
    },
    rollout::state_estimation,
};

/// Shortest part of a step that is tried.
const SHORTEST: f64 = 0.1;

/// How far a wrench may be from zero at the start of a trial, and from one window to the next, as standard
/// deviations [N, N m].
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    pub(super) first: [f64; 6],
    pub(super) change: [f64; 6],
}

/// One trial on its way to a fit.
pub(super) struct Path<'a> {
    pub(super) trial: &'a Measured,
    track: &'a Track,
    pub(super) windows: Vec<Segment>,
    /// Wrench of every window [N, N m], in the base's frame about its origin.
    pub(super) wrenches: Vec<[f64; 6]>,
    ran: Vec<Ran>,
    slopes: Vec<Slopes>,
    /// From the track to the start of the first window.
    from_track: DVector<f64>,
}

impl<'a> Path<'a> {
    /// Differentiates every window about its track. Ends before the first window in which the model blows
    /// up; none where that is the first.
    pub(super) fn new(
        ground: &Ground<'_>,
        trial: &'a Measured,
        track: &'a Track,
        most: usize,
        watch: &Watch<'_>,
    ) -> Result<Option<Self>, GapError> {
        let mut windows = ground.cut(trial, track, most)?;
        let looked: Vec<_> = windows
            .par_iter()
            .map(|window| {
                watch.check()?;
                ground.differentiate(trial, track, window, [0.0; 6])
            })
            .collect::<Result<_, GapError>>()?;
        let (ran, slopes): (Vec<Ran>, Vec<Slopes>) =
            looked.into_iter().map_while(|found| found).unzip();
        windows.truncate(ran.len());
        Ok((!windows.is_empty()).then(|| Self {
            trial,
            track,
            wrenches: vec![[0.0; 6]; windows.len()],
            from_track: DVector::zeros(2 * ground.model.nv),
            windows,
            ran,
            slopes,
        }))
    }

    /// Steps from the ends of windows to the starts of the next ones.
    fn gaps(&self, ground: &Ground<'_>) -> Vec<DVector<f64>> {
        self.windows
            .iter()
            .skip(1)
            .zip(&self.ran)
            .map(|(next, ran)| ground.tangent((&next.qpos, &next.qvel), (&ran.qpos, &ran.qvel)))
            .collect()
    }

    /// What is to be made small.
    pub(super) fn cost(&self, ground: &Ground<'_>, walk: Walk) -> f64 {
        let weights = weights(ground);
        let readings: f64 = self.ran.iter().map(|ran| ran.residual.norm_squared()).sum();
        let gaps: f64 = self
            .gaps(ground)
            .iter()
            .map(|gap| gap.component_mul(&weights).norm_squared())
            .sum();
        let arrival =
            state_estimation::arrival_precision(ground.model.nv, ground.options.states.arrival_sd);
        let first = self
            .from_track
            .component_mul(&self.from_track)
            .dot(&arrival);
        readings + gaps + first + self.roughness(walk)
    }

    fn roughness(&self, walk: Walk) -> f64 {
        let first = self.wrenches.first().into_iter().flatten().zip(walk.first);
        let changes = self.wrenches.windows(2).flat_map(|pair| {
            (0..6).map(|axis| (pair[1][axis] - pair[0][axis]) / walk.change[axis])
        });
        first
            .map(|(value, sd)| value / sd)
            .chain(changes)
            .map(|deviation| deviation * deviation)
            .sum()
    }

    /// The linearised problem, without what the walk says.
    pub(super) fn linearised(&self, ground: &Ground<'_>) -> Chain {
        let tangents = 2 * ground.model.nv;
        let mut chain = Chain::new(self.windows.len(), tangents + 6);
        for (link, (ran, slopes)) in self.ran.iter().zip(&self.slopes).enumerate() {
            chain.add(link, &slopes.readings, &ran.residual);
        }
        let arrival =
            state_estimation::arrival_precision(ground.model.nv, ground.options.states.arrival_sd)
                .map(f64::sqrt);
        let mut to_track = DMatrix::zeros(tangents, tangents + 6);
        to_track.fill_diagonal(1.0);
        let weigh = |mut matrix: DMatrix<f64>, weights: &DVector<f64>| {
            for (mut row, weight) in matrix.row_iter_mut().zip(weights.iter()) {
                row *= *weight;
            }
            matrix
        };
        let weights = weights(ground);
        let next = weigh(to_track.clone(), &weights);
        chain.add(
            0,
            &weigh(to_track, &arrival),
            &-self.from_track.component_mul(&arrival),
        );
        for (link, gap) in self.gaps(ground).iter().enumerate() {
            let this = -weigh(self.slopes[link].end.clone(), &weights);
            chain.tie(link, &this, &next, &gap.component_mul(&weights));
        }
        chain
    }

    /// With what the walk says.
    fn walking(&self, ground: &Ground<'_>, mut chain: Chain, walk: Walk) -> Chain {
        let tangents = 2 * ground.model.nv;
        let only = |sd: [f64; 6]| {
            let mut columns = DMatrix::zeros(6, tangents + 6);
            for (axis, sd) in sd.into_iter().enumerate() {
                columns[(axis, tangents + axis)] = 1.0 / sd;
            }
            columns
        };
        let columns = only(walk.first);
        let first = DVector::from_fn(6, |axis, _| -self.wrenches[0][axis] / walk.first[axis]);
        chain.add(0, &columns, &first);
        let next = only(walk.change);
        let this = -&next;
        for (link, pair) in self.wrenches.windows(2).enumerate() {
            let change = DVector::from_fn(6, |axis, _| {
                (pair[0][axis] - pair[1][axis]) / walk.change[axis]
            });
            chain.tie(link, &this, &next, &change);
        }
        chain
    }

    /// The linearised fit.
    pub(super) fn solve(&self, ground: &Ground<'_>, chain: Chain, walk: Walk) -> Option<Solved> {
        self.walking(ground, chain, walk).solve()
    }

    /// Log evidence of a walk, to first order and up to what does not depend on it.
    pub(super) fn evidence(&self, ground: &Ground<'_>, chain: &Chain, walk: Walk) -> f64 {
        let whole = self.walking(ground, chain.clone(), walk);
        let Some(solved) = whole.solve() else {
            return f64::NEG_INFINITY;
        };
        let gained: f64 = whole
            .right
            .iter()
            .zip(&solved.unknowns)
            .map(|(right, unknowns)| right.dot(unknowns))
            .sum();
        let spread: f64 = walk.change.iter().map(|sd| sd.ln()).sum();
        let changes = self.windows.len().saturating_sub(1) as f64;
        0.5 * (gained - self.roughness(walk) - solved.log_determinant) - changes * spread
    }

    /// One damped step towards the solution; the cost it reaches, none where no part of the step is any
    /// better than `cost`.
    pub(super) fn step(
        &mut self,
        ground: &Ground<'_>,
        solved: &Solved,
        walk: Walk,
        cost: f64,
        watch: &Watch<'_>,
    ) -> Result<Option<f64>, GapError> {
        let tangents = 2 * ground.model.nv;
        let mut part = 1.0;
        while part > SHORTEST {
            watch.check()?;
            let looked: Vec<_> = (0..self.windows.len())
                .into_par_iter()
                .map(|at| {
                    let change = part * &solved.unknowns[at];
                    let mut simulation = ground.plant.simulation(ground.nuisances, &[])?;
                    let tangent = &change.as_slice()[..tangents];
                    let window = ground.moved(simulation.as_mut(), &self.windows[at], tangent);
                    let wrench: [f64; 6] = std::array::from_fn(|axis| {
                        self.wrenches[at][axis] + change[tangents + axis]
                    });
                    let ran = ground.run(self.trial, self.track, &window, wrench)?;
                    Ok(ran.map(|ran| (window, wrench, ran)))
                })
                .collect::<Result<_, GapError>>()?;
            let whole: Option<Vec<(Segment, [f64; 6], Ran)>> = looked.into_iter().collect();
            if let Some(whole) = whole {
                let mut moved = Self {
                    trial: self.trial,
                    track: self.track,
                    windows: Vec::with_capacity(whole.len()),
                    wrenches: Vec::with_capacity(whole.len()),
                    ran: Vec::with_capacity(whole.len()),
                    slopes: Vec::new(),
                    from_track: &self.from_track + part * solved.unknowns[0].rows(0, tangents),
                };
                for (window, wrench, ran) in whole {
                    moved.windows.push(window);
                    moved.wrenches.push(wrench);
                    moved.ran.push(ran);
                }
                let reached = moved.cost(ground, walk);
                if reached < cost {
                    moved.slopes = std::mem::take(&mut self.slopes);
                    *self = moved;
                    return Ok(Some(reached));
                }
            }
            part *= 0.5;
        }
        Ok(None)
    }

    /// Mean squared whitened residual, one at least: what the stated errors are short of.
    pub(super) fn excess(&self) -> f64 {
        let all = self.ran.iter().flat_map(|ran| ran.residual.iter());
        let (sum, count) = all
            .filter(|value| **value != 0.0)
            .fold((0.0, 0_usize), |(sum, count), value| {
                (sum + value * value, count + 1)
            });
        (sum / count.max(1) as f64).max(1.0)
    }

    /// Track that memories are led along.
    pub(super) fn track(&self) -> &'a Track {
        self.track
    }
}

/// One over the standard deviation of a gap between windows, by tangent.
fn weights(ground: &Ground<'_>) -> DVector<f64> {
    let nv = ground.model.nv;
    let options = &ground.options.residual;
    let base = ground.base.dof..ground.base.dof + 6;
    DVector::from_fn(2 * nv, |axis, _| {
        let sd = if base.contains(&(axis % nv)) {
            options.base_gap_sd
        } else {
            options.joint_gap_sd
        };
        1.0 / sd[axis / nv]
    })
}
