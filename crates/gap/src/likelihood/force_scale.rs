//! Scales of the unmodelled forces.

use nalgebra::DVector;

use crate::{
    error::GapError,
    likelihood::{felt_forces, track::Track},
    problem::problem::Problem,
};

/// Scale of the unmodelled force on every degree of freedom: inertia times the root mean square acceleration, as in the trials
/// and unforced. Along one that every trial prescribes, what force sensors feel there.
pub(crate) fn force_scale(
    problem: &Problem<'_>,
    tracks: &[Track],
) -> Result<DVector<f64>, GapError> {
    let nv = problem.model.nv;
    let step = problem.model.timestep;
    let nominal = vec![0.0; problem.model.nuisances.len()];
    let mut simulation = problem.plant.simulation(&nominal, &[])?;
    // Accelerations from the estimated motion, inertia from the response to a force.
    let (mut squares, mut count) = (DVector::<f64>::zeros(nv), DVector::<f64>::zeros(nv));
    let mut mobility = DVector::<f64>::zeros(nv);
    let mut free = DVector::<f64>::zeros(nv);
    let mut looked = DVector::<f64>::zeros(nv);
    for track in tracks {
        let trial = &problem.trials[track.trial];
        let motion = &problem.motions[track.trial];
        simulation.prescribe(trial.prescribed.clone());
        let moves: Vec<usize> = (0..nv).filter(|axis| !trial.imposes(*axis)).collect();
        if moves.is_empty() {
            continue;
        }
        for row in 1..motion.times.len() {
            let seconds = motion.times[row] - motion.times[row - 1];
            let ((_, before), (_, after)) = (motion.state(row - 1), motion.state(row));
            for axis in moves.iter().copied() {
                squares[axis] += ((after[axis] - before[axis]) / seconds).powi(2);
                count[axis] += 1.0;
            }
        }
        for link in track.links.iter().step_by(4) {
            let segment = &link.segment;
            let mut after = |force: Option<usize>| {
                let mut pushed = vec![0.0; nv];
                if let Some(axis) = force {
                    pushed[axis] = 1.0;
                }
                simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
                simulation.set_force(&pushed);
                simulation.step();
                simulation.qvel().to_vec()
            };
            let from = after(None);
            for axis in moves.iter().copied() {
                looked[axis] += 1.0;
                free[axis] += ((from[axis] - segment.qvel[axis]) / step).powi(2);
                mobility[axis] += (after(Some(axis))[axis] - from[axis]) / step;
            }
        }
    }
    let felt = felt_forces::scale(problem, simulation.as_mut());
    Ok(DVector::from_fn(nv, |axis, _| {
        let looked = looked[axis];
        if looked == 0.0 {
            return felt[axis];
        }
        let inertia = looked / mobility[axis].abs().max(1e-12);
        let acceleration = (squares[axis] / f64::max(count[axis], 1.0)
            + free[axis] / f64::max(looked, 1.0))
        .sqrt();
        inertia * acceleration.max(problem.settings.options.likelihood.least_acceleration)
    }))
}
