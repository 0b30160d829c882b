//! Payload, net buoyancy and current in plain MJCF.

use roxmltree::Node;

use super::{
    mjcf::{Mjcf, parse_numbers},
    xml_edit::{Edits, attribute, number, numbers},
};

/// Radius [m] of the geom that stands for a point mass where inertia is taken from geoms alone.
const POINT: f64 = 1e-3;

/// A point mass [kg] at a position in a body's frame [m]. `None` where the compiler would change it, or the mass is not
/// positive.
pub(super) fn payload(
    model: &Mjcf<'_>,
    body: Node<'_, '_>,
    mass: f64,
    position: [f64; 3],
) -> Option<String> {
    let fixed = ["settotalmass", "boundmass", "boundinertia"]
        .iter()
        .all(|key| model.setting_number("compiler", key) <= 0.0);
    if !fixed || mass <= 0.0 {
        return None;
    }
    let wanted = format!("{}_payload", body.attribute("name")?);
    let name = attribute("name", &model.fresh_name(&wanted));
    let place = numbers(&position);
    let mass = number(mass);
    let inside = if model.setting("compiler", "inertiafromgeom") == Some("true") {
        format!(
            "<geom type=\"sphere\" size=\"{}\" mass=\"{mass}\" contype=\"0\" conaffinity=\"0\" \
             fluidshape=\"none\" group=\"4\"/>",
            number(POINT)
        )
    } else {
        format!("<inertial pos=\"0 0 0\" mass=\"{mass}\" diaginertia=\"0 0 0\"/>")
    };
    let mut edits = Edits::new(model.text);
    edits.append(
        body,
        &format!("<body {name} pos=\"{place}\">{inside}</body>"),
    );
    Some(edits.apply())
}

/// A force [N] against gravity at the centre of mass of a body of this weight [N], as gravity compensation. `None` where
/// bodies hang on it: the centre of mass of the tree is not its own.
pub(super) fn buoyancy(
    model: &Mjcf<'_>,
    body: Node<'_, '_>,
    force: f64,
    weight: f64,
) -> Option<String> {
    let bears = body.descendants().skip(1).any(|below| {
        ["body", "attach", "replicate", "composite", "flexcomp"].contains(&below.tag_name().name())
    });
    if bears || weight.is_nan() || weight <= 0.0 {
        return None;
    }
    let own = body
        .attribute("gravcomp")
        .and_then(|text| parse_numbers(text).first().copied())
        .unwrap_or(0.0);
    let mut edits = Edits::new(model.text);
    edits.set(body, "gravcomp", &number(own + force / weight));
    Some(edits.apply())
}

/// True where MuJoCo's own fluid acts.
pub(super) fn has_native_fluid(model: &Mjcf<'_>) -> bool {
    ["density", "viscosity"]
        .iter()
        .any(|key| model.setting_number("option", key) > 0.0)
}

/// Velocity of the water in the model [m/s].
pub(super) fn wind(model: &Mjcf<'_>) -> [f64; 3] {
    let own = model.setting("option", "wind").map(parse_numbers);
    let own = own.unwrap_or_default();
    std::array::from_fn(|axis| own.get(axis).copied().unwrap_or(0.0))
}

/// Adds a velocity of the water in the world [m/s], for MuJoCo's own fluid.
pub(super) fn current(model: &Mjcf<'_>, velocity: [f64; 3]) -> String {
    let own = wind(model);
    let total: [f64; 3] = std::array::from_fn(|axis| own[axis] + velocity[axis]);
    let options: Vec<Node<'_, '_>> = model.sections("option").collect();
    let given = options.iter().rev().find(|node| node.has_attribute("wind"));
    let mut edits = Edits::new(model.text);
    match given.or(options.last()) {
        Some(option) => edits.set(*option, "wind", &numbers(&total)),
        None => edits.prepend(
            model.root(),
            &format!("<option wind=\"{}\"/>", numbers(&total)),
        ),
    }
    edits.apply()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    fn with(
        text: &str,
        change: impl Fn(&Mjcf<'_>, Node<'_, '_>) -> Option<String>,
    ) -> Option<String> {
        let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
        let body = model.bodies().next().unwrap();
        change(&model, body)
    }

    #[test]
    fn a_payload_is_a_body() {
        let load = |text| {
            with(text, |model, body| {
                payload(model, body, 1.5, [0.1, 0.0, -0.2])
            })
        };
        let text = "<mujoco><worldbody><body name=\"b\"><geom/></body></worldbody></mujoco>";
        assert!(load(text).unwrap().contains(
            "<geom/><body name=\"b_payload\" pos=\"0.1 0 -0.2\"><inertial pos=\"0 0 0\" mass=\"1.5\" \
             diaginertia=\"0 0 0\"/></body></body>"
        ));
        let geoms = text.replace(
            "<worldbody>",
            "<compiler inertiafromgeom=\"true\"/><worldbody>",
        );
        assert!(load(&geoms).unwrap().contains("mass=\"1.5\" contype=\"0\""));
        let total = text.replace("<worldbody>", "<compiler settotalmass=\"3\"/><worldbody>");
        assert_eq!(load(&total), None);
    }

    #[test]
    fn buoyancy_compensates_gravity_of_a_body_alone() {
        let lift = |text| with(text, |model, body| buoyancy(model, body, 2.0, 20.0));
        let alone = "<mujoco><worldbody><body name=\"b\" gravcomp=\"0.5\"/></worldbody></mujoco>";
        assert!(lift(alone).unwrap().contains("gravcomp=\"0.6\""));
        let tree = "<mujoco><worldbody><body name=\"b\"><body/></body></worldbody></mujoco>";
        assert_eq!(lift(tree), None);
    }

    #[test]
    fn a_current_adds_to_the_wind() {
        let model = |text| {
            let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
            (has_native_fluid(&model), current(&model, [0.1, 0.2, 0.0]))
        };
        assert_eq!(
            model("<mujoco><option density=\"1000\" wind=\"1 0 0\"/></mujoco>"),
            (
                true,
                "<mujoco><option density=\"1000\" wind=\"1.1 0.2 0\"/></mujoco>".to_owned()
            )
        );
        assert_eq!(
            model("<mujoco><worldbody/></mujoco>").1,
            "<mujoco><option wind=\"0.1 0.2 0\"/><worldbody/></mujoco>"
        );
    }
}
