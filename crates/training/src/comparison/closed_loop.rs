//! Closed loop: every contender starts where a recorded run starts and is driven by its controls and
//! pushes; the distance from the truth is read after fixed times.

use hydro_frames::{Twist, Wrench, base_from_world, world_from_base};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{rollouts::Rollout, simulator::Simulator};

/// A wrench as a function of the base twist and the water's density [kg/m^3].
pub type WrenchLaw<'a> = dyn Fn(&Twist, f64) -> Wrench + 'a;

/// The wrench that another simulator's water puts on the base at a state: positions, velocities.
pub type WrenchAtState = dyn FnMut(&[f64], &[f64]) -> Wrench;

/// Builds the truth for a run (its density is part of the scene).
pub type MakeTruth<'a> = dyn Fn(&Rollout) -> Box<WrenchAtState> + 'a;

/// Name of the contender with the true base wrench at its own state: nobody who gives a base wrench can do better.
pub const ORACLE: &str = "oracle, at its own state";

/// Where a contender's base wrench comes from.
pub enum Water<'a> {
    /// The scene's own: a plugin, or MuJoCo's fluid.
    OfTheScene,
    /// A law of the base twist, evaluated every step.
    Law(Box<WrenchLaw<'a>>),
    /// The true base wrench at the contender's own state, evaluated every step; built for a run's density.
    Truth(Box<MakeTruth<'a>>),
    /// The recorded true wrench, interpolated between samples. Nothing feeds back: once the motion differs,
    /// the wrench is that of another motion.
    Replayed,
}

impl std::fmt::Debug for Water<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::OfTheScene => "OfTheScene",
            Self::Law(_) => "Law",
            Self::Truth(_) => "Truth",
            Self::Replayed => "Replayed",
        })
    }
}

/// Builds the simulator for a run (its density is part of the scene).
pub type MakeSimulator<'a, E> = dyn Fn(&Rollout) -> Result<Box<dyn Simulator>, E> + 'a;

/// One row of the comparison.
pub struct Contender<'a, E> {
    /// Name in the table.
    pub name: String,
    /// Builds its simulator.
    pub simulator: Box<MakeSimulator<'a, E>>,
    /// Its water.
    pub water: Water<'a>,
}

impl<E> std::fmt::Debug for Contender<'_, E> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Contender")
            .field("name", &self.name)
            .field("water", &self.water)
            .finish_non_exhaustive()
    }
}

/// Median, mean and standard error of the mean over runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median over runs.
    pub median: f64,
    /// Mean over runs.
    pub mean: f64,
    /// Standard error of the mean.
    pub standard_error: f64,
}

impl Spread {
    /// Of one value a run. A run that diverged counts as infinite.
    pub fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        if n == 0 {
            return Self {
                median: f64::NAN,
                mean: f64::NAN,
                standard_error: f64::NAN,
            };
        }
        let median = (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0;
        let mean = sorted.iter().sum::<f64>() / n as f64;
        let variance = sorted.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
            / (n.saturating_sub(1).max(1)) as f64;
        Self {
            median,
            mean,
            standard_error: (variance / n as f64).sqrt(),
        }
    }
}

/// A contender's errors at each horizon.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Errors {
    /// Name in the table.
    pub name: String,
    /// Distance of the base from the truth [m], one entry a horizon.
    pub position: Vec<Spread>,
    /// Angle between base attitudes [deg], one entry a horizon.
    pub attitude: Vec<Spread>,
    /// Runs that blew up before the last horizon; their errors count as infinite.
    pub diverged: usize,
    /// Position errors behind `position`: `[horizon][run]` [m].
    pub position_by_run: Vec<Vec<f64>>,
    /// Base positions along the first run, one a sample [m].
    pub path: Vec<[f64; 3]>,
}

/// The whole comparison.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ClosedLoop {
    /// Times after the start at which errors are read, and that a run reaches [s].
    pub horizons: Vec<f64>,
    /// How many runs.
    pub runs: usize,
    /// True base positions along the first run [m].
    pub truth_path: Vec<[f64; 3]>,
    /// Sample times of the paths [s].
    pub time: Vec<f64>,
    /// One row a contender.
    pub rows: Vec<Errors>,
}

/// Runs every contender through every run; errors are read at those of `horizons` [s] that a run reaches. `tick` is called
/// after each (contender, run).
///
/// # Errors
/// Whatever building a simulator returns.
pub fn closed_loop<E>(
    contenders: &[Contender<'_, E>],
    runs: &[Rollout],
    horizons: &[f64],
    tick: &dyn Fn(&str),
) -> Result<ClosedLoop, E> {
    let reached = |horizon: &f64| runs.iter().any(|run| sample_at(run, *horizon).is_some());
    let horizons: Vec<f64> = horizons.iter().copied().filter(reached).collect();
    let mut rows = Vec::new();
    for contender in contenders {
        let mut position = vec![Vec::new(); horizons.len()];
        let mut attitude = vec![Vec::new(); horizons.len()];
        let mut path = Vec::new();
        let mut diverged = 0;
        for (index, run) in runs.iter().enumerate() {
            let mut simulator = (contender.simulator)(run)?;
            let driven = drive(simulator.as_mut(), run, &contender.water, &mut |_, _| ());
            for (h, horizon) in horizons.iter().enumerate() {
                let Some(k) = sample_at(run, *horizon) else {
                    continue;
                };
                let (distance, angle) = pose_error(&driven[k], run.qpos.row(k));
                position[h].push(distance);
                attitude[h].push(angle);
            }
            diverged += usize::from(driven.iter().any(|pose| !pose[0].is_finite()));
            if index == 0 {
                path = driven.iter().map(base_position).collect();
            }
            tick(&contender.name);
        }
        rows.push(Errors {
            name: contender.name.clone(),
            position: position.iter().map(|v| Spread::of(v)).collect(),
            attitude: attitude.iter().map(|v| Spread::of(v)).collect(),
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

/// Drives a simulator through a run; returns its base pose (7 numbers) at every sample.
///
/// `watch` sees the simulator after every sample, and the water's wrench on the base in the last step.
pub fn drive(
    simulator: &mut dyn Simulator,
    run: &Rollout,
    water: &Water<'_>,
    watch: &mut dyn FnMut(&dyn Simulator, Wrench),
) -> Vec<[f64; 7]> {
    simulator.restart(run.qpos.row(0), run.qvel.row(0));
    let mut poses = vec![base_pose(simulator.qpos())];
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
                Water::OfTheScene => None,
                Water::Law(law) => Some(law(&base_twist(simulator), run.density)),
                Water::Truth(_) => truth
                    .as_mut()
                    .map(|truth| truth(simulator.qpos(), simulator.qvel())),
                Water::Replayed => {
                    let part = step as f64 / steps as f64;
                    Some(recorded_wrench(run, k, part))
                }
            };
            if let Some(wrench) = given {
                simulator.set_base_wrench(wrench);
            }
            simulator.step();
        }
        poses.push(if simulator.diverged() {
            [f64::NAN; 7]
        } else {
            base_pose(simulator.qpos())
        });
        watch(simulator, given.unwrap_or_else(|| simulator.water_wrench()));
    }
    poses
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

/// The sample at a time after the start, if the run is that long.
fn sample_at(run: &Rollout, horizon: f64) -> Option<usize> {
    run.time
        .iter()
        .position(|t| t - run.time[0] >= horizon - 1e-9)
}

fn base_pose(qpos: &[f64]) -> [f64; 7] {
    let mut pose = [0.0; 7];
    pose.copy_from_slice(&qpos[..7]);
    pose
}

fn base_position(qpos: &(impl AsRef<[f64]> + ?Sized)) -> [f64; 3] {
    let q = qpos.as_ref();
    [q[0], q[1], q[2]]
}

/// Distance [m] and angle [deg] between two base poses; infinite where one is not finite.
fn pose_error(pose: &[f64; 7], truth: &[f64]) -> (f64, f64) {
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::rollouts::Table;
    use crate::simulator::PointMass;
    use std::convert::Infallible;

    /// A 2 kg mass pulled by a constant 1 N along x in the water's wrench, from rest.
    fn run() -> Rollout {
        let samples = 201;
        let time: Vec<f64> = (0..samples).map(|k| k as f64 * 0.01).collect();
        let row = |t: &f64| vec![0.25 * t * t, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        let table = |values: Vec<f64>, columns| Table::new(values, columns).unwrap();
        Rollout {
            name: "pull".into(),
            density: 1000.0,
            qpos: table(time.iter().flat_map(row).collect(), 7),
            qvel: table(
                time.iter()
                    .flat_map(|t| [0.5 * t, 0.0, 0.0, 0.0, 0.0, 0.0])
                    .collect(),
                6,
            ),
            ctrl: table(vec![0.0; samples - 1], 1),
            push: table(vec![0.0; 6 * (samples - 1)], 6),
            x: table(vec![1000.0; samples], 1),
            wrench: table([1.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(samples), 6),
            hydrostatic: table(vec![0.0; 6 * samples], 6),
            time,
        }
    }

    fn contender<'a>(name: &str, water: Water<'a>) -> Contender<'a, Infallible> {
        Contender {
            name: name.into(),
            simulator: Box::new(|_| Ok(Box::new(PointMass::new(2.0, 0.002)))),
            water,
        }
    }

    #[test]
    fn a_replayed_wrench_follows_the_truth_and_no_water_falls_behind_as_computed() {
        let contenders = [
            contender("oracle", Water::Replayed),
            contender("none", Water::OfTheScene),
            contender(
                "half",
                Water::Law(Box::new(|_, density| {
                    Wrench::from_array([0.5 * density / 1000.0, 0.0, 0.0, 0.0, 0.0, 0.0])
                })),
            ),
        ];
        let result = closed_loop(&contenders, &[run()], &[1.0, 2.0, 4.0], &|_| ()).unwrap();
        assert_eq!(result.horizons, [1.0, 2.0], "the run lasts 2 s");
        assert!(result.rows[0].position[1].median < 1e-9);
        assert!((result.rows[1].position[0].median - 0.25).abs() < 1e-9);
        assert!((result.rows[1].position[1].median - 1.0).abs() < 1e-9);
        assert!((result.rows[2].position[1].median - 0.5).abs() < 1e-9);
        assert_eq!(result.rows[0].path.len(), 201);
    }

    #[test]
    fn a_quarter_turn_is_ninety_degrees_and_divergence_is_infinite() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (_, angle) = pose_error(
            &[0.0, 0.0, 0.0, half, half, 0.0, 0.0],
            &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        );
        assert!((angle - 90.0).abs() < 1e-9);
        let (distance, _) = pose_error(&[f64::NAN; 7], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(distance, f64::INFINITY);
    }

    #[test]
    fn spread_is_that_of_the_textbook() {
        let spread = Spread::of(&[1.0, 2.0, 3.0, 6.0]);
        assert_eq!((spread.median, spread.mean), (2.5, 3.0));
        assert!((spread.standard_error - (14.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-12);
    }
}
