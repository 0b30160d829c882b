//! Hydrostatics against closed forms, quadrature and the identities that every floating body obeys.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;

mod hulls;
mod meshes;
mod panels;
mod primitives;

use super::{Mesh, Part, Shape, surface::Surface};

fn unit() -> impl Strategy<Value = Vector3<f64>> {
    (-1.0..1.0_f64, 0.0..std::f64::consts::TAU).prop_map(|(z, angle)| {
        let across = (1.0 - z * z).sqrt();
        Vector3::new(across * angle.cos(), across * angle.sin(), z)
    })
}

/// Any direction, and as often one along an axis or a little off it.
fn unit_or_axis() -> impl Strategy<Value = Vector3<f64>> {
    let axis = (0..3_usize, any::<bool>(), unit(), -18..0).prop_map(|(axis, back, off, digits)| {
        let axis = Vector3::ith(axis, if back { -1.0 } else { 1.0 });
        (axis + 10.0_f64.powi(digits) * off).normalize()
    });
    prop_oneof![unit(), axis]
}

fn place() -> impl Strategy<Value = Isometry3<f64>> {
    let turn =
        (unit(), 0.0..3.0).prop_map(|(axis, angle)| UnitQuaternion::from_scaled_axis(axis * angle));
    (prop::array::uniform3(-2.0..2.0_f64), turn)
        .prop_map(|(at, turn)| Isometry3::from_parts(Translation3::from(Vector3::from(at)), turn))
}

fn primitive() -> impl Strategy<Value = Shape> {
    let size = || 0.05..2.0;
    prop_oneof![
        size().prop_map(|radius| Shape::Sphere { radius }),
        prop::array::uniform3(size()).prop_map(|semi_axes| Shape::Ellipsoid { semi_axes }),
        prop::array::uniform3(size()).prop_map(|half| Shape::Box { half }),
        (size(), size()).prop_map(|(radius, half_length)| Shape::Cylinder {
            radius,
            half_length
        }),
        (size(), size()).prop_map(|(radius, half_length)| Shape::Capsule {
            radius,
            half_length
        }),
    ]
}

/// Primitives, and a torus and an angle that are no convex meshes.
fn any_shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        5 => primitive(),
        1 => Just(Shape::Mesh(Arc::new(torus(20, 12)))),
        1 => Just(Shape::Mesh(Arc::new(angle()))),
    ]
}

/// A shape of each kind.
fn one_of_each() -> Vec<Shape> {
    vec![
        Shape::Sphere { radius: 0.3 },
        Shape::Ellipsoid {
            semi_axes: [0.4, 0.25, 0.6],
        },
        Shape::Box {
            half: [0.3, 0.5, 0.2],
        },
        Shape::Cylinder {
            radius: 0.3,
            half_length: 0.5,
        },
        Shape::Cylinder {
            radius: 0.6,
            half_length: 0.1,
        },
        Shape::Capsule {
            radius: 0.25,
            half_length: 0.4,
        },
    ]
}

/// Half of the reach along `up` times `share`, from the middle.
fn level_at(shape: &Shape, up: &Vector3<f64>, share: f64) -> f64 {
    let (low, high) = shape.reach(up);
    0.5 * (low + high) + 0.5 * share * (high - low)
}

/// A shape's surface as a mesh.
fn mesh_of(shape: &Shape, length: f64) -> Mesh {
    let surface = Surface::new(shape, length);
    let vertices: Vec<[f64; 3]> = surface.vertices.iter().map(|v| (*v).into()).collect();
    Mesh::new(&vertices, &surface.faces).unwrap()
}

/// A torus about z, radii 0.5 and 0.2.
fn torus(around: u32, across: u32) -> Mesh {
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (
                std::f64::consts::TAU * f64::from(i) / f64::from(around),
                std::f64::consts::TAU * f64::from(j) / f64::from(across),
            );
            let radius = 0.5 + 0.2 * v.cos();
            vertices.push([radius * u.cos(), radius * u.sin(), 0.2 * v.sin()]);
            let number = |i: u32, j: u32| (i % around) * across + j % across;
            let corners = [
                number(i, j),
                number(i + 1, j),
                number(i + 1, j + 1),
                number(i, j + 1),
            ];
            faces.push([corners[0], corners[1], corners[2]]);
            faces.push([corners[0], corners[2], corners[3]]);
        }
    }
    Mesh::new(&vertices, &faces).unwrap()
}

/// An angle of width 1: legs of 1 x 0.3 along x and along z, off the origin.
fn angle() -> Mesh {
    let profile = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 0.3],
        [0.3, 0.3],
        [0.3, 1.0],
        [0.0, 1.0],
    ];
    let vertices: Vec<[f64; 3]> = [-0.2, 0.8]
        .iter()
        .flat_map(|y| profile.map(|[x, z]| [x + 0.1, *y, z - 0.4]))
        .collect();
    let mut faces = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
    let back: Vec<[u32; 3]> = faces
        .iter()
        .map(|[a, b, c]| [a + 6, c + 6, b + 6])
        .collect();
    faces.extend(back);
    for k in 0..6 {
        let next = (k + 1) % 6;
        faces.push([k, k + 6, next + 6]);
        faces.push([k, next + 6, next]);
    }
    Mesh::new(&vertices, &faces).unwrap()
}

#[track_caller]
fn assert_close(found: &Part, expected: &Part, volume: f64, length: f64, tolerance: f64) {
    let off = (found.volume - expected.volume).abs() / volume;
    let moment = (found.moment - expected.moment).norm() / (volume * length);
    assert!(
        off <= tolerance && moment <= tolerance,
        "found {found:?}, expected {expected:?}: {off:e} and {moment:e} off"
    );
}
