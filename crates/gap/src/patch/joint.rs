//! Damping, spring, friction and backlash of a joint in plain MJCF.

use roxmltree::Node;

use super::{
    mjcf::Mjcf,
    xml_edit::{Edits, attribute, number, numbers},
};
use crate::plant::backlash;

/// Largest Stribeck excess, in parts of Coulomb's friction, that is written as MuJoCo's dry friction.
const LITTLE_EXCESS: f64 = 0.1;

/// True where the compiler sets spring and damping of a joint by itself.
fn tuned<'d>(model: &'d Mjcf<'d>, joint: Node<'d, 'd>) -> bool {
    let pair = model.attribute_numbers(joint, "springdamper");
    pair.len() == 2 && pair.iter().all(|number| *number > 0.0)
}

/// True for a hinge [rad], false for a slide [m], `None` for a joint with several coordinates.
fn turns<'d>(model: &'d Mjcf<'d>, joint: Node<'d, 'd>) -> Option<bool> {
    match model.attribute(joint, "type") {
        None | Some("hinge") => Some(true),
        Some("slide") => Some(false),
        Some(_) => None,
    }
}

/// A radian in the angle unit of the text.
fn angle_unit(model: &Mjcf<'_>) -> f64 {
    if model.setting("compiler", "angle") == Some("radian") {
        1.0
    } else {
        180.0 / std::f64::consts::PI
    }
}

/// Viscous damping [N m s/rad or N s/m] added to a joint's own.
pub(super) fn damping<'d>(
    model: &'d Mjcf<'d>,
    joint: Node<'d, 'd>,
    damping: f64,
) -> Option<String> {
    if tuned(model, joint) {
        return None;
    }
    let mut own = model.attribute_numbers(joint, "damping");
    match own.first_mut() {
        Some(linear) => *linear += damping,
        None => own.push(damping),
    }
    let mut edits = Edits::new(model.text);
    edits.set(joint, "damping", &numbers(&own));
    Some(edits.apply())
}

/// Rotor inertia [kg m^2 or kg] added to a joint's own.
pub(super) fn armature<'d>(model: &'d Mjcf<'d>, joint: Node<'d, 'd>, more: f64) -> String {
    let own = model.attribute_number(joint, "armature");
    let mut edits = Edits::new(model.text);
    edits.set(joint, "armature", &number(own + more));
    edits.apply()
}

/// A term of a joint's `damping` or `stiffness` times a factor, or every one; `None` where the text gives none.
pub(super) fn scaled<'d>(
    model: &'d Mjcf<'d>,
    joint: Node<'d, 'd>,
    attribute: &str,
    term: Option<usize>,
    factor: f64,
) -> Option<String> {
    let mut own = model.merged_numbers(joint, attribute);
    let terms = term.map_or(0..own.len(), |term| term..term + 1);
    if tuned(model, joint) || own.is_empty() {
        return None;
    }
    own.get_mut(terms)?
        .iter_mut()
        .for_each(|value| *value *= factor);
    let mut edits = Edits::new(model.text);
    edits.set(joint, attribute, &numbers(&own));
    Some(edits.apply())
}

/// Writes out the spring and the damping (linear terms) that the compiler derived from `springdamper`: from another inertia
/// it would derive others. `None` where the joint has no `springdamper`.
pub(super) fn keep_tuning<'d>(
    model: &'d Mjcf<'d>,
    joint: Node<'d, 'd>,
    stiffness: f64,
    damping: f64,
) -> Option<String> {
    if !tuned(model, joint) {
        return None;
    }
    let mut edits = Edits::new(model.text);
    if model.inherited(joint, "springdamper").is_some() {
        edits.set(joint, "springdamper", "0 0");
    } else {
        edits.unset(joint, "springdamper");
    }
    for (key, linear) in [("stiffness", stiffness), ("damping", damping)] {
        let mut terms = model.merged_numbers(joint, key);
        match terms.first_mut() {
            Some(first) => *first = linear,
            None => terms.push(linear),
        }
        edits.set(joint, key, &numbers(&terms));
    }
    Some(edits.apply())
}

/// A spring [N m/rad or N/m] with its rest at `reference` [rad or m], added to the joint's own linear spring. `None` where
/// that one is not linear or yields, or where tendons measure their rest by it.
pub(super) fn stiffness<'d>(
    model: &'d Mjcf<'d>,
    joint: Node<'d, 'd>,
    stiffness: f64,
    reference: f64,
) -> Option<String> {
    let own = model.attribute_numbers(joint, "stiffness");
    let linear = own.first().copied().unwrap_or(0.0);
    let bent = own.iter().skip(1).any(|number| *number != 0.0);
    let yields = model.attribute_number(joint, "springyield") != 0.0;
    if bent || yields || tuned(model, joint) || model.sections("tendon").next().is_some() {
        return None;
    }
    let unit = if turns(model, joint)? {
        angle_unit(model)
    } else {
        1.0
    };
    let total = linear + stiffness;
    if total == 0.0 {
        return None;
    }
    let rest = model.attribute_number(joint, "springref");
    let rest = (linear * rest + stiffness * reference * unit) / total;
    let mut edits = Edits::new(model.text);
    edits.set(joint, "stiffness", &number(total));
    if rest != 0.0 || model.attribute(joint, "springref").is_some() {
        edits.set(joint, "springref", &number(rest));
    }
    Some(edits.apply())
}

/// Dry friction [N m or N] added to the joint's own; `None` where the excess at low speed, which MuJoCo's lacks, is large.
pub(super) fn friction<'d>(
    model: &'d Mjcf<'d>,
    joint: Node<'d, 'd>,
    coulomb: f64,
    excess: f64,
) -> Option<String> {
    if excess.abs() > LITTLE_EXCESS * coulomb || turns(model, joint).is_none() {
        return None;
    }
    let own = model.attribute_number(joint, "frictionloss");
    let mut edits = Edits::new(model.text);
    edits.set(joint, "frictionloss", &number(own + coulomb));
    Some(edits.apply())
}

/// Addresses of a joint in the state, and the inertia that it moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointPlace {
    pub(super) qpos: usize,
    pub(super) dof: usize,
    /// Inertia that the joint moves [kg m^2 or kg].
    pub(super) inertia: f64,
    /// Rotor inertia of the nominal in it [kg m^2 or kg].
    pub(super) rotor: f64,
    /// Damping, its own and its servo's [N m s/rad or N s/m].
    pub(super) damping: f64,
    /// Step of the model [s].
    pub(super) step: f64,
}

/// Backlash of a full width [rad or m]: a joint in series behind this one, free between two stops. Actuators and sensors
/// stay with the joint; the body follows it within half the width on either side.
pub(super) fn backlash<'d>(
    model: &'d Mjcf<'d>,
    joint: Node<'d, 'd>,
    width: f64,
    place: JointPlace,
) -> Option<String> {
    let turns = turns(model, joint)?;
    if width <= 0.0 {
        return None;
    }
    let name = joint.attribute("name")?;
    let half = 0.5 * width * if turns { angle_unit(model) } else { 1.0 };
    let inertia = if place.inertia > 0.0 {
        place.inertia
    } else {
        1.0
    };
    let mut extra = format!(
        "<joint {}",
        attribute("name", &model.fresh_name(&format!("{name}_play")))
    );
    let mut say = |key: &str, value: &str| {
        extra.push(' ');
        extra.push_str(&attribute(key, value));
    };
    for key in ["class", "type", "pos", "axis"] {
        if let Some(same) = joint.attribute(key) {
            say(key, same);
        }
    }
    say("limited", "true");
    say("range", &numbers(&[-half, half]));
    say(
        "armature",
        &number(backlash::armature(
            inertia,
            place.rotor,
            place.damping,
            place.step,
        )),
    );
    // As stiff as the step allows: MuJoCo's usual stop gives way for 20 ms.
    say("solreflimit", &numbers(&[2.0 * place.step, 1.0]));
    say("solimplimit", "0.99 0.999 0.001");
    // Defaults of the joint's class must not hold for the extra joint.
    for key in [
        "damping",
        "stiffness",
        "frictionloss",
        "ref",
        "springref",
        "springyield",
        "margin",
    ] {
        if model.inherited(joint, key).is_some() {
            say(key, "0");
        }
    }
    if model.inherited(joint, "springdamper").is_some() {
        say("springdamper", "0 0");
    }
    if model.inherited(joint, "actuatorfrcrange").is_some() {
        say("actuatorfrclimited", "false");
    }
    extra.push_str("/>");
    let mut edits = Edits::new(model.text);
    edits.after(joint, &extra);
    for key in model.section("keyframe") {
        super::keyframe::insert_zero(&mut edits, key, "qpos", place.qpos + 1);
        super::keyframe::insert_zero(&mut edits, key, "qvel", place.dof + 1);
    }
    Some(edits.apply())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    fn changed(
        compiler: &str,
        joint: &str,
        change: impl for<'d> Fn(&'d Mjcf<'d>, Node<'d, 'd>) -> Option<String>,
    ) -> Option<String> {
        let text = format!(
            "<mujoco>{compiler}<default><joint damping=\"1\"/></default><worldbody><body>{joint}</body>\
             </worldbody><keyframe><key qpos=\"5 6\"/></keyframe></mujoco>"
        );
        let model = Mjcf::parse(&text, Path::new("m.xml")).unwrap();
        let joint = model.joints().next().unwrap();
        change(&model, joint).map(|text| {
            let from = text.find("<body>").unwrap() + "<body>".len();
            let inside = &text[from..text.find("</body>").unwrap()];
            let keys = &text[text.find("<key ").unwrap()..text.find("</keyframe>").unwrap()];
            format!("{inside} {keys}").replace(" <key qpos=\"5 6\"/>", "")
        })
    }

    #[test]
    fn damping_adds_to_that_of_the_class() {
        let more = |joint| changed("", joint, |model, joint| damping(model, joint, 0.5));
        assert_eq!(more("<joint/>").unwrap(), "<joint damping=\"1.5\"/>");
        assert_eq!(
            more("<joint damping=\"2 3\"/>").unwrap(),
            "<joint damping=\"2.5 3\"/>"
        );
        assert_eq!(more("<joint springdamper=\"1 1\"/>"), None);
    }

    #[test]
    fn armature_adds_to_that_of_the_class() {
        let more = |joint| changed("", joint, |model, joint| Some(armature(model, joint, 0.25)));
        assert_eq!(more("<joint/>").unwrap(), "<joint armature=\"0.25\"/>");
        assert_eq!(
            more("<joint armature=\"0.5\"/>").unwrap(),
            "<joint armature=\"0.75\"/>"
        );
    }

    #[test]
    fn every_term_of_damping_is_scaled() {
        let scaled = |joint| {
            changed("", joint, |model, joint| {
                scaled(model, joint, "damping", None, 1.5)
            })
        };
        assert_eq!(scaled("<joint/>").unwrap(), "<joint damping=\"1.5\"/>");
        assert_eq!(
            scaled("<joint damping=\"2 3\"/>").unwrap(),
            "<joint damping=\"3 4.5\"/>"
        );
        assert_eq!(scaled("<joint springdamper=\"1 1\"/>"), None);
    }

    #[test]
    fn one_term_of_stiffness_is_scaled() {
        let scaled = |term, joint| {
            changed("", joint, |model, joint| {
                scaled(model, joint, "stiffness", Some(term), 1.5)
            })
        };
        let joint = "<joint stiffness=\"2 0 4\"/>";
        assert_eq!(scaled(0, joint).unwrap(), "<joint stiffness=\"3 0 4\"/>");
        assert_eq!(scaled(2, joint).unwrap(), "<joint stiffness=\"2 0 6\"/>");
        assert_eq!(scaled(3, joint), None);
    }

    #[test]
    fn what_the_compiler_tuned_is_said() {
        let kept = |joint| {
            changed("", joint, |model, joint| {
                keep_tuning(model, joint, 7.0, 0.5)
            })
        };
        assert_eq!(
            kept("<joint springdamper=\"1 1\"/>").unwrap(),
            "<joint stiffness=\"7\" damping=\"0.5\"/>"
        );
        assert_eq!(kept("<joint/>"), None);
    }

    #[test]
    fn two_springs_are_one() {
        let spring = |compiler, joint| {
            changed(compiler, joint, |model, joint| {
                stiffness(model, joint, 3.0, 0.4)
            })
        };
        let radian = "<compiler angle=\"radian\"/>";
        assert_eq!(
            spring(radian, "<joint stiffness=\"1\" springref=\"0.8\"/>").unwrap(),
            "<joint stiffness=\"4\" springref=\"0.5\"/>"
        );
        assert_eq!(
            spring("", "<joint/>").unwrap(),
            "<joint stiffness=\"3\" springref=\"22.9183118052\"/>"
        );
        assert_eq!(
            spring("", "<joint type=\"slide\"/>").unwrap(),
            "<joint type=\"slide\" stiffness=\"3\" springref=\"0.4\"/>"
        );
        assert_eq!(spring(radian, "<joint stiffness=\"1 2\"/>"), None);
        assert_eq!(spring(radian, "<joint springyield=\"1\"/>"), None);
    }

    #[test]
    fn only_coulomb_friction_is_mujocos() {
        let dry = |coulomb, excess| {
            changed("", "<joint frictionloss=\"0.1\"/>", move |model, joint| {
                friction(model, joint, coulomb, excess)
            })
        };
        assert_eq!(dry(0.4, 0.02).unwrap(), "<joint frictionloss=\"0.5\"/>");
        assert_eq!(dry(0.4, 0.2), None);
    }

    #[test]
    fn backlash_is_an_extra_limited_joint() {
        let place = JointPlace {
            rotor: 0.0,
            qpos: 0,
            dof: 0,
            inertia: 0.5,
            damping: 0.0,
            step: 0.002,
        };
        let slack = changed(
            "<compiler angle=\"radian\"/>",
            "<joint name=\"j\" axis=\"0 1 0\" class=\"c\"/>",
            move |model, joint| backlash(model, joint, 0.02, place),
        );
        assert_eq!(
            slack.unwrap(),
            "<joint name=\"j\" axis=\"0 1 0\" class=\"c\"/><joint name=\"j_play\" class=\"c\" axis=\"0 1 0\" \
             limited=\"true\" range=\"-0.01 0.01\" armature=\"0.025\" solreflimit=\"0.004 1\" \
             solimplimit=\"0.99 0.999 0.001\" damping=\"0\"/> \
             <key qpos=\"5 0 6\"/>"
        );
    }
}
