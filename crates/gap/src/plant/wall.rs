//! Walls that stand still.

use nalgebra::{Isometry3, Vector3};

/// A wall of the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Pose in the world.
    pub place: Isometry3<f64>,
    /// Half its sizes [m], of a box; a plane has none, and its z axis as its normal.
    pub half: Option<Vector3<f64>>,
}

impl Wall {
    /// Distance of a point of the world [m].
    pub fn distance(&self, point: [f64; 3]) -> f64 {
        way_out(
            self.place.inverse_transform_point(&point.into()).coords,
            self.half,
        )
        .0
    }
}

/// Distance [m] of a point in a wall's frame, and the unit normal towards it. `half`: that of [`Wall`].
pub fn way_out(point: Vector3<f64>, half: Option<Vector3<f64>>) -> (f64, Vector3<f64>) {
    match half {
        Some(half) => from_box(point, half),
        None => (point.z.max(0.0), Vector3::z()),
    }
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
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::UnitQuaternion;

    use super::*;

    /// A plane's distance is along its z axis, wherever it stands and however it is turned; behind it there is none.
    #[test]
    fn a_wall_is_as_far_as_the_way_to_it() {
        // Its z axis along the world's x.
        let turn = UnitQuaternion::from_euler_angles(0.0, FRAC_PI_2, 0.0);
        let place = Isometry3::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), turn);
        let distance = |half, point| Wall { place, half }.distance(point);
        assert!((distance(None, [1.5, 9.0, -9.0]) - 0.5).abs() < 1e-12);
        assert_eq!(distance(None, [0.5, 0.0, 0.0]), 0.0);
        // Half as high along the world's x, as long along its z.
        let half = Some(Vector3::new(2.0, 1.0, 0.5));
        assert!((distance(half, [1.8, 2.0, 3.0]) - 0.3).abs() < 1e-12);
        assert!((distance(half, [1.0, 2.0, 5.4]) - 0.4).abs() < 1e-12);
    }

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
