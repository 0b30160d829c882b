//! Time of a physics step in every method's scene, measured side by side.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::method::{Method, Water};
use crate::rollouts::Rollout;

/// Time of one physics step of a method's scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StepTime {
    /// Name in the table.
    pub name: String,
    /// Median over runs of the mean time of a step [us].
    pub microseconds: f64,
}

/// Steps a round.
const STEPS: usize = 500;

/// Rounds; methods take turns, so that a slow moment of the machine strikes all.
const ROUNDS: usize = 9;

/// Median over rounds of the mean time of a step, of every method whose water is its scene's own: a
/// wrench that the comparison applies from outside costs what no user would pay.
///
/// # Errors
/// Whatever building a simulator returns.
pub fn step_times<E>(methods: &[Method<'_, E>], run: &Rollout) -> Result<Vec<StepTime>, E> {
    let mut simulators = Vec::new();
    for method in methods {
        if !matches!(method.water, Water::Scene) {
            continue;
        }
        let mut simulator = (method.simulator)(run)?;
        simulator.restart(run.qpos.row(0), run.qvel.row(0));
        simulator.set_control(run.ctrl.row(0));
        simulators.push((method.name.clone(), simulator, Vec::new()));
    }
    for _ in 0..ROUNDS {
        for (_, simulator, times) in &mut simulators {
            let started = Instant::now();
            for _ in 0..STEPS {
                simulator.step();
            }
            times.push(started.elapsed().as_secs_f64() / STEPS as f64);
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    let time = |(name, _, times)| StepTime {
        name,
        microseconds: 1e6 * median(times),
    };
    Ok(simulators.into_iter().map(time).collect())
}
