//! A shape on a body.

use nalgebra::{Isometry3, Vector3};

use super::{part::Part, shape::Shape};

/// A closed shape and its place on the body.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The shape in its own frame.
    pub shape: Shape,
    /// Takes the shape's points to the body's frame.
    pub place: Isometry3<f64>,
}

impl Solid {
    /// The whole solid, body frame.
    pub fn whole(&self) -> Part {
        self.shape.whole().placed(&self.place)
    }

    /// The part of the solid with `up.x <= level`, all in the body's frame.
    pub fn below(&self, up: &Vector3<f64>, level: f64) -> Part {
        let there = self.place.rotation.inverse_transform_vector(up);
        let lift = up.dot(&self.place.translation.vector);
        self.shape.below(&there, level - lift).placed(&self.place)
    }

    /// Least and greatest coordinate [m] of the solid along a unit vector of the body's frame.
    pub fn reach(&self, direction: &Vector3<f64>) -> (f64, f64) {
        let there = self.place.rotation.inverse_transform_vector(direction);
        let (low, high) = self.shape.reach(&there);
        let at = direction.dot(&self.place.translation.vector);
        (low + at, high + at)
    }

    /// Whether a point of the body's frame is in the solid.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        let there = self.place.inverse_transform_point(&(*point).into());
        self.shape.contains(&there.coords)
    }
}
