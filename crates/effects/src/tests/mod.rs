//! Properties of every effect, and of bodies in free motion.

use nalgebra::{Matrix6, Vector3, Vector6};
use proptest::prelude::*;

mod files;
pub(crate) mod fixture;
mod fossen;
mod free_motion;
mod odd_numbers;
mod whole_matrix;

use crate::{BodyPart, Effect, Id, Motion, Part, Physical, Target, TargetKind, all, effect};
use fixture::{any_motion, body_scale, still, target, vector};

/// Every effect that is a wrench on a body.
fn body_parts() -> impl Iterator<Item = (&'static dyn Effect, &'static dyn BodyPart)> {
    all().filter_map(|effect| match effect.part() {
        Part::Body(part) => Some((effect, part)),
        _ => None,
    })
}

/// Parameters about their nulls, within bounds, from numbers between -1 and 1.
fn drawn(effect: &dyn Effect, motion: &Motion, draws: &[f64]) -> Vec<f64> {
    effect
        .parameters(&Target::Body(body_scale(motion)))
        .iter()
        .zip(draws)
        .map(|(parameter, draw)| {
            let value = parameter.null + 1.5 * draw * parameter.prior_sd;
            value.clamp(parameter.lower, parameter.upper)
        })
        .collect()
}

/// Memory after a short and jerky past.
fn warmed(part: &dyn BodyPart, p: &[f64], motion: &Motion, draws: &[f64]) -> Vec<f64> {
    let mut memory = vec![0.0; part.memory_len()];
    let mut past = motion.clone();
    for (index, draw) in draws.iter().enumerate() {
        past.time = motion.time - 0.05 * (draws.len() - index) as f64;
        past.linear = motion.linear.map(|speed| speed + draw);
        past.angular = motion.angular.map(|rate| rate - draw);
        part.advance(p, &past, 0.05, &mut memory);
    }
    memory
}

fn power(motion: &Motion, wrench: [f64; 6]) -> f64 {
    let velocity = motion.linear.iter().chain(&motion.angular);
    wrench.iter().zip(velocity).map(|(f, v)| f * v).sum()
}

/// Size of a wrench, for tolerances.
fn size(wrench: &[f64; 6]) -> f64 {
    wrench.iter().map(|f| f.abs()).fold(0.0, f64::max)
}

#[test]
fn the_catalogue_is_complete_and_each_stands_under_its_own_name() {
    assert_eq!(all().count(), 34);
    for &id in Id::ALL {
        assert_eq!(effect(id).card().id, id);
    }
}

/// A file is read without a trial: what it may say cannot depend on how fast one was driven.
#[test]
fn bounds_do_not_depend_on_the_motion() {
    let scales = |kind: TargetKind, motion: f64| match target(kind) {
        Target::Body(mut scale) => {
            (scale.speed, scale.rate) = (motion, 2.0 * motion);
            Target::Body(scale)
        }
        Target::Joint(mut scale) => {
            (scale.speed, scale.travel) = (motion, 0.3 * motion);
            Target::Joint(scale)
        }
        Target::Actuator(mut scale) => {
            scale.inflow = motion;
            Target::Actuator(scale)
        }
        other => other,
    };
    for effect in all() {
        let card = effect.card();
        let bounds = |motion: f64| -> Vec<(String, f64, f64, Physical)> {
            let parameters = effect.parameters(&scales(card.target, motion)).into_iter();
            parameters
                .map(|p| {
                    assert!(p.lower <= p.start && p.start <= p.upper, "{p:?}");
                    (p.name, p.lower, p.upper, p.physical)
                })
                .collect()
        };
        let still = bounds(0.0);
        for motion in [0.01, 1.0, 30.0, 1000.0] {
            assert_eq!(bounds(motion), still, "{:?} at {motion}", card.id);
        }
    }
}

/// The memory of an effect that remembers motion alone is the same whatever its amplitudes.
#[test]
fn memory_of_the_motion_alone_is_the_same_for_all_amplitudes() {
    let mut remembering = 0;
    for effect in all() {
        let Part::Body(part) = effect.part() else {
            continue;
        };
        if part.memory_len() == 0 || !part.remembers_motion_alone() {
            continue;
        }
        remembering += 1;
        let parameters = effect.parameters(&target(effect.card().target));
        let values = |amplitude: f64| -> Vec<f64> {
            let of = parameters.iter();
            of.map(|p| {
                if p.shapes {
                    p.start
                } else {
                    p.start + amplitude * p.prior_sd
                }
            })
            .collect()
        };
        let draws = [0.3, -0.2, 0.5, 0.1];
        let memory = |amplitude| warmed(part, &values(amplitude), &fixture::still(), &draws);
        assert_eq!(memory(0.0), memory(0.7), "{}", effect.card().id);
        assert!(memory(0.0).iter().any(|value| *value != 0.0));
    }
    assert_eq!(remembering, 2);
}

#[test]
fn every_card_and_parameter_is_filled_in() {
    for effect in all() {
        let card = effect.card();
        for text in [card.summary, card.equation, card.source] {
            assert!(
                !text.trim().is_empty() && !text.contains("  "),
                "{}: {text}",
                card.id
            );
        }
        let parameters = effect.parameters(&target(card.target));
        assert!(!parameters.is_empty(), "{}", card.id);
        for parameter in &parameters {
            let place = format!("{} {}", card.id, parameter.name);
            assert!(
                !parameter.name.is_empty() && !parameter.unit.is_empty(),
                "{place}"
            );
            assert!(
                parameter.null.is_finite() && parameter.start.is_finite(),
                "{place}"
            );
            assert!(
                parameter.prior_sd.is_finite() && parameter.prior_sd > 0.0,
                "{place}"
            );
            assert!(parameter.lower < parameter.upper, "{place}");
            for value in [parameter.null, parameter.start] {
                assert!(
                    (parameter.lower..=parameter.upper).contains(&value),
                    "{place}"
                );
            }
            let same = parameters
                .iter()
                .filter(|other| other.name == parameter.name);
            assert_eq!(same.count(), 1, "{place}");
        }
        // What may be left out comes last, and only bodies have any.
        let optional: Vec<bool> = parameters.iter().map(|of| of.optional).collect();
        assert!(optional.is_sorted() && !optional[0], "{}", card.id);
        assert!(
            card.target == TargetKind::Body || !optional.contains(&true),
            "{}",
            card.id
        );
    }
}

#[test]
fn priors_of_a_body_without_sizes_are_finite() {
    let mut scale = body_scale(&still());
    (
        scale.mass,
        scale.volume,
        scale.density,
        scale.speed,
        scale.rate,
    ) = (0.0, 0.0, 0.0, 0.0, 0.0);
    (scale.inertia, scale.extent, scale.gravity) = ([0.0; 3], [0.0; 3], 0.0);
    for (effect, _) in body_parts() {
        for parameter in effect.parameters(&Target::Body(scale.clone())) {
            assert!(parameter.prior_sd.is_finite() && parameter.prior_sd > 0.0);
            assert!((parameter.lower..=parameter.upper).contains(&parameter.null));
            assert!(parameter.lower < parameter.upper);
        }
    }
}

/// Values within the bounds of a fit are within the bounds used without trials.
#[test]
fn bounds_do_not_depend_on_the_speed_of_the_trials() {
    let fast = body_scale(&still());
    let mut unknown = fast.clone();
    (unknown.speed, unknown.rate) = (0.0, 0.0);
    for effect in all() {
        let with = effect.parameters(&Target::Body(fast.clone()));
        let without = effect.parameters(&Target::Body(unknown.clone()));
        for (with, without) in with.iter().zip(&without) {
            assert_eq!((with.lower, with.upper), (without.lower, without.upper));
        }
    }
}

/// Parameters without an effect while the amplitudes are zero.
#[test]
fn what_shapes_an_effect_is_known_by_name() {
    const SHAPES: [&str; 7] = [
        "frequency",
        "phase",
        "vertical_lag",
        "rate",
        "length",
        "stribeck_speed",
        "reference",
    ];
    for effect in all() {
        let card = effect.card();
        for p in effect.parameters(&target(card.target)) {
            let name = p.name.as_str();
            let is_place = card.id == Id::Payload && ["x", "y", "z"].contains(&name);
            assert_eq!(
                p.shapes,
                is_place || SHAPES.contains(&name),
                "{} {name}",
                card.id
            );
        }
    }
}

#[test]
fn at_the_null_nothing_happens() {
    let mut motion = still();
    (motion.linear, motion.angular) = ([0.4, -0.2, 0.1], [0.3, 0.5, -0.7]);
    (motion.depth, motion.wall) = (Some(0.1), Some((0.2, [1.0, 0.0, 0.0])));
    for (effect, part) in body_parts() {
        let p: Vec<_> = effect
            .parameters(&Target::Body(body_scale(&motion)))
            .iter()
            .map(|parameter| parameter.null)
            .collect();
        let memory = warmed(part, &p, &motion, &[0.3, -0.4, 0.1]);
        assert_eq!(size(&part.wrench(&p, &motion, &memory)), 0.0, "{effect:?}");
        if let Some(inertia) = part.inertia(&p, &motion) {
            assert_eq!(inertia, Matrix6::zeros(), "{effect:?}");
        }
    }
}

#[test]
fn absurd_input_gives_finite_wrenches() {
    let speeds = [0.0, -0.0, 1e-300, 1e300, -1e300, f64::MAX, f64::MIN];
    for (effect, part) in body_parts() {
        for (at, &speed) in speeds.iter().enumerate() {
            let other = speeds[(at + 3) % speeds.len()];
            let mut motion = still();
            (motion.linear, motion.angular) = ([speed, other, -speed], [other, speed, 1.0]);
            (motion.middle, motion.centre) = ([speed; 3], [other; 3]);
            (motion.extent, motion.volume, motion.density) = ([speed, other, 0.0], speed, other);
            motion.gravity = [other, speed, 0.0];
            motion.water_acceleration = [speed, other, speed];
            motion.depth = Some(speed);
            motion.wall = Some((other, [0.0, 0.0, 1.0]));
            for value in [0.0, 1.0, -1.0, 1e300, -1e300] {
                let count = effect.parameters(&Target::Body(body_scale(&still()))).len();
                let p = vec![value; count];
                let mut memory = vec![0.0; part.memory_len()];
                part.advance(&p, &motion, 0.01, &mut memory);
                motion.time += 0.01;
                part.advance(&p, &motion, 0.01, &mut memory);
                let wrench = part.wrench(&p, &motion, &memory);
                assert!(
                    wrench.iter().all(|f| f.is_finite()),
                    "{effect:?} {speed} {value}"
                );
                let inertia = part.inertia(&p, &motion).unwrap_or_else(Matrix6::zeros);
                assert!(
                    inertia.iter().all(|m| m.is_finite()),
                    "{effect:?} {speed} {value}"
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damping_is_the_slope_of_the_wrench(
        motion in any_motion(),
        draws in prop::array::uniform8(-1.0..1.0),
    ) {
        for (effect, part) in body_parts() {
            let p = drawn(effect, &motion, &draws);
            let memory = warmed(part, &p, &motion, &draws[..3]);
            let damping = part.damping(&p, &motion, &memory).unwrap_or_else(Matrix6::zeros);
            let step = 1e-5;
            for axis in 0..6 {
                let moved = |by: f64| {
                    let mut motion = motion.clone();
                    if axis < 3 {
                        motion.linear[axis] += by;
                    } else {
                        motion.angular[axis - 3] += by;
                    }
                    part.wrench(&p, &motion, &memory)
                };
                let (before, after) = (moved(-step), moved(step));
                // Rounding of the difference, and the kink of a square that changes sign within it.
                let scale = size(&after) + damping.amax();
                for row in 0..6 {
                    let slope = (after[row] - before[row]) / (2.0 * step);
                    let fault = (slope + damping[(row, axis)]).abs();
                    prop_assert!(fault < 1e-4 * (scale + 1e-3), "{effect:?} row {row} axis {axis}: {slope} {}", damping[(row, axis)]);
                }
            }
        }
    }

    #[test]
    fn sensitivities_are_the_slopes_of_the_wrench(
        motion in any_motion(),
        draws in prop::array::uniform8(-1.0..1.0),
    ) {
        for (effect, part) in body_parts() {
            let p = drawn(effect, &motion, &draws);
            let memory = warmed(part, &p, &motion, &draws[..3]);
            let columns = part.by_parameters(&p, &motion, &memory);
            prop_assert_eq!(columns.len(), p.len());
            for (index, column) in columns.iter().enumerate() {
                let step = 1e-5 * p[index].abs().max(1.0);
                let moved = |by: f64| {
                    let mut p = p.clone();
                    p[index] += by;
                    part.wrench(&p, &motion, &memory)
                };
                let (before, after) = (moved(-step), moved(step));
                let scale = size(&after) + size(column);
                for row in 0..6 {
                    let slope = (after[row] - before[row]) / (2.0 * step);
                    prop_assert!((slope - column[row]).abs() < 1e-4 * (scale + 1e-3), "{effect:?} row {row} parameter {index}: {slope} {}", column[row]);
                }
            }
        }
    }

    #[test]
    fn inertia_is_symmetric_and_positive(
        motion in any_motion(),
        draws in prop::array::uniform8(-1.0..1.0),
        velocity in prop::array::uniform6(-1.0..1.0),
    ) {
        for (effect, part) in body_parts() {
            let p = drawn(effect, &motion, &draws);
            if let Some(inertia) = part.inertia(&p, &motion) {
                prop_assert!((inertia - inertia.transpose()).amax() <= 1e-12 * inertia.amax());
                let least = inertia.symmetric_eigenvalues().min();
                prop_assert!(least >= -1e-12 * inertia.amax(), "{effect:?}: {least}");
                let velocity = Vector6::from(velocity);
                prop_assert!(velocity.dot(&(inertia * velocity)) >= -1e-12);
            }
        }
    }

    #[test]
    fn drag_only_takes_energy_out(
        motion in any_motion(),
        draws in prop::array::uniform8(-1.0..1.0),
    ) {
        for id in [Id::LinearDrag, Id::QuadraticDrag, Id::CrossFlowDrag] {
            let Part::Body(part) = effect(id).part() else { unreachable!() };
            let p = drawn(effect(id), &motion, &draws);
            let wrench = part.wrench(&p, &motion, &[]);
            prop_assert!(power(&motion, wrench) <= 1e-12 * size(&wrench), "{id}");
        }
        for id in [Id::FreeSurface, Id::WallProximity] {
            let Part::Body(part) = effect(id).part() else { unreachable!() };
            let mut p = drawn(effect(id), &motion, &draws);
            p[2] = 0.0;
            let wrench = part.wrench(&p, &motion, &[]);
            prop_assert!(power(&motion, wrench) <= 1e-12 * size(&wrench), "{id}");
        }
    }

    /// Cummins' and Basset's kernels have positive real parts: whatever the motion, work is taken out in all.
    #[test]
    fn memories_never_give_back_more_than_they_took(
        jerks in prop::collection::vec(vector(1.0), 20..60),
        draws in prop::array::uniform8(-1.0..1.0),
        middle in vector(0.2),
    ) {
        for id in [Id::WakeMemory, Id::BassetHistory] {
            let Part::Body(part) = effect(id).part() else { unreachable!() };
            let mut motion = still();
            motion.middle = middle;
            let p = drawn(effect(id), &motion, &draws);
            let mut memory = vec![0.0; part.memory_len()];
            let step = 0.002;
            let (mut work, mut handled) = (0.0, 0.0);
            for jerk in &jerks {
                // Straight lines of velocity, forty steps each.
                for _ in 0..40 {
                    let before = part.wrench(&p, &motion, &memory);
                    part.advance(&p, &motion, step, &mut memory);
                    let old = power(&motion, before);
                    for (axis, jerk) in jerk.iter().enumerate() {
                        motion.linear[axis] += jerk * step;
                        motion.angular[axis] -= 2.0 * jerk * step;
                    }
                    motion.time += step;
                    let new = power(&motion, part.wrench(&p, &motion, &memory));
                    work += 0.5 * (old + new) * step;
                    handled += 0.5 * (old.abs() + new.abs()) * step;
                }
            }
            prop_assert!(work <= 1e-3 * handled, "{id}: {work} of {handled}");
        }
    }

    /// The part that is quadratic in velocity turns momentum and does no work: what remains after the term
    /// M omega x v of the frame, which belongs to the acceleration.
    #[test]
    fn the_coriolis_part_of_added_mass_does_no_work(
        motion in any_motion(),
        draws in prop::array::uniform6(0.0..1.0),
    ) {
        let mut motion = motion;
        (motion.middle, motion.water_acceleration) = ([0.0; 3], [0.0; 3]);
        let Part::Body(part) = effect(Id::AddedMass).part() else { unreachable!() };
        let p = drawn(effect(Id::AddedMass), &motion, &draws);
        let mut wrench = part.wrench(&p, &motion, &[]);
        let frame = Vector3::from(motion.angular).cross(&Vector3::from(motion.linear));
        for axis in 0..3 {
            wrench[axis] -= p[axis] * frame[axis];
        }
        prop_assert!(power(&motion, wrench).abs() < 1e-9 * (1.0 + size(&wrench)));
    }

    #[test]
    fn what_weighs_does_not_feel_the_flow(
        motion in any_motion(),
        draws in prop::array::uniform8(-1.0..1.0),
        shift in vector(1.0),
    ) {
        for id in [Id::Payload, Id::NetBuoyancy, Id::BuoyancyOffset, Id::ConstantForce] {
            let Part::Body(part) = effect(id).part() else { unreachable!() };
            let p = drawn(effect(id), &motion, &draws);
            let mut carried = motion.clone();
            for (speed, shift) in carried.linear.iter_mut().zip(shift) {
                *speed += shift;
            }
            prop_assert_eq!(part.wrench(&p, &motion, &[]), part.wrench(&p, &carried, &[]));
        }
    }
}
