//! What effects remember along a track, where it is not what the base remembers.

use crate::{
    likelihood::{
        changes::Change,
        track::{Grid, Rolled, Track},
    },
    plant::Simulation,
    problem::problem::Problem,
    rollout::shooting::{self, WarmUp},
};

/// Memory of a change's simulation at every boundary, segment by segment, along the base's motion.
pub(super) fn along(
    problem: &Problem<'_>,
    track: &Track,
    rolled: &[Rolled],
    (simulation, change): (&mut dyn Simulation, &Change),
    grid: Grid,
) -> Vec<Vec<Vec<f64>>> {
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
                    found.push(simulation.memory());
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
