//! Terms that the plain form of an effect on the base neglects, as changes along a track: off-diagonal elements of its
//! matrix, and what else its law names.

use hydro_effects::{Part, effect};
use hydro_frames::world_from_base;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::{
    likelihood::{
        step_changes::{Inputs, References, StateChanges},
        track::{Rolled, Track},
    },
    plant::FreeBase,
    problem::{candidates::Candidate, problem::Problem},
};

/// The base, where a candidate is a wrench on it.
fn base<'p>(problem: &'p Problem<'_>, candidate: &Candidate) -> Option<&'p FreeBase> {
    let base = problem.model.base.as_ref()?;
    let acts_on_it = candidate.targets.contains(&base.body);
    (matches!(effect(candidate.effect).part(), Part::Body(_)) && acts_on_it).then_some(base)
}

/// Number of terms.
pub(crate) fn count(problem: &Problem<'_>, candidate: &Candidate) -> usize {
    base(problem, candidate).map_or(0, |_| {
        let values = vec![0.0; candidate.parameters.len()];
        let terms = effect(candidate.effect).neglected_terms(&values, &[0.0; 6], &[0.0; 6]);
        terms.len()
    })
}

/// Changes with each term, `relative` of its usual size, at a candidate's `values`.
pub(crate) fn inputs(
    problem: &Problem<'_>,
    (track, rolled, references): (&Track, &[Rolled], &References),
    (states, scale): (&[StateChanges], &DVector<f64>),
    (candidate, values, relative): (&Candidate, &[f64], f64),
) -> Vec<Option<Inputs>> {
    let Some(base) = base(problem, candidate) else {
        return Vec::new();
    };
    let (nv, dof) = (problem.model.nv, base.dof);
    let channels = problem.channels.len();
    let law = effect(candidate.effect);
    let count = count(problem, candidate);
    let mut made: Vec<Inputs> = (0..count).map(|_| Inputs(Vec::new())).collect();
    let segments = track.links.iter().zip(rolled).zip(references).zip(states);
    for (((link, rolled), stepped), state) in segments {
        let q = &link.segment.qpos[base.qpos + 3..base.qpos + 7];
        let attitude = world_from_base([q[0], q[1], q[2], q[3]]);
        let boundaries = rolled.boundaries.len();
        for Inputs(of) in &mut made {
            of.push((
                DMatrix::zeros(2 * nv, boundaries),
                DMatrix::zeros(channels, boundaries),
            ));
        }
        for at in 0..boundaries {
            // The last boundary has the acceleration of the one before.
            let from = at.min(boundaries.saturating_sub(2));
            let to = (from + 1).min(boundaries - 1);
            let steps = rolled.boundaries[to].step - rolled.boundaries[from].step;
            let seconds = steps.max(1) as f64 * problem.model.timestep;
            let velocity = &stepped[at][0].qvel[dof..dof + 6];
            let (before, after) = (&stepped[from][0].qvel, &stepped[to][0].qvel);
            let change = |axis: usize| (after[dof + axis] - before[dof + axis]) / seconds;
            let linear =
                attitude.inverse_transform_vector(&Vector3::from_column_slice(&velocity[..3]));
            let angular = Vector3::from_column_slice(&velocity[3..]);
            let in_world = Vector3::new(change(0), change(1), change(2));
            // Components along axes that turn.
            let acceleration =
                attitude.inverse_transform_vector(&in_world) - angular.cross(&linear);
            let nu = [
                linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
            ];
            let nu_dot = [
                acceleration.x,
                acceleration.y,
                acceleration.z,
                change(3),
                change(4),
                change(5),
            ];
            let wrenches = law.neglected_terms(values, &nu, &nu_dot);
            for (Inputs(of), wrench) in made.iter_mut().zip(wrenches) {
                let force = attitude * Vector3::from_column_slice(&wrench[..3]);
                let force = [force.x, force.y, force.z, wrench[3], wrench[4], wrench[5]];
                let Some((tangents, direct)) = of.last_mut() else {
                    continue;
                };
                for (axis, value) in force.iter().enumerate() {
                    let size = relative * value / scale[dof + axis];
                    add(tangents, at, &state.force[at], dof + axis, size);
                    add(direct, at, &state.direct[at], dof + axis, size);
                }
            }
        }
    }
    made.into_iter().map(Some).collect()
}

/// Adds a multiple of a response's column to a boundary's.
fn add(to: &mut DMatrix<f32>, at: usize, response: &DMatrix<f64>, column: usize, size: f64) {
    for (value, part) in to
        .column_mut(at)
        .iter_mut()
        .zip(response.column(column).iter())
    {
        *value += (size * part) as f32;
    }
}
