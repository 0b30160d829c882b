//! `hydro gap effects`: the catalogue, and the user's own effects.

use std::path::PathBuf;

use hydro_effects::{
    Card, Effect, Id, Parameter, Placement, Target, TargetKind,
    card::{ActuatorScale, BodyScale, JointScale, SensorScale},
    effect,
};
use serde::Serialize;

use super::own_effects;
use crate::cli::print_json;

/// Schema of the list.
const SCHEMA: &str = "hydro-gap-effects/1";

/// Flags of `hydro gap effects`.
#[derive(Debug, clap::Args)]
pub(super) struct Flags {
    /// Folder of effects of your own, NAME.toml each: they are checked and listed after the catalogue.
    #[arg(long)]
    effects: Option<PathBuf>,
    /// Print one JSON value.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Catalogue {
    schema: &'static str,
    /// Null, prior and bounds are those of this example; names and units hold for every target of the kind.
    example: &'static str,
    effects: Vec<Entry>,
}

#[derive(Serialize)]
struct Entry {
    id: Id,
    target: TargetKind,
    phrase: &'static str,
    summary: &'static str,
    equation: &'static str,
    source: &'static str,
    /// True where the true form differs a little from the equation.
    idealised: bool,
    placement: Placement,
    /// True where `hydro gap` tries it; false for a part of a design, which a file gives.
    is_hypothesis: bool,
    parameters: Vec<ParameterEntry>,
}

#[derive(Serialize)]
struct ParameterEntry {
    name: String,
    unit: &'static str,
    null: f64,
    prior_sd: f64,
    /// Least value; null where there is no bound.
    lower: Option<f64>,
    /// Greatest value; null where there is no bound.
    upper: Option<f64>,
    /// True where it may be left out; it is then at its null.
    optional: bool,
    /// The value where a file leaves it out; null where a file gives it.
    left_out: Option<f64>,
}

impl From<Parameter> for ParameterEntry {
    fn from(parameter: Parameter) -> Self {
        let bound = |value: f64| value.is_finite().then_some(value);
        Self {
            name: parameter.name,
            unit: parameter.unit,
            null: parameter.null,
            prior_sd: parameter.prior_sd,
            lower: bound(parameter.lower),
            upper: bound(parameter.upper),
            optional: parameter.optional,
            left_out: parameter.left_out,
        }
    }
}

/// The example in words.
const EXAMPLE: &str = "a vehicle of 20 kg, 0.8 x 0.4 x 0.3 m, at 0.5 m/s in fresh water; a hinge of 0.1 kg m^2 \
    with 5 N m; an actuator up to 1; a sensor of three numbers";

/// A target of a kind with ordinary sizes.
fn example(kind: TargetKind) -> Target {
    match kind {
        TargetKind::Body => Target::Body(BodyScale {
            mass: 20.0,
            inertia: [0.4, 1.2, 1.3],
            extent: [0.8, 0.4, 0.3],
            volume: 0.02,
            hull_volume: 0.02,
            buoyancy_left_out: 0.0,
            density: 1000.0,
            gravity: 9.81,
            speed: 0.5,
            rate: 0.5,
        }),
        TargetKind::Joint => Target::Joint(JointScale {
            inertia: 0.1,
            armature: 0.0,
            damping: 0.0,
            torque: 5.0,
            speed: 1.0,
            travel: 0.5,
            middle: 0.0,
            slides: false,
            driven: true,
        }),
        TargetKind::Actuator => Target::Actuator(ActuatorScale {
            command: 1.0,
            inflow: 0.5,
            step: 0.002,
            thrusts: true,
        }),
        TargetKind::Sensor => Target::Sensor(SensorScale {
            dimension: 3,
            noise: 0.01,
            signal: 0.5,
            unit: "1",
            period: 0.02,
            attitude: false,
        }),
    }
}

/// A target with ordinary sizes that an effect can have.
pub(super) fn example_of(effect: &dyn Effect) -> Target {
    match example(effect.card().target) {
        Target::Joint(joint) if !effect.applies_to(&Target::Joint(joint.clone())) => {
            Target::Joint(JointScale {
                slides: true,
                driven: true,
                ..joint
            })
        }
        target => target,
    }
}

fn entry(id: Id) -> Entry {
    let effect = effect(id);
    let Card {
        id,
        target,
        summary,
        equation,
        source,
        idealised,
        placement,
        phrase,
    } = *effect.card();
    Entry {
        id,
        target,
        phrase,
        summary,
        equation,
        source,
        idealised,
        placement,
        is_hypothesis: effect.is_hypothesis(),
        parameters: effect
            .parameters(&example_of(effect))
            .into_iter()
            .map(ParameterEntry::from)
            .collect(),
    }
}

fn catalogue(own: &[Id]) -> Catalogue {
    Catalogue {
        schema: SCHEMA,
        example: EXAMPLE,
        effects: Id::ALL.iter().chain(own).map(|id| entry(*id)).collect(),
    }
}

/// Runs the command.
pub(super) fn run(flags: &Flags) -> anyhow::Result<()> {
    let own = match &flags.effects {
        Some(folder) => own_effects::load(folder)?,
        None => Vec::new(),
    };
    let catalogue = catalogue(&own);
    if flags.json {
        return print_json(&catalogue);
    }
    for entry in &catalogue.effects {
        let target = serde_json::to_value(entry.target)?;
        let placement = serde_json::to_value(entry.placement)?;
        say!(
            "{} (on a {}; written to: {})\n    {}\n    {}\n    source: {}",
            entry.id,
            target.as_str().unwrap_or_default(),
            placement.as_str().unwrap_or_default(),
            entry.summary,
            entry.equation,
            entry.source
        );
        let parameters: Vec<String> = entry
            .parameters
            .iter()
            .map(|parameter| {
                let unit = match parameter.unit {
                    "1" => String::new(),
                    unit => format!(" [{unit}]"),
                };
                let optional = if parameter.optional {
                    " (optional)"
                } else {
                    ""
                };
                format!("{}{unit}{optional}", parameter.name)
            })
            .collect();
        say!("    parameters: {}\n", parameters.join(", "));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn the_catalogue_is_whole() {
        let list = serde_json::to_value(catalogue(&[])).unwrap();
        let effects = list["effects"].as_array().unwrap();
        assert_eq!(effects.len(), Id::ALL.len());
        for effect in effects {
            for key in [
                "id",
                "target",
                "phrase",
                "summary",
                "equation",
                "source",
                "placement",
            ] {
                assert!(!effect[key].as_str().unwrap().is_empty(), "{effect}");
            }
            let parameters = effect["parameters"].as_array().unwrap();
            assert!(!parameters.is_empty(), "{effect}");
            for parameter in parameters {
                for key in ["name", "unit"] {
                    assert!(!parameter[key].as_str().unwrap().is_empty(), "{effect}");
                }
                for key in ["null", "prior_sd"] {
                    assert!(parameter[key].is_f64(), "{effect}");
                }
            }
        }
    }
}
