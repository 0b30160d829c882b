//! Closed loop: every method starts where a recorded run starts and is driven by its controls and
//! pushes; the distance from the truth is read after fixed times.

use hydro_frames::world_from_base;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::{drive::drive, method::Method, spread::Spread};
use crate::rollouts::Rollout;

/// The whole comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClosedLoop {
    /// Times after the start at which errors are read, and that a run reaches [s].
    pub horizons: Vec<f64>,
    /// Number of runs.
    pub runs: usize,
    /// True base positions along the first run [m].
    pub truth_path: Vec<[f64; 3]>,
    /// Sample times of the paths [s].
    pub time: Vec<f64>,
    /// A row a method.
    pub rows: Vec<ClosedLoopRow>,
}

/// A method's errors at each horizon.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClosedLoopRow {
    /// Name in the table.
    pub name: String,
    /// Distance of the base from the truth [m], one entry a horizon.
    pub position: Vec<Spread>,
    /// Angle between base attitudes [deg], one entry a horizon.
    pub attitude: Vec<Spread>,
    /// Root mean square over the joints of their distance from the truth [deg], one entry a horizon.
    #[serde(default)]
    pub joints: Vec<Spread>,
    /// Runs that blew up before the last horizon; their errors count as infinite.
    pub diverged: usize,
    /// Position errors behind `position`: `[horizon][run]` [m].
    pub position_by_run: Vec<Vec<f64>>,
    /// Base positions along the first run, one a sample [m].
    pub path: Vec<[f64; 3]>,
}

/// Runs every method through every run; errors are read at those of `horizons` [s] that a run reaches. `tick` is called
/// after each (method, run).
///
/// # Errors
/// Whatever building a simulator returns.
pub fn closed_loop<E>(
    methods: &[Method<'_, E>],
    runs: &[Rollout],
    horizons: &[f64],
    tick: &dyn Fn(&str),
) -> Result<ClosedLoop, E> {
    let reached = |horizon: &f64| runs.iter().any(|run| sample_at(run, *horizon).is_some());
    let horizons: Vec<f64> = horizons.iter().copied().filter(reached).collect();
    let mut rows = Vec::new();
    for method in methods {
        let mut position = vec![Vec::new(); horizons.len()];
        let mut attitude = vec![Vec::new(); horizons.len()];
        let mut joints = vec![Vec::new(); horizons.len()];
        let mut path = Vec::new();
        let mut diverged = 0;
        for (index, run) in runs.iter().enumerate() {
            let mut simulator = (method.simulator)(run)?;
            let driven = drive(simulator.as_mut(), run, &method.water, &mut |_, _| ());
            for (h, horizon) in horizons.iter().enumerate() {
                let Some(k) = sample_at(run, *horizon) else {
                    continue;
                };
                let (distance, angle) = pose_error(&driven[k], run.qpos.row(k));
                position[h].push(distance);
                attitude[h].push(angle);
                joints[h].push(joint_error(&driven[k], run.qpos.row(k)));
            }
            diverged += usize::from(driven.iter().any(|pose| !pose[0].is_finite()));
            if index == 0 {
                path = driven.iter().map(base_position).collect();
            }
            tick(&method.name);
        }
        rows.push(ClosedLoopRow {
            name: method.name.clone(),
            position: position.iter().map(|v| Spread::from_values(v)).collect(),
            attitude: attitude.iter().map(|v| Spread::from_values(v)).collect(),
            joints: joints.iter().map(|v| Spread::from_values(v)).collect(),
            diverged,
            position_by_run: position,
            path,
        });
    }
    Ok(ClosedLoop {
        horizons,
        runs: runs.len(),
        truth_path: runs
            .first()
            .map(|run| run.qpos.rows().map(base_position).collect())
            .unwrap_or_default(),
        time: runs.first().map(|run| run.time.clone()).unwrap_or_default(),
        rows,
    })
}

/// The sample at a time after the start, if the run is that long.
fn sample_at(run: &Rollout, horizon: f64) -> Option<usize> {
    run.time
        .iter()
        .position(|t| t - run.time[0] >= horizon - 1e-9)
}

fn base_position(qpos: &(impl AsRef<[f64]> + ?Sized)) -> [f64; 3] {
    let q = qpos.as_ref();
    [q[0], q[1], q[2]]
}

/// Distance [m] and angle [deg] between two base poses; infinite where one is not finite.
fn pose_error(pose: &[f64], truth: &[f64]) -> (f64, f64) {
    let attitude = |q: &[f64]| -> UnitQuaternion<f64> { world_from_base([q[3], q[4], q[5], q[6]]) };
    let distance = (Vector3::new(pose[0], pose[1], pose[2])
        - Vector3::new(truth[0], truth[1], truth[2]))
    .norm();
    let angle = attitude(pose).angle_to(&attitude(truth)).to_degrees();
    if distance.is_finite() && angle.is_finite() {
        (distance, angle)
    } else {
        (f64::INFINITY, f64::INFINITY)
    }
}

/// Root mean square of the distances of all joints [deg]; infinite where one is not finite, 0 without a joint.
fn joint_error(qpos: &[f64], truth: &[f64]) -> f64 {
    let (joints, truth) = (&qpos[7..], &truth[7..]);
    if joints.is_empty() {
        return 0.0;
    }
    let squares = joints.iter().zip(truth).map(|(a, b)| (a - b).powi(2));
    let error = (squares.sum::<f64>() / joints.len() as f64).sqrt();
    match error.is_finite() {
        true => error.to_degrees(),
        false => f64::INFINITY,
    }
}

#[cfg(test)]
#[path = "tests/closed_loop.rs"]
mod tests;
