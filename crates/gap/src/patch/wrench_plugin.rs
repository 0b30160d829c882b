//! Instances of the plugin `hydro.wrench` in an MJCF: effects without a form of their own are listed there.

use std::{
    fs,
    path::{Path, PathBuf},
};

use hydro_effects::{Id, SCHEMA, catalogue::is_optional, effect};
use roxmltree::Node;
use serde::{Deserialize, Serialize, Serializer};

use super::{
    error::PatchError,
    mjcf::Mjcf,
    xml_edit::{Edits, attribute, numbers},
};

/// Name of the plugin.
pub(super) const PLUGIN: &str = "hydro.wrench";

/// An element of the attribute `effects`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct ListedEffect {
    pub(super) effect: Id,
    pub(super) target: String,
    /// Values by name, in the order of the catalogue.
    #[serde(serialize_with = "as_map")]
    pub(super) parameters: Vec<(String, f64)>,
    /// Definition of an effect of the user's own, so that the file needs no other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) definition: Option<serde_json::Value>,
}

impl ListedEffect {
    pub(super) fn new(id: Id, target: &str, parameters: Vec<(String, f64)>) -> Self {
        let definition = effect(id).definition();
        Self {
            effect: id,
            target: target.to_owned(),
            parameters,
            definition: definition.and_then(|text| serde_json::from_str(text).ok()),
        }
    }
}

fn as_map<S: Serializer>(values: &[(String, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(name, value)| (name, value)))
}

/// The attribute `effects`, its elements unread.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct List {
    schema: String,
    pub(super) effects: Vec<serde_json::Value>,
}

/// The `<plugin>` element of a body.
pub(super) fn caller<'d, 'a>(model: &'d Mjcf<'a>, body: Node<'d, 'a>) -> Option<Node<'d, 'a>> {
    callers(model).find(|node| Mjcf::body_around(*node) == Some(body))
}

/// The `<plugin>` elements of all bodies. An element may name its instance alone.
pub(super) fn callers<'d, 'a>(model: &'d Mjcf<'a>) -> impl Iterator<Item = Node<'d, 'a>> {
    let ours: Vec<&str> = (instances(model))
        .filter_map(|of| of.attribute("name"))
        .collect();
    let is_ours = move |node: &Node<'_, '_>| match node.attribute("plugin") {
        Some(plugin) => plugin == PLUGIN,
        None => (node.attribute("instance")).is_some_and(|name| ours.contains(&name)),
    };
    let children = model.bodies().flat_map(|body| body.children());
    children.filter(move |node| node.has_tag_name("plugin") && is_ours(node))
}

/// The element with the attributes of a caller: its instance, or the caller itself.
pub(super) fn holder<'d, 'a>(model: &'d Mjcf<'a>, caller: Node<'d, 'a>) -> Node<'d, 'a> {
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
pub(super) fn config<'d, 'a>(holder: Node<'d, 'a>, key: &str) -> Option<Node<'d, 'a>> {
    holder
        .children()
        .find(|node| node.has_tag_name("config") && node.attribute("key") == Some(key))
}

pub(super) fn config_text(key: &str, value: &str) -> String {
    format!("<config key=\"{key}\" {}/>", attribute("value", value))
}

pub(super) fn set_config(edits: &mut Edits<'_>, holder: Node<'_, '_>, key: &str, value: &str) {
    match config(holder, key) {
        Some(found) => edits.set(found, "value", value),
        None => edits.append(holder, &config_text(key, value)),
    }
}

/// Names of the bodies with an instance.
pub(super) fn bodies_with_instance(model: &Mjcf<'_>) -> Vec<String> {
    callers(model)
        .filter_map(|caller| caller.parent()?.attribute("name"))
        .map(str::to_owned)
        .collect()
}

/// Makes the paths in instances absolute: a path is looked for in `search`, then beside the model; one that is not found
/// stays.
pub(super) fn absolute_paths(model: &Mjcf<'_>, search: &[PathBuf], folder: &Path) -> String {
    let mut edits = Edits::new(model.text);
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

/// Adds effects to the instance on a body, made where there is none; `density` [kg/m^3] is that of MuJoCo's own fluid,
/// where it acts.
pub(super) fn add(
    model: &Mjcf<'_>,
    body: &str,
    effects: &[ListedEffect],
    density: Option<f64>,
) -> Result<String, PatchError> {
    let Some(body) = model
        .bodies()
        .find(|node| node.attribute("name") == Some(body))
    else {
        return Ok(model.text.to_owned());
    };
    let mut edits = Edits::new(model.text);
    if let Some(caller) = caller(model, body) {
        let holder = holder(model, caller);
        let found = config(holder, "effects").and_then(|node| node.attribute("value"));
        let value = merged(found, effects)?;
        set_config(&mut edits, holder, "effects", &value);
        return Ok(edits.apply());
    }
    let name = fresh_instance(model, "hydro_effects");
    let mut inside = vec![config_text("effects", &merged(None, effects)?)];
    // The water is that of an instance that the model has already.
    let other = callers(model).next().map(|caller| holder(model, caller));
    for key in ["density", "waterline", "current", "waves", "hull"] {
        let value = other
            .and_then(|other| config(other, key))
            .and_then(|node| node.attribute("value"))
            .map(str::to_owned)
            .or_else(|| {
                density
                    .filter(|_| key == "density")
                    .map(super::xml_edit::number)
            });
        inside.extend(value.map(|value| config_text(key, &value)));
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

/// Gives a body an empty child, so that MuJoCo's inertia matrix has room for added inertia: for a body without children
/// the matrix may be diagonal. The child changes nothing else.
pub(super) fn make_room(model: &Mjcf<'_>, body: &str) -> String {
    let found = model
        .bodies()
        .find(|node| node.attribute("name") == Some(body));
    let Some(found) = found else {
        return model.text.to_owned();
    };
    let has_child = found
        .descendants()
        .skip(1)
        .any(|below| below.has_tag_name("body"));
    let mut edits = Edits::new(model.text);
    if !has_child {
        let name = model.fresh_name(&format!("{body}_water"));
        edits.append(found, &format!("<body {}/>", attribute("name", &name)));
    }
    edits.apply()
}

/// Adds a velocity of the water [m/s] to every instance.
pub(super) fn add_current(model: &Mjcf<'_>, velocity: [f64; 3]) -> String {
    let mut edits = Edits::new(model.text);
    let mut done = Vec::new();
    for caller in callers(model) {
        let holder = holder(model, caller);
        if done.contains(&holder) {
            continue;
        }
        done.push(holder);
        let own = config(holder, "current")
            .and_then(|node| node.attribute("value"))
            .map(super::mjcf::parse_numbers)
            .unwrap_or_default();
        let total: [f64; 3] =
            std::array::from_fn(|axis| own.get(axis).copied().unwrap_or(0.0) + velocity[axis]);
        set_config(&mut edits, holder, "current", &numbers(&total));
    }
    edits.apply()
}

/// A free name for an instance: `wanted`, or that with a number.
pub(super) fn fresh_instance(model: &Mjcf<'_>, wanted: &str) -> String {
    let taken = |name: &str| instances(model).any(|node| node.attribute("name") == Some(name));
    let mut name = wanted.to_owned();
    let mut count = 2;
    while taken(&name) {
        name = format!("{wanted}_{count}");
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
        .rfind(|node| ["compiler", "option", "size"].contains(&node.tag_name().name()));
    match above {
        Some(above) => edits.after(above, &section),
        None => edits.prepend(root, &section),
    }
}

/// The attribute `effects` with more effects.
fn merged(found: Option<&str>, effects: &[ListedEffect]) -> Result<String, PatchError> {
    let found = found.map(str::trim).filter(|found| !found.is_empty());
    let fault = |detail: String| PatchError::Effects {
        found: found.unwrap_or_default().to_owned(),
        detail,
    };
    let written = |effect: &ListedEffect| {
        serde_json::to_string(effect).map_err(|error| fault(error.to_string()))
    };
    let Some(found) = found else {
        let added: Vec<String> = effects.iter().map(written).collect::<Result<_, _>>()?;
        return Ok(format!(
            "{{\"schema\":\"{SCHEMA}\",\"effects\":[{}]}}",
            added.join(",")
        ));
    };
    let mut list = read_list(found).map_err(fault)?;
    let mut added: Vec<String> = Vec::new();
    let mut summed = false;
    for effect in effects {
        if list.effects.iter_mut().any(|own| add_to(own, effect)) {
            summed = true;
        } else if list.effects.iter().any(|own| is_same(own, effect)) {
            return Err(PatchError::Twice {
                effect: effect.effect,
                target: effect.target.clone(),
            });
        } else {
            added.push(written(effect)?);
        }
    }
    // Existing text stays byte by byte.
    let open = found
        .strip_suffix('}')
        .and_then(|found| found.trim_end().strip_suffix(']'))
        .filter(|open| open.starts_with('{') && !summed && !list.effects.is_empty());
    if let Some(open) = open {
        return Ok(format!("{open},{}]}}", added.join(",")));
    }
    let own = list.effects.iter().map(ToString::to_string);
    let all: Vec<String> = own.chain(added).collect();
    Ok(format!(
        "{{\"schema\":\"{SCHEMA}\",\"effects\":[{}]}}",
        all.join(",")
    ))
}

fn is_same(own: &serde_json::Value, effect: &ListedEffect) -> bool {
    own["effect"] == effect.effect.as_str() && own["target"] == effect.target.as_str()
}

/// Adds the values of an effect to an existing element; false where they differ in effect or target, or are not additive.
fn add_to(own: &mut serde_json::Value, listed: &ListedEffect) -> bool {
    if !is_same(own, listed) || !effect(listed.effect).is_additive() {
        return false;
    }
    let sums: Option<Vec<f64>> = listed
        .parameters
        .iter()
        .map(|(name, value)| match own["parameters"].get(name) {
            Some(own) => Some(own.as_f64()? + value),
            None => is_optional(listed.effect, name).then_some(*value),
        })
        .collect();
    let Some(sums) = sums else {
        return false;
    };
    for ((name, _), sum) in listed.parameters.iter().zip(sums) {
        own["parameters"][name] = serde_json::json!(sum);
    }
    true
}

pub(super) fn read_list(found: &str) -> Result<List, String> {
    let text = if found.starts_with('{') {
        found.to_owned()
    } else {
        hydro_files::read_text(Path::new(found), hydro_files::TEXT)
            .map_err(|error| error.to_string())?
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

    fn drag() -> ListedEffect {
        let values = vec![("z".to_owned(), 1.5), ("a".to_owned(), 1e-9)];
        ListedEffect::new(Id::LinearDrag, "it's", values)
    }

    const JSON: &str =
        r#"{"effect":"linear_drag","target":"it's","parameters":{"z":1.5,"a":1e-9}}"#;

    fn added(text: &str, density: Option<f64>) -> Result<String, PatchError> {
        add(
            &Mjcf::parse(text, Path::new("m.xml")).unwrap(),
            "hull",
            &[drag()],
            density,
        )
    }

    #[test]
    fn an_instance_is_made_and_called() {
        let text = "<mujoco>\n  <option/>\n  <worldbody>\n    <body name=\"hull\">\n      <geom/>\n    \
                    </body>\n  </worldbody>\n</mujoco>";
        let effects = JSON.replace('\'', "&apos;");
        assert_eq!(
            added(text, Some(1025.0)).unwrap(),
            format!(
                "<mujoco>\n  <option/>\n  <extension>\n    <plugin plugin=\"hydro.wrench\">\n      \
                 <instance name=\"hydro_effects\">\n        <config key=\"effects\" \
                 value='{{\"schema\":\"hydro-effects/1\",\"effects\":[{effects}]}}'/>\n        \
                 <config key=\"density\" value=\"1025\"/>\n      </instance>\n    </plugin>\n  \
                 </extension>\n  <worldbody>\n    <body name=\"hull\">\n      <plugin plugin=\"hydro.wrench\" instance=\"hydro_effects\"/>\n      \
                 <geom/>\n    </body>\n  </worldbody>\n</mujoco>"
            )
        );
    }

    #[test]
    fn a_body_may_name_its_instance_alone() {
        let text = "<mujoco><extension><plugin plugin=\"hydro.wrench\"><instance name=\"w\"/></plugin>\
                    </extension><worldbody><body name=\"hull\"><plugin instance=\"w\"/></body></worldbody></mujoco>";
        let added = added(text, None).unwrap();
        assert_eq!(added.matches("<instance").count(), 1, "{added}");
        assert_eq!(added.matches("key=\"effects\"").count(), 1, "{added}");
    }

    #[test]
    fn an_effect_of_the_users_own_brings_its_definition() {
        let text = "summary = \"s\"\ntarget = \"body\"\nworld_force = {x = \"-k * x\"}\n[parameters.k]\n\
                    unit = \"N/m\"\nlower = 0\nupper = 9\nprior_sd = 1";
        let id = hydro_effects::own::register_toml("spring", text).unwrap();
        let listed = ListedEffect::new(id, "hull", vec![("k".to_owned(), 2.0)]);
        let list = merged(None, &[listed]).unwrap();
        let list: serde_json::Value = serde_json::from_str(&list).unwrap();
        let entry = &list["effects"][0];
        assert_eq!(entry["effect"], "user.spring");
        assert_eq!(entry["definition"]["world_force"]["x"], "-k * x");
        assert_eq!(hydro_effects::listed_id(entry), Some(id));
    }

    #[test]
    fn what_was_left_out_is_nothing_when_effects_add_up() {
        let force = |parameters: &[(&str, f64)]| {
            let values = parameters.iter().map(|(n, v)| ((*n).to_owned(), *v));
            ListedEffect::new(Id::ConstantForce, "hull", values.collect())
        };
        let mut own = serde_json::to_value(force(&[("x", 1.0), ("y", 2.0)])).unwrap();
        assert!(add_to(
            &mut own,
            &force(&[("x", 0.5), ("y", 0.0), ("torque_z", 3.0)])
        ));
        assert_eq!(
            own["parameters"],
            serde_json::json!({"x": 1.5, "y": 2.0, "torque_z": 3.0})
        );
        assert!(!add_to(&mut own, &force(&[("z", 0.5)])));
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
        let text = added(&with("<config key=\"checkpoint\" value=\"c\"/>"), None).unwrap();
        assert!(
            text.contains("value=\"c\"/><config key=\"effects\" value='{"),
            "{text}"
        );
        let own =
            "<config key=\"effects\" value='{\"schema\":\"hydro-effects/1\",\"effects\":[1]}'/>";
        let text = added(&with(own), None).unwrap();
        assert!(text.contains("[1,{\"effect\":\"linear_drag\""), "{text}");
        let turned =
            "<config key=\"effects\" value='{\"effects\":[2.5],\"schema\":\"hydro-effects/1\"}'/>";
        let text = added(&with(turned), None).unwrap();
        assert!(text.contains("[2.5,{\"effect\":\"linear_drag\""), "{text}");
        let same = "<config key=\"effects\" value='{\"schema\":\"hydro-effects/1\",\"effects\":[{\"effect\":\
                    \"linear_drag\",\"target\":\"it&apos;s\",\"parameters\":{\"a\":0.5,\"z\":1.0}}]}'/>";
        let text = added(&with(same), None).unwrap();
        assert!(text.contains("\"a\":0.500000001,\"z\":2.5}"), "{text}");
        let one = same.replace("\"a\":0.5,", "");
        let text = added(&with(&one), None).unwrap_err().to_string();
        assert!(
            text.contains("linear_drag acts on `it's` already"),
            "{text}"
        );
        let other = own.replace("effects/1", "effects/2");
        let text = added(&with(&other), None).unwrap_err().to_string();
        assert!(text.contains("expected `hydro-effects/1`"), "{text}");
    }

    #[test]
    fn an_instance_written_in_the_body_gains_them_too() {
        let text = "<mujoco><extension><plugin plugin=\"hydro.wrench\"/></extension><worldbody><body \
                    name=\"hull\"><plugin plugin=\"hydro.wrench\"><config key=\"density\" value=\"1\"/>\
                    </plugin></body></worldbody></mujoco>";
        let text = added(text, None).unwrap();
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
        assert_eq!(bodies_with_instance(&model), ["hull"]);
    }

    #[test]
    fn a_body_alone_is_given_room() {
        let text =
            "<mujoco><worldbody><body name=\"a\"><body name=\"b\"/></body></worldbody></mujoco>";
        let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
        assert_eq!(make_room(&model, "a"), text);
        assert!(
            make_room(&model, "b").contains("<body name=\"b\"><body name=\"b_water\"/></body>")
        );
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
        assert_eq!(
            absolute("c", std::slice::from_ref(&root), Path::new("/none")),
            expected
        );
        assert_eq!(absolute("c", &[], &root), expected);
        assert_eq!(absolute("d", &[], &root), text("d"));
    }
}
