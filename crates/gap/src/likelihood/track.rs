//! A trial as a chain of short segments, and the rollout of each under a working point.

use nalgebra::DVector;

use crate::{
    error::GapError,
    plant::Simulation,
    problem::{
        channels::MeasuredTrial,
        problem::Problem,
        segments::{self, EstimatedMotion, Segment},
    },
    rollout::{
        resolution,
        shooting::{self, Trace, WarmUp},
    },
};

/// A segment of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    /// Rows and start; the start follows the readings.
    pub(crate) segment: Segment,
    /// Steps to the start of the next segment, or to the last row.
    pub(crate) steps: usize,
    /// Unmodelled forces, piece by piece, one a degree of freedom [pieces * nv]; none before they were smoothed.
    pub(crate) forces: Vec<f64>,
    /// Factor on each whitened residual, row by row, channel by channel, for what rows cannot resolve; none
    /// before that is known.
    pub(crate) weights: Vec<f64>,
    /// Factor on the scale of each unmodelled force, likewise [pieces * nv]; none before that is known.
    pub(crate) factors: Vec<f64>,
}

/// Blocks of steps between boundaries, and pieces of unmodelled forces made of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// Steps of a block.
    pub(crate) block: usize,
    /// Blocks from one boundary at which most changes are taken to the next; between, they are linear.
    pub(crate) stride: usize,
    /// Pieces of a segment.
    pub(crate) pieces: usize,
}

impl Grid {
    /// Blocks and looks of some seconds each, at a step of the model [s].
    pub(crate) fn new([block, look]: [f64; 2], pieces: usize, step: f64) -> Self {
        Self {
            block: ((block / step).round() as usize).max(1),
            stride: ((look / block).round() as usize).max(1),
            pieces,
        }
    }
}

impl Link {
    /// Factor on a whitened residual.
    pub(crate) fn weight(&self, residual: usize) -> f64 {
        self.weights.get(residual).copied().unwrap_or(1.0)
    }

    /// Factor on the scale of an unmodelled force.
    pub(crate) fn factor(&self, force: usize) -> f64 {
        self.factors.get(force).copied().unwrap_or(1.0)
    }

    /// Gives the unmodelled forces other factors; the forces stay what they are.
    pub(crate) fn set_factors(&mut self, factors: Vec<f64>) {
        for (at, force) in self.forces.iter_mut().enumerate() {
            let before = self.factors.get(at).copied().unwrap_or(1.0);
            *force *= before / factors.get(at).copied().unwrap_or(1.0);
        }
        self.factors = factors;
    }

    /// Number of blocks.
    pub(crate) fn blocks(&self, grid: Grid) -> usize {
        self.steps.div_ceil(grid.block)
    }

    /// True for a step at which a block begins, or the segment ends.
    pub(crate) fn is_boundary(&self, grid: Grid, step: usize) -> bool {
        step.is_multiple_of(grid.block) || step == self.steps
    }

    /// True for a boundary at which most changes are taken.
    pub(crate) fn is_looked_at(&self, grid: Grid, boundary: usize) -> bool {
        boundary.is_multiple_of(grid.stride) || boundary == self.blocks(grid)
    }

    /// The piece that a block belongs to.
    pub(crate) fn piece(&self, grid: Grid, block: usize) -> usize {
        (block * grid.pieces / self.blocks(grid)).min(grid.pieces - 1)
    }

    /// The piece that a step belongs to.
    pub(crate) fn piece_at(&self, grid: Grid, step: usize) -> usize {
        self.piece(grid, step / grid.block)
    }

    /// Unmodelled forces at a step.
    pub(crate) fn force(&self, grid: Grid, step: usize, scale: &DVector<f64>) -> Vec<f64> {
        let nv = scale.len();
        let first = self.piece_at(grid, step) * nv;
        match self.forces.get(first..first + nv) {
            Some(forces) => (forces.iter().zip(scale.iter()).enumerate())
                .map(|(axis, (a, b))| a * b * self.factor(first + axis))
                .collect(),
            None => vec![0.0; nv],
        }
    }
}

/// One trial cut into segments.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    pub(crate) trial: usize,
    pub(crate) links: Vec<Link>,
}

impl Track {
    /// True for the last boundary of a segment whose changes are those at the next one's start: the same time, and almost the
    /// same state. Steady states have nothing to do with each other.
    pub(crate) fn end_is_next_start(
        &self,
        number: usize,
        boundary: usize,
        boundaries: usize,
        steady: bool,
    ) -> bool {
        boundary + 1 == boundaries && number + 1 < self.links.len() && !steady
    }

    /// Cuts a trial into segments of about `length` seconds along its estimated motion, up to `most` seconds. A rest shorter
    /// than a part `rest` of a segment joins the last one.
    pub(crate) fn new(
        index: usize,
        trial: &MeasuredTrial,
        motion: &EstimatedMotion,
        [length, rest, most]: [f64; 3],
        step: f64,
    ) -> Self {
        let rows = match trial.steady {
            true => trial.times.len(),
            false => (trial.times).partition_point(|time| *time <= trial.times[0] + most),
        };
        let segments = segments::cut(trial, motion, rows, [length, rest], 1);
        let links = segments.into_iter().map(|segment| {
            let stop = motion.times[segment.rows.end.min(rows - 1)];
            let steps = ((stop - segment.start) / step).round() as usize;
            Link {
                steps: if trial.steady { 1 } else { steps.max(1) },
                segment,
                forces: Vec::new(),
                weights: Vec::new(),
                factors: Vec::new(),
            }
        });
        Self {
            trial: index,
            links: links.collect(),
        }
    }
}

/// Weighs the readings of a track by what its rows resolve of the motion that its starts and unmodelled forces give the
/// nominal, which it returns. Where that blows up they stay as they are.
pub(crate) fn weigh(
    problem: &Problem<'_>,
    track: &mut Track,
    (grid, scale): (Grid, &DVector<f64>),
) -> Result<Option<Vec<Rolled>>, GapError> {
    let (trial, motion) = (&problem.trials[track.trial], &problem.motions[track.trial]);
    let step = problem.model.timestep;
    let nominal = vec![0.0; problem.model.nuisances.len()];
    let options = &problem.settings.options.rollout;
    let warm_up = WarmUp::required(problem.model, &[], options);
    let mut simulation = problem.plant.simulation(&nominal, &[])?;
    let rolled = roll(
        simulation.as_mut(),
        trial,
        motion,
        track,
        warm_up,
        step,
        grid,
        scale,
        false,
    );
    let (channels, unresolved) = (&problem.channels, options.unresolved);
    for (link, rolled) in track.links.iter_mut().zip(rolled.iter().flatten()) {
        let (trace, segment) = (&rolled.trace, &link.segment);
        link.weights = resolution::weights(trace, trial, segment, channels, step, unresolved);
    }
    Ok(rolled)
}

/// The simulation at a boundary between blocks of steps.
#[derive(Clone, Debug)]
pub(crate) struct Boundary {
    /// Step of the segment.
    pub(crate) step: usize,
    pub(crate) saved: Vec<f64>,
    pub(crate) full: Vec<f64>,
    /// Memory of effects.
    pub(crate) memory: Vec<f64>,
    /// Commands of this step and of the one before.
    pub(crate) control: Vec<f64>,
    pub(crate) earlier: Vec<f64>,
    /// Unmodelled forces.
    pub(crate) force: Vec<f64>,
}

/// A segment as rolled out.
#[derive(Clone, Debug)]
pub(crate) struct Rolled {
    pub(crate) trace: Trace,
    pub(crate) boundaries: Vec<Boundary>,
    /// Full-physics state at every step; empty unless asked for.
    pub(crate) every: Vec<Vec<f64>>,
    pub(crate) end: (Vec<f64>, Vec<f64>),
}

/// Rolls all segments of a track out; `None` where one blows up.
///
/// `scale`: of the unmodelled forces. Memories run on from segment to segment, but for steady states.
#[expect(clippy::too_many_arguments)]
pub(crate) fn roll(
    simulation: &mut dyn Simulation,
    trial: &MeasuredTrial,
    motion: &EstimatedMotion,
    track: &Track,
    warm_up: WarmUp,
    step: f64,
    grid: Grid,
    scale: &DVector<f64>,
    keep_every: bool,
) -> Option<Vec<Rolled>> {
    let first = track.links.first()?;
    shooting::lead_in(simulation, trial, &first.segment, motion, warm_up, step);
    let mut rolled = Vec::with_capacity(track.links.len());
    for (number, link) in track.links.iter().enumerate() {
        if trial.steady && number > 0 {
            shooting::lead_in(simulation, trial, &link.segment, motion, warm_up, step);
        }
        let mut boundaries = Vec::new();
        let mut every = Vec::new();
        let mut end = None;
        let mut trace = Trace::default();
        let mut control = vec![0.0; trial.control.width()];
        let mut earlier = control.clone();
        let mut at_end = Vec::new();
        let whole = shooting::roll_observed(
            simulation,
            trial,
            &link.segment,
            step,
            None,
            link.steps + 1,
            &mut trace,
            &mut |at, simulation| {
                if at > link.steps {
                    return;
                }
                let time = link.segment.start + at as f64 * step;
                let force = link.force(grid, at, scale);
                simulation.set_force(&force);
                if link.is_boundary(grid, at) {
                    trial.control.interpolate(time, &mut control);
                    trial.control.interpolate(time - step, &mut earlier);
                    boundaries.push(Boundary {
                        step: at,
                        saved: simulation.save(),
                        full: simulation.full_state(),
                        memory: simulation.memory(),
                        control: control.clone(),
                        earlier: earlier.clone(),
                        force,
                    });
                }
                if keep_every {
                    every.push(simulation.full_state());
                }
                if at == link.steps {
                    end = Some((simulation.qpos().to_vec(), simulation.qvel().to_vec()));
                    at_end = simulation.save();
                }
            },
        );
        if !whole {
            return None;
        }
        // The rows' last readings may lie a step beyond.
        simulation.load(&at_end);
        rolled.push(Rolled {
            trace,
            boundaries,
            every,
            end: end?,
        });
    }
    Some(rolled)
}
