//! Velocity, acceleration and pressure of the water.

use std::f64::consts::{FRAC_PI_2, TAU};

use proptest::prelude::*;

use super::{GRAVITY, any_place, any_sea, read, sea};
use crate::sea::{Component, SeaNote, Wave, WaveField, wavenumber};

const WAVE: Wave = Wave {
    amplitude: 0.3,
    period: 4.0,
    direction: 0.5,
    phase: 0.2,
};

fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} is not {expected} to {tolerance:e}"
    );
}

/// Potential of the flow [m^2/s] by the library's hyperbolic functions: a g / omega cosh(k (z + d)) / cosh(k d) sin(phase).
fn potential(sea: &WaveField, [x, y, z]: [f64; 3], time: f64) -> f64 {
    let of = |wave: &Component| {
        let k = wave.wavenumber_norm();
        let decay = if sea.depth().is_finite() {
            (k * (z + sea.depth())).cosh() / (k * sea.depth()).cosh()
        } else {
            (k * z).exp()
        };
        let phase = wave.wavenumber[0] * x + wave.wavenumber[1] * y - wave.frequency * time;
        wave.amplitude * GRAVITY / wave.frequency * decay * (phase + wave.phase).sin()
    };
    sea.components().iter().map(of).sum()
}

/// Central difference of the fourth order.
fn rate(step: f64, f: impl Fn(f64) -> f64) -> f64 {
    (8.0 * (f(step) - f(-step)) - (f(2.0 * step) - f(-2.0 * step))) / (12.0 * step)
}

fn moved(point: [f64; 3], axis: usize, by: f64) -> [f64; 3] {
    let mut point = point;
    point[axis] += by;
    point
}

const STEP: f64 = 1e-3;
const TOLERANCE: f64 = 1e-9;

proptest! {
    #[test]
    fn velocity_is_the_gradient_of_the_potential_and_pressure_its_rate(
        sea in any_sea(), (point, time) in any_place()
    ) {
        let water = sea.kinematics(point, time);
        for axis in 0..3 {
            let slope = rate(STEP, |by| potential(&sea, moved(point, axis, by), time));
            assert_near(water.velocity[axis], slope, TOLERANCE);
        }
        let fall = -rate(STEP, |by| potential(&sea, point, time + by));
        assert_near(water.pressure, fall, TOLERANCE);
    }

    #[test]
    fn acceleration_is_the_rate_of_the_velocity_and_the_gradient_of_the_pressure(
        sea in any_sea(), (point, time) in any_place()
    ) {
        let acceleration = sea.acceleration(point, time);
        for (axis, found) in acceleration.into_iter().enumerate() {
            let rises = rate(STEP, |by| sea.velocity(point, time + by)[axis]);
            assert_near(found, rises, TOLERANCE);
            let pushes = -rate(STEP, |by| sea.pressure(moved(point, axis, by), time));
            assert_near(found, pushes, TOLERANCE);
        }
    }

    #[test]
    fn water_is_not_compressed_and_does_not_turn(sea in any_sea(), (point, time) in any_place()) {
        let slope = |component: usize, axis: usize| {
            rate(STEP, |by| sea.velocity(moved(point, axis, by), time)[component])
        };
        assert_near(slope(0, 0) + slope(1, 1) + slope(2, 2), 0.0, TOLERANCE);
        assert_near(slope(2, 1), slope(1, 2), TOLERANCE);
        assert_near(slope(0, 2), slope(2, 0), TOLERANCE);
        assert_near(slope(1, 0), slope(0, 1), TOLERANCE);
    }

    #[test]
    fn the_surface_moves_with_the_water_at_constant_pressure(
        sea in any_sea(), ([x, y, _], time) in any_place()
    ) {
        let water = sea.kinematics([x, y, 0.0], time);
        assert_near(water.pressure, GRAVITY * water.elevation, 1e-13);
        let rises = rate(STEP, |by| sea.elevation(x, y, time + by));
        assert_near(water.velocity[2], rises, TOLERANCE);
        assert_near(water.slope[0], rate(STEP, |by| sea.elevation(x + by, y, time)), TOLERANCE);
        assert_near(water.slope[1], rate(STEP, |by| sea.elevation(x, y + by, time)), TOLERANCE);
    }

    #[test]
    fn one_pass_gives_what_each_call_gives(sea in any_sea(), (point, time) in any_place()) {
        let water = sea.kinematics(point, time);
        let [x, y, _] = point;
        prop_assert_eq!(water.elevation.to_bits(), sea.elevation(x, y, time).to_bits());
        prop_assert_eq!(water.slope, sea.slope(x, y, time));
        prop_assert_eq!(water.velocity, sea.velocity(point, time));
        prop_assert_eq!(water.acceleration, sea.acceleration(point, time));
        prop_assert_eq!(water.pressure.to_bits(), sea.pressure(point, time).to_bits());
    }

    #[test]
    fn all_is_bounded_anywhere_and_always(
        sea in any_sea(), point in [-1e9..1e9, -1e9..1e9, -1e9..1e9], time in -1e9..1e9
    ) {
        let water = sea.kinematics(point, time);
        let bound = sea.highest() * (1.0 + 1e-12);
        prop_assert!(water.elevation.abs() <= bound);
        prop_assert!(water.pressure.abs() <= GRAVITY * bound);
        // No component is above a omega; the shortest period is 1.5 s, and the water may be shallow.
        let fastest = sea.components().iter().map(|wave| {
            wave.amplitude * GRAVITY * wave.wavenumber_norm() / wave.frequency
        });
        let fastest = fastest.sum::<f64>() * (1.0 + 1e-12);
        prop_assert!(water.velocity.iter().all(|speed| speed.abs() <= fastest));
    }
}

#[test]
fn a_deep_wave_in_closed_form() {
    let field = sea(
        &[Wave {
            direction: 0.0,
            ..WAVE
        }],
        None,
    );
    let omega = TAU / 4.0;
    let k = omega * omega / GRAVITY;
    let (x, z, time) = (3.0, -1.7, 9.4);
    let (sin, cos) = (k * x - omega * time + 0.2_f64).sin_cos();
    let decay = (k * z).exp();
    let water = field.kinematics([x, 5.0, z], time);
    assert_near(water.elevation, 0.3 * cos, 1e-14);
    assert_near(water.slope[0], -0.3 * k * sin, 1e-14);
    assert_near(water.velocity[0], 0.3 * omega * decay * cos, 1e-14);
    assert_near(water.velocity[2], 0.3 * omega * decay * sin, 1e-14);
    assert_near(
        water.acceleration[0],
        0.3 * omega * omega * decay * sin,
        1e-14,
    );
    assert_near(
        water.acceleration[2],
        -0.3 * omega * omega * decay * cos,
        1e-14,
    );
    assert_near(water.pressure, 0.3 * GRAVITY * decay * cos, 1e-14);
    assert_eq!(
        (water.slope[1], water.velocity[1], water.acceleration[1]),
        (0.0, 0.0, 0.0)
    );
}

/// NumPy and SciPy, each wave by cosh and sinh:
///
/// ```text
/// from math import *; from scipy.optimize import brentq
/// g, d, x, y, z, t, s = 9.81, 8.0, 3.0, -2.0, -1.5, 7.25, [0]*4
/// for a, T, b, f in (0.25, 4, 30, 10), (0.1, 2.5, -80, 200), (0.4, 9, 120, -45):
///     w, b, f = 2*pi/T, radians(b), radians(f)
///     k = brentq(lambda k: g*k*tanh(k*d) - w*w, 1e-4, 100, xtol=1e-16, rtol=1e-15)
///     th = k*(x*cos(b) + y*sin(b)) - w*t + f; c, h = cosh(k*(z + d)), sinh(k*(z + d))
///     s[0] += a*cos(th); s[1] += a*w*c/sinh(k*d)*cos(th)*cos(b)
///     s[2] -= a*w*w*h/sinh(k*d)*cos(th); s[3] += a*g*c/cosh(k*d)*cos(th)
/// print(s)
/// ```
#[test]
fn three_waves_as_computed_independently() {
    let field = read(
        r#"{"schema": "hydro-waves/1", "depth": 8, "components": [
            {"height": 0.5, "period": 4, "direction": 30, "phase": 10},
            {"amplitude": 0.1, "period": 2.5, "direction": -80, "phase": 200},
            {"amplitude": 0.4, "period": 9, "direction": 120, "phase": -45}]}"#,
    );
    let water = field.kinematics([3.0, -2.0, -1.5], 7.25);
    assert_near(water.elevation, 0.430_529_537_023_412, 1e-13);
    assert_near(water.velocity[0], -0.251_702_813_748_283_5, 1e-13);
    assert_near(water.acceleration[2], -0.275_902_519_407_631_55, 1e-13);
    assert_near(water.pressure, 3.599_285_675_936_194, 1e-12);
}

#[test]
fn deep_water_is_the_limit_of_depth() {
    let deep = sea(&[WAVE], None);
    for depth in [60.0, 1000.0, 20_000.0] {
        let finite = sea(&[WAVE], Some(depth));
        for z in [0.0, -0.5, -20.0, -59.0] {
            let (a, b) = (
                deep.kinematics([4.0, 1.0, z], 2.0),
                finite.kinematics([4.0, 1.0, z], 2.0),
            );
            assert_near(a.elevation, b.elevation, 1e-9);
            assert_near(a.velocity[0], b.velocity[0], 1e-6);
            assert_near(a.velocity[2], b.velocity[2], 1e-6);
            assert_near(a.pressure, b.pressure, 1e-6);
        }
    }
}

#[test]
fn shallow_water_moves_as_a_whole() {
    // A tenth of a metre, 30 s: k d = 0.02.
    let depth = 0.1;
    let wave = Wave {
        amplitude: 0.001,
        period: 30.0,
        direction: 0.0,
        phase: 0.0,
    };
    let field = sea(&[wave], Some(depth));
    let celerity = (GRAVITY * depth).sqrt();
    assert!((field.peak().length / (celerity * 30.0) - 1.0).abs() < 1e-3);
    for time in [0.0, 4.0, 11.0] {
        let elevation = field.elevation(2.0, 0.0, time);
        let surface = field.velocity([2.0, 0.0, 0.0], time);
        for share in [0.0, 0.3, 0.7, 1.0] {
            let water = field.kinematics([2.0, 0.0, -share * depth], time);
            assert_near(
                water.velocity[0],
                elevation * celerity / depth,
                1e-3 * 0.001 * celerity / depth,
            );
            assert_near(water.velocity[2], (1.0 - share) * surface[2], 1e-3 * 0.001);
            assert_near(water.pressure, GRAVITY * elevation, 1e-3 * GRAVITY * 0.001);
        }
    }
}

#[test]
fn above_the_still_level_all_is_as_at_it_and_below_the_bed_as_at_the_bed() {
    for depth in [None, Some(6.0)] {
        let field = sea(&[WAVE], depth);
        let level = field.kinematics([1.0, 2.0, 0.0], 3.0);
        assert_eq!(field.kinematics([1.0, 2.0, 0.2], 3.0), level);
        assert_eq!(field.kinematics([1.0, 2.0, 1e6], 3.0), level);
    }
    let field = sea(&[WAVE], Some(6.0));
    let bed = field.kinematics([1.0, 2.0, -6.0], 3.0);
    assert_eq!(field.kinematics([1.0, 2.0, -9.0], 3.0), bed);
    assert!(bed.velocity[2].abs() < 1e-16 && bed.acceleration[2].abs() < 1e-16);
    assert!(bed.velocity[0].abs() > 0.01);
}

/// The whole pressure, g (elevation - z) at the still level and above, is 0 on a crest.
#[test]
fn pressure_on_a_crest_is_zero() {
    let field = sea(&[Wave { phase: 0.0, ..WAVE }], None);
    let whole = field.pressure([0.0, 0.0, 0.3], 0.0) - GRAVITY * 0.3;
    assert_near(whole, 0.0, 1e-14);
}

#[test]
fn a_wave_travels_along_its_direction() {
    let field = sea(&[Wave { phase: 0.0, ..WAVE }], Some(5.0));
    let celerity = field.peak().length / 4.0;
    for time in [0.3, 5.0, 77.0] {
        let way = celerity * time;
        let crest = field.kinematics([way * 0.5_f64.cos(), way * 0.5_f64.sin(), 0.0], time);
        assert_near(crest.elevation, 0.3, 1e-12);
        // Under a crest the water moves with the wave.
        assert!(crest.velocity[0] > 0.0 && crest.velocity[1] > 0.0);
    }
}

#[test]
fn waves_add_up() {
    let other = Wave {
        amplitude: 0.1,
        period: 2.5,
        direction: -2.0,
        phase: 1.0,
    };
    let both = sea(&[WAVE, other], Some(7.0)).kinematics([1.0, 2.0, -0.4], 5.0);
    let [a, b] =
        [WAVE, other].map(|wave| sea(&[wave], Some(7.0)).kinematics([1.0, 2.0, -0.4], 5.0));
    assert_near(both.elevation, a.elevation + b.elevation, 1e-15);
    for axis in 0..3 {
        assert_near(
            both.velocity[axis],
            a.velocity[axis] + b.velocity[axis],
            1e-15,
        );
        assert_near(
            both.acceleration[axis],
            a.acceleration[axis] + b.acceleration[axis],
            1e-15,
        );
    }
}

#[test]
fn extreme_waves_and_depths_stay_numbers() {
    for period in [0.01, 0.3, 10.0, 10_000.0] {
        for depth in [None, Some(0.001), Some(1.0), Some(20_000.0)] {
            let wave = Wave {
                amplitude: 1e-7,
                period,
                direction: 1.0,
                phase: 0.0,
            };
            let field = sea(&[wave], depth);
            for z in [10.0, 0.0, -1e-3, -1.0, -300.0, -1e5, f64::NEG_INFINITY] {
                let water = field.kinematics([1.0, 1.0, z], 0.1);
                let all = [water.velocity, water.acceleration].concat();
                assert!(
                    all.iter().all(|number| number.is_finite()),
                    "{period} {depth:?} {z}"
                );
                assert!(water.pressure.abs() <= GRAVITY * 1e-7 * 1.000_001);
            }
        }
    }
    assert!(
        sea(&[WAVE], None)
            .kinematics([f64::NAN, 0.0, 0.0], 0.0)
            .elevation
            .is_nan()
    );
}

#[test]
fn gravity_sets_the_length() {
    let gentle = Wave {
        amplitude: 0.1,
        ..WAVE
    };
    let (moon, _) = WaveField::new(&[gentle], None, 1.62).expect("a sea");
    let expected = 1.62 * 16.0 / TAU;
    assert_near(moon.peak().length, expected, 1e-12);
    assert_eq!(moon.gravity().to_bits(), 1.62_f64.to_bits());
}

#[test]
fn the_sea_is_described_by_its_highest_and_its_shortest_noticeable_wave() {
    let swell = Wave {
        amplitude: 0.5,
        period: 8.0,
        direction: 0.1,
        phase: 0.0,
    };
    let ripple = |amplitude| Wave {
        amplitude,
        period: 1.0,
        direction: 0.0,
        phase: 0.0,
    };
    let length = |period: f64| TAU / wavenumber(TAU / period, f64::INFINITY, GRAVITY);
    let field = sea(&[ripple(0.02), swell], None);
    assert_near(field.shortest_length(), length(8.0), 1e-12);
    assert_eq!((field.peak().height, field.peak().direction), (1.0, 0.1));
    assert_near(field.highest(), 0.52, 1e-15);
    let field = sea(&[ripple(0.06), swell], None);
    assert_near(field.shortest_length(), length(1.0), 1e-12);
    assert_near(
        sea(&[swell], None).significant_height(),
        2.0_f64.sqrt(),
        1e-15,
    );
    let calm = sea(
        &[Wave {
            amplitude: 0.0,
            ..swell
        }],
        None,
    );
    assert_eq!(
        (calm.shortest_length(), calm.significant_height()),
        (f64::INFINITY, 0.0)
    );
    assert_eq!(calm.large_hull(1e6), None);
    assert_eq!(calm.elevation(1.0, 1.0, 1.0), 0.0);
}

#[test]
fn a_steep_sea_is_noted() {
    let notes = |amplitude: f64, period: f64, depth: Option<f64>| {
        let wave = Wave {
            amplitude,
            period,
            direction: 0.0,
            phase: FRAC_PI_2,
        };
        WaveField::new(&[wave], depth, GRAVITY).expect("a sea").1
    };
    // k a = 0.19 and 0.22 in deep water.
    assert!(notes(0.19 * 4.0 * GRAVITY / (TAU * TAU), 2.0, None).is_empty());
    let [SeaNote::Steep { second_harmonic }] =
        notes(0.22 * 4.0 * GRAVITY / (TAU * TAU), 2.0, None)[..]
    else {
        panic!("no note on a steep wave");
    };
    assert_near(second_harmonic, 0.11, 1e-12);
    // Gentle, but long in shallow water.
    let notes = notes(0.02, 10.0, Some(0.2));
    assert!(notes[0].to_string().contains("% higher"), "{notes:?}");
    // Two waves that are gentle one by one.
    let wave = Wave {
        amplitude: 0.12,
        period: 2.0,
        direction: 0.0,
        phase: 0.0,
    };
    assert!(
        WaveField::new(&[wave], None, GRAVITY)
            .expect("a sea")
            .1
            .is_empty()
    );
    assert_eq!(
        WaveField::new(&[wave; 2], None, GRAVITY)
            .expect("a sea")
            .1
            .len(),
        1
    );
}

#[test]
fn a_hull_that_is_large_beside_the_waves_is_noted() {
    let field = sea(&[WAVE], None);
    let length = field.peak().length;
    assert_eq!(field.large_hull(0.19 * length), None);
    assert_eq!(field.large_hull(f64::NAN), None);
    let note = field.large_hull(0.25 * length).expect("a note");
    let SeaNote::LargeHull { share, ratio, .. } = note else {
        panic!("another note: {note:?}");
    };
    assert_eq!(share, 1.0);
    assert!((0.8..0.94).contains(&ratio), "{ratio}");
    assert!(note.to_string().contains("100 % of the energy"), "{note}");
}
