//! Changes that one step of a block does not stand for: of backlash, whose gap is passed within a few steps.

use hydro_effects::Entry;
use nalgebra::{DMatrix, DVector};

use crate::{
    error::GapError,
    likelihood::{
        changes::Change,
        step_changes::{Inputs, difference, end_at_next_starts, stepped},
        track::{Boundary, Grid, Link, Rolled, Track},
    },
    plant::Simulation,
    problem::problem::Problem,
    rollout::shooting::{self, WarmUp},
};

/// Inputs of a change from every step along the base's motion: of the state the mean over a block, of the readings those at
/// its start. Both sides have a memory of their own of that motion, and the unmodelled forces: they tell which side of a gap
/// bears. `base`: numbers of the nominal and entries of the base.
pub(super) fn inputs(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    (grid, force_scale): (Grid, &DVector<f64>),
    change: &Change,
    base: (&[f64], &[Entry]),
) -> Result<Inputs, GapError> {
    let trial = &problem.trials[track.trial];
    let motion = &problem.motions[track.trial];
    let step = problem.model.timestep;
    let plant = problem.plant.cheaper().unwrap_or(problem.plant);
    let mut reference = plant.simulation(base.0, base.1)?;
    reference.prescribe(trial.prescribed.clone());
    let mut sides = [reference, change.simulation(problem, track.trial, base)?];
    let options = &problem.settings.options.rollout;
    let warm_up = WarmUp::required(problem.model, &change.entries, options);
    let mut found = Vec::with_capacity(rolled.len());
    for (number, (of, link)) in rolled.iter().zip(&track.links).enumerate() {
        if number == 0 || trial.steady {
            for side in &mut sides {
                shooting::lead_in(side.as_mut(), trial, &link.segment, motion, warm_up, step);
            }
        }
        let is_last = number + 1 == rolled.len() || trial.steady;
        found.push(segment(
            problem,
            (track, link, of, is_last),
            (grid, force_scale),
            change.step,
            &mut sides,
        ));
    }
    if !trial.steady {
        end_at_next_starts(&mut found);
    }
    Ok(Inputs(found))
}

fn segment(
    problem: &Problem<'_>,
    (track, link, of, is_last): (&Track, &Link, &Rolled, bool),
    (grid, force_scale): (Grid, &DVector<f64>),
    size: f64,
    [reference, changed]: &mut [Box<dyn Simulation + '_>; 2],
) -> (DMatrix<f32>, DMatrix<f32>) {
    let trial = &problem.trials[track.trial];
    let (start, step) = (link.segment.start, problem.model.timestep);
    let (mut tangent, mut reading) = (
        vec![0.0; 2 * problem.model.nv],
        vec![0.0; problem.channels.len()],
    );
    let boundaries = of.boundaries.len();
    let mut states = DMatrix::zeros(tangent.len(), boundaries);
    let mut readings = DMatrix::zeros(reading.len(), boundaries);
    let mut at = Boundary {
        control: vec![0.0; trial.control.width()],
        earlier: vec![0.0; trial.control.width()],
        ..of.boundaries[0].clone()
    };
    let mut block = 0;
    // The end's step belongs to the segment that follows, if any.
    let steps = link.steps + usize::from(is_last);
    for (number, state) in of.every.iter().enumerate().take(steps) {
        let is_first = link.is_boundary(grid, number);
        block += usize::from(is_first && number > 0);
        let time = start + number as f64 * step;
        trial.control.interpolate(time, &mut at.control);
        trial.control.interpolate(time - step, &mut at.earlier);
        at.force = link.force(grid, number, force_scale);
        reference.rejoin(state);
        changed.rejoin(state);
        let from = stepped(reference.as_mut(), &at);
        let to = stepped(changed.as_mut(), &at);
        difference(
            problem,
            changed.as_ref(),
            &from,
            &to,
            size,
            &mut tangent,
            &mut reading,
        );
        let steps = match of.boundaries.get(block + 1) {
            Some(next) => next.step - of.boundaries[block].step,
            None => 1,
        };
        for (mean, value) in states.column_mut(block).iter_mut().zip(&tangent) {
            *mean += (*value / steps as f64) as f32;
        }
        if is_first {
            for (place, value) in readings.column_mut(block).iter_mut().zip(&reading) {
                *place = *value as f32;
            }
        }
    }
    (states, readings)
}
