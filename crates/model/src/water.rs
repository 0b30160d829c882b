//! The water that training data were made in, as a card has it.
//!
//! `water` is what the data set's manifest says: a name (`strip`) and its settings, or nothing where it was MuJoCo's own fluid
//! or that of a recorded model. `added_mass` lists, body by body, the added mass that the force leaves out because it belongs
//! into the inertia of the model that the force drives: a force in proportion to an acceleration, given a sample late, is
//! unstable wherever the added mass exceeds the mass.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Elements of a 6 x 6 matrix.
const ELEMENTS: usize = 36;

/// Added mass of one body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyAddedMass {
    /// Name of the body in the model.
    pub body: String,
    /// Added mass over the density of the water [m^3, m^4, m^5], 6 x 6 by rows: surge, sway, heave, roll, pitch, yaw, about
    /// the body's origin in its frame.
    pub matrix: Vec<f64>,
}

/// Reason why a list of added masses is none, if there is one.
pub fn added_mass_fault(bodies: &[BodyAddedMass]) -> Option<String> {
    bodies.iter().enumerate().find_map(|(at, entry)| {
        let found = entry.matrix.len();
        if found != ELEMENTS {
            return Some(format!(
                "added_mass of `{}` has {found} numbers, expected {ELEMENTS}, six rows of six",
                entry.body
            ));
        }
        if let Some(index) = entry.matrix.iter().position(|value| !value.is_finite()) {
            return Some(format!(
                "added_mass of `{}`: element {index} is {}",
                entry.body, entry.matrix[index]
            ));
        }
        let twice = bodies[..at].iter().any(|other| other.body == entry.body);
        twice.then(|| format!("added_mass names the body `{}` twice", entry.body))
    })
}

/// A water in words.
pub fn water_in_words(water: Option<&Value>) -> String {
    let Some(water) = water else {
        return "no `water` is named (MuJoCo's own fluid, or that of a recorded model)".to_owned();
    };
    let name = water["name"].as_str().unwrap_or("without a name");
    let settings = water.as_object().into_iter().flatten();
    let settings: Vec<String> = settings
        .filter(|(key, value)| *key != "name" && !value.is_null())
        .map(|(key, value)| match value.as_str() {
            Some(text) => format!("{key} {text}"),
            None => format!("{key} {value}"),
        })
        .collect();
    match settings.is_empty() {
        true => name.to_owned(),
        false => format!("{name} ({})", settings.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_list_that_is_none_is_named() {
        let good = BodyAddedMass {
            body: "hull".to_owned(),
            matrix: vec![0.0; ELEMENTS],
        };
        assert_eq!(added_mass_fault(std::slice::from_ref(&good)), None);
        let twice = [good.clone(), good.clone()];
        assert!(added_mass_fault(&twice).is_some_and(|fault| fault.contains("`hull` twice")));
        let mut short = good.clone();
        short.matrix.pop();
        assert!(added_mass_fault(&[short]).is_some_and(|fault| fault.contains("35 numbers")));
        let mut infinite = good;
        infinite.matrix[7] = f64::INFINITY;
        assert!(
            added_mass_fault(&[infinite]).is_some_and(|fault| fault.contains("element 7 is inf"))
        );
    }

    #[test]
    fn a_water_is_told_by_its_name_and_settings() {
        let strip = json!({"name": "strip", "waterline": null, "wake_share": 0.35, "added_mass": "inertia"});
        assert_eq!(
            water_in_words(Some(&strip)),
            "strip (added_mass inertia, wake_share 0.35)"
        );
        assert!(water_in_words(None).contains("no `water`"));
    }
}
