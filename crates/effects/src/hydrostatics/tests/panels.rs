//! Pressure on panels.

use super::*;
use crate::hydrostatics::{Hull, Panels, Solid};

const GRAVITY: f64 = 9.81;

fn hull_of(shape: &Shape) -> Hull {
    Hull::new(vec![Solid {
        shape: shape.clone(),
        place: Isometry3::new(Vector3::new(0.2, -0.1, 0.05), Vector3::new(0.4, 0.9, -0.3)),
    }])
}

/// Greatest errors, over drawn attitudes, of force and torque from hydrostatic pressure below a flat surface, and of the
/// wet part, in shares of the hull's weight, its size, its volume.
fn errors(hull: &Hull, fineness: usize, depth: f64) -> [f64; 3] {
    use proptest::strategy::ValueTree;
    let panels = Panels::new(hull, fineness);
    let (volume, size) = (hull.volume(), 0.5);
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut worst = [0.0_f64; 3];
    for _ in 0..40 {
        let (place, share) = (place(), -0.9..0.9)
            .new_tree(&mut runner)
            .unwrap()
            .current();
        let up = place.rotation.inverse() * Vector3::z();
        let (low, high) = hull.reach(&up);
        let level = 0.5 * (low + high) + 0.5 * share * (high - low) + depth;
        let surface = level + place.translation.z;
        let (wrench, wet) = panels.push(&place, |_| surface, |x| GRAVITY * (surface - x.z));
        let part = hull.below(&up, level);
        let force = Vector3::new(wrench[0], wrench[1], wrench[2]) - GRAVITY * part.volume * up;
        let torque =
            Vector3::new(wrench[3], wrench[4], wrench[5]) - GRAVITY * part.moment.cross(&up);
        let volumes = (wet.volume - part.volume).abs() / volume;
        let moments = (wet.moment - part.moment).norm() / (volume * size);
        for (worst, found) in worst.iter_mut().zip([
            force.norm() / (GRAVITY * volume),
            torque.norm() / (GRAVITY * volume * size),
            volumes.max(moments),
        ]) {
            *worst = worst.max(found);
        }
    }
    worst
}

#[test]
fn pressure_below_a_flat_surface_is_buoyancy() {
    let shapes = one_of_each().into_iter().chain([
        Shape::Cylinder {
            radius: 0.02,
            half_length: 0.5,
        },
        Shape::Capsule {
            radius: 0.02,
            half_length: 0.5,
        },
        Shape::Mesh(Arc::new(angle())),
        Shape::Mesh(Arc::new(torus(20, 12))),
    ]);
    for shape in shapes {
        let hull = hull_of(&shape);
        let (radius, flat) = match &shape {
            Shape::Box { .. } | Shape::Mesh(_) => (0.0, true),
            Shape::Ellipsoid { semi_axes } => {
                (semi_axes.iter().copied().fold(0.0, f64::max), false)
            }
            Shape::Sphere { radius }
            | Shape::Cylinder { radius, .. }
            | Shape::Capsule { radius, .. } => (*radius, false),
        };
        for fineness in [8_u32, 16, 32, 64] {
            let extents = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
                let (low, high) = hull.reach(&axis);
                high - low
            });
            let length = extents.into_iter().fold(0.0, f64::max) / f64::from(fineness);
            let round = (4.0 * (std::f64::consts::FRAC_PI_2 * radius / length).ceil()).max(12.0);
            let bound = if flat { 1e-12 } else { 1.0 / (round * round) };
            let found = errors(&hull, fineness as usize, 0.0);
            assert!(
                found.iter().all(|off| *off < bound),
                "{shape:?} {fineness}: {found:?}"
            );
        }
        // Deep under water round shapes are exact as well.
        let found = errors(&hull, 8, 5.0);
        assert!(found.iter().all(|off| *off < 1e-12), "{shape:?}: {found:?}");
        assert_eq!(errors(&hull, 8, -5.0), [0.0; 3]);
    }
}

/// A slope as the elevation is a plane that is not level; a constant pressure on what is below pushes across it.
#[test]
fn a_sloping_surface_cuts_as_a_plane_does() {
    let hull = hull_of(&Shape::Box {
        half: [0.3, 0.5, 0.2],
    });
    let panels = Panels::new(&hull, 12);
    let place = Isometry3::new(Vector3::new(3.0, -2.0, 0.1), Vector3::new(0.5, -0.2, 1.0));
    let (a, b) = (0.2, -0.35);
    let elevation = |x: Vector3<f64>| 0.15 + a * (x.x - 3.0) + b * (x.y + 2.0);
    let normal = Vector3::new(-a, -b, 1.0).normalize();
    let up = place.rotation.inverse() * normal;
    let level = normal.dot(&(Vector3::new(3.0, -2.0, 0.15) - place.translation.vector));
    let part = hull.below(&up, level);
    // Pressure that grows along -normal, zero on the surface.
    let (wrench, wet) = panels.push(&place, elevation, |x| {
        GRAVITY * (0.15 * normal.z + normal.x * 3.0 - normal.y * 2.0 - normal.dot(&x))
    });
    assert_close(&wet, &part, hull.volume(), 1.0, 1e-13);
    let force = GRAVITY * part.volume * up;
    let torque = GRAVITY * part.moment.cross(&up);
    for k in 0..3 {
        assert!((wrench[k] - force[k]).abs() < 1e-13);
        assert!((wrench[3 + k] - torque[k]).abs() < 1e-13);
    }
}

/// Under a short wave: volume and force of an upright box from the wave's integrals.
#[test]
fn a_box_under_a_wave_is_wet_to_the_wave() {
    let (half, amplitude, number) = ([0.5, 0.2, 0.3], 0.05, 9.0_f64);
    let hull = Hull::new(vec![Solid {
        shape: Shape::Box { half },
        place: Isometry3::identity(),
    }]);
    let phase = 0.7;
    let elevation = |x: Vector3<f64>| amplitude * (number * x.x - phase).cos();
    let pressure = |x: Vector3<f64>| GRAVITY * (elevation(x) * (number * x.z).exp() - x.z);
    let [x, y, z] = half;
    let area = ((number * x - phase).sin() + (number * x + phase).sin()) / number;
    let volume = 2.0 * y * (2.0 * x * z + amplitude * area);
    // Up on the flat bottom.
    let lift = GRAVITY * 2.0 * y * (2.0 * x * z + amplitude * (-number * z).exp() * area);
    let mut before = f64::INFINITY;
    for fineness in [16, 32, 64] {
        let (wrench, wet) =
            Panels::new(&hull, fineness).push(&Isometry3::identity(), elevation, pressure);
        let off = (wet.volume / volume - 1.0).abs();
        assert!(
            off < 1.0 / (fineness * fineness) as f64,
            "{fineness}: {off:e}"
        );
        assert!(off < before);
        before = off;
        assert!((wrench[2] / lift - 1.0).abs() < 1.0 / (fineness * fineness) as f64);
        // It is symmetric about y = 0.
        assert!(
            wrench[1].abs() < 1e-13 && wrench[3].abs() < 1e-13 && wrench[5].abs() < 1e-13,
            "{wrench:?}"
        );
    }
}

/// A wave that mirrors itself about x = 0, over hulls that do.
#[test]
fn a_symmetric_hull_is_pushed_symmetrically() {
    let elevation = |x: Vector3<f64>| 0.07 * (6.0 * x.x).cos() * (5.0 * x.y + 0.4).cos();
    let pressure = |x: Vector3<f64>| GRAVITY * (elevation(x) * (7.8 * x.z).exp() - x.z);
    for shape in one_of_each() {
        for turn in [Vector3::zeros(), Vector3::x(), Vector3::y()] {
            let hull = Hull::new(vec![Solid {
                shape: shape.clone(),
                place: Isometry3::new(Vector3::zeros(), turn * std::f64::consts::FRAC_PI_2),
            }]);
            for fineness in [5, 10] {
                let panels = Panels::new(&hull, fineness);
                let (wrench, wet) = panels.push(&Isometry3::identity(), elevation, pressure);
                // Sway, roll and heave are free; surge, pitch and yaw are none.
                for k in [0, 4, 5] {
                    assert!(
                        wrench[k].abs() < 1e-14,
                        "{shape:?} {turn:?} {k}: {wrench:?}"
                    );
                }
                assert!(wet.moment.x.abs() < 1e-15);
            }
        }
    }
}

#[test]
fn panels_are_as_fine_as_asked() {
    let hull = Hull::new(vec![Solid {
        shape: Shape::Box {
            half: [0.5, 0.25, 0.125],
        },
        place: Isometry3::identity(),
    }]);
    // Faces of 8 x 4, 8 x 2 and 4 x 2 squares, two of each, two panels a square.
    assert_eq!(Panels::new(&hull, 8).count(), 4 * (32 + 16 + 8));
    assert_eq!(Panels::new(&hull, 0).count(), Panels::new(&hull, 1).count());
    assert_eq!(Panels::new(&Hull::default(), 8).count(), 0);
}

#[test]
fn a_surface_that_is_none_gives_no_force() {
    let panels = Panels::new(&hull_of(&Shape::Sphere { radius: 0.3 }), 8);
    let (wrench, wet) = panels.push(&Isometry3::identity(), |_| f64::NAN, |x| -GRAVITY * x.z);
    assert!(wrench.iter().all(|x| x.is_nan()) && wet.volume.is_nan());
}

#[test]
fn nothing_panics() {
    let sizes = [0.0, f64::NAN, f64::INFINITY, 1e300, 1e-300];
    for radius in sizes {
        for half_length in sizes {
            for shape in [
                Shape::Sphere { radius },
                Shape::Box {
                    half: [radius, half_length, 1.0],
                },
                Shape::Capsule {
                    radius,
                    half_length,
                },
            ] {
                let hull = hull_of(&shape);
                let _ = Hull::united(vec![hull.solids()[0].clone(); 2]).below(&Vector3::z(), 0.1);
                let panels = Panels::new(&hull, 4);
                for value in [0.0, f64::NAN, f64::INFINITY, -1e300] {
                    let _ = panels.push(&Isometry3::identity(), |_| value, |_| value);
                }
            }
        }
    }
}
