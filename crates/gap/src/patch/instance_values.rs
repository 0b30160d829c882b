//! Values in the attributes of an instance of `hydro.wrench`: those of its effects, and the factors on its checkpoint's
//! wrench.

use hydro_effects::{Id, listed_id};
use roxmltree::Node;

use super::{
    mjcf::{Mjcf, parse_numbers},
    wrench_plugin::{callers, config, holder, read_list, set_config},
    xml_edit::{Edits, numbers},
};

/// A value of an effect, and the factor on it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Value {
    /// Index of the entry in the list.
    pub(super) entry: usize,
    /// Index of the parameter, in the order of the catalogue.
    pub(super) value: usize,
    pub(super) factor: f64,
}

/// Scales values of the effects of the instance on a body; a list in a file is then written into the model.
pub(super) fn scale_values(
    model: &Mjcf<'_>,
    body: &str,
    values: &[Value],
    names: impl Fn(Id, &str) -> Vec<String>,
) -> Result<String, String> {
    let holder = callers(model)
        .find(|caller| {
            Mjcf::body_around(*caller).and_then(|body| body.attribute("name")) == Some(body)
        })
        .map(|caller| holder(model, caller))
        .ok_or_else(|| format!("the text has no instance of hydro.wrench on a body `{body}`"))?;
    let found = attribute(holder, "effects")
        .ok_or_else(|| format!("the instance on `{body}` has no attribute `effects`"))?;
    let mut list = read_list(found).map_err(|reason| format!("attribute `effects`: {reason}"))?;
    for Value {
        entry,
        value,
        factor,
    } in values
    {
        let listed = list.effects.get_mut(*entry);
        let listed = listed.ok_or_else(|| format!("attribute `effects` has no entry {entry}"))?;
        let name = listed_id(listed)
            .zip(listed["target"].as_str())
            .and_then(|(id, target)| names(id, target).into_iter().nth(*value));
        let number = name.and_then(|name| listed.get_mut("parameters")?.get_mut(name));
        let number = number.ok_or_else(|| {
            format!("entry {entry} of attribute `effects` does not say its parameter {value}")
        })?;
        let was = number
            .as_f64()
            .ok_or_else(|| format!("attribute `effects` says {number}, no number"))?;
        *number = serde_json::json!(was * factor);
    }
    let written = serde_json::to_string(&list).map_err(|error| error.to_string())?;
    let mut edits = Edits::new(model.text);
    set_config(&mut edits, holder, "effects", &written);
    Ok(edits.apply())
}

/// Scales the wrench of every checkpoint; `None` where the text has none.
pub(super) fn scale_wrench(model: &Mjcf<'_>, factors: [f64; 6]) -> Option<String> {
    let mut edits = Edits::new(model.text);
    let mut done = Vec::new();
    for caller in callers(model) {
        let holder = holder(model, caller);
        if done.contains(&holder) || attribute(holder, "checkpoint").is_none() {
            continue;
        }
        done.push(holder);
        let own = attribute(holder, "wrench_scale").map(parse_numbers);
        let own = own.unwrap_or_default();
        let scaled: [f64; 6] =
            std::array::from_fn(|axis| own.get(axis).copied().unwrap_or(1.0) * factors[axis]);
        set_config(&mut edits, holder, "wrench_scale", &numbers(&scaled));
    }
    (!done.is_empty()).then(|| edits.apply())
}

/// An attribute of an instance; an empty one is none.
fn attribute<'d>(holder: Node<'d, '_>, key: &str) -> Option<&'d str> {
    config(holder, key)
        .and_then(|node| node.attribute("value"))
        .map(str::trim)
        .filter(|value| !value.is_empty())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::path::Path;

    use super::*;

    fn model(configs: &str) -> String {
        format!(
            "<mujoco><extension><plugin plugin=\"hydro.wrench\"><instance name=\"w\">{configs}</instance>\
             </plugin></extension><worldbody><body name=\"hull\"><plugin plugin=\"hydro.wrench\" \
             instance=\"w\"/></body></worldbody></mujoco>"
        )
    }

    const LIST: &str = r#"{"schema":"hydro-effects/1","effects":[{"effect":"linear_drag","parameters":{"surge":2.0},"target":"hull"}]}"#;

    fn effects(text: &str) -> String {
        model(&format!("<config key=\"effects\" value='{text}'/>"))
    }

    fn scaled(text: &str, values: &[Value]) -> Result<String, String> {
        let model = Mjcf::parse(text, Path::new("m.xml")).unwrap();
        scale_values(&model, "hull", values, |_, _| {
            vec!["surge".to_owned(), "sway".to_owned()]
        })
    }

    #[test]
    fn a_value_is_scaled_in_the_list_or_its_file() {
        let half = |value| Value {
            entry: 0,
            value,
            factor: 0.5,
        };
        let expected = effects(&LIST.replace("2.0", "1.0"));
        assert_eq!(scaled(&effects(LIST), &[half(0)]).unwrap(), expected);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("effects.json");
        std::fs::write(&path, LIST).unwrap();
        let text = effects(path.to_str().unwrap());
        assert_eq!(scaled(&text, &[half(0)]).unwrap(), expected);
        let refusal = scaled(&effects(LIST), &[half(1)]).unwrap_err();
        assert!(refusal.contains("parameter 1"), "{refusal}");
        let refusal = scaled(&effects("none.json"), &[half(0)]).unwrap_err();
        assert!(refusal.contains("`effects`"), "{refusal}");
        assert!(scaled(&model(""), &[half(0)]).is_err());
    }

    #[test]
    fn factors_on_a_checkpoint_multiply() {
        let scale = |configs: &str| {
            let text = model(configs);
            let model = Mjcf::parse(&text, Path::new("m.xml")).unwrap();
            scale_wrench(&model, [2.0, 1.0, 1.0, 1.0, 1.0, 0.5])
        };
        let checkpoint = "<config key=\"checkpoint\" value=\"c\"/>";
        let factors = |text: &str| {
            model(&format!(
                "{checkpoint}<config key=\"wrench_scale\" value=\"{text}\"/>"
            ))
        };
        assert_eq!(scale(checkpoint).unwrap(), factors("2 1 1 1 1 0.5"));
        let own = format!("{checkpoint}<config key=\"wrench_scale\" value=\"1.5 1 1 1 1 3\"/>");
        assert_eq!(scale(&own).unwrap(), factors("3 1 1 1 1 1.5"));
        assert_eq!(scale("<config key=\"effects\" value=\"{}\"/>"), None);
    }
}
