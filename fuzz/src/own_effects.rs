//! A definition of the user's own effect. One that is accepted is the same effect when it comes back from JSON, and acts with
//! finite forces at its bounds.

use hydro_effects::{Entry, Target, TargetKind, effect, own};

use super::{effects, refused, robot};

/// Reads a definition.
pub fn read(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return false;
    };
    let id = match own::register_toml("probe", text) {
        Ok(id) => id,
        Err(error) => return refused(&error),
    };
    let definition = effect(id).definition().expect("it has one");
    let value = serde_json::from_str(definition).expect("it is JSON");
    let again = own::register_json("user.probe", &value).expect("it was accepted");
    assert_eq!(id, again, "{definition}");
    for (kind, name) in [
        (TargetKind::Body, robot::BODIES[0]),
        (TargetKind::Joint, robot::JOINTS[0]),
        (TargetKind::Joint, robot::JOINTS[1]),
    ] {
        let target = robot::target(kind, name);
        if effect(id).card().target == kind && effect(id).applies_to(&target) {
            at_bounds(id, name, &target);
        }
    }
    true
}

fn at_bounds(id: hydro_effects::Id, name: &str, target: &Target) {
    let parameters = effect(id).parameters(target);
    for choose in [
        |low: f64, _: f64, _: f64| low,
        |_, high, _| high,
        |_, _, null| null,
    ] {
        let values = parameters
            .iter()
            .map(|of| choose(of.lower, of.upper, of.null));
        effects::apply(&Entry {
            effect: id,
            target: name.to_owned(),
            parameters: values.collect(),
        });
    }
}
