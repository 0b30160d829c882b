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
        ("kind", kind(card)),
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
    say!("\nForces: range and deviation of the training data, errors on the test split");
    say!("{}", forces(card));
    let pooled = |key: &str| card.metrics[key].as_f64();
    match (pooled("pooled"), pooled("pooled_hydrodynamic")) {
        (Some(error), Some(without)) => {
            let start = card.metrics["start"].as_str().unwrap_or("unknown");
            say!(
                "nRMSE over all axes {}, without buoyancy {}; first force: {start}",
                short(error),
                short(without)
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
    value.map_or("-".to_owned(), short)
}

/// Three digits or more, small numbers too.
fn short(value: f64) -> String {
    let size = value.abs();
    let decimals = match size {
        _ if size == 0.0 || size >= 0.1 => 3,
        _ => 2 + (-size.log10()).ceil().min(15.0) as usize,
    };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_forces_keep_their_digits() {
        let found = [133.9561, 0.25, 0.021, -0.00123, 4.5e-7, 0.0].map(short);
        let expected = [
            "133.956",
            "0.250",
            "0.0210",
            "-0.00123",
            "0.000000450",
            "0.000",
        ];
        assert_eq!(found, expected);
    }

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
