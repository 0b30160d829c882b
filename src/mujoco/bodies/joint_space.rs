//! A wrench on a body, in joint space: `qfrc += J^T w`.

use hydro_frames as frames;
use hydro_frames::Wrench;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::{
    mujoco::ffi::{DataView, ModelView},
    plugin::Base,
};

/// A rotation of MuJoCo's (nine numbers by rows).
pub(crate) fn rotation(matrices: &[f64], row: usize) -> Matrix3<f64> {
    Matrix3::from_row_slice(&matrices[9 * row..9 * row + 9])
}

/// A point or vector of MuJoCo's.
pub(crate) fn vector(values: &[f64], row: usize) -> Vector3<f64> {
    Vector3::from(ModelView::triple(values, row))
}

/// A pose of MuJoCo's.
pub(crate) fn pose(position: [f64; 3], wxyz: [f64; 4]) -> Isometry3<f64> {
    let rotation: UnitQuaternion<f64> = frames::world_from_base(wxyz);
    Isometry3::from_parts(Translation3::from(Vector3::from(position)), rotation)
}

/// Adds a base-frame wrench about the body's origin to `qfrc_passive`.
pub(crate) fn add_to_passive(data: &mut DataView<'_>, body: usize, base: &Base, wrench: Wrench) {
    if let Base::Free { dof, .. } = base {
        // A free joint's forces: world at the origin, then base-frame torque.
        let force = frames::to_world(base.world_from_base(data.qpos()), wrench.force);
        let passive = &mut data.qfrc_passive_mut()[*dof..*dof + 6];
        for (sum, value) in passive
            .iter_mut()
            .zip(force.into_iter().chain(wrench.torque))
        {
            *sum += value;
        }
        return;
    }
    let model = data.model();
    let attitude = ModelView::quadruple(data.xquat(), body);
    let force = Vector3::from(frames::to_world(attitude, wrench.force));
    let root = model.body_rootid()[body] as usize;
    let arm = vector(data.xpos(), body) - vector(data.subtree_com(), root);
    let torque = Vector3::from(frames::to_world(attitude, wrench.torque)) + arm.cross(&force);
    // Every degree of freedom between the body and the world; motion axes are (rotation, translation)
    // about the centre of mass of the tree.
    let mut dof = last_dof(model, body);
    while let Ok(at) = usize::try_from(dof) {
        let axis = &data.cdof()[6 * at..6 * at + 6];
        let power = Vector3::new(axis[0], axis[1], axis[2]).dot(&torque)
            + Vector3::new(axis[3], axis[4], axis[5]).dot(&force);
        data.qfrc_passive_mut()[at] += power;
        dof = model.dof_parentid()[at];
    }
}

/// Adds torques on degrees of freedom to `qfrc_passive`.
pub(crate) fn add_torques(data: &mut DataView<'_>, torques: &[(usize, f64)]) {
    for (dof, torque) in torques {
        data.qfrc_passive_mut()[*dof] += torque;
    }
}

/// The last degree of freedom of a body or of the nearest ancestor that has one; -1: none.
pub(crate) fn last_dof(model: ModelView<'_>, mut body: usize) -> i32 {
    while body != 0 && model.body_dofnum()[body] == 0 {
        body = model.body_parentid()[body] as usize;
    }
    if body == 0 {
        return -1;
    }
    model.body_dofadr()[body] + model.body_dofnum()[body] - 1
}
