//! `effects.json`. A list that is accepted is written and read back to the same, and its forces are finite.

use hydro_effects::{EffectSet, Entry, JointMotion, Part, effect};

use super::{refused, robot};

/// Reads a list of effects.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    let set = match EffectSet::parse(text, &robot::Robot) {
        Ok(set) => set,
        Err(error) => return refused(&error),
    };
    set.entries.iter().for_each(apply);
    let written = set.to_json(&robot::Robot).expect("it was checked");
    let again = EffectSet::parse(&written, &robot::Robot).expect("it was written");
    assert_eq!(set, again, "{written}");
    true
}

/// Lets an effect act for two steps.
pub(super) fn apply(entry: &Entry) {
    let of = effect(entry.effect);
    let p = &entry.parameters;
    if let Some(part) = of.body_part(p) {
        let mut memory = vec![0.0; part.memory_len()];
        for mut motion in robot::motions() {
            motion.commands = vec![0.5; of.commands().len()];
            finite(entry, &part.wrench(p, &motion, &memory));
            if let Some(inertia) = part.inertia(p, &motion) {
                finite(entry, inertia.as_slice());
            }
            if let Some(damping) = part.damping(p, &motion, &memory) {
                finite(entry, damping.as_slice());
            }
            part.advance(p, &motion, robot::TIMESTEP, &mut memory);
            finite(entry, &memory);
        }
        return;
    }
    match of.part() {
        Part::Joint(part) => {
            let mut memory = vec![0.0; part.memory_len()];
            for speed in [0.0, -3.0] {
                let motion = JointMotion {
                    commands: vec![0.5; of.commands().len()],
                    ..JointMotion::new(0.4, speed)
                };
                let force = part.force(p, &motion, &memory);
                finite(entry, &[force, part.damping(p, &motion, &memory)]);
                part.advance(p, &motion, robot::TIMESTEP, &mut memory);
                finite(entry, &memory);
            }
        }
        Part::Actuator(part) => {
            let mut memory = vec![0.0; part.memory_len(p, robot::TIMESTEP)];
            for command in [1.0, -0.5] {
                let command = part.command(p, command, robot::TIMESTEP, &mut memory);
                finite(
                    entry,
                    &[command, part.force(p, command), part.force_factor(p, 0.7)],
                );
            }
        }
        Part::Water(part) => {
            let place = [1.0, -2.0, -0.5];
            finite(entry, &part.velocity(p, place, 2.0));
            finite(entry, &part.acceleration(p, place, 2.0));
        }
        Part::Sensor(part) => {
            finite(entry, &[part.delay(p), part.scale(p), part.bias(p, 1)]);
        }
        Part::Body(_) => {}
    }
}

fn finite(entry: &Entry, numbers: &[f64]) {
    assert!(
        numbers.iter().all(|number| number.is_finite()),
        "{numbers:?} of {entry:?}"
    );
}
