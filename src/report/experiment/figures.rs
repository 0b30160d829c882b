//! The pictures.

use hydro_training::experiment::{ExperimentResults, Row, Truth};

use crate::report::plot::{Axes, Panel, Series, panels};

/// Rows that stand in pictures of many: few, so that lines can be told apart; the first is drawn thick.
const SHOWN: [&str; 8] = [
    "relaxation-ode",
    "relaxation-ode-modes",
    "mlp-ode-rk4",
    "attention-ode-rk4",
    "cnode-natural-rk4",
    "cnode-hermite-rk4",
    "lstm",
    "mlp",
];

/// Name of the file and its SVG text, of every picture.
pub fn figures(results: &ExperimentResults) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for data in results.experiment.data() {
        let rows: Vec<&Row> = results
            .rows
            .iter()
            .filter(|row| row.data == *data && !row.seeds.is_empty())
            .collect();
        if rows.is_empty() {
            continue;
        }
        for row in &rows {
            let name = format!("wrench-{data}-{}.svg", row.entry);
            found.push((name, wrench(results, row)));
        }
        found.push((format!("horizon-{data}.svg"), horizon(&rows)));
        found.push((format!("noise-{data}.svg"), noise(&rows)));
        for row in rows.iter().filter(|row| row.attention.is_some()) {
            let name = format!("attention-{data}-{}.svg", row.entry);
            found.push((name, attention(row)));
        }
    }
    found
}

/// Truth and prediction, axis by axis.
fn wrench(results: &ExperimentResults, row: &Row) -> String {
    let none = Truth::default();
    let Truth { time, force } = results.truth.get(&row.data).unwrap_or(&none);
    let line = |name: &str, values: &[Vec<f32>], axis: usize| Series {
        name: name.to_owned(),
        points: time
            .iter()
            .zip(values)
            .map(|(t, row)| (f64::from(*t), f64::from(row[axis])))
            .collect(),
    };
    let titles: Vec<String> = results
        .outputs
        .iter()
        .map(|name| {
            let unit = if name.starts_with("torque") {
                "N m"
            } else {
                "N"
            };
            format!("{name} [{unit}]")
        })
        .collect();
    let all: Vec<Panel<'_>> = titles
        .iter()
        .enumerate()
        .map(|(axis, title)| Panel {
            axes: Axes {
                title,
                x: "time [s]",
                y: "",
                size: (380, 230),
                equal: false,
            },
            series: vec![
                line("truth", force, axis),
                line(&row.label, &row.example, axis),
            ],
        })
        .collect();
    panels(&all, 3)
}

fn shown<'a>(rows: &[&'a Row]) -> Vec<&'a Row> {
    SHOWN
        .iter()
        .filter_map(|id| rows.iter().find(|row| row.entry == *id).copied())
        .collect()
}

fn horizon(rows: &[&Row]) -> String {
    curves(
        rows,
        ("error against time since the start", "time [s]"),
        |row| row.by_horizon.clone(),
    )
}

fn noise(rows: &[&Row]) -> String {
    let axes = (
        "error against noise on the features",
        "noise [standard deviations of each feature]",
    );
    curves(rows, axes, |row| {
        row.noise
            .iter()
            .map(|noisy| (noisy.level, noisy.nrmse))
            .collect()
    })
}

fn curves(
    rows: &[&Row],
    (title, x): (&str, &str),
    points: impl Fn(&Row) -> Vec<(f64, f64)>,
) -> String {
    let series = shown(rows)
        .into_iter()
        .map(|row| Series {
            name: row.label.clone(),
            points: points(row),
        })
        .collect();
    let axes = Axes {
        title,
        x,
        y: "nRMSE",
        size: (760, 420),
        equal: false,
    };
    panels(&[Panel { axes, series }], 1)
}

/// Weight by lag, a line a head.
fn attention(row: &Row) -> String {
    let series = row
        .attention
        .iter()
        .flatten()
        .enumerate()
        .map(|(head, weights)| Series {
            name: format!("head {}", head + 1),
            points: weights
                .iter()
                .enumerate()
                .map(|(lag, weight)| (-(lag as f64), *weight))
                .collect(),
        })
        .collect();
    let axes = Axes {
        title: &format!("{}: mean attention over the window", row.label),
        x: "sample, 0 the newest",
        y: "weight",
        size: (640, 360),
        equal: false,
    };
    panels(&[Panel { axes, series }], 1)
}
