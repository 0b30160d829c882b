//! One closed shape in its own frame.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{capsule, cylinder, ellipsoid, mesh::Mesh, part::Part, polyhedron};

/// A closed shape in its own frame: MuJoCo's geom frame, axis z, and MuJoCo's half sizes [m]. All but the mesh are
/// symmetric about their origin. Sizes are zero or more; a shape without volume displaces nothing.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub enum Shape {
    Sphere {
        radius: f64,
    },
    Ellipsoid {
        semi_axes: [f64; 3],
    },
    Box {
        half: [f64; 3],
    },
    Cylinder {
        radius: f64,
        half_length: f64,
    },
    /// A cylinder of `half_length` between two half balls.
    Capsule {
        radius: f64,
        half_length: f64,
    },
    Mesh(Arc<Mesh>),
}

impl Shape {
    /// The whole shape.
    pub fn whole(&self) -> Part {
        let volume = match self {
            Self::Sphere { radius } => ellipsoid::volume(&Vector3::from_element(*radius)),
            Self::Ellipsoid { semi_axes } => ellipsoid::volume(&Vector3::from(*semi_axes)),
            Self::Box { half } => polyhedron::box_volume(&Vector3::from(*half)),
            Self::Cylinder {
                radius,
                half_length,
            } => cylinder::volume(*radius, *half_length),
            Self::Capsule {
                radius,
                half_length,
            } => capsule::volume(*radius, *half_length),
            Self::Mesh(mesh) => return mesh.whole(),
        };
        Part {
            volume,
            moment: Vector3::zeros(),
        }
    }

    /// The part of the shape below a plane: `up` is the plane's unit normal towards the air, in the shape's frame, and
    /// points with `up.x <= level` [m] are wet.
    ///
    /// Exact to about 1e-14 of the shape's volume, a mesh to the rounding of its sums; continuous in attitude and level.
    pub fn below(&self, up: &Vector3<f64>, level: f64) -> Part {
        if level.is_nan() || !up.norm_squared().is_finite() {
            return Part::NAN;
        }
        let (lowest, highest) = match self {
            Self::Mesh(mesh) => mesh.ball_reach(up),
            _ => self.reach(up),
        };
        if level >= highest {
            return self.whole();
        }
        if level <= lowest {
            return Part::NONE;
        }
        let part = match self {
            Self::Sphere { radius } => ellipsoid::ball_below(*radius, up, level),
            Self::Ellipsoid { semi_axes } => ellipsoid::below(semi_axes, up, level),
            Self::Box { half } => polyhedron::box_below(&Vector3::from(*half), up, level),
            Self::Cylinder {
                radius,
                half_length,
            } => cylinder::below(*radius, *half_length, up, level),
            Self::Capsule {
                radius,
                half_length,
            } => capsule::below(*radius, *half_length, up, level),
            Self::Mesh(mesh) => mesh.below(up, level),
        };
        // Rounding, where next to nothing is wet.
        if part.volume < 0.0 { Part::NONE } else { part }
    }

    /// Least and greatest coordinate [m] of the shape along a unit vector; over all vertices of a mesh.
    pub fn reach(&self, direction: &Vector3<f64>) -> (f64, f64) {
        let highest = match self {
            Self::Sphere { radius } => *radius,
            Self::Ellipsoid { semi_axes } => {
                Vector3::from(*semi_axes).component_mul(direction).norm()
            }
            Self::Box { half } => Vector3::from(*half).dot(&direction.abs()),
            Self::Cylinder {
                radius,
                half_length,
            } => half_length * direction.z.abs() + radius * direction.xy().norm(),
            Self::Capsule {
                radius,
                half_length,
            } => half_length * direction.z.abs() + radius,
            Self::Mesh(mesh) => return mesh.reach(direction),
        };
        (-highest, highest)
    }

    /// Radius [m] of a ball about the shape's origin that holds the shape.
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Self::Sphere { radius } => *radius,
            Self::Ellipsoid { semi_axes } => semi_axes.iter().copied().fold(0.0, f64::max),
            Self::Box { half } => Vector3::from(*half).norm(),
            Self::Cylinder {
                radius,
                half_length,
            } => radius.hypot(*half_length),
            Self::Capsule {
                radius,
                half_length,
            } => radius + half_length,
            Self::Mesh(mesh) => mesh.bounding_radius(),
        }
    }

    /// Whether a point of the shape's frame is in the shape.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        match self {
            Self::Sphere { radius } => point.norm() <= *radius,
            Self::Ellipsoid { semi_axes } => {
                point.component_div(&Vector3::from(*semi_axes)).norm() <= 1.0
            }
            Self::Box { half } => point.iter().zip(half).all(|(x, half)| x.abs() <= *half),
            Self::Cylinder {
                radius,
                half_length,
            } => point.z.abs() <= *half_length && point.xy().norm() <= *radius,
            Self::Capsule {
                radius,
                half_length,
            } => {
                let beyond = (point.z.abs() - half_length).max(0.0);
                point.xy().norm().hypot(beyond) <= *radius
            }
            Self::Mesh(mesh) => mesh.contains(point),
        }
    }
}
