//! Scales of the unmodelled forces.
//!
//! An unmodelled acceleration has a size of its own: its force is that times the inertia that the point has. A factor on all
//! forces and inertias then leaves every reading as it is. Were the force held instead, half of all forces and inertias would
//! need half of it, and long trials, of thousands of pieces of unmodelled force, would move masses, gains and drags together
//! until little of it was needed.

use hydro_effects::{Entry, effect};
use nalgebra::DVector;

use crate::{
    error::GapError,
    likelihood::{felt_forces, track::Track},
    plant::PlantError,
    problem::{point::Point, problem::Problem},
};

/// Links from one that is looked at for the motion of a free system to the next.
const STRIDE: usize = 4;

/// Sizes of what nobody modelled, by degree of freedom.
#[derive(Clone, Debug)]
pub(crate) struct Unmodelled {
    /// Root mean square acceleration, as in the trials and unforced [m/s^2, rad/s^2]; `None` along one that every trial
    /// prescribes.
    accelerations: Vec<Option<f64>>,
    /// What force sensors feel along prescribed ones [N, N m].
    felt: Vec<f64>,
}

impl Unmodelled {
    /// From the estimated motion, and from the nominal without commands.
    pub(crate) fn new(problem: &Problem<'_>, tracks: &[Track]) -> Result<Self, GapError> {
        let nv = problem.model.nv;
        let step = problem.model.timestep;
        let nominal = vec![0.0; problem.model.nuisances.len()];
        let mut simulation = problem.plant.simulation(&nominal, &[])?;
        let (mut squares, mut count) = (DVector::<f64>::zeros(nv), DVector::<f64>::zeros(nv));
        let (mut free, mut looked) = (DVector::<f64>::zeros(nv), DVector::<f64>::zeros(nv));
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
            for link in track.links.iter().step_by(STRIDE) {
                let segment = &link.segment;
                simulation.set_motion(segment.start, &segment.qpos, &segment.qvel);
                simulation.set_force(&vec![0.0; nv]);
                simulation.step();
                for axis in moves.iter().copied() {
                    looked[axis] += 1.0;
                    free[axis] += ((simulation.qvel()[axis] - segment.qvel[axis]) / step).powi(2);
                }
            }
        }
        let felt = felt_forces::scale(problem, simulation.as_mut());
        let least = problem.settings.options.likelihood.least_acceleration;
        let accelerations = (0..nv).map(|axis| {
            let looked = looked[axis];
            let mean = squares[axis] / f64::max(count[axis], 1.0) + free[axis] / looked.max(1.0);
            (looked > 0.0).then(|| mean.sqrt().max(least))
        });
        Ok(Self {
            accelerations: accelerations.collect(),
            felt,
        })
    }

    /// Scale of the unmodelled force on every degree of freedom at a point [N, N m].
    ///
    /// # Errors
    /// The plant refuses the point.
    pub(crate) fn forces(
        &self,
        problem: &Problem<'_>,
        tracks: &[Track],
        point: &Point,
    ) -> Result<DVector<f64>, PlantError> {
        let nv = problem.model.nv;
        let step = problem.model.timestep;
        let nuisances = problem.nuisance_values(point);
        // Those that add inertia: of a joint with play a force would move the rotor alone.
        let adds = |of: &Entry| effect(of.effect).part().adds_inertia();
        let entries: Vec<Entry> = problem.entries(point).into_iter().filter(adds).collect();
        let mut simulation = problem.plant.simulation(&nuisances, &entries)?;
        // Inertia from the response to a force.
        let (mut mobility, mut looked) = (DVector::<f64>::zeros(nv), DVector::<f64>::zeros(nv));
        for track in tracks {
            let trial = &problem.trials[track.trial];
            simulation.prescribe(trial.prescribed.clone());
            let moves: Vec<usize> = (0..nv).filter(|axis| !trial.imposes(*axis)).collect();
            if moves.is_empty() {
                continue;
            }
            for link in track.links.iter().step_by(STRIDE) {
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
                    mobility[axis] += (after(Some(axis))[axis] - from[axis]) / step;
                }
            }
        }
        Ok(DVector::from_fn(nv, |axis, _| {
            match self.accelerations[axis] {
                Some(acceleration) => acceleration * looked[axis] / mobility[axis].abs().max(1e-12),
                None => self.felt[axis],
            }
        }))
    }
}
