//! Attributes of a plugin instance in an MJCF text, set before the model is compiled.

use thiserror::Error;

/// Why an attribute could not be set.
#[derive(Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum SceneError {
    /// No XML.
    #[error("the scene is no XML: {reason}")]
    Unreadable {
        /// Message of the parser.
        reason: String,
    },
    /// The plugin is not in the scene.
    #[error(
        "the scene has no <plugin plugin=\"{plugin}\"> with an <instance> in its <extension>; plugins there: {known}"
    )]
    NoInstance {
        /// The plugin looked for.
        plugin: String,
        /// The plugins that are there.
        known: String,
    },
}

/// Sets `key="value"` in every instance of `plugin`, replacing or adding a `<config>`; all else stays as it is.
///
/// # Errors
/// If the text is no XML or holds no instance of the plugin.
pub fn with_attribute(
    mjcf: &str,
    plugin: &str,
    key: &str,
    value: &str,
) -> Result<String, SceneError> {
    let document = roxmltree::Document::parse(mjcf).map_err(|error| SceneError::Unreadable {
        reason: error.to_string(),
    })?;
    let plugins = || {
        let named = |node: &roxmltree::Node<'_, '_>| node.has_tag_name("plugin");
        let extensions = document
            .descendants()
            .filter(|node| node.has_tag_name("extension"));
        extensions
            .flat_map(|extension| extension.children())
            .filter(named)
    };
    let config = format!(
        "<config key=\"{}\" value=\"{}\"/>",
        escape(key),
        escape(value)
    );
    // Byte ranges and what takes their place, in the order of the text.
    let mut edits = Vec::new();
    for node in plugins().filter(|node| node.attribute("plugin") == Some(plugin)) {
        for instance in node.children().filter(|node| node.has_tag_name("instance")) {
            let known = instance
                .children()
                .find(|node| node.attribute("key") == Some(key));
            match (known, instance.first_child()) {
                (Some(known), _) => edits.push((known.range(), config.clone())),
                (None, Some(first)) => {
                    edits.push((first.range().start..first.range().start, config.clone()))
                }
                (None, None) => {
                    let name = instance.attribute("name").map_or(String::new(), escape);
                    edits.push((
                        instance.range(),
                        format!("<instance name=\"{name}\">{config}</instance>"),
                    ));
                }
            }
        }
    }
    if edits.is_empty() {
        let known: Vec<&str> = plugins()
            .filter_map(|node| node.attribute("plugin"))
            .collect();
        return Err(SceneError::NoInstance {
            plugin: plugin.to_owned(),
            known: if known.is_empty() {
                "none".to_owned()
            } else {
                known.join(", ")
            },
        });
    }
    let mut text = mjcf.to_owned();
    for (range, replacement) in edits.into_iter().rev() {
        text.replace_range(range, &replacement);
    }
    Ok(text)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const SCENE: &str = r#"<mujoco><extension><plugin plugin="hydro.wrench">
      <instance name="a"><config key="density" value="1000"/></instance><instance name="b"/>
    </plugin></extension></mujoco>"#;

    #[test]
    fn an_attribute_is_replaced_or_added_in_every_instance() {
        let text = with_attribute(SCENE, "hydro.wrench", "density", "1025").unwrap();
        assert_eq!(text.matches(r#"key="density" value="1025""#).count(), 2);
        assert!(!text.contains("1000"));
        let text = with_attribute(&text, "hydro.wrench", "checkpoint", "a&\"b").unwrap();
        assert_eq!(text.matches("a&amp;&quot;b").count(), 2);
        assert_eq!(text.matches("1025").count(), 2);
        roxmltree::Document::parse(&text).unwrap();
    }

    #[test]
    fn a_scene_without_the_plugin_is_refused_and_says_what_it_has() {
        let message = with_attribute(SCENE, "hydro.other", "a", "b")
            .unwrap_err()
            .to_string();
        assert!(message.contains("plugins there: hydro.wrench"), "{message}");
        let message = with_attribute("<mujoco", "hydro.wrench", "a", "b")
            .unwrap_err()
            .to_string();
        assert!(message.contains("no XML"), "{message}");
    }
}
