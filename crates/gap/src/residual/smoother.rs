//! The base wrench along one trial: starts and wrenches of all windows together, by damped Gauss-Newton.
//!
//! A window has to end where the next one starts, so a wrench is seen by everything that comes after it,
//! not by its own few readings alone; between windows the wrench is a random walk.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    problem::{
        channels::MeasuredTrial,
        segments::{EstimatedMotion, Segment},
    },
    progress::Watch,
    residual::{
        chain::{Chain, Solved},
        windows::{WindowProblem, WindowRollout, WindowSensitivities},
    },
    rollout::state_estimation,
};

/// Shortest part of a step that is tried.
const SHORTEST: f64 = 0.1;

/// Prior standard deviations of the wrench [N, N m]: at the start of a trial, and of its change from window to window.
#[derive(Clone, Copy, Debug)]
pub(super) struct RandomWalk {
    pub(super) first: [f64; 6],
    pub(super) change: [f64; 6],
}

/// One trial on its way to a fit.
pub(super) struct TrialSmoother<'a> {
    pub(super) trial: &'a MeasuredTrial,
    motion: &'a EstimatedMotion,
    pub(super) windows: Vec<Segment>,
    /// Wrench of every window [N, N m], in the base's frame about its origin.
    pub(super) wrenches: Vec<[f64; 6]>,
    ran: Vec<WindowRollout>,
    slopes: Vec<WindowSensitivities>,
    /// From the motion to the start of the first window.
    from_motion: DVector<f64>,
}

impl<'a> TrialSmoother<'a> {
    /// Differentiates every window about its motion. Ends before the first window in which the model blows
    /// up; none where that is the first.
    pub(super) fn new(
        setup: &WindowProblem<'_>,
        trial: &'a MeasuredTrial,
        motion: &'a EstimatedMotion,
        most: usize,
        watch: &Watch<'_>,
    ) -> Result<Option<Self>, GapError> {
        let mut windows = setup.cut(trial, motion, most)?;
        let looked: Vec<_> = windows
            .par_iter()
            .map(|window| {
                watch.check()?;
                setup.differentiate(trial, motion, window, [0.0; 6])
            })
            .collect::<Result<_, GapError>>()?;
        let (ran, slopes): (Vec<WindowRollout>, Vec<WindowSensitivities>) =
            looked.into_iter().map_while(|found| found).unzip();
        windows.truncate(ran.len());
        Ok((!windows.is_empty()).then(|| Self {
            trial,
            motion,
            wrenches: vec![[0.0; 6]; windows.len()],
            from_motion: DVector::zeros(2 * setup.model.nv),
            windows,
            ran,
            slopes,
        }))
    }

    /// Steps from the ends of windows to the starts of the next ones.
    fn gaps(&self, setup: &WindowProblem<'_>) -> Vec<DVector<f64>> {
        self.windows
            .iter()
            .skip(1)
            .zip(&self.ran)
            .map(|(next, ran)| setup.tangent((&next.qpos, &next.qvel), (&ran.qpos, &ran.qvel)))
            .collect()
    }

    /// The cost: whitened residuals, gaps between windows, and the priors of start and wrench.
    pub(super) fn cost(&self, setup: &WindowProblem<'_>, walk: RandomWalk) -> f64 {
        let weights = weights(setup);
        let readings: f64 = self.ran.iter().map(|ran| ran.residual.norm_squared()).sum();
        let gaps: f64 = self
            .gaps(setup)
            .iter()
            .map(|gap| gap.component_mul(&weights).norm_squared())
            .sum();
        let arrival =
            state_estimation::arrival_precision(setup.model.nv, setup.options.states.arrival_sd);
        let first = self
            .from_motion
            .component_mul(&self.from_motion)
            .dot(&arrival);
        readings + gaps + first + self.roughness(walk)
    }

    fn roughness(&self, walk: RandomWalk) -> f64 {
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
    pub(super) fn linearized(&self, setup: &WindowProblem<'_>) -> Chain {
        let tangents = 2 * setup.model.nv;
        let mut chain = Chain::new(self.windows.len(), tangents + 6);
        for (link, (ran, slopes)) in self.ran.iter().zip(&self.slopes).enumerate() {
            chain.add(link, &slopes.readings, &ran.residual);
        }
        let arrival =
            state_estimation::arrival_precision(setup.model.nv, setup.options.states.arrival_sd)
                .map(f64::sqrt);
        let mut to_motion = DMatrix::zeros(tangents, tangents + 6);
        to_motion.fill_diagonal(1.0);
        let weigh = |mut matrix: DMatrix<f64>, weights: &DVector<f64>| {
            for (mut row, weight) in matrix.row_iter_mut().zip(weights.iter()) {
                row *= *weight;
            }
            matrix
        };
        let weights = weights(setup);
        let next = weigh(to_motion.clone(), &weights);
        chain.add(
            0,
            &weigh(to_motion, &arrival),
            &-self.from_motion.component_mul(&arrival),
        );
        for (link, gap) in self.gaps(setup).iter().enumerate() {
            let this = -weigh(self.slopes[link].end.clone(), &weights);
            chain.tie(link, &this, &next, &gap.component_mul(&weights));
        }
        chain
    }

    /// With what the walk says.
    fn walking(&self, setup: &WindowProblem<'_>, mut chain: Chain, walk: RandomWalk) -> Chain {
        let tangents = 2 * setup.model.nv;
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
    pub(super) fn solve(
        &self,
        setup: &WindowProblem<'_>,
        chain: Chain,
        walk: RandomWalk,
    ) -> Option<Solved> {
        self.walking(setup, chain, walk).solve()
    }

    /// Log evidence of a walk, to first order and up to what does not depend on it.
    pub(super) fn evidence(
        &self,
        setup: &WindowProblem<'_>,
        chain: &Chain,
        walk: RandomWalk,
    ) -> f64 {
        let whole = self.walking(setup, chain.clone(), walk);
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
        setup: &WindowProblem<'_>,
        solved: &Solved,
        walk: RandomWalk,
        cost: f64,
        watch: &Watch<'_>,
    ) -> Result<Option<f64>, GapError> {
        let tangents = 2 * setup.model.nv;
        let mut part = 1.0;
        while part > SHORTEST {
            watch.check()?;
            let looked: Vec<_> = (0..self.windows.len())
                .into_par_iter()
                .map(|at| {
                    let change = part * &solved.unknowns[at];
                    let mut simulation = setup.plant.simulation(setup.nuisances, &[])?;
                    let tangent = &change.as_slice()[..tangents];
                    let window = setup.moved(simulation.as_mut(), &self.windows[at], tangent);
                    let wrench: [f64; 6] = std::array::from_fn(|axis| {
                        self.wrenches[at][axis] + change[tangents + axis]
                    });
                    let ran = setup.run(self.trial, self.motion, &window, wrench)?;
                    Ok(ran.map(|ran| (window, wrench, ran)))
                })
                .collect::<Result<_, GapError>>()?;
            let whole: Option<Vec<(Segment, [f64; 6], WindowRollout)>> =
                looked.into_iter().collect();
            if let Some(whole) = whole {
                let mut moved = Self {
                    trial: self.trial,
                    motion: self.motion,
                    windows: Vec::with_capacity(whole.len()),
                    wrenches: Vec::with_capacity(whole.len()),
                    ran: Vec::with_capacity(whole.len()),
                    slopes: Vec::new(),
                    from_motion: &self.from_motion + part * solved.unknowns[0].rows(0, tangents),
                };
                for (window, wrench, ran) in whole {
                    moved.windows.push(window);
                    moved.wrenches.push(wrench);
                    moved.ran.push(ran);
                }
                let reached = moved.cost(setup, walk);
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

    /// Estimated motion along which the memories of effects are run.
    pub(super) fn motion(&self) -> &'a EstimatedMotion {
        self.motion
    }
}

/// One over the standard deviation of a gap between windows, by tangent.
fn weights(setup: &WindowProblem<'_>) -> DVector<f64> {
    let nv = setup.model.nv;
    let options = &setup.options.residual;
    let base = setup.base.dof..setup.base.dof + 6;
    DVector::from_fn(2 * nv, |axis, _| {
        let sd = if base.contains(&(axis % nv)) {
            options.base_gap_sd
        } else {
            options.joint_gap_sd
        };
        1.0 / sd[axis / nv]
    })
}
