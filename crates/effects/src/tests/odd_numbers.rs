//! Effects with numbers of every size, and files of odd values: refused, or forces that are finite.

use proptest::prelude::*;
use serde_json::{Map, Value, json};

use super::fixture::{Model, any_motion, target};
use crate::{EffectSet, JointMotion, Part, all, effect};

/// A number of any size, the sizes evenly in their logarithm.
fn number() -> impl Strategy<Value = f64> {
    let decades = (-320.0..309.0f64, any::<bool>());
    prop_oneof![
        3 => decades.prop_map(|(decade, negative)| 10f64.powf(decade) * if negative { -1.0 } else { 1.0 }),
        1 => -2.0..2.0f64,
        1 => prop::sample::select(vec![0.0, -0.0, f64::MIN_POSITIVE, f64::MAX, 1e18, 1e-18]),
    ]
}

/// A file of the effect of a number in the catalogue, with these values.
fn file(which: usize, values: &[f64]) -> String {
    let effects: Vec<_> = all().collect();
    let of = effects[which % effects.len()];
    let kind = of.card().target;
    let parameters: Map<String, Value> = of
        .parameters(&target(kind))
        .iter()
        .zip(values.iter().cycle())
        .map(|(parameter, value)| (parameter.name.clone(), json!(value)))
        .collect();
    let name = match kind {
        crate::TargetKind::Body => "hull",
        crate::TargetKind::Joint => "knee",
        crate::TargetKind::Actuator => "thruster_1",
        crate::TargetKind::Sensor => "imu_gyro",
    };
    json!({"schema": "hydro-effects/1", "effects": [{"effect": of.card().id, "target": name, "parameters": parameters}]})
        .to_string()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn numbers_of_every_size_are_refused_or_give_finite_forces(
        which in 0..200usize, values in prop::collection::vec(number(), 1..10), motion in any_motion()
    ) {
        let set = match EffectSet::parse(&file(which, &values), &Model) {
            Ok(set) => set,
            Err(fault) => {
                prop_assert!(!fault.to_string().is_empty());
                return Ok(());
            }
        };
        for entry in &set.entries {
            let of = effect(entry.effect);
            let p = &entry.parameters;
            let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
            match of.part() {
                Part::Body(part) => {
                    let mut memory = vec![0.0; part.memory_len()];
                    part.advance(p, &motion, 0.002, &mut memory);
                    prop_assert!(finite(&memory), "{entry:?}");
                    prop_assert!(finite(&part.wrench(p, &motion, &memory)), "{entry:?}");
                    if let Some(inertia) = part.inertia(p, &motion) {
                        prop_assert!(finite(inertia.as_slice()), "{entry:?}");
                    }
                }
                Part::Joint(part) => {
                    let memory = vec![0.0; part.memory_len()];
                    let moving = JointMotion::new(0.3, -2.0);
                    prop_assert!(finite(&[part.force(p, &moving, &memory), part.damping(p, &moving, &memory)]), "{entry:?}");
                }
                Part::Actuator(part) => {
                    let mut memory = vec![0.0; part.memory_len(p, 0.002)];
                    let command = part.command(p, 0.7, 0.002, &mut memory);
                    prop_assert!(finite(&[command, part.force(p, command), part.force_factor(p, 0.5)]), "{entry:?}");
                }
                Part::Water(part) => prop_assert!(finite(&part.velocity(p, [1.0, 2.0, -3.0], 4.0)), "{entry:?}"),
                Part::Sensor(part) => {
                    prop_assert!(finite(&[part.delay(p), part.scale(p), part.bias(p, 0)]), "{entry:?}");
                }
            }
        }
        let written = set.to_json(&Model).expect("it was checked");
        prop_assert_eq!(EffectSet::parse(&written, &Model).expect("it was written"), set);
    }
}
