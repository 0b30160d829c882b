//! A trial from the tables that a reader found: checks that are the same for every format.

use std::path::Path;

use super::{
    Part, Remark, RemarkKind, RowPlace, SensorSignature, Series, Signature, Trial, TrialError,
    file_name::trial_name,
    tables::{Parts, Table},
    times, unit_checks,
};

/// Checks the tables and makes a trial of them, with remarks.
pub(super) fn assemble(
    path: &Path,
    signature: &Signature,
    parts: Parts,
) -> Result<(Trial, Vec<Remark>), TrialError> {
    let Parts {
        control,
        mut sensors,
        initial_state,
        state,
        prescribed,
        mut remarks,
    } = parts;
    let tables = [
        (Part::Control, Some(&control), 1),
        (Part::Sensors, Some(&sensors), 2),
        (Part::State, state.as_ref(), 1),
    ];
    for (part, table, expected) in tables {
        let Some(table) = table else { continue };
        let rows = table.series.len();
        if rows < expected {
            return Err(TrialError::Empty {
                path: path.to_owned(),
                what: part.to_string(),
                found: rows,
                expected,
            });
        }
        times::check(path, table.time_name, &table.series.times, |row| {
            table.place(row)
        })?;
        times::check_length(path, table, signature.timestep)?;
    }
    let hint = "; a control is needed in every row, leave the row out where there is none";
    control.check_finite(path, |_| false, hint)?;
    sensors.check_finite(path, f64::is_nan, "; a lost sample is NaN or an empty cell")?;
    if let Some(state) = &state {
        state.check_finite(path, |_| false, "")?;
    }
    check_initial_state(path, initial_state.as_deref())?;

    note_missing_sensors(signature, &mut sensors.series, &mut remarks);
    if sensors.series.width() == 0 {
        return Err(TrialError::NoSensors {
            path: path.to_owned(),
            model: signature.describe(),
        });
    }
    unit_checks::check(path, signature, &sensors, &mut remarks)?;
    if let Some(table) = &prescribed {
        check_prescribed(path, table, &sensors.series)?;
    }

    times::note(Part::Control, &control.series.times, &mut remarks);
    times::note(Part::Sensors, &sensors.series.times, &mut remarks);
    times::note_rates(&control.series, &sensors.series, &mut remarks);
    times::note_range(
        &control.series.times,
        &sensors.series.times,
        signature.timestep,
        &mut remarks,
    );
    note_constant_controls(&control.series, &mut remarks);
    note_states(
        signature,
        initial_state.as_deref(),
        state.is_some(),
        &control.series.times,
        &mut remarks,
    );
    let trial = Trial {
        name: trial_name(path),
        control: control.series,
        sensors: sensors.series,
        initial_state,
        state: state.map(|table| table.series),
        prescribed: prescribed.map(|table| table.series),
        steady: None,
    };
    Ok((trial, remarks.into_iter().map(Remark::from).collect()))
}

/// Samples that a spline with an acceleration needs.
const LEAST_SAMPLES: usize = 4;

/// Refuses prescribed joints whose samples make no trajectory of the rows to be compared.
fn check_prescribed(path: &Path, table: &Table, sensors: &Series) -> Result<(), TrialError> {
    table.check_finite(
        path,
        f64::is_nan,
        "; leave the cell empty where there is no sample",
    )?;
    let series = &table.series;
    for (column, joint) in series.columns.iter().enumerate() {
        let refused = |reason: String| TrialError::Prescribed {
            path: path.to_owned(),
            joint: joint.clone(),
            reason,
        };
        let values = series.times.iter().zip(series.column_values(column));
        let times: Vec<f64> = (values.filter(|(_, value)| !value.is_nan()))
            .map(|(time, _)| *time)
            .collect();
        if times.len() < LEAST_SAMPLES {
            return Err(refused(format!(
                "{} samples, expected at least {LEAST_SAMPLES} for a trajectory with an acceleration",
                times.len()
            )));
        }
        let (first, last) = (times[0], times[times.len() - 1]);
        let apart = (last - first) / (times.len() - 1) as f64;
        let rows = [sensors.times.first(), sensors.times.last()];
        let [Some(from), Some(to)] = rows else {
            continue;
        };
        if *from < first - apart || *to > last + apart {
            return Err(refused(format!(
                "samples from {first} s to {last} s, but rows of sensors from {from} s to {to} s; expected samples as long as \
                 there are rows"
            )));
        }
    }
    Ok(())
}

fn check_initial_state(path: &Path, state: Option<&[f64]>) -> Result<(), TrialError> {
    let state = state.unwrap_or_default();
    match state.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Err(TrialError::NotFinite {
            path: path.to_owned(),
            place: RowPlace::Row(at),
            column: "initial_state".to_owned(),
            found: state[at],
            hint: "; leave the initial state out where it is not known",
        }),
    }
}

/// Notes sensors of the model without a sample or with lost ones, and drops the columns of those without any.
fn note_missing_sensors(
    signature: &Signature,
    sensors: &mut Series,
    remarks: &mut Vec<RemarkKind>,
) {
    let mut kept = Vec::new();
    for sensor in &signature.sensors {
        let columns: Vec<usize> = sensor
            .columns()
            .iter()
            .filter_map(|name| sensors.column(name))
            .collect();
        let lost = |row: &[f64], column: &usize| row[*column].is_nan();
        // A component that the log lacks altogether is missing, not lost in every row.
        let recorded: Vec<usize> = columns
            .iter()
            .copied()
            .filter(|column| !sensors.column_values(*column).all(f64::is_nan))
            .collect();
        if recorded.is_empty() {
            let sensor = sensor.name.clone();
            remarks.push(RemarkKind::MissingSensor { sensor });
            continue;
        }
        note_missing_components(sensor, sensors, &recorded, remarks);
        let rows = (0..sensors.len())
            .filter(|row| {
                recorded
                    .iter()
                    .any(|column| lost(sensors.row(*row), column))
            })
            .count();
        if rows > 0 {
            remarks.push(RemarkKind::DroppedSamples {
                sensor: sensor.name.clone(),
                rows,
                of: sensors.len(),
            });
        }
        kept.extend(columns);
    }
    if kept.len() < sensors.width() {
        let rows = 0..sensors.len();
        let places = rows.flat_map(|row| kept.iter().map(move |column| (row, *column)));
        sensors.data = places
            .map(|(row, column)| sensors.at(row, column))
            .collect();
        sensors.columns = kept
            .iter()
            .map(|column| sensors.columns[*column].clone())
            .collect();
    }
}

fn note_missing_components(
    sensor: &SensorSignature,
    sensors: &Series,
    recorded: &[usize],
    remarks: &mut Vec<RemarkKind>,
) {
    let mut columns = sensor.columns();
    columns.retain(|name| {
        !recorded
            .iter()
            .any(|column| sensors.columns[*column] == *name)
    });
    if !columns.is_empty() {
        let sensor = sensor.name.clone();
        remarks.push(RemarkKind::MissingComponents { sensor, columns });
    }
}

fn note_constant_controls(control: &Series, remarks: &mut Vec<RemarkKind>) {
    let is_constant = |column: usize| {
        let mut values = control.column_values(column);
        let first = values.next();
        values.all(|value| Some(value) == first)
    };
    let constant: Vec<usize> = (0..control.width())
        .filter(|column| is_constant(*column))
        .collect();
    if constant.is_empty() {
        return;
    }
    remarks.push(if constant.len() == control.width() {
        RemarkKind::ConstantControls
    } else {
        let names = constant
            .iter()
            .map(|column| control.columns[*column].clone());
        let actuators = names.collect();
        RemarkKind::IdleActuators { actuators }
    });
}

fn note_states(
    signature: &Signature,
    initial_state: Option<&[f64]>,
    has_states: bool,
    control_times: &[f64],
    remarks: &mut Vec<RemarkKind>,
) {
    match initial_state.and_then(|state| state.first()) {
        None => remarks.push(RemarkKind::MissingInitialState),
        Some(initial_state) => {
            let first_control = control_times.first().copied().unwrap_or(*initial_state);
            if (initial_state - first_control).abs() > 0.5 * signature.timestep {
                remarks.push(RemarkKind::StartTimes {
                    initial_state: *initial_state,
                    first_control,
                });
            }
        }
    }
    if !has_states {
        remarks.push(RemarkKind::MissingStates);
    }
}
