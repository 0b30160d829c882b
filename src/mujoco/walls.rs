//! Walls that stand still: planes and boxes of the world.

use nalgebra::{Isometry3, Rotation3, Vector3};

use super::{
    apply::{rotation, vector},
    bindings::{mjGEOM_BOX, mjGEOM_PLANE},
    views::{DataView, ModelView},
};
use crate::{
    plugin::bound::{Wall, WallShape},
    sim::plant::PlantWall,
};

/// Opacity below which a geom that touches nothing is taken for a drawing of the water's surface.
const OPAQUE: f32 = 1.0;

/// Planes and boxes on bodies that never move. A translucent one that collides with nothing is no wall.
pub(super) fn find(model: ModelView<'_>) -> Vec<Wall> {
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

/// The same for a description, where they stand now.
pub(super) fn standing(data: &DataView<'_>) -> Vec<PlantWall> {
    let walls = find(data.model()).into_iter();
    walls
        .map(|(geom, shape)| {
            let turn = Rotation3::from_matrix_unchecked(rotation(data.geom_xmat(), geom));
            let half = match shape {
                WallShape::Plane => None,
                WallShape::Box => Some(vector(data.model().geom_size(), geom)),
            };
            PlantWall {
                place: Isometry3::from_parts(vector(data.geom_xpos(), geom).into(), turn.into()),
                half,
            }
        })
        .collect()
}

/// Distance [m] of a point to the nearest wall, and that wall's unit normal in the world, towards the
/// point.
pub(super) fn nearest(
    data: &DataView<'_>,
    walls: &[Wall],
    point: Vector3<f64>,
) -> Option<(f64, [f64; 3])> {
    let mut nearest: Option<(f64, Vector3<f64>)> = None;
    for (geom, shape) in walls {
        let frame = rotation(data.geom_xmat(), *geom);
        let from_wall = frame.tr_mul(&(point - vector(data.geom_xpos(), *geom)));
        let (distance, normal) = match shape {
            WallShape::Plane => (from_wall.z.max(0.0), Vector3::z()),
            WallShape::Box => {
                let half = vector(data.model().geom_size(), *geom);
                from_box(from_wall, half)
            }
        };
        if nearest.is_none_or(|(known, _)| distance < known) {
            nearest = Some((distance, frame * normal));
        }
    }
    nearest.map(|(distance, normal)| (distance, normal.into()))
}

/// Distance to a box about the origin, and the way out; inside it the distance is zero.
fn from_box(point: Vector3<f64>, half: Vector3<f64>) -> (f64, Vector3<f64>) {
    let inside = point.zip_map(&half, |x, h| x.clamp(-h, h));
    let out = point - inside;
    let distance = out.norm();
    if distance > 0.0 {
        return (distance, out / distance);
    }
    let depth = half - point.abs();
    let axis = depth.imin();
    let mut normal = Vector3::zeros();
    normal[axis] = if point[axis] < 0.0 { -1.0 } else { 1.0 };
    (0.0, normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_left_by_the_shortest_way() {
        let half = Vector3::new(1.0, 2.0, 3.0);
        let (distance, normal) = from_box(Vector3::new(4.0, 0.5, 0.0), half);
        assert!((distance - 3.0).abs() < 1e-12 && (normal - Vector3::x()).norm() < 1e-12);
        let (distance, normal) = from_box(Vector3::new(-0.9, 0.0, 0.0), half);
        assert!(distance == 0.0 && (normal + Vector3::x()).norm() < 1e-12);
        let (distance, normal) = from_box(Vector3::new(2.0, 3.0, 0.0), half);
        assert!((distance - 2.0_f64.sqrt()).abs() < 1e-12 && (normal.x - normal.y).abs() < 1e-12);
    }
}
