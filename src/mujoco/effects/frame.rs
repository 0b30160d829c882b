//! A body's frame in motion, and how its degrees of freedom move it.

use nalgebra::{Matrix3, Vector3, Vector6};
use smallvec::SmallVec;

use crate::{
    mujoco::{
        bodies::joint_space::{rotation, vector},
        ffi::DataView,
    },
    plugin::bound::WetBody,
};

/// The six columns of a free body are kept in the frame, without an allocation a step.
type Columns = SmallVec<[Vector6<f64>; 6]>;

/// A body's frame in motion.
pub(super) struct Frame {
    pub(super) rotation: Matrix3<f64>,
    /// Velocity of the body [6] by each of its degrees of freedom, body frame: linear, angular.
    pub(super) columns: Columns,
    pub(super) origin: Vector3<f64>,
    /// Origin from the point that MuJoCo's spatial vectors are about.
    pub(super) arm: Vector3<f64>,
}

impl Frame {
    pub(super) fn new(data: &DataView<'_>, wet: &WetBody) -> Self {
        let rotation = rotation(data.xmat(), wet.body);
        let root = data.model().body_rootid()[wet.body] as usize;
        let origin = vector(data.xpos(), wet.body);
        let arm = origin - vector(data.subtree_com(), root);
        let columns = wet
            .dofs
            .iter()
            .map(|dof| to_body(&rotation, arm, &data.cdof()[6 * dof..6 * dof + 6]))
            .collect();
        Self {
            rotation,
            columns,
            origin,
            arm,
        }
    }

    /// J x [6].
    pub(super) fn along(&self, wet: &WetBody, x: &[f64]) -> Vector6<f64> {
        self.columns
            .iter()
            .zip(&wet.dofs)
            .fold(Vector6::zeros(), |sum, (column, dof)| {
                sum + column * x[*dof]
            })
    }
}

/// A spatial vector of MuJoCo's (rotation, translation about the tree's centre of mass, world) as linear
/// and angular part at the body's origin, body frame.
pub(super) fn to_body(rotation: &Matrix3<f64>, arm: Vector3<f64>, spatial: &[f64]) -> Vector6<f64> {
    let angular = Vector3::new(spatial[0], spatial[1], spatial[2]);
    let linear = Vector3::new(spatial[3], spatial[4], spatial[5]) + angular.cross(&arm);
    let (linear, angular) = (rotation.tr_mul(&linear), rotation.tr_mul(&angular));
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}
