//! Memories of effects along a track, where they are not the base's.

use std::collections::BTreeMap;

use hydro_effects::Entry;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::{
    error::GapError,
    likelihood::{
        changes::{Change, Kind},
        step_changes::{difference, stepped},
        track::{Boundary, Grid, Rolled, Track},
    },
    plant::Simulation,
    problem::problem::Problem,
    rollout::shooting::{self, WarmUp},
};

/// What a change brings along a segment.
pub(crate) struct Remembered {
    /// Memory at every boundary.
    pub(crate) memory: Vec<Vec<f64>>,
    /// Mean change of the next state over the steps from every boundary to the next, a unit of the parameter
    /// [2 nv, boundaries]; none where a step from the boundary stands for them.
    pub(crate) states: Option<DMatrix<f32>>,
}

/// Segment by segment.
pub(crate) type Memories = Vec<Remembered>;

/// Memories of the changes that have one of their own, by their number. `base`: numbers of the nominal and entries of the base.
pub(super) fn of_changes(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    (grid, force_scale): (Grid, &DVector<f64>),
    changes: &[Change],
    base: (&[f64], &[Entry]),
) -> Result<BTreeMap<usize, Memories>, GapError> {
    let has_own = |of: &Change| of.kind == Kind::Remembering && of.remembers_as.is_none();
    let own: Vec<usize> = (0..changes.len())
        .filter(|at| has_own(&changes[*at]))
        .collect();
    let memories = own.into_par_iter().map(|at| {
        let change = &changes[at];
        let mut simulation = change.simulation(problem, track.trial, base)?;
        let mut reference = match change.every_step {
            true => Some(reference(problem, track, base)?),
            false => None,
        };
        let memories = along(
            problem,
            (track, rolled),
            simulation.as_mut(),
            reference.as_deref_mut(),
            change,
            (grid, force_scale),
        );
        Ok((at, memories))
    });
    memories.collect()
}

/// The base, as differences are taken from it.
fn reference<'p>(
    problem: &'p Problem<'_>,
    track: &Track,
    base: (&[f64], &[Entry]),
) -> Result<Box<dyn Simulation + 'p>, GapError> {
    let plant = problem.plant.cheaper().unwrap_or(problem.plant);
    let mut simulation = plant.simulation(base.0, base.1)?;
    simulation.prescribe(problem.trials[track.trial].prescribed.clone());
    Ok(simulation)
}

/// Memory of a change's simulation along the base's motion, and with a `reference` what every step of it changes.
fn along(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    simulation: &mut dyn Simulation,
    mut reference: Option<&mut (dyn Simulation + '_)>,
    change: &Change,
    (grid, force_scale): (Grid, &DVector<f64>),
) -> Memories {
    let trial = &problem.trials[track.trial];
    let motion = &problem.motions[track.trial];
    let step = problem.model.timestep;
    let options = &problem.settings.options.rollout;
    let warm_up = WarmUp::required(problem.model, &change.entries, options);
    let mut control = vec![0.0; trial.control.width()];
    let mut earlier = control.clone();
    let mut tangent = vec![0.0; 2 * problem.model.nv];
    let mut reading = vec![0.0; problem.channels.len()];
    let segments = rolled.iter().zip(&track.links).enumerate();
    segments
        .map(|(number, (of, link))| {
            let start = link.segment.start;
            if number == 0 || trial.steady {
                let segment = &link.segment;
                shooting::lead_in(simulation, trial, segment, motion, warm_up, step);
            }
            let mut found = Remembered {
                memory: Vec::with_capacity(of.boundaries.len()),
                states: (reference.is_some())
                    .then(|| DMatrix::zeros(2 * problem.model.nv, of.boundaries.len())),
            };
            let mut steps = vec![0_u32; of.boundaries.len()];
            for at in 0..=link.steps {
                if link.is_boundary(grid, at) {
                    found.memory.push(simulation.memory());
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
                let Some((reference, states)) = reference.as_deref_mut().zip(found.states.as_mut())
                else {
                    simulation.remember(next);
                    continue;
                };
                let boundary = found.memory.len() - 1;
                let stand_in = Boundary {
                    force: link.force(grid, at, force_scale),
                    control: control.clone(),
                    earlier: earlier.clone(),
                    ..of.boundaries[boundary].clone()
                };
                reference.rejoin(&of.every[at]);
                let from = stepped(reference, &stand_in);
                let to = stepped(simulation, &stand_in);
                difference(
                    problem,
                    simulation,
                    &from,
                    &to,
                    change.step,
                    &mut tangent,
                    &mut reading,
                );
                steps[boundary] += 1;
                for (sum, value) in states.column_mut(boundary).iter_mut().zip(&tangent) {
                    *sum += *value as f32;
                }
                simulation.rejoin(next);
            }
            if let Some(states) = &mut found.states {
                for (mut column, steps) in states.column_iter_mut().zip(&steps) {
                    column /= (*steps).max(1) as f32;
                }
                // The last boundary's steps, if it has any, are like those before it.
                let last = states.ncols() - 1;
                if last > 0 {
                    let before = states.column(last - 1).clone_owned();
                    states.set_column(last, &before);
                }
            }
            found
        })
        .collect()
}
