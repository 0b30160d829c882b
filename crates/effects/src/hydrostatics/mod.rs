//! Hydrostatics: volume and centre of the part of a hull below a plane, and pressure on its panels below a wavy surface.
//!
//! Pure geometry: it knows no simulator, no density and no gravity. Lengths [m], volumes [m^3], moments of volume [m^4].
//! Buoyancy is `density * gravity * volume` along up, and acts at `moment / volume`.
//!
//! A plane is its unit normal `up`, towards the air, and its `level`: `x` is wet where `up.x <= level`. Both stand in the
//! frame of the shape, or of the body for a [`Hull`].
//!
//! ```
//! use hydro_effects::hydrostatics::{Hull, Shape, Solid};
//! use nalgebra::{Isometry3, Vector3};
//!
//! let float = Solid {
//!     shape: Shape::Sphere { radius: 0.1 },
//!     place: Isometry3::translation(0.0, 0.0, 0.3),
//! };
//! let hull = Hull::new(vec![float]);
//! let half = hull.below(&Vector3::z(), 0.3);
//! assert!((half.volume - 0.5 * hull.volume()).abs() < 1e-15);
//! ```
//!
//! ```text
//! part         volume and first moment
//! ellipsoid    closed form, the ball's too
//! cylinder     closed form
//! capsule      closed form
//! polyhedron   clipped triangles; the box
//! mesh         a closed triangle mesh, checked by:
//!   edges        it is closed and wound one way
//!   crossing     no two faces cut each other
//!   shells       no shell is inside out or in another
//!   box_tree     which triangles are near
//! shape        one of these in its own frame
//! solid        a shape on a body
//! overlap      whether two solids share space
//! shared       what overlapping solids have in common
//! hull         the solids of a body
//! surface      triangles of a shape's surface
//! panels       pressure integrated over them
//! ```
//!
//! An argument that is not a number gives numbers that are none. Nothing panics.

mod box_tree;
mod capsule;
mod crossing;
mod cylinder;
mod edges;
mod ellipsoid;
mod hull;
mod mesh;
mod mesh_error;
mod overlap;
mod panels;
mod part;
mod polyhedron;
mod shape;
mod shared;
mod shells;
mod solid;
mod surface;
#[cfg(test)]
mod tests;

pub use hull::Hull;
pub use mesh::Mesh;
pub use mesh_error::{LARGEST_COORDINATE, MOST_FACES, MeshError};
pub use panels::Panels;
pub use part::Part;
pub use shape::Shape;
pub use solid::Solid;
