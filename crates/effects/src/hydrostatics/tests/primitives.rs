//! Every shape below a plane.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::*;

/// Volume and moment by columns along z over evenly spread points of the shape's shadow.
fn by_columns(shape: &Shape, up: &Vector3<f64>, level: f64) -> Part {
    const N: usize = 700;
    let mut sum = Part::NONE;
    let mut column = |x: f64, y: f64, height: f64, area: f64| {
        let surface = (level - up.x * x - up.y * y) / up.z;
        let (low, high) = if up.z > 0.0 {
            (-height, surface.clamp(-height, height))
        } else {
            (surface.clamp(-height, height), height)
        };
        let volume = area * (high - low);
        sum += Part {
            volume,
            moment: volume * Vector3::new(x, y, 0.5 * (low + high)),
        };
    };
    let half = |k: usize| (k as f64 + 0.5) / N as f64;
    let disc = |a: f64,
                b: f64,
                height: &dyn Fn(f64) -> f64,
                column: &mut dyn FnMut(f64, f64, f64, f64)| {
        for i in 0..N {
            // Even steps of the angle from the pole: heights fall smoothly to the rim.
            let polar = FRAC_PI_2 * half(i);
            let area = FRAC_PI_2 / N as f64 * polar.sin() * polar.cos() * a * b * TAU / N as f64;
            for j in 0..N {
                let angle = TAU * half(j);
                let (x, y) = (a * polar.sin() * angle.cos(), b * polar.sin() * angle.sin());
                column(x, y, height(polar.cos()), area);
            }
        }
    };
    match *shape {
        Shape::Sphere { radius } => disc(radius, radius, &|c| radius * c, &mut column),
        Shape::Ellipsoid {
            semi_axes: [a, b, c],
        } => disc(a, b, &|z| c * z, &mut column),
        Shape::Cylinder {
            radius,
            half_length,
        } => disc(radius, radius, &|_| half_length, &mut column),
        Shape::Capsule {
            radius,
            half_length,
        } => disc(radius, radius, &|c| half_length + radius * c, &mut column),
        Shape::Box { half: [a, b, c] } => {
            for i in 0..N {
                for j in 0..N {
                    let (x, y) = (a * (2.0 * half(i) - 1.0), b * (2.0 * half(j) - 1.0));
                    column(x, y, c, 4.0 * a * b / (N * N) as f64);
                }
            }
        }
        Shape::Mesh(_) => panic!("columns of a mesh"),
    }
    sum
}

#[test]
fn a_ball_is_its_cap() {
    let ball = Shape::Sphere { radius: 0.7 };
    let up = Vector3::new(0.6, 0.0, 0.8);
    for level in [-0.7, -0.6999, -0.3, 0.0, 0.2, 0.69, 0.7] {
        let height: f64 = level + 0.7;
        let cap = PI * height * height * (3.0 * 0.7 - height) / 3.0;
        let centre = -3.0 * (1.4 - height) * (1.4 - height) / (4.0 * (2.1 - height));
        let part = ball.below(&up, level);
        assert!((part.volume - cap).abs() < 1e-15);
        assert!((part.moment - cap * centre * up).norm() < 1e-15);
    }
}

#[test]
fn every_primitive_is_what_columns_sum_to() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for shape in one_of_each() {
        for _ in 0..12 {
            let (up, share) = draw(&mut runner, (unit(), -0.98..0.98));
            if up.z.abs() < 0.1 {
                continue;
            }
            let level = level_at(&shape, &up, share);
            let expected = by_columns(&shape, &up, level);
            let found = shape.below(&up, level);
            let (volume, length) = (shape.whole().volume, shape.bounding_radius());
            assert_close(&found, &expected, volume, length, 4e-6);
        }
    }
}

fn draw<S: Strategy>(runner: &mut proptest::test_runner::TestRunner, from: S) -> S::Value {
    use proptest::strategy::ValueTree;
    from.new_tree(runner).unwrap().current()
}

#[test]
fn every_primitive_is_what_a_fine_mesh_of_it_is() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for shape in one_of_each() {
        let mesh = Shape::Mesh(Arc::new(mesh_of(&shape, 0.015)));
        let exact = matches!(shape, Shape::Box { .. });
        let (volume, length) = (shape.whole().volume, shape.bounding_radius());
        for _ in 0..60 {
            let (up, share) = draw(&mut runner, (unit(), -1.1..1.1));
            let level = level_at(&shape, &up, share);
            let (found, expected) = (shape.below(&up, level), mesh.below(&up, level));
            let tolerance = if exact { 1e-12 } else { 4e-4 };
            assert_close(&found, &expected, volume, length, tolerance);
        }
    }
}

/// The flattest and the slimmest, to the last digits: no seam between the ways to compute them.
#[test]
fn slim_and_flat_cylinders_are_exact() {
    // A slice across the axis at a plane along it is a segment of the disc.
    let rod = Shape::Cylinder {
        radius: 0.1,
        half_length: 2.0,
    };
    let along = Vector3::x();
    for chord in [-0.999_f64, -0.5, 0.0, 0.3, 0.999] {
        let root = (1.0 - chord * chord).sqrt();
        let area = 0.01 * (PI - chord.acos() + chord * root);
        let moment = -2.0 / 3.0 * 0.001 * root.powi(3);
        let part = rod.below(&along, 0.1 * chord);
        assert!((part.volume - 4.0 * area).abs() < 1e-15, "{chord}");
        assert!((part.moment - Vector3::new(4.0 * moment, 0.0, 0.0)).norm() < 1e-16);
    }
    // A plane that passes the rims and not the ends: a cut at the mean height.
    let up: Vector3<f64> = Vector3::new(0.03, 0.04, 0.0);
    let up = up + Vector3::z() * (1.0 - up.norm_squared()).sqrt();
    let (s, c) = (0.05, up.z);
    let part = rod.below(&up, 0.4 * c);
    assert!((part.volume - PI * 0.01 * 2.4).abs() < 1e-15);
    // Second moment of the waterplane, tilted: lateral -pi r^4 / 4 tan, axial pi r^4 / 8 tan^2.
    let quartic = PI * 1e-4;
    let tan = s / c;
    let lateral = -quartic / 4.0 * tan;
    let axial = PI * 0.01 * 0.5 * (0.16 - 4.0) + quartic / 8.0 * tan * tan;
    let expected = Vector3::new(0.6 * lateral, 0.8 * lateral, axial);
    assert!(
        (part.moment - expected).norm() < 1e-15,
        "{:?}",
        part.moment - expected
    );
}

/// Values by `mpmath` with 40 digits, from the areas of slices: parts of `up` along x and z, level; volume, moment along x and z.
/// Radius 0.25, half length 0.4.
#[rustfmt::skip]
const SLICES: [(bool, [f64; 3], [f64; 3]); 12] = [
    // Cylinders.
    (false, [0.6, 0.8, 0.17], [0.120_264_093_770_234_28, -0.002_300_971_181_828_461_8, -0.010_411_894_597_773_792]),
    (false, [0.6, -0.8, -0.41], [0.000_854_955_498_426_165_9, -0.000_177_608_802_247_274_96, 0.000_323_470_145_314_210_06]),
    (false, [0.001, 0.999_999_499_999_874_9, 0.31], [0.139_408_204_437_248_75, -3.067_963_109_753_221e-6, -0.006_273_356_861_549_924]),
    (false, [0.9999, 0.014_141_782_065_920_051, 0.1], [0.117_445_902_155_336_33, -0.006_413_656_643_179_578, -0.000_276_507_002_809_786_04]),
    (false, [0.999_999_995, -9.999_999_957_112_645e-5, -0.2], [0.008_175_055_768_553_133, -0.001_800_000_001_777_785_6, 1.279_999_964_248_687_5e-6]),
    (false, [0.28, 0.96, 0.43], [0.156_851_949_117_899_6, -4.865_556_765_620_814e-5, -8.943_273_968_259_415e-5]),
    // Capsules.
    (true, [0.6, 0.8, 0.17], [0.152_989_017_245_127_95, -0.002_300_971_181_828_461_8, -0.026_569_825_563_502_545]),
    (true, [0.6, -0.8, -0.41], [0.015_867_945_597_568_184, -0.001_406_625_952_744_950_3, 0.008_204_167_455_297_619]),
    (true, [0.001, 0.999_999_499_999_874_9, 0.31], [0.172_133_127_912_142_41, -3.067_963_109_753_221e-6, -0.022_431_287_827_278_68]),
    (true, [0.9999, 0.014_141_782_065_920_051, 0.1], [0.168_741_199_506_036_2, -0.008_576_012_175_376_012, -0.000_861_578_506_946_133_1]),
    (true, [0.999_999_995, -9.999_999_957_112_645e-5, -0.2], [0.010_007_652_968_456_788, -0.002_197_608_042_522_959_3, 2.810_734_105_152_278e-6]),
    (true, [0.28, 0.96, 0.43], [0.198_732_750_454_630_9, -0.000_802_316_411_034_462_2, -0.012_267_850_108_451_746]),
];

#[test]
fn cylinders_and_capsules_are_exact() {
    let (radius, half_length) = (0.25, 0.4);
    for (round, [across, along, level], [volume, x, z]) in SLICES {
        let shape = if round {
            Shape::Capsule {
                radius,
                half_length,
            }
        } else {
            Shape::Cylinder {
                radius,
                half_length,
            }
        };
        let found = shape.below(&Vector3::new(across, 0.0, along), level);
        let expected = Part {
            volume,
            moment: Vector3::new(x, 0.0, z),
        };
        assert_close(&found, &expected, shape.whole().volume, 0.5, 1e-14);
        let found = shape.below(&Vector3::new(0.0, -across, along), level);
        let expected = Part {
            volume,
            moment: Vector3::new(0.0, -x, z),
        };
        assert_close(&found, &expected, shape.whole().volume, 0.5, 1e-14);
    }
}

#[test]
fn a_capsule_without_length_is_a_ball() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    for _ in 0..3000 {
        let (up, level) = draw(&mut runner, (unit(), -1.01..1.01));
        let ball = Shape::Sphere { radius: 1.0 }.below(&up, level);
        let capsule = Shape::Capsule {
            radius: 1.0,
            half_length: 0.0,
        };
        assert_close(&capsule.below(&up, level), &ball, 1.0, 1.0, 3e-15);
    }
}

/// Volume and moment for small turns and shifts about places where formulas meet.
#[test]
fn no_seams() {
    let mut worst: f64 = 0.0;
    for shape in one_of_each() {
        let (volume, size) = (shape.whole().volume, shape.bounding_radius());
        for base in [
            Vector3::z(),
            -Vector3::z(),
            Vector3::x(),
            Vector3::y(),
            Vector3::new(0.6, 0.0, 0.8),
        ] {
            for share in [-1.0, -0.999, -0.5, 0.0, 0.1, 0.7, 1.0] {
                let level = level_at(&shape, &base, share);
                let at = |tilt: f64, shift: f64| {
                    let up = (base + tilt * Vector3::new(0.48, 0.64, 0.6)).normalize();
                    shape.below(&up, level + shift)
                };
                let still = at(0.0, 0.0);
                for exponent in 1..18 {
                    let small = 0.1_f64.powi(exponent);
                    for (tilt, shift) in
                        [(small, 0.0), (-small, 0.0), (0.0, small), (small, -small)]
                    {
                        let near = at(tilt, shift);
                        let bound = 40.0 * small + 4e-13;
                        let off = (near.volume - still.volume).abs() / volume;
                        let moment = (near.moment - still.moment).norm() / (volume * size);
                        worst = worst.max((off - 40.0 * small).max(moment - 40.0 * small));
                        assert!(
                            off < bound && moment < bound,
                            "{shape:?} {base:?} {share} {tilt:e} {shift:e}: {off:e} {moment:e}"
                        );
                    }
                }
            }
        }
    }
    assert!(worst < 1e-13, "{worst:e}");
}

/// A tilt that takes the narrowness of a cylinder over its bound.
#[test]
fn quadrature_and_antiderivatives_agree() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut worst: f64 = 0.0;
    for _ in 0..2000 {
        let (share, turn, half_length) = draw(&mut runner, (-1.0..1.0, 0.0..TAU, 0.1..4.0));
        let shape = Shape::Cylinder {
            radius: 1.0,
            half_length,
        };
        // 2 h along = 0.1 across.
        let tan: f64 = 20.0 * half_length;
        let at = |nudge: f64| {
            let angle = tan.atan() * (1.0 + nudge);
            let up = Vector3::new(
                angle.sin() * turn.cos(),
                angle.sin() * turn.sin(),
                angle.cos(),
            );
            shape.below(&up, level_at(&shape, &up, share))
        };
        let [before, after] = [at(-1e-13), at(1e-13)];
        let volume = shape.whole().volume;
        worst = worst.max((before.volume - after.volume).abs() / volume);
        worst =
            worst.max((before.moment - after.moment).norm() / (volume * shape.bounding_radius()));
    }
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn the_waterplane_is_how_fast_the_volume_grows() {
    let grows = |shape: &Shape, up: Vector3<f64>, level: f64| {
        let step = 1e-5;
        (shape.below(&up, level + step).volume - shape.below(&up, level - step).volume)
            / (2.0 * step)
    };
    let [sphere, ellipsoid, cuboid, rod, _, capsule] = &one_of_each()[..] else {
        panic!("six shapes");
    };
    let close =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    close(grows(sphere, Vector3::x(), 0.1), PI * (0.09 - 0.01));
    close(grows(ellipsoid, Vector3::z(), 0.3), PI * 0.1 * 0.75);
    close(grows(cuboid, Vector3::y(), 0.3), 0.6 * 0.4);
    close(grows(rod, Vector3::z(), 0.3), PI * 0.09);
    close(grows(rod, Vector3::y(), 0.0), 0.6 * 1.0);
    close(grows(capsule, Vector3::z(), 0.5), PI * (0.0625 - 0.01));
    close(grows(capsule, Vector3::x(), 0.15), 0.4 * 0.8 + PI * 0.04);
    // An ellipse of the tilted cut.
    let up = Vector3::new(0.28, 0.0, 0.96);
    close(grows(rod, up, 0.1), PI * 0.09 / 0.96);
}

/// For every shape: `moment.up` is the integral of level over volume, and the waterplane's first moment, which is how fast
/// the moment grows with the level, is how fast the volume falls with a tilt.
fn obeys_the_identities(shape: &Shape, up: &Vector3<f64>, level: f64) {
    const STEPS: usize = 2000;
    let (volume, size) = (shape.whole().volume, shape.bounding_radius());
    let part = shape.below(up, level);
    let (low, _) = shape.reach(up);
    let step = (level - low) / STEPS as f64;
    let sum: f64 = (0..STEPS)
        .map(|k| shape.below(up, low + (k as f64 + 0.5) * step).volume * step)
        .sum();
    let along = level * part.volume - sum;
    let off = (part.moment.dot(up) - along).abs() / (volume * size);
    assert!(off < 2e-6, "{shape:?} {up:?} {level}: {off:e} along");

    let small = 1e-5 * size;
    let tangents = [
        up.cross(&Vector3::ith(up.iamin(), 1.0)).normalize(),
        up.cross(&up.cross(&Vector3::ith(up.iamin(), 1.0)))
            .normalize(),
    ];
    let grows = (shape.below(up, level + small).moment - shape.below(up, level - small).moment)
        / (2.0 * small);
    for tangent in tangents {
        let tilted = |angle: f64| {
            let up = up * angle.cos() + tangent * angle.sin();
            shape.below(&up, level).volume
        };
        let falls = -(tilted(1e-5) - tilted(-1e-5)) / 2e-5;
        let off = (grows.dot(&tangent) - falls).abs() / volume;
        // Where the waterplane's outline turns sharply, differences are of first order.
        assert!(off < 2e-3, "{shape:?} {up:?} {level}: {off:e} across");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn the_identities_hold(shape in any_shape(), up in unit(), share in -0.95..0.95) {
        let level = level_at(&shape, &up, share);
        obeys_the_identities(&shape, &up, level);
    }

    #[test]
    fn the_wet_and_the_dry_part_are_the_whole(shape in any_shape(), up in unit_or_axis(), share in -1.1..1.1) {
        let level = level_at(&shape, &up, share);
        let both = shape.below(&up, level) + shape.below(&-up, -level);
        let whole = shape.whole();
        assert_close(&both, &whole, whole.volume, shape.bounding_radius(), 2e-13);
    }

    #[test]
    fn more_is_wet_at_a_higher_level(shape in any_shape(), up in unit_or_axis(), share in -1.1..1.1, rise in 0.0..0.3) {
        let (lower, upper) = (level_at(&shape, &up, share), level_at(&shape, &up, share + rise));
        let whole = shape.whole().volume;
        let (before, after) = (shape.below(&up, lower), shape.below(&up, upper));
        prop_assert!(before.volume <= after.volume + 1e-13 * whole);
        prop_assert!(before.volume >= 0.0 && after.volume <= whole * (1.0 + 1e-13));
        // No more than a slab of the ball about it.
        let slab = PI * shape.bounding_radius().powi(2) * (upper - lower);
        prop_assert!(after.volume - before.volume <= slab + 1e-13 * whole);
    }

    #[test]
    fn turned_about_its_axis_a_round_shape_is_the_same(
        radius in 0.05..2.0, half_length in 0.05..2.0, up in unit_or_axis(), share in -1.0..1.0, angle in 0.0..TAU,
    ) {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        for shape in [Shape::Cylinder { radius, half_length }, Shape::Capsule { radius, half_length }] {
            let level = level_at(&shape, &up, share);
            let one = shape.below(&up, level);
            let turned = shape.below(&(turn * up), level);
            let back = Part { volume: turned.volume, moment: turn.inverse() * turned.moment };
            assert_close(&back, &one, shape.whole().volume, shape.bounding_radius(), 1e-13);
        }
    }

    #[test]
    fn a_ball_has_no_attitude(radius in 0.01..3.0, up in unit(), share in -1.0..1.0) {
        let round = Shape::Ellipsoid { semi_axes: [radius; 3] };
        let (ball, level) = (Shape::Sphere { radius }, share * radius);
        let upright = ball.below(&Vector3::z(), level);
        let expected = Part { volume: upright.volume, moment: upright.moment.z * up };
        assert_close(&ball.below(&up, level), &expected, ball.whole().volume, radius, 1e-14);
        assert_close(&round.below(&up, level), &expected, ball.whole().volume, radius, 1e-14);
    }

    #[test]
    fn nothing_panics(
        kind in 0..5, sizes in prop::array::uniform3(wild()), up in prop::array::uniform3(wild()), level in wild(),
    ) {
        let [radius, half_length, _] = sizes;
        let shape = match kind {
            0 => Shape::Sphere { radius },
            1 => Shape::Ellipsoid { semi_axes: sizes },
            2 => Shape::Box { half: sizes },
            3 => Shape::Cylinder { radius, half_length },
            _ => Shape::Capsule { radius, half_length },
        };
        let up = Vector3::from(up);
        let _ = shape.below(&up, level);
        let _ = (shape.whole(), shape.bounding_radius(), shape.reach(&up), shape.contains(&up));
    }
}

/// Numbers that are none, and numbers that overflow.
fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        Just(-0.0),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(1e300),
        Just(-1e300),
        Just(1e-300),
        Just(1.0),
        -1.0..1.0,
    ]
}

#[test]
fn not_a_number_is_not_a_number_and_no_end_is_all_or_nothing() {
    for shape in one_of_each()
        .into_iter()
        .chain([Shape::Mesh(Arc::new(angle()))])
    {
        let up = Vector3::z();
        assert!(shape.below(&up, f64::NAN).volume.is_nan());
        assert!(
            shape
                .below(&Vector3::new(0.0, f64::NAN, 1.0), 0.0)
                .volume
                .is_nan()
        );
        assert_eq!(shape.below(&up, f64::INFINITY), shape.whole());
        assert_eq!(shape.below(&up, f64::NEG_INFINITY), Part::NONE);
    }
}

#[test]
fn without_volume_nothing_is_displaced() {
    let flat = [
        Shape::Sphere { radius: 0.0 },
        Shape::Ellipsoid {
            semi_axes: [0.0, 1.0, 1.0],
        },
        Shape::Box {
            half: [1.0, 0.0, 1.0],
        },
        Shape::Cylinder {
            radius: 0.0,
            half_length: 1.0,
        },
        Shape::Cylinder {
            radius: 1.0,
            half_length: 0.0,
        },
        Shape::Capsule {
            radius: 0.0,
            half_length: 1.0,
        },
    ];
    for shape in flat {
        for up in [
            Vector3::x(),
            Vector3::y(),
            Vector3::z(),
            Vector3::new(0.6, 0.0, -0.8),
        ] {
            for level in [-0.3, 0.0, 0.3] {
                let part = shape.below(&up, level);
                assert_eq!(part.volume, 0.0, "{shape:?}");
                assert!(part.moment.norm() < 1e-16, "{shape:?}");
            }
        }
    }
}
