//! Checks of units: quaternions that are no rotations, degrees instead of radians.

use std::{f64::consts::TAU, path::Path};

use super::{
    RemarkKind, SensorQuantity, SensorSignature, Signature, TrialError,
    series::{Series, median},
    tables::Table,
};

/// Largest departure of the median length of quaternions from 1; noise of a measurement stays well below.
const QUATERNION_TOLERANCE: f64 = 0.05;
/// Largest angle accepted as radians: two turns.
const LARGEST_ANGLE: f64 = 2.0 * TAU;
/// A column that ends farther from zero than it began, by this share of its way, revolves and does not swing.
const ONE_WAY: f64 = 0.9;

/// Rows from which it shows whether one reading is another's rate.
const LEAST_ROWS: usize = 20;
/// Correlation of an angle's change with its rate at least, and how far their ratio may be from 1.
const CORRELATION: f64 = 0.9;
const RATIO: f64 = 1.25;

/// Refuses sensors in other units than the model's, where that shows.
pub(super) fn check(
    path: &Path,
    signature: &Signature,
    sensors: &Table,
    remarks: &mut Vec<RemarkKind>,
) -> Result<(), TrialError> {
    for sensor in &signature.sensors {
        let columns = sensor.columns();
        let columns: Vec<usize> = columns
            .iter()
            .filter_map(|name| sensors.series.column(name))
            .collect();
        match sensor.kind {
            SensorQuantity::Quaternion => check_quaternion(path, sensor, sensors)?,
            SensorQuantity::Angle => {
                for column in columns {
                    check_angle(path, signature, (sensors, column), remarks)?;
                }
            }
            SensorQuantity::Other => {}
        }
    }
    Ok(())
}

fn check_quaternion(
    path: &Path,
    sensor: &SensorSignature,
    sensors: &Table,
) -> Result<(), TrialError> {
    let is_recorded = |column: &usize| !sensors.series.column_values(*column).all(f64::is_nan);
    let (columns, missing): (Vec<_>, Vec<_>) = (sensor.columns().into_iter())
        .map(|name| (sensors.series.column(&name).filter(is_recorded), name))
        .partition(|(column, _)| column.is_some());
    if columns.is_empty() {
        return Ok(());
    }
    if !missing.is_empty() {
        let names: Vec<String> = missing.into_iter().map(|(_, name)| name).collect();
        return Err(TrialError::PartialQuaternion {
            path: path.to_owned(),
            sensor: sensor.name.clone(),
            missing: names.join(", "),
        });
    }
    let columns: Vec<usize> = columns
        .into_iter()
        .filter_map(|(column, _)| column)
        .collect();
    let length = |row: &[f64]| {
        columns
            .iter()
            .map(|column| row[*column].powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let rows = 0..sensors.series.len();
    let lengths = rows.map(|row| length(sensors.series.row(row))).collect();
    match median(lengths) {
        Some(found) if (found - 1.0).abs() > QUATERNION_TOLERANCE => Err(TrialError::Quaternion {
            path: path.to_owned(),
            sensor: sensor.name.clone(),
            found,
            tolerance: QUATERNION_TOLERANCE,
        }),
        _ => Ok(()),
    }
}

/// An angle that swings beyond two turns is in degrees, unless another sensor reads its rate; one that only grows may belong to a
/// joint that revolves.
fn check_angle(
    path: &Path,
    signature: &Signature,
    (sensors, column): (&Table, usize),
    remarks: &mut Vec<RemarkKind>,
) -> Result<(), TrialError> {
    let values = sensors.series.column_values(column).enumerate();
    let values: Vec<(usize, f64)> = values.filter(|(_, value)| !value.is_nan()).collect();
    let largest = values
        .iter()
        .max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()));
    let Some((row, found)) = largest
        .copied()
        .filter(|(_, value)| value.abs() > LARGEST_ANGLE)
    else {
        return Ok(());
    };
    let travelled: f64 = values
        .windows(2)
        .map(|pair| (pair[1].1 - pair[0].1).abs())
        .sum();
    let (first, last) = (values[0].1, values[values.len() - 1].1);
    let name = sensors.series.columns[column].clone();
    let moved = last.abs() - first.abs();
    if moved > LARGEST_ANGLE && moved >= ONE_WAY * travelled {
        remarks.push(RemarkKind::LargeAngle {
            column: name,
            largest: found.abs(),
        });
        return Ok(());
    }
    let rates = signature.sensors.iter();
    let rates = rates.filter(|of| of.kind == SensorQuantity::Other);
    let mut rates = rates.flat_map(SensorSignature::columns);
    let series = &sensors.series;
    if rates.any(|name| (series.column(&name)).is_some_and(|rate| is_rate(series, column, rate))) {
        return Ok(());
    }
    Err(TrialError::Degrees {
        path: path.to_owned(),
        place: sensors.place(row),
        column: name,
        found,
        turns: found.abs() / TAU,
    })
}

/// True where a column reads how fast another one changes, in the same unit.
fn is_rate(series: &Series, of: usize, rate: usize) -> bool {
    let pairs = (1..series.len().saturating_sub(1)).map(|row| {
        let seconds = series.times[row + 1] - series.times[row - 1];
        let change = series.at(row + 1, of) - series.at(row - 1, of);
        (change / seconds, series.at(row, rate))
    });
    let pairs: Vec<(f64, f64)> = pairs.filter(|(a, b)| (a + b).is_finite()).collect();
    if pairs.len() < LEAST_ROWS {
        return false;
    }
    let [mut aa, mut ab, mut bb] = [0.0; 3];
    for (a, b) in pairs {
        aa += a * a;
        ab += a * b;
        bb += b * b;
    }
    let ratio = ab / bb;
    ab >= CORRELATION * (aa * bb).sqrt() && (RATIO.recip()..=RATIO).contains(&ratio)
}
