//! Description of a checkpoint: sizes, provenance, and ranges and errors axis by axis.

use hydro_model::{
    Outputs,
    checkpoint::{Card, Checkpoint},
    water::water_in_words,
};
use hydro_plugin::report::gap::number;
use serde_json::Value;

use crate::cli::table::{facts, table};

pub(super) fn show(checkpoint: &Checkpoint) -> anyhow::Result<()> {
    let card = &checkpoint.card;
    let dataset = card.dataset.as_ref();
    let trained_on = dataset.map_or("nothing".to_owned(), |data| {
        format!(
            "{}, {} trajectories, manifest sha256 {}",
            data.name, data.trajectories, data.sha256
        )
    });
    facts(&[
        ("checkpoint", card.name.clone()),
        ("kind", kind(card)),
        (
            "configuration",
            brief(&serde_json::to_value(&card.model)?["config"]),
        ),
        ("parameters", checkpoint.parameter_count().to_string()),
        ("solver", card.solver.to_string()),
        ("sample period", format!("{} s", card.sample_period)),
        ("trained on", trained_on),
        ("water", water_in_words(card.water.as_ref())),
        ("outputs", Outputs::of(&card.outputs).to_string()),
        ("added mass", added_mass(card)),
        ("weights sha256", card.weights_sha256.clone()),
        ("command", card.command.clone()),
    ])?;
    say!("\nFeatures, and the range of the training data");
    if card.envelope.is_none() {
        say!("(not known: the plugin holds the network to nothing)");
    }
    say!("{}", features(card));
    say!("\nForces: range and deviation of the training data, errors on the test split");
    say!("{}", forces(card));
    let pooled = |key: &str| card.metrics[key].as_f64();
    match (pooled("pooled"), pooled("pooled_hydrodynamic")) {
        (Some(error), Some(without)) => {
            let start = card.metrics["start"].as_str().unwrap_or("unknown");
            say!(
                "nRMSE over all axes {}, without buoyancy {}; first force: {start}",
                number(error),
                number(without)
            );
        }
        // A residual is judged otherwise.
        _ => say!("metrics: {}", card.metrics),
    }
    Ok(())
}

fn kind(card: &Card) -> String {
    let kind = card.model.kind();
    match card.residual {
        true => format!("{kind}, of what another model of the water lacks"),
        false => kind.to_owned(),
    }
}

/// Where the added mass is, as far as the card says.
fn added_mass(card: &Card) -> String {
    match card.added_mass.len() {
        0 => "in the force, if anywhere".to_owned(),
        bodies => format!("of {bodies} bodies in the model's inertia, not in the force"),
    }
}

/// A configuration on one line; a list of objects as its length.
fn brief(value: &Value) -> String {
    match value {
        Value::Object(fields) => {
            let fields = fields.iter().map(|(name, value)| {
                let value = brief(value);
                format!("{name} {value}")
            });
            fields.collect::<Vec<_>>().join(", ")
        }
        Value::Array(items) if items.iter().any(Value::is_object) => items.len().to_string(),
        Value::Array(items) => items.iter().map(brief).collect::<Vec<_>>().join("-"),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn features(card: &Card) -> String {
    let rows = card.features.features().iter().enumerate();
    let rows = rows.map(|(at, feature)| {
        let range = card.envelope.as_ref();
        vec![
            feature.to_string(),
            card.feature_units[at].clone(),
            shown(range.map(|range| range.least[at])),
            shown(range.map(|range| range.most[at])),
        ]
    });
    let rows: Vec<_> = rows.collect();
    table(&["", "unit", "least", "most"], &rows).to_string()
}

fn forces(card: &Card) -> String {
    let error = |kind: &str, at: usize| card.metrics[kind][at].as_f64();
    let rows = card.outputs.iter().enumerate().map(|(at, output)| {
        let range = card.envelope.as_ref();
        vec![
            output.clone(),
            card.output_units[at].clone(),
            shown(range.map(|range| range.least_force[at])),
            shown(range.map(|range| range.most_force[at])),
            shown(Some(card.normaliser.output_std[at])),
            shown(error("mae", at)),
            shown(error("rmse", at)),
            shown(error("nrmse", at)),
            shown(error("nrmse_hydrodynamic", at)),
        ]
    });
    let head = [
        "",
        "unit",
        "least",
        "most",
        "deviation",
        "MAE",
        "RMSE",
        "nRMSE",
        "no buoyancy",
    ];
    table(&head, &rows.collect::<Vec<_>>()).to_string()
}

fn shown(value: Option<f64>) -> String {
    number(value.unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_is_a_line_and_a_list_of_links_its_number() {
        let links = serde_json::json!({"links": {"links": [{"name": "trunk"}, {"name": "calf"}]}});
        let config = serde_json::json!({"encoding": links, "hidden": [256, 128], "skip": true});
        assert_eq!(
            brief(&config),
            "encoding links links 2, hidden 256-128, skip true"
        );
    }
}
