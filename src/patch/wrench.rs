//! Effects that MJCF cannot say, in instances of the plugin `hydro.wrench`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use roxmltree::Node;
use serde::{Deserialize, Serialize, Serializer};

use super::{
    document::Mjcf,
    edit::{Edits, attribute, numbers},
    error::PatchError,
};
use crate::effects::Id;

/// Name of the plugin.
const PLUGIN: &str = "hydro.wrench";

/// Schema of the attribute `effects`.
const SCHEMA: &str = "hydro-effects/1";

/// An effect as the attribute lists it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Listed {
    /// Which effect.
    pub(super) effect: Id,
    /// What it acts on.
    pub(super) target: String,
    /// Values by name, in the order of the catalogue.
    #[serde(serialize_with = "as_map")]
    pub(super) parameters: Vec<(String, f64)>,
}

fn as_map<S: Serializer>(values: &[(String, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(name, value)| (name, value)))
}

/// The attribute, with effects of whatever kind.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    schema: String,
    effects: Vec<serde_json::Value>,
}

/// The element on a body that calls the plugin.
fn caller<'d, 'a>(model: &'d Mjcf<'a>, body: Node<'d, 'a>) -> Option<Node<'d, 'a>> {
    callers(model).find(|node| Mjcf::body_of(*node) == Some(body))
}

/// Every element on a body that calls the plugin.
fn callers<'d, 'a>(model: &'d Mjcf<'a>) -> impl Iterator<Item = Node<'d, 'a>> {
    model.bodies().flat_map(|body| {
        body.children()
            .filter(|node| node.has_tag_name("plugin") && node.attribute("plugin") == Some(PLUGIN))
    })
}

/// Where the attributes of a caller stand: in its instance, or in itself.
fn holder<'d, 'a>(model: &'d Mjcf<'a>, caller: Node<'d, 'a>) -> Node<'d, 'a> {
    let instance = caller.attribute("instance").and_then(|name| {
        instances(model).find(|instance| instance.attribute("name") == Some(name))
    });
    instance.unwrap_or(caller)
}

/// Every instance that the extensions declare.
fn instances<'d, 'a>(model: &'d Mjcf<'a>) -> impl Iterator<Item = Node<'d, 'a>> {
    model
        .section("extension")
        .filter(|node| node.attribute("plugin") == Some(PLUGIN))
        .flat_map(|plugin| {
            plugin
                .children()
                .filter(|node| node.has_tag_name("instance"))
        })
}

/// An attribute of an instance.
fn config<'d, 'a>(holder: Node<'d, 'a>, key: &str) -> Option<Node<'d, 'a>> {
    holder
        .children()
        .find(|node| node.has_tag_name("config") && node.attribute("key") == Some(key))
}

fn config_text(key: &str, value: &str) -> String {
    format!("<config key=\"{key}\" {}/>", attribute("value", value))
}

fn set_config(edits: &mut Edits<'_>, holder: Node<'_, '_>, key: &str, value: &str) {
    match config(holder, key) {
        Some(found) => edits.set(found, "value", value),
        None => edits.append(holder, &config_text(key, value)),
    }
}

/// Names of the bodies that carry an instance.
pub(super) fn carriers(model: &Mjcf<'_>) -> Vec<String> {
    callers(model)
        .filter_map(|caller| caller.parent()?.attribute("name"))
        .map(str::to_owned)
        .collect()
}

/// Makes the folders and files that instances name absolute: a path is looked for in `search`, then
/// beside the model. What is in none stays as it is.
pub(super) fn absolute_paths(model: &Mjcf<'_>, search: &[PathBuf], folder: &Path) -> String {
    let mut edits = Edits::of(model.text);
    for holder in instances(model).chain(callers(model)) {
        for key in ["checkpoint", "effects"] {
            let Some((node, value)) = config(holder, key)
                .and_then(|node| node.attribute("value").map(|value| (node, value)))
            else {
                continue;
            };
            let path = Path::new(value.trim());
            if value.trim().is_empty() || value.trim().starts_with('{') || path.is_absolute() {
                continue;
            }
            if let Some(found) = find(path, search, folder) {
                edits.set(node, "value", &found.to_string_lossy());
            }
        }
    }
    edits.apply()
}

fn find(path: &Path, search: &[PathBuf], folder: &Path) -> Option<PathBuf> {
    search
        .iter()
        .map(PathBuf::as_path)
        .chain([folder])
        .map(|place| place.join(path))
        .find(|path| path.exists())
        .and_then(|path| fs::canonicalize(path).ok())
}

/// What an instance that has to be made should know of the water.
#[derive(Clone, Debug, Default)]
pub(super) struct Water {
    /// Density of MuJoCo's own fluid [kg/m^3], where it acts.
    pub(super) density: Option<f64>,
    /// Velocity of the water [m/s].
    pub(super) current: [f64; 3],
}

/// Adds effects to the instance on a body, which is made where there is none.
pub(super) fn add(
    model: &Mjcf<'_>,
    body: &str,
    effects: &[Listed],
    water: &Water,
) -> Result<String, PatchError> {
    let Some(body) = model
        .bodies()
        .find(|node| node.attribute("name") == Some(body))
    else {
        return Ok(model.text.to_owned());
    };
    let mut edits = Edits::of(model.text);
    if let Some(caller) = caller(model, body) {
        let holder = holder(model, caller);
        let found = config(holder, "effects").and_then(|node| node.attribute("value"));
        let value = merged(found, effects)?;
        set_config(&mut edits, holder, "effects", &value);
        return Ok(edits.apply());
    }
    let name = fresh_instance(model);
    let mut inside = vec![config_text("effects", &merged(None, effects)?)];
    // An instance that the model has already knows the water best.
    let other = callers(model).next().map(|caller| holder(model, caller));
    for key in ["density", "waterline"] {
        let value = other
            .and_then(|other| config(other, key))
            .and_then(|node| node.attribute("value"))
            .map(str::to_owned)
            .or_else(|| {
                let density = water.density.filter(|_| key == "density");
                density.map(super::edit::number)
            });
        inside.extend(value.map(|value| config_text(key, &value)));
    }
    let inherited = other
        .and_then(|other| config(other, "current"))
        .and_then(|node| node.attribute("value"))
        .map(super::document::numbers_of);
    let current = inherited.unwrap_or_else(|| water.current.to_vec());
    if current.iter().any(|speed| *speed != 0.0) {
        inside.push(config_text("current", &numbers(&current)));
    }
    let instance = format!(
        "<instance {}>\n  {}\n</instance>",
        attribute("name", &name),
        inside.join("\n  ")
    );
    declare(model, &mut edits, PLUGIN, Some(&instance));
    let call = format!(
        "<plugin plugin=\"{PLUGIN}\" {}/>",
        attribute("instance", &name)
    );
    edits.prepend(body, &call);
    Ok(edits.apply())
}

/// Adds a velocity of the water [m/s] to every instance.
pub(super) fn add_current(model: &Mjcf<'_>, velocity: [f64; 3]) -> String {
    let mut edits = Edits::of(model.text);
    let mut done = Vec::new();
    for caller in callers(model) {
        let holder = holder(model, caller);
        if done.contains(&holder) {
            continue;
        }
        done.push(holder);
        let own = config(holder, "current")
            .and_then(|node| node.attribute("value"))
            .map(super::document::numbers_of)
            .unwrap_or_default();
        let total: [f64; 3] =
            std::array::from_fn(|axis| own.get(axis).copied().unwrap_or(0.0) + velocity[axis]);
        set_config(&mut edits, holder, "current", &numbers(&total));
    }
    edits.apply()
}

fn fresh_instance(model: &Mjcf<'_>) -> String {
    let taken = |name: &str| instances(model).any(|node| node.attribute("name") == Some(name));
    let mut name = "hydro_effects".to_owned();
    let mut count = 2;
    while taken(&name) {
        name = format!("hydro_effects_{count}");
        count += 1;
    }
    name
}

/// Declares a plugin, with an instance where one is given.
pub(super) fn declare(
    model: &Mjcf<'_>,
    edits: &mut Edits<'_>,
    plugin: &str,
    instance: Option<&str>,
) {
    let declared = model
        .section("extension")
        .find(|node| node.attribute("plugin") == Some(plugin));
    if let Some(declared) = declared {
        if let Some(instance) = instance {
            edits.append(declared, instance);
        }
        return;
    }
    let indented = instance.map(|instance| instance.replace('\n', "\n  "));
    let element = match indented {
        Some(instance) => format!("<plugin plugin=\"{plugin}\">\n  {instance}\n</plugin>"),
        None => format!("<plugin plugin=\"{plugin}\"/>"),
    };
    let root = model.root();
    if let Some(extension) = model.sections("extension").last() {
        edits.append(extension, &element);
        return;
    }
    let section = format!(
        "<extension>\n  {}\n</extension>",
        element.replace('\n', "\n  ")
    );
    let above = root
        .children()
        .filter(|node| ["compiler", "option", "size"].contains(&node.tag_name().name()))
        .last();
    match above {
        Some(above) => edits.after(above, &section),
        None => edits.prepend(root, &section),
    }
}

/// The attribute with effects added to those it has.
fn merged(found: Option<&str>, effects: &[Listed]) -> Result<String, PatchError> {
    let found = found.map(str::trim).filter(|found| !found.is_empty());
    let fault = |detail: String| PatchError::Effects {
        found: found.unwrap_or_default().to_owned(),
        detail,
    };
    let mut added = Vec::new();
    for effect in effects {
        added.push(serde_json::to_string(effect).map_err(|error| fault(error.to_string()))?);
    }
    let added = added.join(",");
    let Some(found) = found else {
        return Ok(format!("{{\"schema\":\"{SCHEMA}\",\"effects\":[{added}]}}"));
    };
    let list = read_list(found).map_err(fault)?;
    let comma = if list.effects.is_empty() { "" } else { "," };
    // What was written by hand, or in the order of the catalogue, stays as it is.
    let open = found
        .strip_suffix('}')
        .and_then(|found| found.trim_end().strip_suffix(']'));
    if let Some(open) = open.filter(|open| open.starts_with('{')) {
        return Ok(format!("{open}{comma}{added}]}}"));
    }
    let own: Vec<String> = list.effects.iter().map(ToString::to_string).collect();
    Ok(format!(
        "{{\"schema\":\"{SCHEMA}\",\"effects\":[{}{comma}{added}]}}",
        own.join(",")
    ))
}

fn read_list(found: &str) -> Result<List, String> {
    let text = if found.starts_with('{') {
        found.to_owned()
    } else {
        fs::read_to_string(found).map_err(|error| error.to_string())?
    };
    let list: List = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    if list.schema == SCHEMA {
        Ok(list)
    } else {
        Err(format!("schema is `{}`, expected `{SCHEMA}`", list.schema))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn drag() -> Listed {
        Listed {
            effect: Id::LinearDrag,
            target: "it's".to_owned(),
            parameters: vec![("z".to_owned(), 1.5), ("a".to_owned(), 1e-9)],
        }
    }

    const JSON: &str =
        r#"{"effect":"linear_drag","target":"it's","parameters":{"z":1.5,"a":1e-9}}"#;

    fn added(text: &str, water: &Water) -> Result<String, PatchError> {
        add(
            &Mjcf::parse(text, Path::new("m.xml")).unwrap(),
            "hull",
            &[drag()],
            water,
        )
    }

    #[test]
    fn an_instance_is_made_and_called() {
        let text = "<mujoco>\n  <option/>\n  <worldbody>\n    <body name=\"hull\">\n      <geom/>\n    \
                    </body>\n  </worldbody>\n</mujoco>";
        let water = Water {
            density: Some(1025.0),
            current: [0.1, 0.0, 0.0],
        };
        let effects = JSON.replace('\'', "&apos;");
        assert_eq!(
            added(text, &water).unwrap(),
            format!(
                "<mujoco>\n  <option/>\n  <extension>\n    <plugin plugin=\"hydro.wrench\">\n      \
                 <instance name=\"hydro_effects\">\n        <config key=\"effects\" \
                 value='{{\"schema\":\"hydro-effects/1\",\"effects\":[{effects}]}}'/>\n        \
                 <config key=\"density\" value=\"1025\"/>\n        <config key=\"current\" value=\"0.1 0 \
                 0\"/>\n      </instance>\n    </plugin>\n  </extension>\n  <worldbody>\n    <body \
                 name=\"hull\">\n      <plugin plugin=\"hydro.wrench\" instance=\"hydro_effects\"/>\n      \
                 <geom/>\n    </body>\n  </worldbody>\n</mujoco>"
            )
        );
    }

    #[test]
    fn the_instance_on_the_body_gains_them() {
        let with = |config: &str| {
            format!(
                "<mujoco><extension><plugin plugin=\"hydro.wrench\"><instance name=\"w\">{config}</instance>\
                 </plugin></extension><worldbody><body name=\"hull\"><plugin plugin=\"hydro.wrench\" \
                 instance=\"w\"/></body></worldbody></mujoco>"
            )
        };
        let water = Water::default();
        let text = added(&with("<config key=\"checkpoint\" value=\"c\"/>"), &water).unwrap();
        assert!(
            text.contains("value=\"c\"/><config key=\"effects\" value='{"),
            "{text}"
        );
        let own =
            "<config key=\"effects\" value='{\"schema\":\"hydro-effects/1\",\"effects\":[1]}'/>";
        let text = added(&with(own), &water).unwrap();
        assert!(text.contains("[1,{\"effect\":\"linear_drag\""), "{text}");
        let turned =
            "<config key=\"effects\" value='{\"effects\":[2.5],\"schema\":\"hydro-effects/1\"}'/>";
        let text = added(&with(turned), &water).unwrap();
        assert!(text.contains("[2.5,{\"effect\":\"linear_drag\""), "{text}");
        let other = own.replace("effects/1", "effects/2");
        let text = added(&with(&other), &water).unwrap_err().to_string();
        assert!(text.contains("expected `hydro-effects/1`"), "{text}");
    }

    #[test]
    fn an_instance_written_in_the_body_gains_them_too() {
        let text = "<mujoco><extension><plugin plugin=\"hydro.wrench\"/></extension><worldbody><body \
                    name=\"hull\"><plugin plugin=\"hydro.wrench\"><config key=\"density\" value=\"1\"/>\
                    </plugin></body></worldbody></mujoco>";
        let text = added(text, &Water::default()).unwrap();
        assert!(
            text.contains("value=\"1\"/><config key=\"effects\""),
            "{text}"
        );
        let model = Mjcf::parse(&text, Path::new("m.xml")).unwrap();
        let text = add_current(&model, [0.0, 0.2, 0.0]);
        assert!(
            text.contains("<config key=\"current\" value=\"0 0.2 0\"/>"),
            "{text}"
        );
        assert_eq!(carriers(&model), ["hull"]);
    }

    #[test]
    fn paths_become_absolute_where_they_are_found() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("c")).unwrap();
        let root = fs::canonicalize(folder.path()).unwrap();
        let text = |path: &str| {
            format!(
                "<mujoco><extension><plugin plugin=\"hydro.wrench\"><instance name=\"w\"><config \
                 key=\"checkpoint\" value=\"{path}\"/></instance></plugin></extension></mujoco>"
            )
        };
        let absolute = |path: &str, search: &[PathBuf], folder: &Path| {
            let text = text(path);
            absolute_paths(
                &Mjcf::parse(&text, Path::new("m.xml")).unwrap(),
                search,
                folder,
            )
        };
        let expected = text(&root.join("c").to_string_lossy());
        assert_eq!(absolute("c", &[root.clone()], Path::new("/none")), expected);
        assert_eq!(absolute("c", &[], &root), expected);
        assert_eq!(absolute("d", &[], &root), text("d"));
    }
}
