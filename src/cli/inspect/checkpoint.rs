//! What a checkpoint is: sizes, where it comes from, and what it was trained on, axis by axis.

use hydro_plugin::checkpoint::{Card, Checkpoint};
use serde_json::Value;

use super::{super::table::table, facts};

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
        ("kind", card.model.kind().to_owned()),
        (
            "configuration",
            brief(&serde_json::to_value(&card.model)?["config"]),
        ),
        ("parameters", checkpoint.parameter_count().to_string()),
        ("solver", card.solver.to_string()),
        ("sample period", format!("{} s", card.sample_period)),
        ("trained on", trained_on),
        ("weights sha256", card.weights_sha256.clone()),
        ("command", card.command.clone()),
    ])?;
    say!("\nFeatures, and the range of the training data");
    if card.envelope.is_none() {
        say!("(not known: the plugin holds the network to nothing)");
    }
    say!("{}", features(card));
    say!("\nForces, and the errors on the test split");
    say!("{}", forces(card));
    let pooled = |key: &str| card.metrics[key].as_f64();
    if let (Some(error), Some(without)) = (pooled("pooled"), pooled("pooled_hydrodynamic")) {
        say!("nRMSE over all axes {error:.3}, without buoyancy {without:.3}");
    }
    Ok(())
}

/// A configuration on one line; of a list of objects, how many they are.
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
            number(range.map(|range| range.least[at])),
            number(range.map(|range| range.most[at])),
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
            number(range.map(|range| range.least_force[at])),
            number(range.map(|range| range.most_force[at])),
            number(Some(card.normaliser.output_std[at])),
            number(error("mae", at)),
            number(error("rmse", at)),
            number(error("nrmse", at)),
            number(error("nrmse_hydrodynamic", at)),
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

fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.3}"))
}
