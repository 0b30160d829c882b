//! Typical speeds, travels and commands of the trials, which scale the priors of effects.

use crate::{
    plant::PlantDescription,
    problem::{channels::MeasuredTrial, segments::EstimatedMotion},
};

/// Typical motions in the trials, which scale the priors.
#[derive(Clone, Debug)]
pub(crate) struct Typical {
    /// Root mean square speed of every degree of freedom.
    pub(crate) speed: Vec<f64>,
    /// Largest excursion of every position from its mean.
    pub(crate) travel: Vec<f64>,
    /// Middle of the range of every position.
    pub(crate) middle: Vec<f64>,
    /// Least value of every position.
    pub(crate) lowest: Vec<f64>,
    /// Largest value of every position.
    pub(crate) highest: Vec<f64>,
    /// Least distance of a base that swims free from a wall.
    pub(crate) clearance: f64,
    /// Largest command of every actuator.
    pub(crate) command: Vec<f64>,
}

impl Typical {
    /// Root mean square speeds, excursions and commands.
    pub(crate) fn from_trials(
        model: &PlantDescription,
        trials: &[MeasuredTrial],
        motions: &[EstimatedMotion],
    ) -> Self {
        let mut speed = vec![0.0; model.nv];
        let mut lowest = vec![f64::INFINITY; model.nq];
        let mut highest = vec![f64::NEG_INFINITY; model.nq];
        let mut rows = 0_usize;
        let mut clearance = f64::INFINITY;
        for motion in motions {
            for row in 0..motion.times.len() {
                let (qpos, qvel) = motion.state(row);
                for (sum, value) in speed.iter_mut().zip(qvel) {
                    *sum += value * value;
                }
                for ((low, high), value) in lowest.iter_mut().zip(&mut highest).zip(qpos) {
                    *low = value.min(*low);
                    *high = value.max(*high);
                }
                if let Some(base) = &model.base {
                    let at: [f64; 3] = std::array::from_fn(|axis| qpos[base.qpos + axis]);
                    let walls = model.walls.iter().map(|wall| wall.distance(at));
                    clearance = walls.fold(clearance, f64::min);
                }
                rows += 1;
            }
        }
        let mut command = vec![0.0_f64; model.actuators.len()];
        for trial in trials {
            let width = trial.control.width();
            for row in trial.control.data.chunks_exact(width.max(1)) {
                for ((largest, value), actuator) in
                    command.iter_mut().zip(row).zip(&model.actuators)
                {
                    if value.is_finite() {
                        *largest = largest.max(actuator.limited(*value).abs());
                    }
                }
            }
        }
        Self {
            speed: speed
                .iter()
                .map(|sum| (sum / rows.max(1) as f64).sqrt())
                .collect(),
            travel: lowest
                .iter()
                .zip(&highest)
                .map(|(low, high)| 0.5 * (high - low).max(0.0))
                .collect(),
            middle: lowest
                .iter()
                .zip(&highest)
                .map(|(low, high)| 0.5 * (low + high))
                .map(|middle| if middle.is_finite() { middle } else { 0.0 })
                .collect(),
            lowest,
            highest,
            clearance,
            command,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{fake::RigidBody, on_prepared, trial};

    #[test]
    fn the_largest_command_is_one_that_an_actuator_obeys() {
        let trials = vec![trial("pushed", &[], &[0.0, 0.0], 0, 1.0)];
        on_prepared(&RigidBody::new(), trials, |problem, _| {
            let mut model = problem.model.clone();
            let largest = |model: &PlantDescription| {
                Typical::from_trials(model, &problem.trials, &problem.motions).command
            };
            assert!(largest(&model)[1] > 0.5);
            model.actuators[1].range = Some([-0.2, 0.1]);
            assert_eq!(largest(&model)[1], 0.2);
        });
    }
}
