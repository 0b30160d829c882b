//! Forces that the noise of logged commands makes.
//!
//! Averaged over a piece of a segment, white noise of the rows is white from piece to piece; what it does within a piece, the
//! smoothed commands leave out (`problem/command_noise.rs`).

use hydro_effects::Entry;
use nalgebra::{DMatrix, DVector};

use crate::{
    likelihood::track::{Boundary, Grid, Link, Rolled, Track},
    plant::{PlantError, Simulation},
    problem::problem::Problem,
    rollout::shooting::remembers,
};

/// Generalised forces along every segment of a track that one standard deviation of each noisy command makes over a piece, in
/// the scales of the unmodelled forces [nv, noisy commands]. They are those of a point `about` which is linearised, numbers of
/// the nominal and effects, without effects that remember: of a command that a lag holds back a step tells little.
///
/// # Errors
/// The plant refuses the point.
pub(crate) fn command_forces(
    problem: &Problem<'_>,
    (track, rolled): (&Track, &[Rolled]),
    grid: Grid,
    force_scale: &DVector<f64>,
    about: (&[f64], &[Entry]),
) -> Result<Vec<DMatrix<f64>>, PlantError> {
    let noisy: Vec<(usize, f64)> = problem.noisy_commands().collect();
    let trial = &problem.trials[track.trial];
    // Steady states are means over many rows.
    if noisy.is_empty() || trial.steady {
        return Ok(vec![
            DMatrix::zeros(problem.model.nv, noisy.len());
            rolled.len()
        ]);
    }
    let step = problem.model.timestep;
    let mut entries = about.1.to_vec();
    entries.retain(|entry| !remembers(std::slice::from_ref(entry), step));
    let mut simulation = problem.plant.simulation(about.0, &entries)?;
    simulation.prescribe(trial.prescribed.clone());
    let axes: Vec<usize> = (0..problem.model.nv)
        .filter(|axis| !trial.imposes(*axis))
        .collect();
    // Of rows closer than a step every step meets one.
    let row = trial
        .control
        .period()
        .map_or(step, |period| period.max(step));
    let each = (rolled.iter().zip(&track.links)).map(|(of, link)| {
        let rows = piece_seconds(link, grid, step) / row;
        let sizes = noisy
            .iter()
            .map(|(at, sd)| (*at, sd / rows.max(1.0).sqrt()));
        forces(
            simulation.as_mut(),
            &of.boundaries[0],
            &axes,
            sizes.collect(),
            force_scale,
        )
    });
    Ok(each.collect())
}

/// Length of a segment's pieces [s].
fn piece_seconds(link: &Link, grid: Grid, step: f64) -> f64 {
    link.steps as f64 * step / grid.pieces as f64
}

/// From what a step does to the velocities under a command, and under forces.
fn forces(
    simulation: &mut dyn Simulation,
    boundary: &Boundary,
    axes: &[usize],
    noisy: Vec<(usize, f64)>,
    force_scale: &DVector<f64>,
) -> DMatrix<f64> {
    let nv = force_scale.len();
    let mut after = |axis: Option<usize>, command: Option<(usize, f64)>| {
        let mut force = vec![0.0; nv];
        if let Some(axis) = axis {
            force[axis] = force_scale[axis];
        }
        let (mut control, mut earlier) = (boundary.control.clone(), boundary.earlier.clone());
        if let Some((at, size)) = command {
            control[at] += size;
            earlier[at] += size;
        }
        simulation.rejoin(&boundary.full);
        simulation.set_force(&force);
        simulation.set_earlier_control(&earlier);
        simulation.set_control(&control);
        simulation.step();
        let velocities = simulation.qvel();
        DVector::from_iterator(axes.len(), axes.iter().map(|axis| velocities[*axis]))
    };
    let from = after(None, None);
    let mut mobility = DMatrix::zeros(axes.len(), axes.len());
    for (column, axis) in axes.iter().enumerate() {
        mobility.set_column(column, &(after(Some(*axis), None) - &from));
    }
    let mut moved = DMatrix::zeros(axes.len(), noisy.len());
    for (column, of) in noisy.iter().enumerate() {
        moved.set_column(column, &(after(None, Some(*of)) - &from));
    }
    let mut all = DMatrix::zeros(nv, noisy.len());
    let solved = mobility.lu().solve(&moved);
    if let Some(solved) = solved.filter(|of| of.iter().all(|value| value.is_finite())) {
        for (row, axis) in axes.iter().enumerate() {
            all.row_mut(*axis).copy_from(&solved.row(row));
        }
    }
    all
}
