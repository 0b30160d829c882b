//! Walls that stand still: planes and boxes of the world.

use hydro_gap::plant::wall::{self, way_out};
use nalgebra::{Isometry3, Rotation3, Vector3};

use crate::{
    mujoco::{
        bodies::joint_space::{rotation, vector},
        ffi::{
            DataView, ModelView,
            bindings::{mjGEOM_BOX, mjGEOM_PLANE},
        },
    },
    plugin::bound::{Wall, WallShape},
};

/// Opacity below which a geom that touches nothing is taken for a drawing of the water's surface.
const OPAQUE: f32 = 1.0;

/// Planes and boxes on bodies that never move. A translucent one that collides with nothing is no wall.
pub(crate) fn find(model: ModelView<'_>) -> Vec<Wall> {
    let stands = |geom: &usize| {
        let body = model.geom_bodyid()[*geom] as usize;
        model.body_weldid()[body] == 0 && model.body_mocapid()[body] < 0
    };
    let solid = |geom: &usize| {
        model.geom_contype()[*geom] != 0
            || model.geom_conaffinity()[*geom] != 0
            || model.geom_rgba()[4 * geom + 3] >= OPAQUE
    };
    (0..model.geom_type().len())
        .filter(|geom| stands(geom) && solid(geom))
        .filter_map(|geom| match model.geom_type()[geom] as u32 {
            kind if kind == mjGEOM_PLANE => Some((geom, WallShape::Plane)),
            kind if kind == mjGEOM_BOX => Some((geom, WallShape::Box)),
            _ => None,
        })
        .collect()
}

/// The walls with their present places, for a description.
pub(crate) fn standing(data: &DataView<'_>) -> Vec<wall::Wall> {
    let walls = find(data.model()).into_iter();
    walls
        .map(|(geom, shape)| {
            let turn = Rotation3::from_matrix_unchecked(rotation(data.geom_xmat(), geom));
            wall::Wall {
                place: Isometry3::from_parts(vector(data.geom_xpos(), geom).into(), turn.into()),
                half: half(data, geom, shape),
            }
        })
        .collect()
}

/// Half the sizes of a box [m].
fn half(data: &DataView<'_>, geom: usize, shape: WallShape) -> Option<Vector3<f64>> {
    match shape {
        WallShape::Plane => None,
        WallShape::Box => Some(vector(data.model().geom_size(), geom)),
    }
}

/// Distance [m] of a point to the nearest wall, and that wall's unit normal in the world, towards the
/// point.
pub(crate) fn nearest(
    data: &DataView<'_>,
    walls: &[Wall],
    point: Vector3<f64>,
) -> Option<(f64, [f64; 3])> {
    let mut nearest: Option<(f64, Vector3<f64>)> = None;
    for (geom, shape) in walls {
        let frame = rotation(data.geom_xmat(), *geom);
        let from_wall = frame.tr_mul(&(point - vector(data.geom_xpos(), *geom)));
        let (distance, normal) = way_out(from_wall, half(data, *geom, *shape));
        if nearest.is_none_or(|(known, _)| distance < known) {
            nearest = Some((distance, frame * normal));
        }
    }
    nearest.map(|(distance, normal)| (distance, normal.into()))
}
