//! The error of a form's direction: what each parameter of an effect on the base contributes along its own axis may act in
//! part along the five others, as the off-diagonal terms of a coupling matrix do (T. I. Fossen, Handbook of Marine Craft
//! Hydrodynamics and Motion Control, 2nd ed., Wiley 2021, sections 6.3 and 6.4).

use hydro_effects::{Part, effect};
use hydro_frames::world_from_base;
use nalgebra::{DMatrix, DVector, Matrix6};

use crate::{
    likelihood::{
        step_changes::{Inputs, StateChanges},
        track::Track,
    },
    problem::{candidates::Candidate, problem::Problem},
};

/// Axes of a base's wrench.
const AXES: usize = 6;

/// Columns of one parameter: the other axes.
pub(crate) const COUNT: usize = AXES - 1;

/// True for a candidate whose parts may act along other axes: a wrench on the body that swims free.
pub(crate) fn applies(problem: &Problem<'_>, candidate: &Candidate) -> bool {
    let on_base = |body: &str| candidate.targets.iter().any(|target| target == body);
    matches!(effect(candidate.effect).part(), Part::Body(_))
        && (problem.model.base.as_ref()).is_some_and(|base| on_base(&base.body))
}

/// Changes with what a parameter contributes along its main axis, turned to each of the others, `relative` of it there.
///
/// `of`: changes with the parameter; `states`: with forces of size `scale` on every degree of freedom.
pub(crate) fn along_others(
    problem: &Problem<'_>,
    track: &Track,
    of: &Inputs,
    states: &[StateChanges],
    scale: &DVector<f64>,
    relative: f64,
) -> Option<Vec<Inputs>> {
    let base = problem.model.base.as_ref()?;
    let nv = problem.model.nv;
    // By segment and boundary: the contribution by axis of the base, in what moves it.
    let mut sizes = [0.0; AXES];
    let mut contributions = Vec::with_capacity(of.0.len());
    let mut frames = Vec::with_capacity(of.0.len());
    for (((changed, _), state), link) in of.0.iter().zip(states).zip(&track.links) {
        let q = &link.segment.qpos[base.qpos + 3..base.qpos + 7];
        let frame = base_forces(scale, base.dof, [q[0], q[1], q[2], q[3]]);
        let inverse = frame.try_inverse()?;
        let by_boundary: Vec<[f64; AXES]> = (0..changed.ncols())
            .map(|boundary| {
                let velocity =
                    DVector::from_fn(nv, |row, _| f64::from(changed[(nv + row, boundary)]));
                let response = state.force[boundary].rows(nv, nv).into_owned();
                let forces = response
                    .lu()
                    .solve(&velocity)
                    .unwrap_or_else(|| DVector::zeros(nv));
                let of_base = inverse * forces.fixed_rows::<AXES>(base.dof);
                for (size, value) in sizes.iter_mut().zip(of_base.iter()) {
                    *size += value * value;
                }
                of_base.into()
            })
            .collect();
        contributions.push(by_boundary);
        frames.push(frame);
    }
    let main = (0..AXES).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]))?;
    let others = (0..AXES).filter(|axis| *axis != main);
    let turned = others.map(|axis| {
        let links =
            (contributions.iter().zip(&frames).zip(states)).map(|((by_boundary, frame), state)| {
                let columns = by_boundary.len();
                let channels = state.direct.first().map_or(0, DMatrix::nrows);
                let mut tangents = DMatrix::<f32>::zeros(2 * nv, columns);
                let mut direct = DMatrix::<f32>::zeros(channels, columns);
                for (boundary, contribution) in by_boundary.iter().enumerate() {
                    let size = relative * contribution[main];
                    let forces = frame.column(axis) * size;
                    let put = |to: &mut DMatrix<f32>, response: &DMatrix<f64>| {
                        let change = response.columns(base.dof, AXES) * forces;
                        for (row, value) in change.iter().enumerate() {
                            to[(row, boundary)] = *value as f32;
                        }
                    };
                    put(&mut tangents, &state.force[boundary]);
                    put(&mut direct, &state.direct[boundary]);
                }
                (tangents, direct)
            });
        Inputs(links.collect())
    });
    Some(turned.collect())
}

/// Forces on the base's degrees of freedom, in their scales, of a unit along each of its own axes: translations are the
/// world's there, and their scales one.
fn base_forces(scale: &DVector<f64>, dof: usize, attitude: [f64; 4]) -> Matrix6<f64> {
    let rotation = world_from_base(attitude).to_rotation_matrix();
    let translation = (scale.rows(dof, 3).norm_squared() / 3.0).sqrt();
    let mut forces = Matrix6::identity();
    for row in 0..3 {
        for column in 0..3 {
            forces[(row, column)] = rotation[(row, column)] * translation / scale[dof + row];
        }
    }
    forces
}
