//! Memories of effects along a track, where they are not the base's.

use std::collections::BTreeMap;

use hydro_effects::Entry;
use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::{
        changes::{Change, Kind},
        track::{Grid, Rolled, Track},
    },
    plant::Simulation,
    problem::problem::Problem,
    rollout::shooting::{self, WarmUp},
};

/// What a simulation remembers.
pub(crate) struct Memory {
    pub(crate) of_effects: Vec<f64>,
    /// Those of a change that has its own; none of another.
    pub(crate) activations: Option<Vec<f64>>,
}

/// Memory at every boundary, segment by segment.
pub(crate) type Memories = Vec<Vec<Memory>>;

/// Memories of the changes that have one of their own, by their number. `base`: numbers of the nominal and entries of the base.
pub(super) fn of_changes(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    grid: Grid,
    changes: &[Change],
    base: (&[f64], &[Entry]),
) -> Result<BTreeMap<usize, Memories>, GapError> {
    let has_own =
        |of: &Change| of.kind.has_own_memory() && of.remembers_as.is_none() && !of.every_step;
    let own: Vec<usize> = (0..changes.len())
        .filter(|at| has_own(&changes[*at]))
        .collect();
    let memories = own.into_par_iter().map(|at| {
        let mut simulation = changes[at].simulation(problem, track.trial, base)?;
        let memories = along(
            problem,
            (track, rolled),
            simulation.as_mut(),
            &changes[at],
            grid,
        );
        Ok((at, memories))
    });
    memories.collect()
}

/// Memory of a simulation; the part of joints that the nominal does not have is the base's own.
fn beside_base(simulation: &dyn Simulation, base: &[f64]) -> Vec<f64> {
    let mut memory = simulation.memory();
    let hidden = simulation.hidden().min(base.len()).min(memory.len());
    let first = memory.len() - hidden;
    memory[first..].copy_from_slice(&base[base.len() - hidden..]);
    memory
}

/// Memory of a change's simulation along the base's motion.
fn along(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    simulation: &mut dyn Simulation,
    change: &Change,
    grid: Grid,
) -> Memories {
    let trial = &problem.trials[track.trial];
    let motion = &problem.motions[track.trial];
    let step = problem.model.timestep;
    let options = &problem.settings.options.rollout;
    let warm_up = WarmUp::required(problem.model, &change.entries, options);
    let mut control = vec![0.0; trial.control.width()];
    let mut earlier = control.clone();
    let is_begun = change.kind == Kind::Begun;
    let rejoin = |simulation: &mut dyn Simulation, state: &[f64]| {
        let own = is_begun.then(|| simulation.activations());
        simulation.rejoin(state);
        if let Some(own) = own {
            simulation.set_activations(&own);
        }
    };
    let segments = rolled.iter().zip(&track.links).enumerate();
    segments
        .map(|(number, (of, link))| {
            let start = link.segment.start;
            if number == 0 || trial.steady {
                let segment = &link.segment;
                shooting::lead_in(simulation, trial, segment, motion, warm_up, step);
            }
            let mut found = Vec::with_capacity(of.boundaries.len());
            for at in 0..=link.steps {
                if link.is_boundary(grid, at) {
                    let base = &of.boundaries[found.len()].memory;
                    found.push(Memory {
                        of_effects: beside_base(simulation, base),
                        activations: is_begun.then(|| simulation.activations()),
                    });
                }
                // The end's step belongs to the next segment.
                let Some(next) = of.every.get(at + 1).filter(|_| at < link.steps) else {
                    break;
                };
                if at == 0 {
                    rejoin(simulation, &of.every[0]);
                }
                let time = start + at as f64 * step;
                trial.control.interpolate(time, &mut control);
                trial.control.interpolate(time - step, &mut earlier);
                simulation.set_earlier_control(&earlier);
                simulation.set_control(&control);
                if is_begun && !simulation.activations().is_empty() {
                    simulation.step();
                    rejoin(simulation, next);
                } else {
                    simulation.remember(next);
                }
            }
            found
        })
        .collect()
}
