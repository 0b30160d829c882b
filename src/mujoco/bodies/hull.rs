//! The robot's hull: which geoms it is made of, and how much of it is under water.

use hydro_frames::Wrench;

use crate::{
    mujoco::ffi::{
        DataView, ModelView,
        bindings::{mjGEOM_BOX, mjGEOM_CAPSULE, mjGEOM_CYLINDER, mjGEOM_ELLIPSOID, mjGEOM_SPHERE},
    },
    plugin::{native_fluid::EllipsoidCoefficients, waterline},
};

/// A wrench of a fully submerged robot, less what is lost above the surface.
pub(crate) fn below_surface(
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

/// Certainty that a geom is part of the hull. Only the most certain of a robot count: looks lie over the hull, and
/// would be counted twice.
pub(crate) fn part_of_hull(model: ModelView<'_>, geom: usize) -> waterline::PartOfHull {
    waterline::PartOfHull::from_geom(
        model.geom_fluid()[EllipsoidCoefficients::LEN * geom],
        model.geom_group()[geom],
    )
}

pub(crate) fn shape(code: i32) -> waterline::Shape {
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
