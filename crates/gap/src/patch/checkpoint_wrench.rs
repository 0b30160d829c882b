//! A learned wrench on a body, in an instance of the plugin `hydro.wrench`.

use std::path::Path;

use super::{
    Patched,
    error::PatchError,
    force_sensors,
    mjcf::Mjcf,
    wrench_plugin::{PLUGIN, caller, config, config_text, declare, fresh_instance, holder},
    xml_edit::{Edits, attribute, number, numbers},
};

/// A learned wrench for a body.
#[derive(Clone, Copy, Debug)]
pub struct CheckpointWrench<'a> {
    /// Name of the body.
    pub body: &'a str,
    /// The checkpoint's folder; absolute, for the model loads from any folder.
    pub checkpoint: &'a Path,
    /// Density of the water that it was trained in [kg/m^3].
    pub density: f64,
    /// Velocity of that water in the world [m/s].
    pub current: [f64; 3],
}

/// Adds a learned wrench to the result of [`patch`](super::patch) for the model `nominal`. An instance that the body already
/// has gets the checkpoint and keeps its own water.
///
/// # Errors
/// A body that the text does not name, or that has a learned wrench already.
pub fn add_checkpoint_wrench(
    patched: Patched,
    nominal: &Path,
    wrench: &CheckpointWrench<'_>,
) -> Result<Patched, PatchError> {
    let model = Mjcf::parse(&patched.xml, nominal)?;
    let body = model
        .bodies()
        .find(|node| node.attribute("name") == Some(wrench.body))
        .ok_or_else(|| PatchError::NoBody {
            body: wrench.body.to_owned(),
        })?;
    let folder = wrench.checkpoint.to_string_lossy();
    let mut edits = Edits::new(model.text);
    if let Some(caller) = caller(&model, body) {
        let holder = holder(&model, caller);
        if config(holder, "checkpoint").is_some() {
            return Err(PatchError::LearnedTwice {
                body: wrench.body.to_owned(),
            });
        }
        edits.append(holder, &config_text("checkpoint", &folder));
    } else {
        let name = fresh_instance(&model, "hydro_residual");
        let inside = [
            config_text("checkpoint", &folder),
            config_text("density", &number(wrench.density)),
            config_text("current", &numbers(&wrench.current)),
        ];
        let instance = format!(
            "<instance {}>\n  {}\n</instance>",
            attribute("name", &name),
            inside.join("\n  ")
        );
        declare(&model, &mut edits, PLUGIN, Some(&instance));
        let call = format!(
            "<plugin plugin=\"{PLUGIN}\" {}/>",
            attribute("instance", &name)
        );
        edits.prepend(body, &call);
    }
    let text = edits.apply();
    let cells = force_sensors::convert(&Mjcf::parse(&text, nominal)?, &[wrench.body.to_owned()]);
    let mut remarks = patched.remarks.clone();
    remarks.extend(cells.remarks());
    // The result must be well-formed XML.
    Mjcf::parse(&cells.text, nominal)?;
    Ok(Patched {
        written: patched.written.clone(),
        numbers: patched.numbers.clone(),
        xml: cells.text,
        remarks,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn added(xml: &str, body: &str) -> Result<String, PatchError> {
        let patched = Patched {
            xml: xml.to_owned(),
            written: Vec::new(),
            numbers: Vec::new(),
            remarks: Vec::new(),
        };
        let wrench = CheckpointWrench {
            body,
            checkpoint: Path::new("/out/it's/residual"),
            density: 1025.0,
            current: [0.1, 0.0, 0.0],
        };
        add_checkpoint_wrench(patched, Path::new("m.xml"), &wrench).map(|patched| patched.xml)
    }

    #[test]
    fn a_bare_body_gets_an_instance_with_the_water_it_was_trained_in() {
        let text = "<mujoco>\n  <worldbody>\n    <body name=\"hull\">\n      <freejoint/>\n    \
                    </body>\n  </worldbody>\n</mujoco>";
        let found = added(text, "hull").unwrap();
        for part in [
            "<instance name=\"hydro_residual\">",
            "<config key=\"checkpoint\" value=\"/out/it's/residual\"/>",
            "<config key=\"density\" value=\"1025\"/>",
            "<config key=\"current\" value=\"0.1 0 0\"/>",
            "<plugin plugin=\"hydro.wrench\" instance=\"hydro_residual\"/>",
        ] {
            assert!(found.contains(part), "{part}\n{found}");
        }
        let error = added(text, "keel").unwrap_err().to_string();
        assert!(error.contains("`keel`"), "{error}");
    }

    #[test]
    fn an_instance_of_effects_gains_it_and_one_with_a_checkpoint_has_no_room() {
        let with = |config: &str| {
            format!(
                "<mujoco><extension><plugin plugin=\"hydro.wrench\"><instance name=\"w\">{config}</instance>\
                 </plugin></extension><worldbody><body name=\"hull\"><plugin plugin=\"hydro.wrench\" \
                 instance=\"w\"/></body></worldbody></mujoco>"
            )
        };
        let effects = "<config key=\"effects\" value=\"e.json\"/>";
        let found = added(&with(effects), "hull").unwrap();
        assert!(found.contains(effects), "{found}");
        assert!(
            found.contains("value=\"/out/it's/residual\"/></instance>"),
            "{found}"
        );
        let error = added(&with("<config key=\"checkpoint\" value=\"b1\"/>"), "hull");
        let error = error.unwrap_err().to_string();
        assert!(error.contains("`hull`") && error.contains("one"), "{error}");
    }
}
