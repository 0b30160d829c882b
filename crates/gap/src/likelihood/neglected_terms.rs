//! Terms that the plain form of an effect on a hull neglects, as changes along a track: off-diagonal elements of its
//! matrix, and what else its law names.

use hydro_effects::{Part, effect};
use nalgebra::{DMatrix, DVector, Vector6};

use crate::{
    likelihood::{
        step_changes::{Inputs, References, StateChanges},
        track::Rolled,
    },
    problem::{candidates::Candidate, problem::Problem},
};

/// The hull that a candidate is a wrench on, among the problem's.
fn hull(problem: &Problem<'_>, candidate: &Candidate) -> Option<usize> {
    let is_wrench = matches!(effect(candidate.effect).part(), Part::Body(_));
    let mut hulls = problem.hulls.iter();
    let hull = hulls.position(|hull| candidate.targets.contains(hull));
    hull.filter(|_| is_wrench)
}

/// Number of terms.
pub(crate) fn count(problem: &Problem<'_>, candidate: &Candidate) -> usize {
    hull(problem, candidate).map_or(0, |_| {
        let values = vec![0.0; candidate.parameters.len()];
        let terms = effect(candidate.effect).neglected_terms(&values, &[0.0; 6], &[0.0; 6]);
        terms.len()
    })
}

/// Changes with each term, `relative` of its usual size, at a candidate's `values`.
pub(crate) fn inputs(
    problem: &Problem<'_>,
    (rolled, references): (&[Rolled], &References),
    (states, scale): (&[StateChanges], &DVector<f64>),
    (candidate, values, relative): (&Candidate, &[f64], f64),
) -> Vec<Option<Inputs>> {
    let Some(hull) = hull(problem, candidate) else {
        return Vec::new();
    };
    let nv = problem.model.nv;
    let channels = problem.channels.len();
    let law = effect(candidate.effect);
    let count = count(problem, candidate);
    let mut made: Vec<Inputs> = (0..count).map(|_| Inputs(Vec::new())).collect();
    for ((rolled, stepped), state) in rolled.iter().zip(references).zip(states) {
        let boundaries = rolled.boundaries.len();
        for Inputs(of) in &mut made {
            of.push((
                DMatrix::zeros(2 * nv, boundaries),
                DMatrix::zeros(channels, boundaries),
            ));
        }
        // Components along axes that turn with the hull.
        let velocity = |at: usize| -> Vector6<f64> {
            let product = &state.hulls[hull][at] * DVector::from_column_slice(&stepped[at][0].qvel);
            Vector6::from_column_slice(product.as_slice())
        };
        for at in 0..boundaries {
            // The last boundary has the acceleration of the one before.
            let from = at.min(boundaries.saturating_sub(2));
            let to = (from + 1).min(boundaries - 1);
            let steps = rolled.boundaries[to].step - rolled.boundaries[from].step;
            let seconds = steps.max(1) as f64 * problem.model.timestep;
            let change = (velocity(to) - velocity(from)) / seconds;
            let wrenches = law.neglected_terms(values, &velocity(at).into(), &change.into());
            for (Inputs(of), wrench) in made.iter_mut().zip(wrenches) {
                let Some((tangents, direct)) = of.last_mut() else {
                    continue;
                };
                let force = state.hulls[hull][at].tr_mul(&Vector6::from(wrench));
                for (axis, value) in force.iter().enumerate() {
                    let size = relative * value / scale[axis];
                    add(tangents, at, &state.force[at], axis, size);
                    add(direct, at, &state.direct[at], axis, size);
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
