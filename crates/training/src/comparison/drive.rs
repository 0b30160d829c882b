//! A simulator driven through a recorded run.

use hydro_frames::{Twist, Wrench, base_from_world};

use super::method::Water;
use crate::{rollouts::Rollout, simulator::Simulator};

/// Drives a simulator through a run; returns its positions [nq] at every sample, NaN once it has blown up.
///
/// `watch` sees the simulator after every sample, and the water's wrench on the base in the last step.
pub fn drive(
    simulator: &mut dyn Simulator,
    run: &Rollout,
    water: &Water<'_>,
    watch: &mut dyn FnMut(&dyn Simulator, Wrench),
) -> Vec<Vec<f64>> {
    simulator.restart(run.qpos.row(0), run.qvel.row(0));
    let mut positions = vec![simulator.qpos().to_vec()];
    let mut given = None;
    let mut truth = match water {
        Water::Truth(build) => Some(build(run)),
        _ => None,
    };
    for k in 0..run.ctrl.len() {
        let period = run.time[k + 1] - run.time[k];
        let steps = (period / simulator.timestep()).round().max(1.0) as usize;
        simulator.set_control(run.ctrl.row(k));
        simulator.set_push(run.push.row(k));
        for step in 0..steps {
            given = match water {
                Water::Scene => None,
                Water::Law(law) => Some(law(&base_twist(simulator), run.density)),
                Water::Truth(_) => truth
                    .as_mut()
                    .map(|truth| truth(simulator.qpos(), simulator.qvel())),
                Water::Replayed => {
                    let part = step as f64 / steps as f64;
                    Some(recorded_wrench(run, k, part))
                }
                Water::Steps { joints } => {
                    let dofs = if *joints { simulator.qvel().len() } else { 6 };
                    let force = step_force(run, k, step, simulator.qvel().len());
                    let force = force.and_then(|force| force.get(..dofs));
                    if let Some(force) = force {
                        simulator.set_generalised_force(force);
                    }
                    None
                }
            };
            if let Some(wrench) = given {
                simulator.set_base_wrench(wrench);
            }
            simulator.step();
        }
        positions.push(if simulator.diverged() {
            vec![f64::NAN; simulator.qpos().len()]
        } else {
            simulator.qpos().to_vec()
        });
        watch(simulator, given.unwrap_or_else(|| simulator.water_wrench()));
    }
    positions
}

/// The base's twist in the base frame, still water.
fn base_twist(simulator: &dyn Simulator) -> Twist {
    let (q, v) = (simulator.qpos(), simulator.qvel());
    Twist {
        angular: [v[3], v[4], v[5]],
        linear: base_from_world([q[3], q[4], q[5], q[6]], [v[0], v[1], v[2]]),
    }
}

/// The recorded wrench a part of the way from sample `k` to the next.
fn recorded_wrench(run: &Rollout, k: usize, part: f64) -> Wrench {
    let (here, there) = (run.wrench.row(k), run.wrench.row(k + 1));
    let mut between = [0.0; 6];
    for (value, (a, b)) in between.iter_mut().zip(here.iter().zip(there)) {
        *value = a + part * (b - a);
    }
    Wrench::from_array(between)
}

/// The recorded force [nv] of a physics step of interval `k`.
fn step_force(run: &Rollout, k: usize, step: usize, dofs: usize) -> Option<&[f64]> {
    run.step_force.as_ref()?.row(k).chunks_exact(dofs).nth(step)
}
