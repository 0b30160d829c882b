//! A list of effects with values: `effects.json`.
//!
//! ```json
//! {"schema": "hydro-effects/1",
//!  "effects": [{"effect": "net_buoyancy", "target": "hull", "parameters": {"force": 1.5}}]}
//! ```
//!
//! Names and units of the parameters are those of [`crate::Effect::parameters`]; only those marked optional may be left
//! out. Added mass and drags take a whole matrix in place of six names,
//! `{"matrix": [[6 numbers] x 6], "point": [x, y, z]}` ([`crate::MatrixPart`]). An effect of the user's own, `user.NAME`, brings its definition along, under the key `definition`: the file needs no
//! other.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::{
    Entry, Id, MatrixPart, OwnError, Parameter, Target, TargetKind,
    card::OWN_PREFIX,
    did_you_mean::hint,
    effect, is_matrix,
    json_shape::{in_words, object, shape},
    matrix_json,
    own::register_json,
    set_error::{SCHEMA, SetError},
};

/// Key of a definition in an element of the list.
const DEFINITION: &str = "definition";

/// The bodies, joints, actuators and sensors of a model.
pub trait Targets {
    /// The sizes of the target of a kind and name, if there is one.
    fn find(&self, kind: TargetKind, name: &str) -> Option<Target>;

    /// The names of a kind.
    fn names(&self, kind: TargetKind) -> Vec<String>;
}

/// Effects on the parts of one model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectSet {
    /// In the order of the file.
    pub entries: Vec<Entry>,
}

fn kind_name(kind: TargetKind) -> &'static str {
    match kind {
        TargetKind::Body => "body",
        TargetKind::Joint => "joint",
        TargetKind::Actuator => "actuator",
        TargetKind::Sensor => "sensor",
    }
}

fn with_unit(parameter: &Parameter) -> String {
    format!("{} [{}]", parameter.name, parameter.unit)
}

impl EffectSet {
    /// Reads and checks the text of an `effects.json` for a model.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(text: &str, targets: &dyn Targets) -> Result<Self, SetError> {
        let document: Value = serde_json::from_str(text).map_err(|error| SetError::Json {
            line: error.line(),
            column: error.column(),
            what: error.to_string(),
        })?;
        let [schema, list] = object("effects.json", &document, ["schema", "effects"], None)?;
        if schema.as_str() != Some(SCHEMA) {
            let found = schema
                .as_str()
                .map_or_else(|| in_words(schema), str::to_owned);
            return Err(SetError::Schema { found });
        }
        let list = list
            .as_array()
            .ok_or_else(|| shape("`effects`".to_owned(), list, "a list"))?;
        let entries = list
            .iter()
            .enumerate()
            .map(|(index, value)| entry(index, value, targets))
            .collect::<Result<Vec<_>, _>>()?;
        let set = Self { entries };
        set.check(targets)?;
        Ok(set)
    }

    /// Checks that targets exist, and that values are as many as parameters, finite and physically possible
    /// ([`Parameter::physical`]); bounds of fits are none of a file.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self, targets: &dyn Targets) -> Result<(), SetError> {
        let mut seen = BTreeSet::new();
        for (index, entry) in self.entries.iter().enumerate() {
            let (effect, target) = (entry.effect, entry.target.clone());
            let parameters = find_parameters(index, effect, &target, targets)?;
            let other = self.entries[..index]
                .iter()
                .find(|other| other.effect != effect && other.effect.as_str() == effect.as_str());
            if other.is_some() {
                return Err(SetError::DefinedTwice { index, effect });
            }
            if !seen.insert((effect, target.clone())) {
                return Err(SetError::Twice {
                    index,
                    effect,
                    target,
                });
            }
            if let Some(part) = matrix_part(entry) {
                matrix_json::check(index, entry, part)?;
                continue;
            }
            if parameters.len() != entry.parameters.len() {
                return Err(SetError::WrongCount {
                    index,
                    effect,
                    target,
                    found: entry.parameters.len(),
                    expected: parameters.len(),
                });
            }
            for (parameter, &value) in parameters.iter().zip(&entry.parameters) {
                if !value.is_finite() {
                    return Err(SetError::NotFinite {
                        index,
                        effect,
                        target,
                        parameter: parameter.name.clone(),
                        value,
                    });
                }
                if !parameter.physical.holds(value) {
                    return Err(SetError::OutOfBounds {
                        index,
                        effect,
                        target,
                        parameter: parameter.name.clone(),
                        value,
                        unit: parameter.unit,
                        expected: parameter.physical,
                    });
                }
            }
        }
        Ok(())
    }

    /// The text of an `effects.json`, on one line an effect, that [`EffectSet::parse`] reads back to the same
    /// values (`serde_json` reads a number to within one unit in the last place).
    ///
    /// # Errors
    /// As [`EffectSet::check`].
    pub fn to_json(&self, targets: &dyn Targets) -> Result<String, SetError> {
        self.check(targets)?;
        let mut lines = Vec::with_capacity(self.entries.len());
        for (index, entry) in self.entries.iter().enumerate() {
            let values = if matrix_part(entry).is_some() {
                matrix_json::write(&entry.parameters)
            } else {
                find_parameters(index, entry.effect, &entry.target, targets)?
                    .into_iter()
                    .zip(&entry.parameters)
                    .filter(|(parameter, value)| !parameter.optional || **value != parameter.null)
                    .map(|(parameter, &value)| (parameter.name, json!(value)))
                    .collect()
            };
            let mut element = json!({
                "effect": entry.effect.as_str(),
                "target": entry.target,
                "parameters": values,
            });
            let definition = effect(entry.effect).definition();
            if let Some(definition) = definition.and_then(|text| serde_json::from_str(text).ok()) {
                element[DEFINITION] = definition;
            }
            lines.push(element.to_string());
        }
        let list = if lines.is_empty() {
            "[]".to_owned()
        } else {
            format!("[\n  {}\n]", lines.join(",\n  "))
        };
        Ok(format!(
            "{{\"schema\": \"{SCHEMA}\", \"effects\": {list}}}\n"
        ))
    }
}

/// The part that an entry's values are a whole matrix of, if they are one.
fn matrix_part(entry: &Entry) -> Option<&'static dyn MatrixPart> {
    let whole = effect(entry.effect).matrix_part();
    whole.filter(|_| is_matrix(&entry.parameters))
}

/// The parameters of an effect on a target of the model.
fn find_parameters(
    index: usize,
    id: Id,
    target: &str,
    targets: &dyn Targets,
) -> Result<Vec<Parameter>, SetError> {
    let kind = effect(id).card().target;
    let found = targets.find(kind, target).ok_or_else(|| {
        let known = targets.names(kind);
        SetError::UnknownTarget {
            index,
            effect: id,
            kind: kind_name(kind),
            found: target.to_owned(),
            hint: hint(target, known.iter().map(String::as_str)),
            known,
        }
    })?;
    if matches!(id, Id::Own(_)) && !effect(id).applies_to(&found) {
        return Err(SetError::WrongTarget {
            index,
            effect: id,
            target: target.to_owned(),
            why: match found {
                Target::Joint(joint) if joint.slides => "it acts on a hinge, and this is a slide",
                _ => "it acts on a slide, and this is a hinge",
            }
            .to_owned(),
        });
    }
    Ok(effect(id).parameters(&found))
}

/// The effect of an element of the list: built in, or the user's own as it is defined there.
fn find_effect(name: &str, element: &Value) -> Result<Option<Id>, OwnError> {
    match element.get(DEFINITION) {
        Some(definition) => register_json(name, definition).map(Some),
        None if name.starts_with(OWN_PREFIX) => Err(OwnError::Format {
            what: format!("an effect of the user's own needs its `{DEFINITION}`"),
        }),
        None => Ok(Id::ALL.iter().copied().find(|id| id.as_str() == name)),
    }
}

/// The effect that an element of the list of an `effects.json` names; `None` where it names none that can be.
pub fn listed_id(element: &Value) -> Option<Id> {
    let name = element.get("effect")?.as_str()?;
    find_effect(name, element).ok()?
}

/// One element of the list. Values are checked afterwards.
fn entry(index: usize, value: &Value, targets: &dyn Targets) -> Result<Entry, SetError> {
    let place = format!("effects[{index}]");
    let keys = ["effect", "target", "parameters"];
    let [name, target, values] = object(&place, value, keys, Some(DEFINITION))?;
    let name = name
        .as_str()
        .ok_or_else(|| shape(format!("{place}.effect"), name, "a name"))?;
    let id = find_effect(name, value)
        .map_err(|fault| SetError::Definition {
            index,
            effect: name.to_owned(),
            fault: Box::new(fault),
        })?
        .ok_or_else(|| SetError::UnknownEffect {
            index,
            found: name.to_owned(),
            hint: hint(name, Id::ALL.iter().map(|id| id.as_str())),
            known: Id::ALL.iter().map(|id| id.as_str().to_owned()).collect(),
        })?;
    let target = target
        .as_str()
        .ok_or_else(|| shape(format!("{place}.target"), target, "a name"))?;
    let parameters = find_parameters(index, id, target, targets)?;
    let values = values.as_object().ok_or_else(|| {
        shape(
            format!("{place}.parameters"),
            values,
            "an object of numbers",
        )
    })?;

    let takes_matrix = effect(id).matrix_part().is_some();
    if takes_matrix && values.contains_key(matrix_json::MATRIX) {
        return Ok(Entry {
            effect: id,
            target: target.to_owned(),
            parameters: matrix_json::read(&format!("{place}.parameters"), values)?,
        });
    }

    let whole = takes_matrix.then(|| matrix_json::IN_WORDS.to_owned());
    let known = || {
        let names = parameters.iter().map(with_unit);
        names.chain(whole.clone()).collect::<Vec<_>>()
    };
    let names = || parameters.iter().map(|parameter| parameter.name.as_str());
    if let Some(found) = values.keys().find(|&key| !names().any(|name| name == key)) {
        return Err(SetError::UnknownParameter {
            index,
            effect: id,
            target: target.to_owned(),
            found: found.clone(),
            hint: hint(found, names()),
            known: known(),
        });
    }
    let missing: Vec<String> = parameters
        .iter()
        .filter(|parameter| !parameter.optional && parameter.left_out.is_none())
        .filter(|parameter| !values.contains_key(&parameter.name))
        .map(|parameter| parameter.name.clone())
        .collect();
    if !missing.is_empty() {
        return Err(SetError::MissingParameters {
            index,
            effect: id,
            target: target.to_owned(),
            missing,
            known: known(),
        });
    }
    let parameters = parameters
        .iter()
        .map(|parameter| {
            let Some(value) = values.get(&parameter.name) else {
                return Ok(parameter.left_out.unwrap_or(parameter.null));
            };
            value.as_f64().ok_or_else(|| {
                shape(
                    format!("{place}.parameters.{}", parameter.name),
                    value,
                    &format!("a number [{}]", parameter.unit),
                )
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Entry {
        effect: id,
        target: target.to_owned(),
        parameters,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture::Model;

    fn parse(text: &str) -> Result<EffectSet, String> {
        EffectSet::parse(text, &Model).map_err(|error| error.to_string())
    }

    fn with(effect: &str) -> Result<EffectSet, String> {
        parse(&format!(
            r#"{{"schema": "hydro-effects/1", "effects": [{effect}]}}"#
        ))
    }

    fn fault(effect: &str) -> String {
        with(effect).expect_err("it should be refused")
    }

    #[test]
    fn every_effect_goes_out_and_comes_back() {
        let entries = Id::ALL
            .iter()
            .map(|&id| {
                let kind = effect(id).card().target;
                let target = Model.names(kind)[0].clone();
                let parameters = effect(id)
                    .parameters(&Model.find(kind, &target).expect("it is there"))
                    .iter()
                    .map(|parameter| {
                        let value = parameter.null + 0.123_456_789 * parameter.prior_sd;
                        value.clamp(parameter.lower, parameter.upper)
                    })
                    .collect();
                Entry {
                    effect: id,
                    target,
                    parameters,
                }
            })
            .collect();
        let set = EffectSet { entries };
        let text = set.to_json(&Model).expect("it can be written");
        let back = parse(&text).expect("it can be read");
        assert_eq!(back.entries.len(), set.entries.len());
        for (back, entry) in back.entries.iter().zip(&set.entries) {
            assert_eq!((back.effect, &back.target), (entry.effect, &entry.target));
            for (back, value) in back.parameters.iter().zip(&entry.parameters) {
                assert!((back - value).abs() <= f64::EPSILON * value.abs());
            }
        }
        assert_eq!(
            parse(
                &EffectSet::default()
                    .to_json(&Model)
                    .expect("nothing is fine")
            ),
            Ok(EffectSet::default())
        );
    }

    #[test]
    fn what_is_no_effects_json_is_refused() {
        assert!(parse("{").expect_err("no JSON").contains("line 1"));
        assert!(
            parse("[]")
                .expect_err("a list")
                .contains("expected an object")
        );
        assert_eq!(
            parse(r#"{"schema": "hydro-effects/7", "effects": []}"#),
            Err("the schema is `hydro-effects/7`, expected `hydro-effects/1`".to_owned())
        );
        assert!(
            parse(r#"{"schema": "hydro-effects/1"}"#)
                .expect_err("no list")
                .contains("no `effects`")
        );
        assert!(
            parse(r#"{"schema": "hydro-effects/1", "effects": [], "more": 1}"#)
                .expect_err("one key too many")
                .contains("the key `more`")
        );
        assert!(
            parse(r#"{"schema": "hydro-effects/1", "effects": {}}"#)
                .expect_err("no list")
                .contains("found an object, expected a list")
        );
    }

    #[test]
    fn an_unknown_effect_lists_the_known_and_offers_the_nearest() {
        let text = fault(r#"{"effect": "linear-drag", "target": "hull", "parameters": {}}"#);
        assert!(text.contains("effects[0]") && text.contains("did you mean `linear_drag`?"));
        assert!(text.contains("wake_memory") && text.contains("constant_force"));
    }

    #[test]
    fn an_unknown_target_lists_the_models() {
        let text = fault(r#"{"effect": "lift", "target": "hul", "parameters": {}}"#);
        assert!(text.contains("no body `hul`; did you mean `hull`?; it has: hull"));
        let text = fault(r#"{"effect": "sensor_bias", "target": "hull", "parameters": {}}"#);
        assert!(text.contains("no sensor `hull`"), "{text}");
    }

    #[test]
    fn parameters_are_checked_by_name_and_value() {
        let buoyancy = |parameters: &str| {
            fault(&format!(
                r#"{{"effect": "net_buoyancy", "target": "hull", "parameters": {parameters}}}"#
            ))
        };
        assert!(
            buoyancy(r#"{"forse": 1}"#).contains("no parameter `forse`; did you mean `force`?")
        );
        assert!(buoyancy("{}").contains("missing force; it has: force [N], moment_x [N m]"));
        assert!(buoyancy(r#"{"force": "1"}"#).contains("the string `1`, expected a number [N]"));
        let heavy = buoyancy(r#"{"force": 1e19}"#);
        assert!(heavy.contains("force is 10000000000000000000 [N], expected -1e18 to 1e18"));
        assert!(buoyancy(r#"{"force": 1e999}"#).contains("not JSON"));
        assert!(buoyancy("3").contains("found the number 3, expected an object of numbers"));
    }

    #[test]
    fn what_is_optional_may_be_left_out_and_is_written_where_it_says_something() {
        let force = r#"{"effect": "constant_force", "target": "hull", "parameters": {"x": 1, "y": 2, "z": 3}}"#;
        let set = with(force).expect("a force alone");
        assert_eq!(set.entries[0].parameters, [1.0, 2.0, 3.0, 0.0, 0.0, 0.0]);
        assert!(!set.to_json(&Model).expect("text").contains("torque"));
        let wrench = force.replace("\"z\": 3", "\"z\": 3, \"torque_y\": -0.5");
        let set = with(&wrench).expect("with a torque");
        assert_eq!(set.entries[0].parameters, [1.0, 2.0, 3.0, 0.0, -0.5, 0.0]);
        assert!(
            set.to_json(&Model)
                .expect("text")
                .contains("\"torque_y\":-0.5")
        );
        assert!(fault(&force.replace("\"y\": 2, ", "")).contains("missing y"));
    }

    #[test]
    fn what_no_file_can_hold_is_not_written() {
        let entry = |parameters: Vec<f64>| Entry {
            effect: Id::NetBuoyancy,
            target: "hull".to_owned(),
            parameters,
        };
        let fault = |entries: Vec<Entry>| {
            EffectSet { entries }
                .to_json(&Model)
                .expect_err("it should be refused")
                .to_string()
        };
        assert!(
            fault(vec![entry(vec![f64::NAN, 0.0, 0.0, 0.0])])
                .contains("force is NaN, expected a finite")
        );
        assert!(fault(vec![entry(vec![1.0, 2.0])]).contains("2 values for 4 parameters"));
        assert!(
            fault(vec![
                entry(vec![1.0, 0.0, 0.0, 0.0]),
                entry(vec![2.0, 0.0, 0.0, 0.0])
            ])
            .contains("twice")
        );
    }
}
