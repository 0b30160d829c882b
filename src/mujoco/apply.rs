//! A wrench on a body, in joint space: `qfrc += J^T w`.

use hydro_frames as frames;
use hydro_frames::Wrench;
#[cfg(mujoco_plugins)]
use nalgebra::Matrix3;
use nalgebra::Vector3;

use super::views::{DataView, ModelView};
use crate::plugin::{Base, native_fluid::EllipsoidCoefficients, waterline};

/// A rotation of MuJoCo's (nine numbers by rows).
#[cfg(mujoco_plugins)]
pub(super) fn rotation(matrices: &[f64], row: usize) -> Matrix3<f64> {
    Matrix3::from_row_slice(&matrices[9 * row..9 * row + 9])
}

/// A point or vector of MuJoCo's.
pub(super) fn vector(values: &[f64], row: usize) -> Vector3<f64> {
    Vector3::from(ModelView::triple(values, row))
}

/// Adds a base-frame wrench about the body's origin to `qfrc_passive`.
pub(super) fn add_to_passive(data: &mut DataView<'_>, body: usize, base: &Base, wrench: Wrench) {
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

/// The last degree of freedom of a body or of the nearest ancestor that has one; -1: none.
pub(super) fn last_dof(model: ModelView<'_>, mut body: usize) -> i32 {
    while body != 0 && model.body_dofnum()[body] == 0 {
        body = model.body_parentid()[body] as usize;
    }
    if body == 0 {
        return -1;
    }
    model.body_dofadr()[body] + model.body_dofnum()[body] - 1
}

/// A wrench of a fully submerged robot, less what is lost above the surface.
pub(super) fn below_surface(
    data: &DataView<'_>,
    body: usize,
    waterline: Option<f64>,
    mut wrench: Wrench,
) -> Wrench {
    if let Some(waterline) = waterline {
        let part = submerged_fraction(data, body, waterline);
        wrench
            .force
            .iter_mut()
            .chain(&mut wrench.torque)
            .for_each(|component| *component *= part);
    }
    wrench
}

/// Submerged part (0..=1) of the hull of the bodies below and at `body`.
fn submerged_fraction(data: &DataView<'_>, body: usize, waterline: f64) -> f64 {
    let model = data.model();
    let geoms = || {
        (body..model.bodies())
            .filter(|link| model.hangs_below(*link, body))
            .flat_map(|link| {
                let first = model.body_geomadr()[link].max(0) as usize;
                first..first + model.body_geomnum()[link] as usize
            })
    };
    let hull = geoms().map(|geom| part_of_hull(model, geom)).max();
    let lumps = geoms()
        .filter(|geom| Some(part_of_hull(model, *geom)) == hull)
        .map(|geom| {
            let size = ModelView::triple(model.geom_size(), geom);
            let radius = model.geom_rbound()[geom];
            waterline::Lump {
                height: data.geom_xpos()[3 * geom + 2],
                radius,
                volume: waterline::volume(shape(model.geom_type()[geom]), size, radius),
            }
        });
    waterline::submerged_fraction(waterline, lumps)
}

/// How surely a geom is part of the hull. Only the surest of a robot count: looks lie over the hull, and
/// would be counted twice.
pub(super) fn part_of_hull(model: ModelView<'_>, geom: usize) -> waterline::PartOfHull {
    waterline::PartOfHull::of(
        model.geom_fluid()[EllipsoidCoefficients::LEN * geom],
        model.geom_group()[geom],
    )
}

pub(super) fn shape(code: i32) -> waterline::Shape {
    use super::bindings::{
        mjGEOM_BOX, mjGEOM_CAPSULE, mjGEOM_CYLINDER, mjGEOM_ELLIPSOID, mjGEOM_SPHERE,
    };
    use waterline::Shape;
    const SHAPES: [(u32, Shape); 5] = [
        (mjGEOM_SPHERE, Shape::Sphere),
        (mjGEOM_CAPSULE, Shape::Capsule),
        (mjGEOM_ELLIPSOID, Shape::Ellipsoid),
        (mjGEOM_CYLINDER, Shape::Cylinder),
        (mjGEOM_BOX, Shape::Box),
    ];
    SHAPES
        .iter()
        .find(|(known, _)| *known == code as u32)
        .map_or(Shape::Other, |(_, shape)| *shape)
}
