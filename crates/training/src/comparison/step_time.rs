//! What a physics step costs in every contender's scene, measured side by side.

use std::time::Instant;

use super::{
    closed_loop::{Contender, Water},
    summary::StepTime,
};
use crate::rollouts::Rollout;

/// Steps a round.
const STEPS: usize = 500;
/// Rounds; contenders take turns, so that a slow moment of the machine strikes all.
const ROUNDS: usize = 9;

/// Median over rounds of the mean time of a step, of every contender whose water is its scene's own: a
/// wrench that the comparison applies from outside costs what no user would pay.
///
/// # Errors
/// Whatever building a simulator returns.
pub fn step_times<E>(contenders: &[Contender<'_, E>], run: &Rollout) -> Result<Vec<StepTime>, E> {
    let mut simulators = Vec::new();
    for contender in contenders {
        if !matches!(contender.water, Water::OfTheScene) {
            continue;
        }
        let mut simulator = (contender.simulator)(run)?;
        simulator.restart(run.qpos.row(0), run.qvel.row(0));
        simulator.set_control(run.ctrl.row(0));
        simulators.push((contender.name.clone(), simulator, Vec::new()));
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
