//! Mass, moments of inertia and centre of mass of a body in plain MJCF.
//!
//! The compiler makes an inertia from geoms, from an `<inertial>`, or from both and its own settings. The compiled inertia
//! is the one that is changed; where the text cannot express that, it gets an explicit `<inertial>` of compiled values.
//! Gravity compensation is a force: it keeps its size and its place.

use roxmltree::Node;

use super::{
    mjcf::Mjcf,
    xml_edit::{Edits, attribute, number, numbers},
};
use crate::plant::Inertial;

/// Mass [kg] of a body that only carries a force. MuJoCo's fluid ignores bodies below `mjMINVAL`, 1e-15 kg; a heavier one
/// would be a box in it, of several centimetres at 1e-12 kg.
const WEIGHTLESS: f64 = 1e-16;

/// Groups of geoms that make inertia by default.
const ALL_GROUPS: [f64; 2] = [0.0, 5.0];

/// Attributes that rotate an `<inertial>`.
const ATTITUDES: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// Change of the inertia of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InertiaChange {
    /// Factor on the mass.
    pub(super) mass: f64,
    /// Factors on the principal moments.
    pub(super) moments: [f64; 3],
    /// Displacement of the centre of mass in the body's frame [m].
    pub(super) way: [f64; 3],
}

impl InertiaChange {
    /// No change.
    pub(super) const NONE: Self = Self {
        mass: 1.0,
        moments: [1.0; 3],
        way: [0.0; 3],
    };

    fn moves(&self) -> bool {
        self.way != [0.0; 3]
    }

    fn changes_moments(&self) -> bool {
        self.moments != [1.0; 3]
    }
}

/// The text with a body's inertia changed.
#[derive(Debug)]
pub(super) struct Written {
    /// The text.
    pub(super) text: String,
    /// Principal moments as written [kg m^2].
    pub(super) moments: [f64; 3],
    /// True where the wanted moments are impossible and the nearest possible ones were written.
    pub(super) moments_were_impossible: bool,
}

/// The setting of the compiler that would undo a change of any body's inertia, if there is one.
pub(super) fn obstacle(model: &Mjcf<'_>) -> Option<String> {
    if model.setting_number("compiler", "settotalmass") > 0.0 {
        return Some("`compiler settotalmass` rescales every mass of the model".to_owned());
    }
    (model.setting("compiler", "fusestatic") == Some("true"))
        .then(|| "`compiler fusestatic` makes one body of several of the text".to_owned())
}

/// Makes the compiler read every `<inertial>`, which `inertiafromgeom="true"` ignores. A body whose `<inertial>` was
/// ignored loses it, so that none changes.
pub(super) fn let_inertials_count(model: &Mjcf<'_>) -> String {
    let mut edits = Edits::new(model.text);
    if model.setting("compiler", "inertiafromgeom") == Some("true") {
        for compiler in model.sections("compiler") {
            if compiler.has_attribute("inertiafromgeom") {
                edits.set(compiler, "inertiafromgeom", "auto");
            }
        }
        for body in model.bodies() {
            if let Some(inertial) = inertial_of(body)
                && has_geoms(model, body)
            {
                edits.remove(inertial);
            }
        }
    }
    edits.apply()
}

/// The `<inertial>` of a body, be it in a frame.
fn inertial_of<'d, 'a>(body: Node<'d, 'a>) -> Option<Node<'d, 'a>> {
    body.descendants()
        .find(|node| node.has_tag_name("inertial") && Mjcf::body_around(*node) == Some(body))
}

/// True where a body has geoms that make inertia.
fn has_geoms(model: &Mjcf<'_>, body: Node<'_, '_>) -> bool {
    let range = model
        .setting("compiler", "inertiagrouprange")
        .map(super::mjcf::parse_numbers)
        .and_then(|range| <[f64; 2]>::try_from(range).ok())
        .unwrap_or(ALL_GROUPS);
    body.descendants()
        .filter(|node| node.has_tag_name("geom") && Mjcf::body_around(*node) == Some(body))
        .any(|geom| (range[0]..=range[1]).contains(&model.attribute_number(geom, "group")))
}

/// True where the compiler moves the frame of a floating body to its centre of mass.
fn is_aligned(model: &Mjcf<'_>, body: Node<'_, '_>) -> bool {
    let whole_model = model.setting("compiler", "alignfree") == Some("true");
    body.children()
        .filter(|node| {
            node.has_tag_name("freejoint")
                || (node.has_tag_name("joint") && node.attribute("type") == Some("free"))
        })
        .any(|joint| match joint.attribute("align") {
            Some("true") => true,
            Some("false") => false,
            _ => whole_model,
        })
}

/// Changes the inertia of a body, after [`let_inertials_count`]; the error is the reason why it cannot.
pub(super) fn change(
    model: &Mjcf<'_>,
    body: Node<'_, '_>,
    was: &Inertial,
    change: &InertiaChange,
) -> Result<Written, String> {
    let mass = was.mass * change.mass;
    let wanted: [f64; 3] = std::array::from_fn(|axis| was.moments[axis] * change.moments[axis]);
    let (moments, bent) = possible(wanted);
    let least = |key| model.setting_number("compiler", key);
    if mass < least("boundmass") {
        return Err(format!(
            "its mass would be {} kg, below `compiler boundmass`",
            number(mass)
        ));
    }
    if moments.iter().any(|moment| *moment < least("boundinertia")) {
        return Err("a moment of inertia would be below `compiler boundinertia`".to_owned());
    }
    let inertial = inertial_of(body);
    let own = inertial.filter(|node| node.parent() == Some(body));
    let in_place = own.filter(|_| !change.changes_moments() || !is_aligned(model, body));
    if is_aligned(model, body) && (change.moves() || in_place.is_none()) {
        return Err(
            "the compiler aligns the body's frame with its inertia (`align`, `alignfree`)"
                .to_owned(),
        );
    }
    let mut edits = Edits::new(model.text);
    match in_place {
        Some(node) => in_its_place(&mut edits, node, was, change, mass, moments),
        None => {
            if let Some(in_frame) = inertial {
                edits.remove(in_frame);
            }
            edits.prepend(body, &explicit(was, change, mass, moments));
        }
    }
    let force = was.compensation * was.mass;
    if force != 0.0 && change.moves() {
        if least("boundmass") > 0.0 || least("boundinertia") > 0.0 {
            return Err(
                "its buoyancy needs a weightless body of its own, which `compiler boundmass` and \
                 `boundinertia` do not allow"
                    .to_owned(),
            );
        }
        edits.set(body, "gravcomp", "0");
        edits.append(body, &buoy(model, body, was.position, force));
    } else if force != 0.0 && change.mass != 1.0 {
        edits.set(body, "gravcomp", &number(was.compensation / change.mass));
    }
    Ok(Written {
        text: edits.apply(),
        moments,
        moments_were_impossible: bent,
    })
}

/// Changes only those attributes of an `<inertial>` that differ.
fn in_its_place(
    edits: &mut Edits<'_>,
    node: Node<'_, '_>,
    was: &Inertial,
    change: &InertiaChange,
    mass: f64,
    moments: [f64; 3],
) {
    if change.mass != 1.0 {
        edits.set(node, "mass", &number(mass));
    }
    if change.moves() {
        edits.set(node, "pos", &numbers(&moved(was, change)));
    }
    if !change.changes_moments() {
        return;
    }
    if node.has_attribute("fullinertia") {
        // Its axes are found by the compiler: they are said, so that the moments can be.
        edits.unset(node, "fullinertia");
        for key in ATTITUDES {
            if key != "quat" {
                edits.unset(node, key);
            }
        }
        edits.set(node, "quat", &numbers(&was.attitude));
    }
    edits.set(node, "diaginertia", &numbers(&moments));
}

fn moved(was: &Inertial, change: &InertiaChange) -> [f64; 3] {
    std::array::from_fn(|axis| was.position[axis] + change.way[axis])
}

fn explicit(was: &Inertial, change: &InertiaChange, mass: f64, moments: [f64; 3]) -> String {
    let turns = if was.attitude == [1.0, 0.0, 0.0, 0.0] {
        String::new()
    } else {
        format!(" {}", attribute("quat", &numbers(&was.attitude)))
    };
    format!(
        "<inertial {}{turns} {} {}/>",
        attribute("pos", &numbers(&moved(was, change))),
        attribute("mass", &number(mass)),
        attribute("diaginertia", &numbers(&moments)),
    )
}

/// A weightless body that lifts `force` over gravity [kg] at a place of a body [m].
fn buoy(model: &Mjcf<'_>, body: Node<'_, '_>, place: [f64; 3], force: f64) -> String {
    let wanted = format!("{}_buoyancy", body.attribute("name").unwrap_or("body"));
    format!(
        "<body {} {} {}><inertial pos=\"0 0 0\" mass=\"{}\" diaginertia=\"0 0 0\"/></body>",
        attribute("name", &model.fresh_name(&wanted)),
        attribute("pos", &numbers(&place)),
        attribute("gravcomp", &number(force / WEIGHTLESS)),
        number(WEIGHTLESS),
    )
}

/// The possible moments nearest to those wanted, as they read when written: none greater than the other two together.
/// True where they differ by more than rounding.
fn possible(wanted: [f64; 3]) -> ([f64; 3], bool) {
    /// Rounding error of a sum.
    const ROUNDING: f64 = 1e-9;
    let mut moments = wanted;
    let greatest = (0..3)
        .max_by(|a, b| wanted[*a].total_cmp(&wanted[*b]))
        .unwrap_or(0);
    let excess = |of: &[f64; 3]| 2.0 * of[greatest] - of.iter().sum::<f64>();
    let over = excess(&wanted);
    if over > 0.0 {
        // The least change in parts of each.
        let squares: f64 = wanted.iter().map(|moment| moment * moment).sum();
        for (axis, moment) in moments.iter_mut().enumerate() {
            let way = if axis == greatest { -1.0 } else { 1.0 };
            *moment += way * over * wanted[axis] * wanted[axis] / squares;
        }
    }
    let as_read = |moment: f64| number(moment).parse().unwrap_or(moment);
    moments = moments.map(as_read);
    for _ in 0..8 {
        // The compiler allows no rounding at all; this is two units of the last digit written.
        let [a, b, c] = moments;
        if a + b >= c && a + c >= b && b + c >= a {
            break;
        }
        moments[greatest] = as_read(moments[greatest] * (1.0 - 2e-11));
    }
    (moments, over > ROUNDING * wanted[greatest])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    const WAS: Inertial = Inertial {
        mass: 2.0,
        position: [0.1, 0.0, 0.0],
        attitude: [0.5, 0.5, 0.5, 0.5],
        moments: [0.2, 0.3, 0.4],
        compensation: 0.0,
    };

    fn turned(text: &str, was: &Inertial, change: &InertiaChange) -> Result<String, String> {
        let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
        let text = let_inertials_count(&model);
        let model = Mjcf::parse(&text, Path::new("m.xml")).unwrap();
        let body = model.bodies().next().unwrap();
        super::change(&model, body, was, change).map(|written| written.text)
    }

    fn body(attributes: &str, inside: &str) -> String {
        format!(
            "<mujoco><worldbody><body name=\"b\"{attributes}>{inside}</body></worldbody></mujoco>"
        )
    }

    const ALL: InertiaChange = InertiaChange {
        mass: 1.5,
        moments: [1.0, 1.0, 1.1],
        way: [0.0, 0.01, 0.0],
    };

    #[test]
    fn only_what_is_turned_is_written() {
        let own =
            "<inertial pos=\"0.1 0 0\" euler=\"1 2 3\" mass=\"2\" fullinertia=\"1 1 1 0 0 0\"/>";
        let heavier = InertiaChange {
            mass: 1.5,
            ..InertiaChange::NONE
        };
        assert_eq!(
            turned(&body("", own), &WAS, &heavier).unwrap(),
            body("", &own.replace("mass=\"2\"", "mass=\"3\""))
        );
        assert_eq!(
            turned(&body("", own), &WAS, &ALL).unwrap(),
            body(
                "",
                "<inertial pos=\"0.1 0.01 0\" mass=\"3\" quat=\"0.5 0.5 0.5 0.5\" \
                 diaginertia=\"0.2 0.3 0.44\"/>"
            )
        );
    }

    #[test]
    fn an_inertia_of_geoms_is_said() {
        let said = "<inertial pos=\"0.1 0.01 0\" quat=\"0.5 0.5 0.5 0.5\" mass=\"3\" \
                    diaginertia=\"0.2 0.3 0.44\"/>";
        assert_eq!(
            turned(&body("", "<geom/>"), &WAS, &ALL).unwrap(),
            body("", &format!("{said}<geom/>"))
        );
        let geoms = "<mujoco><compiler inertiafromgeom=\"true\"/><worldbody><body><geom/><inertial a=\"1\"/>\
                     </body><body><inertial a=\"2\"/></body></worldbody></mujoco>";
        assert_eq!(
            turned(geoms, &WAS, &ALL).unwrap(),
            format!(
                "<mujoco><compiler inertiafromgeom=\"auto\"/><worldbody><body>{said}<geom/></body><body>\
                 <inertial a=\"2\"/></body></worldbody></mujoco>"
            )
        );
    }

    #[test]
    fn buoyancy_stays_where_it_was() {
        let own = "<inertial pos=\"0.1 0 0\" mass=\"2\" diaginertia=\"1 1 1\"/>";
        let was = Inertial {
            compensation: 0.6,
            ..WAS
        };
        let heavier = InertiaChange {
            mass: 1.5,
            ..InertiaChange::NONE
        };
        let text = turned(&body(" gravcomp=\"0.6\"", own), &was, &heavier).unwrap();
        assert!(text.contains("gravcomp=\"0.4\""), "{text}");
        let text = turned(&body(" gravcomp=\"0.6\"", own), &was, &ALL).unwrap();
        assert!(
            text.contains("<body name=\"b\" gravcomp=\"0\">")
                && text.contains(
                    "<body name=\"b_buoyancy\" pos=\"0.1 0 0\" gravcomp=\"1.2e16\"><inertial pos=\"0 0 0\" \
                     mass=\"1e-16\" diaginertia=\"0 0 0\"/></body>"
                ),
            "{text}"
        );
    }

    #[test]
    fn no_body_has_moments_beyond_the_triangle() {
        let (moments, bent) = possible([1.0, 0.1, 1.2]);
        assert!(bent && (moments[2] - 1.15).abs() < 0.01, "{moments:?}");
        assert!(moments[0] + moments[1] >= moments[2]);
        assert_eq!(possible([1.0, 0.5, 1.2]), ([1.0, 0.5, 1.2], false));
        // A plate: the sum as read must not lose the last digit.
        for digit in 1..200 {
            let (a, b) = (0.1234567 / f64::from(digit), 0.7654321 / f64::from(digit));
            let (moments, bent) = possible([a, b, a + b]);
            assert!(moments[0] + moments[1] >= moments[2] && !bent);
            assert!((moments[2] / (a + b) - 1.0).abs() < 1e-10);
        }
    }

    #[test]
    fn what_the_compiler_would_undo_is_refused() {
        for (compiler, part) in [
            ("settotalmass=\"3\"", "settotalmass"),
            ("fusestatic=\"true\"", "fusestatic"),
        ] {
            let text = format!("<mujoco><compiler {compiler}/></mujoco>");
            let model = Mjcf::parse(&text, Path::new("m.xml")).unwrap();
            assert!(obstacle(&model).unwrap().contains(part));
        }
        let with = |compiler: &str, inside: &str| {
            let text = body("", inside).replace("<worldbody>", &format!("{compiler}<worldbody>"));
            turned(&text, &WAS, &ALL).unwrap_err()
        };
        assert!(with("<compiler boundmass=\"9\"/>", "<geom/>").contains("boundmass"));
        assert!(with("<compiler boundinertia=\"9\"/>", "<geom/>").contains("boundinertia"));
        assert!(with("", "<freejoint align=\"true\"/><geom/>").contains("aligns"));
        assert!(with("<compiler alignfree=\"true\"/>", "<freejoint/>").contains("aligns"));
    }
}
