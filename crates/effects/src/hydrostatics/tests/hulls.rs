//! Hulls of several solids, and what keeps them upright.

use std::f64::consts::PI;

use super::*;
use crate::hydrostatics::{Hull, Solid};

fn hull() -> impl Strategy<Value = Hull> {
    proptest::collection::vec((any_shape(), place()), 1..4).prop_map(|solids| {
        let solids = solids.into_iter();
        Hull::new(
            solids
                .map(|(shape, place)| Solid { shape, place })
                .collect(),
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn a_hull_that_is_moved_is_wet_as_before(hull in hull(), motion in place(), up in unit(), level in -3.0..3.0) {
        let solids = hull.solids().iter();
        let moved = Hull::new(solids.map(|solid| Solid { shape: solid.shape.clone(), place: motion * solid.place }).collect());
        let there = motion.rotation * up;
        let lift = there.dot(&motion.translation.vector);
        let expected = hull.below(&up, level).placed(&motion);
        let found = moved.below(&there, level + lift);
        assert_close(&found, &expected, hull.volume(), 4.0, 1e-12);
        let (before, after) = (hull.reach(&up), moved.reach(&there));
        prop_assert!((before.0 + lift - after.0).abs() < 1e-12 && (before.1 + lift - after.1).abs() < 1e-12);
        let expected = motion * nalgebra::Point3::from(hull.centre());
        prop_assert!((moved.centre() - expected.coords).norm() < 1e-12);
    }

    #[test]
    fn it_is_dry_and_whole_at_its_reach(hull in hull(), up in unit()) {
        let (low, high) = hull.reach(&up);
        prop_assert!(hull.below(&up, low).volume < 1e-12);
        prop_assert!((hull.below(&up, high).volume - hull.volume()).abs() < 1e-12 * hull.volume());
        prop_assert!(hull.below(&up, low + 0.01 * (high - low)).volume > 0.0);
        prop_assert!(hull.below(&up, high - 0.01 * (high - low)).volume < hull.volume());
        for solid in hull.solids() {
            let radius = solid.shape.bounding_radius();
            let there = solid.place.rotation.inverse() * up;
            let (low, high) = solid.shape.reach(&there);
            prop_assert!(high <= radius + 1e-12 && -low <= radius + 1e-12);
        }
    }
}

/// GM = KB + BM - KG of a box, from the righting moment at small heels.
#[test]
fn an_upright_box_has_its_metacentric_height() {
    let (length, breadth, depth, draught, centre_of_mass) = (4.0, 1.5, 1.0, 0.6, 0.55);
    // The body's origin is at the centre of mass, `centre_of_mass` above the keel.
    let hull = Hull::new(vec![Solid {
        shape: Shape::Box {
            half: [0.5 * length, 0.5 * breadth, 0.5 * depth],
        },
        place: Isometry3::translation(0.0, 0.0, 0.5 * depth - centre_of_mass),
    }]);
    let volume = length * breadth * draught;
    let heeled = |angle: f64| {
        let up = Vector3::new(0.0, angle.sin(), angle.cos());
        // About the middle of the waterplane the volume stays as it is.
        let part = hull.below(&up, up.z * (draught - centre_of_mass));
        assert!((part.volume - volume).abs() < 1e-12);
        part.moment.cross(&up).x
    };
    // A heel about +x takes the world's up towards the body's +y.
    let righting = -(heeled(1e-4) - heeled(-1e-4)) / 2e-4;
    let metacentric = draught / 2.0 + breadth * breadth / (12.0 * draught) - centre_of_mass;
    assert!(
        (righting / volume - metacentric).abs() < 1e-7,
        "{}",
        righting / volume
    );
    // The same lengthwise.
    let pitched = |angle: f64| {
        let up = Vector3::new(-angle.sin(), 0.0, angle.cos());
        hull.below(&up, up.z * (draught - centre_of_mass))
            .moment
            .cross(&up)
            .y
    };
    let righting = -(pitched(1e-4) - pitched(-1e-4)) / 2e-4;
    let metacentric = draught / 2.0 + length * length / (12.0 * draught) - centre_of_mass;
    assert!(
        (righting / volume - metacentric).abs() < 1e-7,
        "{}",
        righting / volume
    );
}

/// At large heels, the wall-sided formula: GZ = sin (GM + BM tan^2 / 2).
#[test]
fn a_wall_sided_box_rights_itself_by_the_formula() {
    let (breadth, draught, centre_of_mass) = (1.5, 0.6, 0.55);
    let hull = Hull::new(vec![Solid {
        shape: Shape::Box {
            half: [2.0, 0.5 * breadth, 0.6],
        },
        place: Isometry3::translation(0.0, 0.0, 0.6 - centre_of_mass),
    }]);
    let metacentre = breadth * breadth / (12.0 * draught);
    let height = draught / 2.0 + metacentre - centre_of_mass;
    for angle in [0.1_f64, 0.3, 0.6] {
        let up = Vector3::new(0.0, angle.sin(), angle.cos());
        let part = hull.below(&up, up.z * (draught - centre_of_mass));
        let arm = -part.moment.cross(&up).x / part.volume;
        let expected = angle.sin() * (height + 0.5 * metacentre * angle.tan().powi(2));
        assert!((arm - expected).abs() < 1e-14, "{arm} {expected}");
    }
}

#[test]
fn an_empty_hull_displaces_nothing() {
    let hull = Hull::default();
    assert_eq!((hull.volume(), hull.centre()), (0.0, Vector3::zeros()));
    assert_eq!(hull.below(&Vector3::z(), 1.0), Part::NONE);
    assert_eq!(hull.reach(&Vector3::z()), (0.0, 0.0));
    assert!(!Hull::united(Vec::new()).overlaps());
}

#[test]
fn solids_that_share_space_are_found() {
    let solid = |shape: &Shape, x: f64| Solid {
        shape: shape.clone(),
        place: Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::new(0.3, 0.0, 0.0)),
    };
    let ball = Shape::Sphere { radius: 0.5 };
    let apart = solid(&ball, 10.0);
    for shape in one_of_each()
        .into_iter()
        .chain([Shape::Mesh(Arc::new(angle()))])
    {
        let (_, high) = solid(&shape, 0.0).reach(&Vector3::x());
        let pair = |gap: f64| {
            Hull::united(vec![
                apart.clone(),
                solid(&shape, 0.0),
                solid(&ball, high + 0.5 + gap),
            ])
        };
        assert!(!pair(1e-9).overlaps(), "{shape:?}");
        assert!(!pair(-0.004).overlaps(), "{shape:?}");
        assert!(pair(-0.35).overlaps(), "{shape:?}");
        // A copy of itself adds nothing.
        let same = Hull::united(vec![solid(&shape, 0.0), solid(&shape, 0.0)]);
        let once = Hull::new(vec![solid(&shape, 0.0)]).volume();
        assert!((same.volume() / once - 1.0).abs() < 0.02, "{shape:?}");
    }
    // A small one in a large one.
    let inner = Shape::Capsule {
        radius: 0.01,
        half_length: 0.02,
    };
    let held = Hull::united(vec![solid(&inner, 0.3), solid(&ball, 0.0)]);
    assert!(held.overlaps());
    let alone = Hull::new(vec![solid(&ball, 0.0)]).volume();
    assert!((held.volume() / alone - 1.0).abs() < 1e-6);
}

/// The share that two equal boxes have in common, at and below a hundredth.
#[test]
fn a_hundredth_in_common_is_found_and_half_of_that_is_not() {
    let cuboid = Shape::Box { half: [0.5; 3] };
    let pair = |share: f64| {
        let at = |x: f64| Solid {
            shape: cuboid.clone(),
            place: Isometry3::translation(x, 0.0, 0.0),
        };
        Hull::united(vec![at(0.0), at(1.0 - share)]).overlaps()
    };
    assert!(!pair(0.005));
    assert!(pair(0.01));
}

fn at(shape: Shape, place: Isometry3<f64>) -> Solid {
    Solid { shape, place }
}

/// Two balls share a lens, two crossed cylinders Steinmetz's solid of 16/3 r^3, two boxes a box.
#[test]
fn a_union_counts_what_is_shared_once() {
    let ball = || Shape::Sphere { radius: 0.5 };
    let tube = || Shape::Cylinder {
        radius: 0.2,
        half_length: 1.0,
    };
    let cuboid = || Shape::Box {
        half: [0.3, 0.2, 0.1],
    };
    let across = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let distance: f64 = 0.6;
    // Two balls of radius r, d apart: pi (2 r - d)^2 (d^2 + 4 r d) / (12 d).
    let lens =
        PI * (1.0 - distance).powi(2) * (distance * distance + 2.0 * distance) / (12.0 * distance);
    for (one, other, shared) in [
        (
            at(ball(), Isometry3::identity()),
            at(ball(), Isometry3::translation(distance, 0.0, 0.0)),
            lens,
        ),
        (
            at(tube(), Isometry3::identity()),
            at(tube(), across),
            16.0 / 3.0 * 0.2_f64.powi(3),
        ),
        (
            at(cuboid(), Isometry3::identity()),
            at(cuboid(), Isometry3::translation(0.4, 0.1, 0.15)),
            0.2 * 0.3 * 0.05,
        ),
    ] {
        let sum = Hull::new(vec![one.clone(), other.clone()]);
        let union = Hull::united(vec![one, other]);
        let found = sum.volume() - union.volume();
        assert!((found / shared - 1.0).abs() < 0.01, "{found} {shared}");
        let missing = sum.whole() - union.whole();
        let middle = sum.centre();
        assert!(
            (missing.moment / missing.volume - middle).norm() < 0.01,
            "{missing:?}"
        );
    }
}

/// Below a plane, at any attitude: no more than the sum, no less than the larger one, all at the top and nothing below, and no
/// jumps.
#[test]
fn a_union_is_cut_by_a_plane_without_jumps() {
    let solids = vec![
        at(Shape::Sphere { radius: 0.3 }, Isometry3::identity()),
        at(
            Shape::Capsule {
                radius: 0.15,
                half_length: 0.5,
            },
            Isometry3::rotation(Vector3::new(0.4, 1.1, 0.0)),
        ),
    ];
    let (union, sum) = (Hull::united(solids.clone()), Hull::new(solids));
    assert!(union.overlaps());
    for up in [
        Vector3::z(),
        Vector3::new(0.3, -0.5, 0.8).normalize(),
        Vector3::x(),
    ] {
        let mut last = 0.0;
        for step in -1000..=1000 {
            let level = f64::from(step) * 1e-3;
            let volume = union.below(&up, level).volume;
            assert!(volume >= last - 1e-9 && volume <= last + 5e-4, "{level}");
            assert!(volume <= sum.below(&up, level).volume + 1e-12);
            last = volume;
        }
        assert!((last - union.volume()).abs() < 1e-12);
    }
}
