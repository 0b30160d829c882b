//! Criterion: what a hull below a surface costs a step.
//!
//! `cargo bench -p hydro-effects`: every shape cut by planes of 64 attitudes, meshes of 1000 and of 20 000 faces, a hull of 18 solids,
//! panels under a wave of 20 components, and the check of a mesh of 20 000 faces.
#![allow(missing_docs, clippy::unwrap_used)]

use std::{f64::consts::TAU, hint::black_box, sync::Arc};

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use hydro_effects::hydrostatics::{Hull, Mesh, Panels, Shape, Solid};
use nalgebra::{Isometry3, Vector3};

/// Vertices and faces of a torus of `2 around across` faces.
fn torus(around: u32, across: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for i in 0..around {
        for j in 0..across {
            let u = TAU * f64::from(i) / f64::from(around);
            let v = TAU * f64::from(j) / f64::from(across);
            let radius = 0.5 + 0.2 * v.cos();
            vertices.push([radius * u.cos(), radius * u.sin(), 0.2 * v.sin()]);
            let number = |i: u32, j: u32| (i % around) * across + j % across;
            let (a, c) = (number(i, j), number(i + 1, j + 1));
            faces.push([a, number(i + 1, j), c]);
            faces.push([a, c, number(i, j + 1)]);
        }
    }
    (vertices, faces)
}

fn shapes() -> [(&'static str, Shape); 6] {
    let (vertices, faces) = torus(25, 20);
    let (radius, half_length) = (0.25, 0.4);
    let cylinder = Shape::Cylinder {
        radius,
        half_length,
    };
    let capsule = Shape::Capsule {
        radius,
        half_length,
    };
    [
        ("sphere", Shape::Sphere { radius }),
        (
            "ellipsoid",
            Shape::Ellipsoid {
                semi_axes: [0.4, 0.25, 0.6],
            },
        ),
        (
            "box",
            Shape::Box {
                half: [0.3, 0.5, 0.2],
            },
        ),
        ("cylinder", cylinder),
        ("capsule", capsule),
        (
            "mesh",
            Shape::Mesh(Arc::new(Mesh::new(&vertices, &faces).unwrap())),
        ),
    ]
}

/// Normals that cover the sphere, each with a level that cuts most shapes.
fn planes() -> Vec<(Vector3<f64>, f64)> {
    (0..64)
        .map(|k| {
            let z = (f64::from(k) + 0.5) / 32.0 - 1.0;
            let across = (1.0 - z * z).sqrt();
            let angle = 2.4 * f64::from(k);
            let up = Vector3::new(across * angle.cos(), across * angle.sin(), z);
            (up, 0.15 * (0.7 * f64::from(k)).sin())
        })
        .collect()
}

fn below(criterion: &mut Criterion) {
    let planes = planes();
    let mut group = criterion.benchmark_group("below");
    for (name, shape) in shapes() {
        group.bench_function(BenchmarkId::from_parameter(name), |bench| {
            let mut planes = planes.iter().cycle();
            bench.iter(|| {
                let (up, level) = planes.next().unwrap();
                black_box(&shape).below(black_box(up), *level)
            });
        });
    }
    let (vertices, faces) = torus(100, 100);
    let large = Shape::Mesh(Arc::new(Mesh::new(&vertices, &faces).unwrap()));
    group.bench_function(BenchmarkId::new("mesh", faces.len()), |bench| {
        let mut planes = planes.iter().cycle();
        bench.iter(|| {
            let (up, level) = planes.next().unwrap();
            black_box(&large).below(black_box(up), *level)
        });
    });
    // Nearly on its side: the slices of a cylinder are summed.
    let (name, rod) = &shapes()[3];
    group.bench_function(BenchmarkId::new(*name, "on its side"), |bench| {
        let up = Vector3::new(0.0, 0.02_f64.cos(), 0.02_f64.sin());
        bench.iter(|| black_box(rod).below(black_box(&up), 0.1));
    });
    group.bench_function(BenchmarkId::new(*name, "deep"), |bench| {
        let up = Vector3::new(0.0, 0.6, 0.8);
        bench.iter(|| black_box(rod).below(black_box(&up), 3.0));
    });
    group.finish();
}

/// A walker's 18 capsules and boxes in a ring.
fn robot() -> Hull {
    let [_, _, (_, cuboid), _, (_, capsule), _] = shapes();
    let solid = |k: u32| Solid {
        shape: if k.is_multiple_of(3) {
            cuboid.clone()
        } else {
            capsule.clone()
        },
        place: Isometry3::new(
            Vector3::new(3.0 * f64::from(k).cos(), 3.0 * f64::from(k).sin(), 0.0),
            Vector3::new(0.3 * f64::from(k), 0.4, 0.0),
        ),
    };
    Hull::new((0..18).map(solid).collect())
}

fn hull(criterion: &mut Criterion) {
    let (hull, planes) = (robot(), planes());
    criterion.bench_function("hull of 18", |bench| {
        let mut planes = planes.iter().cycle();
        bench.iter(|| {
            let (up, level) = planes.next().unwrap();
            hull.below(black_box(up), *level)
        });
    });
    let solids = hull.solids();
    criterion.bench_function("union of 18", |bench| {
        bench.iter(|| Hull::united(solids.to_vec()));
    });
}

fn panels(criterion: &mut Criterion) {
    let [_, _, (_, cuboid), ..] = shapes();
    let panels = Panels::new(
        &Hull::new(vec![Solid {
            shape: cuboid,
            place: Isometry3::identity(),
        }]),
        16,
    );
    let place = Isometry3::new(Vector3::new(1.0, 2.0, 0.05), Vector3::new(0.1, 0.2, 0.3));
    let count = panels.count();
    criterion.bench_function(&format!("{count} panels, flat"), |bench| {
        bench.iter(|| panels.push(black_box(&place), |_| 0.0, |x| -9.81 * x.z));
    });
    let waves: Vec<[f64; 3]> = (1..=20)
        .map(|k| [0.1 / f64::from(k), 0.8 * f64::from(k), 1.3 * f64::from(k)])
        .collect();
    let sum = |x: Vector3<f64>, decays: bool| -> f64 {
        let components = waves.iter().map(|[amplitude, number, phase]| {
            let fade = if decays { (number * x.z).exp() } else { 1.0 };
            amplitude * fade * (number * x.x - phase).cos()
        });
        components.sum()
    };
    criterion.bench_function(&format!("{count} panels, 20 waves"), |bench| {
        bench.iter(|| {
            panels.push(
                black_box(&place),
                |x| sum(x, false),
                |x| 9.81 * (sum(x, true) - x.z),
            )
        });
    });
}

fn check(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("check of a mesh");
    group.sample_size(10);
    for (around, across) in [(25, 20), (100, 100)] {
        let (vertices, faces) = torus(around, across);
        group.bench_function(BenchmarkId::from_parameter(faces.len()), |bench| {
            bench.iter(|| Mesh::new(&vertices, &faces).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, below, hull, panels, check);
criterion_main!(benches);
