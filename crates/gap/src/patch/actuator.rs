//! Gain, lag and delay of an actuator in plain MJCF.
//!
//! Forces of MuJoCo's native actuators are affine, `gain u + bias0 + bias1 length + bias2 speed`; its shortcuts (`motor`,
//! `position`...) are notations of that. A factor multiplies gain and bias, so that limits of force and control stay. A
//! shortcut keeps its notation where that can express the change, else it becomes `general` with every number written.

use roxmltree::Node;

use super::{
    mjcf::{ACTUATORS, Mjcf, parse_numbers},
    xml_edit::{Edits, number, numbers},
};

/// Numbers of an affine gain or bias.
const AFFINE: usize = 3;

/// Gain, bias and dynamics of an actuator, after its default classes.
#[derive(Clone, Debug, PartialEq)]
struct ForceLaw {
    /// The notation that it is written in.
    written: String,
    gain_type: String,
    gain: [f64; AFFINE],
    bias_type: String,
    /// A positive third number is a ratio of damping, which the compiler turns into a speed gain.
    bias: [f64; AFFINE],
    dynamics: String,
}

impl ForceLaw {
    /// MuJoCo's own defaults in a notation; `None` for one that is not affine.
    fn default_for(written: &str) -> Option<Self> {
        let law = |gain_type: &str, gain, bias_type: &str, bias, dynamics: &str| Self {
            written: written.to_owned(),
            gain_type: gain_type.to_owned(),
            gain,
            bias_type: bias_type.to_owned(),
            bias,
            dynamics: dynamics.to_owned(),
        };
        let one = [1.0, 0.0, 0.0];
        let none = [0.0; AFFINE];
        Some(match written {
            "general" | "motor" => law("fixed", one, "none", none, "none"),
            "position" => law("fixed", one, "affine", [0.0, -1.0, 0.0], "none"),
            "intvelocity" => law("fixed", one, "affine", [0.0, -1.0, 0.0], "integrator"),
            "velocity" => law("fixed", one, "affine", [0.0, 0.0, -1.0], "none"),
            "damper" => law("affine", [0.0, 0.0, -1.0], "none", none, "none"),
            "cylinder" => law("fixed", one, "affine", none, "filter"),
            _ => return None,
        })
    }

    /// The law of an element from those of the classes around it, outermost first; `None`: not known. A shortcut inherits
    /// parameters from its own kind and from `general` only; `general` inherits from any.
    fn with(element: Node<'_, '_>, inherited: &[Option<Self>]) -> Option<Self> {
        let written = element.tag_name().name();
        if written == "general" {
            let mut law = inherited.last().cloned().flatten()?;
            written.clone_into(&mut law.written);
            law.read_general(element);
            return Some(law);
        }
        let mut law = Self::default_for(written)?;
        let from = inherited.iter().rev().flatten().find(|from| {
            from.written == written
                || (from.written == "general" && from.gain_type == law.gain_type)
        });
        let given = |key| element.attribute(key).map(parse_numbers);
        let one = |key| given(key).and_then(|numbers| numbers.first().copied());
        match written {
            "position" | "intvelocity" => {
                let kp = one("kp").or(from.map(|from| from.gain[0])).unwrap_or(1.0);
                let speed = from.map_or(0.0, |from| from.bias[2]);
                let speed = one("kv").map_or(speed, |kv| -kv);
                law.gain[0] = kp;
                law.bias = [0.0, -kp, one("dampratio").unwrap_or(speed)];
                let filters = one("timeconst").map_or_else(
                    || {
                        from.is_some_and(|from| {
                            from.written == written && from.dynamics == "filterexact"
                        })
                    },
                    |time_constant| time_constant > 0.0,
                );
                if filters && written == "position" {
                    "filterexact".clone_into(&mut law.dynamics);
                }
            }
            "velocity" => {
                let kv = one("kv").or(from.map(|from| from.gain[0])).unwrap_or(1.0);
                law.gain[0] = kv;
                law.bias[2] = -kv;
            }
            "damper" => {
                law.gain[2] = -one("kv").or(from.map(|from| -from.gain[2])).unwrap_or(1.0);
            }
            "cylinder" => {
                let round = one("diameter").map(|d| std::f64::consts::FRAC_PI_4 * d * d);
                let area = round.or(one("area")).or(from.map(|from| from.gain[0]));
                law.gain[0] = area.unwrap_or(1.0);
                law.bias = from.map_or(law.bias, |from| from.bias);
                law.bias = filled(law.bias, &given("bias").unwrap_or_default());
            }
            _ => {}
        }
        Some(law)
    }

    fn read_general(&mut self, element: Node<'_, '_>) {
        for (key, word) in [
            ("gaintype", &mut self.gain_type),
            ("biastype", &mut self.bias_type),
            ("dyntype", &mut self.dynamics),
        ] {
            if let Some(found) = element.attribute(key) {
                found.clone_into(word);
            }
        }
        for (key, numbers) in [("gainprm", &mut self.gain), ("biasprm", &mut self.bias)] {
            if let Some(found) = element.attribute(key) {
                *numbers = filled(*numbers, &parse_numbers(found));
            }
        }
    }

    /// The laws of the default classes of an element, outermost first.
    fn from_classes(model: &Mjcf<'_>, element: Node<'_, '_>) -> Vec<Option<Self>> {
        let mut laws = vec![Self::default_for("general")];
        let chain = model
            .root()
            .document()
            .get_node(element.id())
            .map(|element| model.class_chain(element))
            .unwrap_or_default();
        for level in chain {
            // A class starts as a copy of the one round it.
            let mut here = laws.last().cloned().flatten();
            for default in level {
                if ACTUATORS.contains(&default.tag_name().name()) {
                    let mut inherited = laws.clone();
                    inherited.push(here);
                    here = Self::with(default, &inherited);
                }
            }
            laws.push(here);
        }
        laws
    }

    /// The law of an element of the model; `None` where it is not affine.
    fn from_element(model: &Mjcf<'_>, element: Node<'_, '_>) -> Option<Self> {
        let law = Self::with(element, &Self::from_classes(model, element))?;
        let affine = ["fixed", "affine"].contains(&law.gain_type.as_str())
            && ["none", "affine"].contains(&law.bias_type.as_str());
        affine.then_some(law)
    }

    /// True where the third bias is a ratio of damping.
    fn has_damping_ratio(&self) -> bool {
        self.bias_type == "affine" && self.bias[2] > 0.0 && self.gain[0] == -self.bias[1]
    }

    /// The law with its force multiplied by a factor.
    fn times(&self, factor: f64) -> Self {
        let mut law = self.clone();
        law.gain = law.gain.map(|gain| gain * factor);
        law.bias = law.bias.map(|bias| bias * factor);
        if self.has_damping_ratio() {
            // The compiler multiplies it by 2 sqrt(kp m).
            law.bias[2] = self.bias[2] * factor.sqrt();
        }
        law
    }

    /// Writes the element as `general`, without the attributes that its class already gives.
    fn write_general(&self, model: &Mjcf<'_>, element: Node<'_, '_>, edits: &mut Edits<'_>) {
        let was = element.tag_name().name();
        for key in [
            "kp",
            "kv",
            "dampratio",
            "timeconst",
            "area",
            "diameter",
            "bias",
        ] {
            edits.unset(element, key);
        }
        if was != "general" {
            edits.rename(element, "general");
        }
        // What its control is does not change.
        match was {
            "position" => edits.set(element, "input", "pos"),
            "velocity" => edits.set(element, "input", "vel"),
            _ => {}
        }
        let class = Self::from_classes(model, element).pop().flatten();
        let mut say = |key, said: String, inherited: Option<String>| {
            if element.has_attribute(key) || inherited.as_ref() != Some(&said) {
                edits.set(element, key, &said);
            }
        };
        let of = |part: fn(&Self) -> String| (part(self), class.as_ref().map(part));
        let (said, inherited) = of(|law| law.gain_type.clone());
        say("gaintype", said, inherited);
        let (said, inherited) = of(|law| short(&law.gain));
        say("gainprm", said, inherited);
        let (said, inherited) = of(|law| law.bias_type.clone());
        say("biastype", said, inherited);
        let (said, inherited) = of(|law| numbers(&law.bias));
        say("biasprm", said, inherited);
        let (said, inherited) = of(|law| law.dynamics.clone());
        say("dyntype", said, inherited);
    }
}

/// Numbers replaced from the left by those given.
fn filled(mut numbers: [f64; AFFINE], given: &[f64]) -> [f64; AFFINE] {
    for (number, given) in numbers.iter_mut().zip(given) {
        *number = *given;
    }
    numbers
}

/// A fixed gain is one number.
fn short(gain: &[f64; AFFINE]) -> String {
    if gain[1] == 0.0 && gain[2] == 0.0 {
        number(gain[0])
    } else {
        numbers(gain)
    }
}

/// The force of an actuator times a factor. `None` where MJCF cannot express it.
pub(super) fn gain(model: &Mjcf<'_>, element: Node<'_, '_>, factor: f64) -> Option<String> {
    let law = ForceLaw::from_element(model, element)?.times(factor);
    let mut edits = Edits::new(model.text);
    match element.tag_name().name() {
        "position" | "intvelocity" => {
            edits.set(element, "kp", &number(law.gain[0]));
            if law.bias[2] > 0.0 {
                edits.set(element, "dampratio", &number(law.bias[2]));
            } else if law.bias[2] < 0.0 {
                edits.set(element, "kv", &number(-law.bias[2]));
            }
        }
        "velocity" => edits.set(element, "kv", &number(law.gain[0])),
        "damper" => edits.set(element, "kv", &number(-law.gain[2])),
        "cylinder" => {
            edits.unset(element, "diameter");
            edits.set(element, "area", &number(law.gain[0]));
            if law.bias != [0.0; AFFINE] {
                edits.set(element, "bias", &numbers(&law.bias));
            }
        }
        "general" => {
            edits.set(element, "gainprm", &short(&law.gain));
            if law.bias_type == "affine" {
                edits.set(element, "biasprm", &numbers(&law.bias));
            }
        }
        _ => law.write_general(model, element, &mut edits),
    }
    Some(edits.apply())
}

/// Writes out the speed gain of an actuator with a ratio of damping, for a model whose inertia has changed: the compiler
/// would derive another. `bias` is the third number that it derived [force s/length]. `None` where there is no ratio.
pub(super) fn keep_damping(model: &Mjcf<'_>, element: Node<'_, '_>, bias: f64) -> Option<String> {
    let mut law = ForceLaw::from_element(model, element)?;
    if !law.has_damping_ratio() {
        return None;
    }
    law.bias[2] = bias;
    let mut edits = Edits::new(model.text);
    if element.has_tag_name("general") {
        edits.set(element, "biasprm", &numbers(&law.bias));
    } else {
        edits.unset(element, "dampratio");
        edits.set(element, "kv", &number(-bias));
    }
    Some(edits.apply())
}

/// A first-order lag [s] in front of an actuator. `None` where it has dynamics already, or is not affine.
pub(super) fn lag(model: &Mjcf<'_>, element: Node<'_, '_>, time_constant: f64) -> Option<String> {
    let mut law = ForceLaw::from_element(model, element)?;
    if law.dynamics != "none" || time_constant <= 0.0 {
        return None;
    }
    "filterexact".clone_into(&mut law.dynamics);
    let mut edits = Edits::new(model.text);
    law.write_general(model, element, &mut edits);
    edits.set(element, "dynprm", &number(time_constant));
    // The force of a step takes the command of that step, as what was fitted does.
    edits.set(element, "actearly", "true");
    add_activation_to_keys(model, element, &mut edits)?;
    Some(edits.apply())
}

/// Key frames that list activations get a zero for the new one.
fn add_activation_to_keys(
    model: &Mjcf<'_>,
    element: Node<'_, '_>,
    edits: &mut Edits<'_>,
) -> Option<()> {
    let keys: Vec<Node<'_, '_>> = model
        .section("keyframe")
        .filter(|key| {
            key.attribute("act")
                .is_some_and(|act| !act.trim().is_empty())
        })
        .collect();
    if keys.is_empty() {
        return Some(());
    }
    let mut before = 0;
    for other in model.section("actuator") {
        if other.range() == element.range() {
            break;
        }
        let law = ForceLaw::from_element(model, other)?;
        before += usize::from(law.dynamics != "none");
    }
    for key in keys {
        super::keyframe::insert_zero(edits, key, "act", before);
    }
    Some(())
}

/// A pure delay [s] in front of an actuator; `step` is the model's. Delays add up.
///
/// MuJoCo's least delay is a step, because it reads its ring before it writes: a shorter one is rounded to a step or to
/// none.
pub(super) fn delay(
    model: &Mjcf<'_>,
    element: Node<'_, '_>,
    delay: f64,
    step: f64,
) -> Option<String> {
    let total = model.attribute_number(element, "delay") + delay;
    let possible = step > 0.0 && total >= 0.5 * step;
    if !possible {
        return None;
    }
    let total = total.max(step);
    // One more than is needed, so that rounding of time never reads before the first.
    let samples = (total / step - 1e-6).ceil() + 1.0;
    let samples = samples.max(model.attribute_number(element, "nsample"));
    let mut edits = Edits::new(model.text);
    edits.set(element, "delay", &number(total));
    edits.set(element, "nsample", &number(samples));
    edits.set(element, "interp", "linear");
    Some(edits.apply())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    /// The actuator of a model, changed.
    fn changed(
        defaults: &str,
        actuator: &str,
        change: impl Fn(&Mjcf<'_>, Node<'_, '_>) -> Option<String>,
    ) -> Option<String> {
        let text = format!(
            "<mujoco><default>{defaults}</default><actuator>{actuator}</actuator></mujoco>"
        );
        let model = Mjcf::parse(&text, Path::new("m.xml")).unwrap();
        let element = model.section("actuator").next().unwrap();
        change(&model, element).map(|text| {
            let from = text.find("<actuator>").unwrap() + "<actuator>".len();
            text[from..text.find("</actuator>").unwrap()].to_owned()
        })
    }

    fn stronger(defaults: &str, actuator: &str) -> Option<String> {
        changed(defaults, actuator, |model, element| {
            gain(model, element, 4.0)
        })
    }

    #[test]
    fn a_gain_keeps_the_notation_where_it_can() {
        for (defaults, actuator, expected) in [
            (
                "",
                "<motor joint=\"j\" gear=\"2\"/>",
                "<general joint=\"j\" gear=\"2\" gainprm=\"4\"/>",
            ),
            (
                "<general dyntype=\"filter\" biastype=\"affine\"/>",
                "<motor joint=\"j\"/>",
                "<general joint=\"j\" gainprm=\"4\" biastype=\"none\" dyntype=\"none\"/>",
            ),
            (
                "<position kp=\"30\" kv=\"2\"/>",
                "<position joint=\"j\"/>",
                "<position joint=\"j\" kp=\"120\" kv=\"8\"/>",
            ),
            (
                "<position kp=\"30\" kv=\"2\"/>",
                "<position joint=\"j\" kp=\"1\" dampratio=\"1\"/>",
                "<position joint=\"j\" kp=\"4\" dampratio=\"2\"/>",
            ),
            (
                "<velocity kv=\"3\"/>",
                "<velocity joint=\"j\"/>",
                "<velocity joint=\"j\" kv=\"12\"/>",
            ),
            (
                "<general gainprm=\"7\" biastype=\"affine\" biasprm=\"1 2 3\"/>",
                "<general joint=\"j\"/>",
                "<general joint=\"j\" gainprm=\"28\" biasprm=\"4 8 12\"/>",
            ),
            (
                "",
                "<damper joint=\"j\" kv=\"2\"></damper>",
                "<damper joint=\"j\" kv=\"8\"></damper>",
            ),
            (
                "",
                "<cylinder joint=\"j\" diameter=\"2\"/>",
                "<cylinder joint=\"j\" area=\"12.5663706144\"/>",
            ),
        ] {
            assert_eq!(stronger(defaults, actuator).as_deref(), Some(expected));
        }
    }

    #[test]
    fn a_ratio_of_damping_becomes_the_gain_that_it_was() {
        let kept = |defaults, actuator| {
            changed(defaults, actuator, |model, element| {
                keep_damping(model, element, -0.3)
            })
        };
        let ratio = "<position dampratio=\"1\"/>";
        assert_eq!(
            kept("", "<position joint=\"j\" dampratio=\"2\" kp=\"3\"/>").unwrap(),
            "<position joint=\"j\" kp=\"3\" kv=\"0.3\"/>"
        );
        assert_eq!(
            kept(ratio, "<position joint=\"j\"/>").unwrap(),
            "<position joint=\"j\" kv=\"0.3\"/>"
        );
        assert_eq!(kept(ratio, "<position joint=\"j\" kv=\"1\"/>"), None);
        assert_eq!(
            kept(
                "",
                "<general joint=\"j\" biastype=\"affine\" gainprm=\"5\" biasprm=\"0 -5 1\"/>"
            )
            .unwrap(),
            "<general joint=\"j\" biastype=\"affine\" gainprm=\"5\" biasprm=\"0 -5 -0.3\"/>"
        );
    }

    #[test]
    fn what_is_not_affine_is_left_to_the_plugin() {
        for actuator in [
            "<muscle joint=\"j\"/>",
            "<pid joint=\"j\"/>",
            "<adhesion body=\"b\"/>",
            "<general joint=\"j\" gaintype=\"user\"/>",
        ] {
            assert_eq!(stronger("", actuator), None);
        }
        let slow = |actuator| changed("", actuator, |model, element| lag(model, element, 0.1));
        assert_eq!(slow("<general joint=\"j\" dyntype=\"integrator\"/>"), None);
        assert_eq!(slow("<intvelocity joint=\"j\"/>"), None);
        assert_eq!(slow("<position joint=\"j\" timeconst=\"0.1\"/>"), None);
    }

    #[test]
    fn a_lag_says_every_number_of_the_force() {
        let slow = changed(
            "<position kp=\"30\" kv=\"2\"/>",
            "<position joint=\"j\" ctrlrange=\"-1 1\" kp=\"5\"/>",
            |model, element| lag(model, element, 0.1),
        );
        assert_eq!(
            slow.unwrap(),
            "<general joint=\"j\" ctrlrange=\"-1 1\" input=\"pos\" gainprm=\"5\" biasprm=\"0 -5 -2\" \
             dyntype=\"filterexact\" dynprm=\"0.1\" actearly=\"true\"/>"
        );
    }

    #[test]
    fn delays_add_up_and_are_at_least_a_step() {
        let late = |actuator, seconds| {
            changed(
                "<motor delay=\"0.01\" nsample=\"5\"/>",
                actuator,
                |model, element| delay(model, element, seconds, 0.01),
            )
        };
        assert_eq!(
            late("<motor joint=\"j\"/>", 0.015).unwrap(),
            "<motor joint=\"j\" delay=\"0.025\" nsample=\"5\" interp=\"linear\"/>"
        );
        let short = |seconds| {
            changed("", "<motor joint=\"j\"/>", |model, element| {
                delay(model, element, seconds, 0.01)
            })
        };
        assert_eq!(short(0.004), None);
        assert_eq!(
            short(0.006).unwrap(),
            "<motor joint=\"j\" delay=\"0.01\" nsample=\"2\" interp=\"linear\"/>"
        );
    }
}
