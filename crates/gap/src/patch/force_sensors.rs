//! Force and torque sensors of a patched model: MuJoCo's do not feel forces of a plugin, so those above them become
//! `hydro.load_cell`, with the same name, place and length of reading.

use roxmltree::Node;

use super::{
    mjcf::Mjcf,
    wrench_plugin::declare,
    xml_edit::{Edits, attribute},
};

/// Name of the plugin.
const PLUGIN: &str = "hydro.load_cell";

/// Attributes that change a reading and that only MuJoCo's own sensors have.
const OWN: [&str; 4] = ["delay", "nsample", "interp", "interval"];

/// The force and torque sensors whose site stands on one of `bodies` or above.
fn above<'d, 'a>(model: &'d Mjcf<'a>, bodies: &[String]) -> Vec<Node<'d, 'a>> {
    let of_sensor = |sensor: &Node<'d, 'a>| -> Option<Node<'d, 'a>> {
        let name = sensor.attribute("site")?;
        let site = model
            .sites()
            .find(|site| site.attribute("name") == Some(name))?;
        Mjcf::body_around(site)
    };
    let feels = |sensor: &Node<'d, 'a>| {
        of_sensor(sensor).is_some_and(|cell| {
            cell.descendants().any(|below| {
                below.has_tag_name("body")
                    && below
                        .attribute("name")
                        .is_some_and(|name| bodies.iter().any(|body| body == name))
            })
        })
    };
    model
        .section("sensor")
        .filter(|node| node.has_tag_name("force") || node.has_tag_name("torque"))
        .filter(feels)
        .collect()
}

/// True where a force or torque sensor stands on the body or above.
pub(super) fn is_weighed(model: &Mjcf<'_>, body: &str) -> bool {
    !above(model, &[body.to_owned()]).is_empty()
}

/// The model with its load cells.
#[derive(Debug)]
pub(super) struct Cells {
    /// The text.
    pub(super) text: String,
    /// Sensors that became load cells.
    pub(super) changed: Vec<String>,
    /// Sensors that could not.
    pub(super) kept: Vec<String>,
}

impl Cells {
    /// Remarks for a person.
    pub(super) fn remarks(&self) -> impl Iterator<Item = String> {
        let changed = self
            .changed
            .iter()
            .map(|name| format!("`{name}` became a load cell, so that it shows what was added"));
        let kept = self.kept.iter().map(|name| {
            format!(
                "`{name}` has a delay or an interval of its own, which a load cell cannot have: it does not \
                 show what was added"
            )
        });
        changed.chain(kept)
    }
}

/// Makes load cells of the sensors that should feel the plugin's forces on `bodies`.
pub(super) fn convert(model: &Mjcf<'_>, bodies: &[String]) -> Cells {
    let mut edits = Edits::new(model.text);
    let (mut changed, mut kept) = (Vec::new(), Vec::new());
    for sensor in above(model, bodies) {
        let name = sensor.attribute("name").unwrap_or_default().to_owned();
        if OWN.iter().any(|key| sensor.has_attribute(*key)) {
            kept.push(name);
            continue;
        }
        edits.replace(sensor.range(), cell(sensor));
        changed.push(name);
    }
    if !changed.is_empty() {
        declare(model, &mut edits, PLUGIN, None);
    }
    Cells {
        text: edits.apply(),
        changed,
        kept,
    }
}

fn cell(sensor: Node<'_, '_>) -> String {
    let mut text = "<plugin".to_owned();
    let mut say = |key: &str, value: &str| {
        text.push(' ');
        text.push_str(&attribute(key, value));
    };
    if let Some(name) = sensor.attribute("name") {
        say("name", name);
    }
    say("plugin", PLUGIN);
    for key in ["cutoff", "user"] {
        if let Some(value) = sensor.attribute(key) {
            say(key, value);
        }
    }
    text.push('>');
    for (key, value) in [
        ("site", sensor.attribute("site").unwrap_or_default()),
        ("quantity", sensor.tag_name().name()),
        ("include", "plugin"),
    ] {
        text.push_str(&format!(
            "<config key=\"{key}\" {}/>",
            attribute("value", value)
        ));
    }
    text.push_str("</plugin>");
    // A plugin's sensor has no attribute for it.
    if let Some(noise) = sensor.attribute("noise") {
        text.push_str(&format!("<!-- noise {} -->", noise.replace("--", "")));
    }
    text
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    const MODEL: &str = "<mujoco><worldbody><body name=\"a\"><site name=\"s\"/><body name=\"b\"/></body>\
        <body name=\"c\"/></worldbody><sensor><gyro site=\"s\"/><force name=\"f\" site=\"s\" noise=\"0.1\"/>\
        <torque site=\"s\" cutoff=\"9\"/></sensor></mujoco>";

    #[test]
    fn sensors_above_become_load_cells_in_their_place() {
        let model = Mjcf::parse(MODEL, Path::new("m.xml")).unwrap();
        let cells = convert(&model, &["b".to_owned()]);
        assert_eq!(cells.changed, ["f", ""]);
        assert!(cells.text.contains(
            "<sensor><gyro site=\"s\"/><plugin name=\"f\" plugin=\"hydro.load_cell\"><config key=\"site\" \
             value=\"s\"/><config key=\"quantity\" value=\"force\"/><config key=\"include\" value=\"plugin\"/>\
             </plugin><!-- noise 0.1 --><plugin plugin=\"hydro.load_cell\" cutoff=\"9\">"
        ));
        assert!(
            cells
                .text
                .contains("<extension><plugin plugin=\"hydro.load_cell\"/></extension>")
        );
    }

    #[test]
    fn others_stay() {
        let model = Mjcf::parse(MODEL, Path::new("m.xml")).unwrap();
        let cells = convert(&model, &["c".to_owned()]);
        assert!(cells.changed.is_empty() && cells.text == MODEL);
        assert!(is_weighed(&model, "a") && is_weighed(&model, "b") && !is_weighed(&model, "c"));
        let late = MODEL.replace("name=\"f\"", "name=\"f\" delay=\"0.01\" nsample=\"5\"");
        let model = Mjcf::parse(&late, Path::new("m.xml")).unwrap();
        assert_eq!(convert(&model, &["a".to_owned()]).kept, ["f"]);
    }
}
