//! Unmodelled forces along prescribed degrees of freedom: they move nothing, and force sensors feel them.

use crate::{plant::Simulation, problem::problem::Problem};

/// Rows of a trial that are looked at, at most.
const LOOKS: usize = 200;
/// Force that is tried [N, N m]. Readings are linear in it.
const TRIED: f64 = 1.0;

/// Scale of an unmodelled force by prescribed degree of freedom [N, N m]: the root mean square of the force along it that
/// explains the readings best. One where no sensor feels any.
pub(crate) fn scale(problem: &Problem<'_>, simulation: &mut dyn Simulation) -> Vec<f64> {
    let nv = problem.model.nv;
    let mut sums = vec![(0.0, 0.0); nv];
    for (trial, motion) in problem.trials.iter().zip(&problem.motions) {
        let axes: Vec<usize> = (0..nv).filter(|axis| trial.imposes(*axis)).collect();
        if axes.is_empty() {
            continue;
        }
        simulation.prescribe(trial.prescribed.clone());
        let nothing = vec![0.0; trial.width];
        let mut control = vec![0.0; trial.control.width()];
        let mut reading = vec![0.0; problem.channels.len()];
        let mut change = reading.clone();
        for row in (0..trial.times.len()).step_by(trial.times.len().div_ceil(LOOKS)) {
            let (qpos, qvel) = motion.state(row);
            trial.control.interpolate(motion.times[row], &mut control);
            let mut read = |pushed: Option<usize>| {
                let mut force = vec![0.0; nv];
                if let Some(axis) = pushed {
                    force[axis] = TRIED;
                }
                simulation.set_motion(motion.times[row], qpos, qvel);
                simulation.set_control(&control);
                simulation.set_force(&force);
                simulation.step();
                simulation.sensors()[..trial.width].to_vec()
            };
            let base = read(None);
            problem
                .channels
                .residual(trial.row(row), &nothing, &mut reading);
            for axis in axes.iter().copied() {
                problem
                    .channels
                    .residual(&read(Some(axis)), &base, &mut change);
                let felt = (reading.iter().zip(&change).zip(&problem.channels.list))
                    .filter(|((reading, change), _)| reading.is_finite() && change.is_finite())
                    .fold((0.0, 0.0), |sum, ((reading, change), channel)| {
                        let weight = channel.noise.powi(-2);
                        (
                            sum.0 + weight * reading * change,
                            sum.1 + weight * change * change,
                        )
                    });
                if felt.1 > 0.0 {
                    sums[axis].0 += (TRIED * felt.0 / felt.1).powi(2);
                    sums[axis].1 += 1.0;
                }
            }
        }
    }
    (sums.iter())
        .map(|(squares, count)| match *squares > 0.0 {
            true => (squares / count).sqrt(),
            false => 1.0,
        })
        .collect()
}
