//! Rows of the tables that nothing was trained for: predictions without learning, and what the paper prints.

use std::collections::BTreeMap;

use super::{
    detail::detail,
    mean_sd::MeanSd,
    table::{Metric, Row, halves, mean},
};
use crate::{
    dataset::Split,
    metrics::{ErrorSums, Yardstick},
};

/// Rows beside those of a data set: of its test split, then the paper's own.
pub fn yardsticks(data: &str, test: &Split) -> Vec<Row> {
    let unlearned = Yardstick::of_split(test).into_iter();
    unlearned
        .map(|yardstick| row(data, yardstick.label(), None, figures(yardstick, test)))
        .chain(printed(data))
        .collect()
}

/// The paper's tables: MAE and RMSE as printed. Some RMSE are below their MAE, which no definition of both allows. Task 2 prints
/// parameters too, and the time of inference.
pub(super) fn printed(data: &str) -> Vec<Row> {
    let of = |name: &str, parameters: Option<usize>, mae: f64, rmse: f64| {
        let figures = BTreeMap::from([("mae".to_owned(), mae), ("rmse".to_owned(), rmse)]);
        row(
            data,
            &format!("the paper prints: {name}"),
            parameters,
            figures,
        )
    };
    // Static, changing, noisy.
    let towing = [
        (
            "MLP-ODE, Euler",
            [(9.2e-3, 3.8e-3), (3.3e-3, 4.7e-3), (4.9, 6.4)],
        ),
        (
            "Attention-ODE, Euler",
            [(8.1e-3, 4.1e-3), (3.1e-3, 2.1e-3), (3.7, 5.0)],
        ),
        (
            "MLP-ODE, RK4",
            [(4.9e-4, 6.0e-4), (9.2e-4, 4.6e-4), (2.6, 4.7)],
        ),
        (
            "Attention-ODE, RK4",
            [(2.7e-4, 6.0e-4), (3.3e-4, 6.4e-5), (2.1, 4.2)],
        ),
    ];
    let at = match data {
        "1.1" => 0,
        "1.2" => 1,
        "1.3" => 2,
        _ => {
            return vec![
                of("MLP-ODE (17 ms)", Some(530_628), 29.4, 43.1),
                of("Attention-ODE (15 ms)", Some(554_934), 18.6, 40.2),
                of("CNODE (26 ms)", Some(636_626), 19.7, 38.0),
                of("LSTM (80 ms)", Some(828_422), 16.3, 43.9),
            ];
        }
    };
    towing
        .into_iter()
        .map(|(name, errors)| of(name, None, errors[at].0, errors[at].1))
        .collect()
}

fn row(data: &str, label: &str, parameters: Option<usize>, figures: BTreeMap<Metric, f64>) -> Row {
    let values = figures.into_iter();
    Row {
        data: data.to_owned(),
        label: label.to_owned(),
        parameters,
        values: values
            .filter_map(|(name, value)| Some((name, MeanSd::from_values(&[value])?)))
            .collect(),
        ..Row::default()
    }
}

/// Errors on a split, by the names of [`Row::values`].
fn figures(yardstick: Yardstick, test: &Split) -> BTreeMap<Metric, f64> {
    let mut sums = ErrorSums::new(test.outputs());
    let forces: Vec<Vec<f64>> = (0..test.len())
        .map(|trajectory| yardstick.predict(test, trajectory))
        .collect();
    for (trajectory, forces) in forces.iter().enumerate() {
        sums.add_trajectory(forces, test, trajectory);
    }
    let (errors, (mae, rmse)) = (sums.errors(), detail(test, &forces).pooled_si);
    let (force, torque) = halves(&errors);
    let all = [
        ("mae", Some(mae)),
        ("rmse", Some(rmse)),
        ("nrmse", Some(errors.pooled)),
        ("nrmse_hydrodynamic", Some(errors.pooled_hydrodynamic)),
        ("nmae", Some(errors.pooled_mae)),
        ("mae_force", mean(&errors.mae[force.clone()])),
        ("rmse_force", mean(&errors.rmse[force])),
        ("mae_torque", mean(&errors.mae[torque.clone()])),
        ("rmse_torque", mean(&errors.rmse[torque])),
    ];
    all.into_iter()
        .filter_map(|(name, value)| Some((name.to_owned(), value.filter(|v| v.is_finite())?)))
        .collect()
}

#[cfg(test)]
#[path = "tests/yardsticks.rs"]
mod tests;
