//! What one step from every boundary gives: changes of the next state and of the readings.

use hydro_effects::Entry;
use nalgebra::{DMatrix, DVector};

use crate::{
    error::GapError,
    likelihood::{
        changes::{Change, Kind},
        memories::Memories,
        track::{Boundary, Grid, Link, Rolled, Track},
    },
    plant::Simulation,
    problem::problem::Problem,
};

/// Steps of the difference quotients of states: positions [m or rad], velocities.
const STATE_STEP: [f64; 2] = [1e-6, 1e-6];
/// Step of the difference quotients of forces, as a part of what accelerates a degree of freedom by 1 m/s^2 or rad/s^2.
const FORCE_STEP: f64 = 1e-3;

/// Changes at the boundaries of one segment with the state and with forces, a step each.
pub(crate) struct StateChanges {
    /// The state after a step with the state before it, by boundary [2 nv, 2 nv].
    pub(crate) transition: Vec<DMatrix<f64>>,
    /// ... with the forces, each times its scale [2 nv, nv].
    pub(crate) force: Vec<DMatrix<f64>>,
    /// The channels with the state [channels, 2 nv].
    pub(crate) reading: Vec<DMatrix<f64>>,
    /// ... with the forces [channels, nv].
    pub(crate) direct: Vec<DMatrix<f64>>,
    /// Jacobians of the hulls, hull by hull [6, nv], in their own frames.
    pub(crate) hulls: Vec<Vec<DMatrix<f64>>>,
}

impl StateChanges {
    fn all(&mut self) -> impl Iterator<Item = &mut Vec<DMatrix<f64>>> {
        let changes = [
            &mut self.transition,
            &mut self.force,
            &mut self.reading,
            &mut self.direct,
        ];
        changes.into_iter().chain(&mut self.hulls)
    }
}

/// What a step from a boundary gives: state and readings.
pub(crate) struct Stepped {
    pub(crate) qpos: Vec<f64>,
    pub(crate) qvel: Vec<f64>,
    pub(crate) readings: Vec<f64>,
}

pub(crate) fn stepped(simulation: &mut dyn Simulation, at: &Boundary) -> Stepped {
    stepped_under(simulation, at, &at.force)
}

/// A step without unmodelled forces. Changes with parameters are taken of such steps, for what stays as it is while an inertia
/// changes is the acceleration that nobody modelled, not its force (`force_scale.rs`).
fn stepped_unforced(simulation: &mut dyn Simulation, at: &Boundary) -> Stepped {
    stepped_under(simulation, at, &vec![0.0; at.force.len()])
}

fn stepped_under(simulation: &mut dyn Simulation, at: &Boundary, force: &[f64]) -> Stepped {
    simulation.set_force(force);
    simulation.set_earlier_control(&at.earlier);
    simulation.set_control(&at.control);
    simulation.step();
    Stepped {
        qpos: simulation.qpos().to_vec(),
        qvel: simulation.qvel().to_vec(),
        readings: simulation.sensors().to_vec(),
    }
}

/// Differences of two steps over a step of something: tangent [2 nv] and channels.
pub(crate) fn difference(
    problem: &Problem<'_>,
    simulation: &dyn Simulation,
    from: &Stepped,
    to: &Stepped,
    step: f64,
    tangent: &mut [f64],
    channels: &mut [f64],
) {
    let nv = problem.model.nv;
    simulation.differentiate(&from.qpos, &to.qpos, &mut tangent[..nv]);
    for ((value, a), b) in tangent[nv..].iter_mut().zip(&from.qvel).zip(&to.qvel) {
        *value = b - a;
    }
    problem
        .channels
        .residual(&to.readings, &from.readings, channels);
    for value in tangent.iter_mut().chain(channels) {
        *value = if value.is_finite() {
            *value / step
        } else {
            0.0
        };
    }
}

pub(crate) fn state_changes(
    problem: &Problem<'_>,
    simulation: &mut dyn Simulation,
    rolled: &[Rolled],
    (track, grid): (&Track, Grid),
    force_scale: &DVector<f64>,
) -> Vec<StateChanges> {
    let (nv, channels) = (problem.model.nv, problem.channels.len());
    let (mut tangent, mut reading) = (vec![0.0; 2 * nv], vec![0.0; channels]);
    let steady = problem.trials[track.trial].steady;
    let mut all: Vec<StateChanges> = rolled
        .iter()
        .zip(&track.links)
        .enumerate()
        .map(|(number, (of, link))| {
            let boundaries = of.boundaries.len();
            let unknown = || vec![DMatrix::zeros(0, 0); boundaries];
            let mut found = StateChanges {
                transition: unknown(),
                force: unknown(),
                reading: unknown(),
                direct: unknown(),
                hulls: problem.hulls.iter().map(|_| unknown()).collect(),
            };
            for (at, boundary) in of.boundaries.iter().enumerate() {
                let is_next_start = track.end_is_next_start(number, at, boundaries, steady);
                if !link.is_looked_at(grid, at) || is_next_start {
                    continue;
                }
                simulation.load(&boundary.saved);
                for (jacobians, hull) in found.hulls.iter_mut().zip(&problem.hulls) {
                    jacobians[at] = simulation.body_jacobian(hull);
                }
                simulation.load(&boundary.saved);
                let from = stepped(simulation, boundary);
                let mut transition = DMatrix::zeros(2 * nv, 2 * nv);
                let mut outputs = DMatrix::zeros(channels, 2 * nv);
                for axis in 0..2 * nv {
                    let step = STATE_STEP[axis / nv];
                    let mut moved = vec![0.0; 2 * nv];
                    moved[axis] = step;
                    simulation.load(&boundary.saved);
                    simulation.retract(&moved);
                    let to = stepped(simulation, boundary);
                    difference(
                        problem,
                        simulation,
                        &from,
                        &to,
                        step,
                        &mut tangent,
                        &mut reading,
                    );
                    transition.set_column(axis, &DVector::from_column_slice(&tangent));
                    outputs.set_column(axis, &DVector::from_column_slice(&reading));
                }
                let mut force = DMatrix::zeros(2 * nv, nv);
                let mut direct = DMatrix::zeros(channels, nv);
                for axis in 0..nv {
                    let mut pushed = boundary.force.clone();
                    pushed[axis] += FORCE_STEP * force_scale[axis];
                    simulation.load(&boundary.saved);
                    let to = stepped_under(simulation, boundary, &pushed);
                    difference(
                        problem,
                        simulation,
                        &from,
                        &to,
                        FORCE_STEP,
                        &mut tangent,
                        &mut reading,
                    );
                    force.set_column(axis, &DVector::from_column_slice(&tangent));
                    direct.set_column(axis, &DVector::from_column_slice(&reading));
                }
                found.transition[at] = transition;
                found.force[at] = force;
                found.reading[at] = outputs;
                found.direct[at] = direct;
            }
            found
        })
        .collect();
    for number in 0..all.len() {
        let (these, nexts) = all.split_at_mut(number + 1);
        let of = &mut these[number];
        let last = of.transition.len() - 1;
        let next = nexts.first_mut().filter(|_| !steady);
        if let Some(next) = next {
            for (own, next) in of.all().zip(next.all()) {
                own[last].clone_from(&next[0]);
            }
        }
        between(
            &track.links[number],
            grid,
            last + 1,
            |at, [from, to], part| {
                for all in of.all() {
                    all[at] = all[from].zip_map(&all[to], |a, b| a + part * (b - a));
                }
            },
        );
    }
    all
}

/// Goes through the boundaries at which most changes are not taken, with the two about each at which they are, and its part of
/// the way between them.
fn between(
    link: &Link,
    grid: Grid,
    boundaries: usize,
    mut put: impl FnMut(usize, [usize; 2], f64),
) {
    let places: Vec<usize> = (0..boundaries)
        .filter(|at| link.is_looked_at(grid, *at))
        .collect();
    for pair in places.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        for at in from + 1..to {
            put(at, [from, to], (at - from) as f64 / (to - from) as f64);
        }
    }
}

/// Changes at all boundaries of a track with one parameter, by segment: after a step [2 nv, boundaries], and of the
/// channels [channels, boundaries].
pub(crate) struct Inputs(pub(crate) Vec<(DMatrix<f32>, DMatrix<f32>)>);

/// Steps of the base from all boundaries: as loaded, and as joined.
pub(crate) type References = Vec<Vec<[Stepped; 2]>>;

pub(crate) fn references(simulation: &mut dyn Simulation, rolled: &[Rolled]) -> References {
    let mut of = |boundary: &Boundary| {
        simulation.load(&boundary.saved);
        let loaded = stepped_unforced(simulation, boundary);
        simulation.rejoin(&boundary.full);
        simulation.set_memory(&boundary.memory);
        [loaded, stepped_unforced(simulation, boundary)]
    };
    rolled
        .iter()
        .map(|rolled| rolled.boundaries.iter().map(&mut of).collect())
        .collect()
}

/// Gives the last boundary of every segment the changes of the next one's first: the same time, and almost the same state.
pub(crate) fn end_at_next_starts(segments: &mut [(DMatrix<f32>, DMatrix<f32>)]) {
    for number in 1..segments.len() {
        let (before, after) = segments.split_at_mut(number);
        let ((states, direct), next) = (&mut before[number - 1], &after[0]);
        let last = states.ncols() - 1;
        states.set_column(last, &next.0.column(0));
        direct.set_column(last, &next.1.column(0));
    }
}

pub(crate) fn inputs(
    problem: &Problem<'_>,
    track: &Track,
    rolled: &[Rolled],
    references: &References,
    grid: Grid,
    (change, memories): (&Change, Option<&Memories>),
    base: (&[f64], &[Entry]),
) -> Result<Option<Inputs>, GapError> {
    if change.kind == Kind::Measurement {
        return Ok(None);
    }
    let (nv, channels) = (problem.model.nv, problem.channels.len());
    let mut simulation = change.simulation(problem, track.trial, base)?;
    let trial = &problem.trials[track.trial];
    let (mut tangent, mut reading) = (vec![0.0; 2 * nv], vec![0.0; channels]);
    let mut found: Vec<(DMatrix<f32>, DMatrix<f32>)> = rolled
        .iter()
        .zip(&track.links)
        .zip(references)
        .enumerate()
        .map(|(number, ((of, link), references))| {
            let boundaries = of.boundaries.len();
            let mut states = DMatrix::zeros(2 * nv, of.boundaries.len());
            let mut direct = DMatrix::zeros(channels, of.boundaries.len());
            for (at, boundary) in of.boundaries.iter().enumerate() {
                let is_next_start = track.end_is_next_start(number, at, boundaries, trial.steady);
                if is_next_start || !(change.fine || link.is_looked_at(grid, at)) {
                    continue;
                }
                let [loaded, joined] = &references[at];
                let from = if change.kind == Kind::Loaded {
                    simulation.load(&boundary.saved);
                    loaded
                } else {
                    let own = memories.map(|of| of[number].get(at));
                    match own {
                        // Nothing is left of what came before the log.
                        Some(None) => continue,
                        Some(Some(own)) => {
                            simulation.rejoin(&own.state(&boundary.full));
                            simulation.set_memory(&own.of_effects);
                        }
                        None => {
                            simulation.rejoin(&boundary.full);
                            simulation.set_memory(&boundary.memory);
                        }
                    }
                    joined
                };
                let to = stepped_unforced(simulation.as_mut(), boundary);
                difference(
                    problem,
                    simulation.as_ref(),
                    from,
                    &to,
                    change.step,
                    &mut tangent,
                    &mut reading,
                );
                for (row, value) in tangent.iter().enumerate() {
                    states[(row, at)] = *value as f32;
                }
                for (row, value) in reading.iter().enumerate() {
                    direct[(row, at)] = *value as f32;
                }
            }
            (states, direct)
        })
        .collect();
    if !trial.steady {
        end_at_next_starts(&mut found);
    }
    for ((states, direct), link) in found.iter_mut().zip(&track.links) {
        if change.fine {
            continue;
        }
        between(link, grid, states.ncols(), |at, [from, to], part| {
            let part = part as f32;
            for all in [&mut *states, &mut *direct] {
                let column = all.column(from) * (1.0 - part) + all.column(to) * part;
                all.set_column(at, &column);
            }
        });
    }
    Ok(Some(Inputs(found)))
}
