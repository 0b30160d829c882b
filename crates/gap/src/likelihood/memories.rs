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

/// Memory of a change's simulation.
pub(crate) struct Memory {
    pub(crate) of_effects: Vec<f64>,
    /// Change of the nominal's state after its velocities; empty where it is the base's.
    beside: Vec<f64>,
}

impl Memory {
    /// A full-physics state of the base with what the change makes of it.
    pub(crate) fn state(&self, base: &[f64]) -> Vec<f64> {
        let mut state = base.to_vec();
        let first = state.len().saturating_sub(self.beside.len());
        for (value, change) in state[first..].iter_mut().zip(&self.beside) {
            *value += change;
        }
        state
    }
}

/// Memory at every boundary, segment by segment; none where nothing is left of a change.
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
        if changes[at].kind == Kind::Begun {
            let plant = problem.plant.cheaper().unwrap_or(problem.plant);
            let mut without = plant.simulation(base.0, base.1)?;
            without.prescribe(problem.trials[track.trial].prescribed.clone());
            let mut both = [simulation, without];
            return Ok((at, begun(problem, (track, rolled), &mut both, base.1, grid)));
        }
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
                        beside: Vec::new(),
                    });
                }
                // The end's step belongs to the next segment.
                let Some(next) = of.every.get(at + 1).filter(|_| at < link.steps) else {
                    break;
                };
                if at == 0 {
                    simulation.rejoin(&of.every[0]);
                }
                let time = start + at as f64 * step;
                trial.control.interpolate(time, &mut control);
                trial.control.interpolate(time - step, &mut earlier);
                simulation.set_earlier_control(&earlier);
                simulation.set_control(&control);
                simulation.remember(next);
            }
            found
        })
        .collect()
}

/// Changes of all that is remembered with commands before the log, along the base's motion: between two simulations, one with a little
/// more of them. Both are of the integrator of differences, and neither is pushed by unmodelled forces.
fn begun(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    both: &mut [Box<dyn Simulation + '_>; 2],
    entries: &[Entry],
    grid: Grid,
) -> Memories {
    let trial = &problem.trials[track.trial];
    let motion = &problem.motions[track.trial];
    let model = problem.model;
    let step = model.timestep;
    let first = 1 + model.nq + model.nv;
    let warm_up = WarmUp::required(model, entries, &problem.settings.options.rollout);
    let mut memories: Memories = rolled.iter().map(|_| Vec::new()).collect();
    if trial.steady {
        return memories;
    }
    let mut control = vec![0.0; trial.control.width()];
    let mut earlier = control.clone();
    let mut at_start = None;
    for (number, (of, link)) in rolled.iter().zip(&track.links).enumerate() {
        for simulation in both.iter_mut() {
            if number == 0 {
                shooting::lead_in(
                    simulation.as_mut(),
                    trial,
                    &link.segment,
                    motion,
                    warm_up,
                    step,
                );
            }
            rejoin(simulation.as_mut(), &of.every[0], first);
        }
        for at in 0..=link.steps {
            if link.is_boundary(grid, at) {
                let [own, without] = [0, 1].map(|at| both[at].memory());
                let change = difference(&own, &without);
                let mut memory = Memory {
                    of_effects: of.boundaries[memories[number].len()].memory.clone(),
                    beside: difference(
                        &both[0].full_state()[first..],
                        &both[1].full_state()[first..],
                    ),
                };
                // Where bodies are in their backlash is the base's.
                let of_effects = change.len() - both[0].hidden().min(change.len());
                let change = &change[..of_effects];
                let all = change.iter().chain(&memory.beside);
                let size = all.fold(0.0, |most: f64, value| most.max(value.abs()));
                if size
                    <= problem.settings.options.likelihood.forgotten * *at_start.get_or_insert(size)
                {
                    return memories;
                }
                for (value, change) in memory.of_effects.iter_mut().zip(change) {
                    *value += change;
                }
                memories[number].push(memory);
            }
            let Some(next) = of.every.get(at + 1).filter(|_| at < link.steps) else {
                break;
            };
            let time = link.segment.start + at as f64 * step;
            trial.control.interpolate(time, &mut control);
            trial.control.interpolate(time - step, &mut earlier);
            for simulation in both.iter_mut() {
                simulation.set_earlier_control(&earlier);
                simulation.set_control(&control);
                simulation.step();
                rejoin(simulation.as_mut(), next, first);
            }
        }
    }
    memories
}

/// Takes a full-physics state, but for what stands after the velocities, from `first` on.
fn rejoin(simulation: &mut dyn Simulation, state: &[f64], first: usize) {
    let mut joined = simulation.full_state();
    joined[..first].copy_from_slice(&state[..first]);
    simulation.rejoin(&joined);
}

fn difference(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(a, b)| a - b).collect()
}
