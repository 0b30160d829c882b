//! The lines below the first.

use std::{fs::File, io::BufReader, path::Path};

use ::csv::{ErrorKind, Position, Reader, ReaderBuilder, StringRecord, Trim};

use super::{
    super::{
        RemarkKind, RowPlace, Series, Signature, TrialError,
        kinds::open_table,
        tables::{Parts, Table},
        times,
    },
    TIME,
    header::{Header, Resolver, missing_actuators},
};

pub(in super::super) fn read(path: &Path, signature: &Signature) -> Result<Parts, TrialError> {
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_reader(open_table(path)?);
    let headers = reader.headers().map_err(|error| damaged(path, &error))?;
    // Spreadsheets put a byte-order mark in front of the first name.
    let names = headers
        .iter()
        .map(|name| name.trim_start_matches('\u{feff}').to_owned());
    let names: Vec<String> = names.collect();
    if names.iter().all(String::is_empty) {
        return Err(TrialError::Damaged {
            path: path.to_owned(),
            place: None,
            reason: "the file is empty".to_owned(),
        });
    }
    let mut remarks = Vec::new();
    let header = Resolver { path, signature }.resolve(names, &mut remarks)?;
    read_rows(path, signature, &header, &mut reader, remarks)
}

fn read_rows(
    path: &Path,
    signature: &Signature,
    header: &Header,
    reader: &mut Reader<BufReader<File>>,
    mut remarks: Vec<RemarkKind>,
) -> Result<Parts, TrialError> {
    let mut control = table(signature.actuators.clone());
    let mut sensors = table(header.sensors.clone());
    let mut state = table(header.state.clone());
    let mut prescribed = table(header.joints.clone());
    let mut sampled: Vec<f64> = Vec::new();
    let mut lines: Vec<u64> = Vec::new();
    let mut record = StringRecord::new();
    while reader
        .read_record(&mut record)
        .map_err(|error| damaged(path, &error))?
    {
        let row = Row {
            path,
            header,
            line: record.position().map_or(0, Position::line),
            record: &record,
        };
        let time = row.number(header.time)?.unwrap_or(f64::NAN);
        sampled.push(time);
        lines.push(row.line);
        // A model without actuators has a row of no controls everywhere.
        if header.control.is_empty() || row.has_any(header.control.iter()) {
            begin(&mut control, time, row.line);
            for column in &header.control {
                control.series.data.push(row.finite_or_empty(*column)?);
            }
        }
        if row.has_any(header.sensor_sources.iter().flatten()) {
            begin(&mut sensors, time, row.line);
            for column in &header.sensor_sources {
                let value = column
                    .map(|column| row.number(column))
                    .transpose()?
                    .flatten();
                sensors.series.data.push(value.unwrap_or(f64::NAN));
            }
        }
        if row.has_any(header.joint_sources.iter()) {
            begin(&mut prescribed, time, row.line);
            for column in &header.joint_sources {
                let value = row.number(*column)?;
                prescribed.series.data.push(value.unwrap_or(f64::NAN));
            }
        }
        if row.has_any(header.state_sources.iter()) {
            begin(&mut state, time, row.line);
            if header.state_lacks_time {
                state.series.data.push(time);
            }
            for column in &header.state_sources {
                let value = row
                    .number(*column)?
                    .ok_or_else(|| row.half_a_state(*column))?;
                state.series.data.push(value);
            }
        }
    }
    // Every row, so that also those without a sample must be in order.
    times::check(path, TIME, &sampled, |row| RowPlace::Line(lines[row]))?;
    if sampled.len() < 2 {
        return Err(TrialError::Empty {
            path: path.to_owned(),
            what: "the file".to_owned(),
            found: sampled.len(),
            expected: 2,
        });
    }
    fill_controls(path, signature, &mut control.series, &mut remarks)?;
    let (initial_state, state) = split_states(header, state);
    Ok(Parts {
        control,
        sensors,
        initial_state,
        state,
        prescribed: (!header.joints.is_empty()).then_some(prescribed),
        remarks,
    })
}

fn table(columns: Vec<String>) -> Table {
    Table {
        series: Series {
            columns,
            ..Series::default()
        },
        time_name: TIME,
        lines: Some(Vec::new()),
    }
}

fn begin(table: &mut Table, time: f64, line: u64) {
    table.series.times.push(time);
    if let Some(lines) = &mut table.lines {
        lines.push(line);
    }
}

/// A line of the file.
struct Row<'a> {
    path: &'a Path,
    header: &'a Header,
    record: &'a StringRecord,
    line: u64,
}

impl Row<'_> {
    fn cell(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or_default()
    }

    fn has_any<'c>(&self, mut columns: impl Iterator<Item = &'c usize>) -> bool {
        columns.any(|column| !self.cell(*column).is_empty())
    }

    /// The number in a cell; `None` where it is empty.
    fn number(&self, column: usize) -> Result<Option<f64>, TrialError> {
        match self.cell(column) {
            "" => Ok(None),
            text => match text.parse() {
                Ok(number) => Ok(Some(number)),
                Err(_) => Err(TrialError::NotANumber {
                    path: self.path.to_owned(),
                    place: RowPlace::Line(self.line),
                    column: self.header.names[column].clone(),
                    found: text.chars().take(40).collect(),
                }),
            },
        }
    }

    /// A finite number; NaN where the cell is empty, and only there.
    fn finite_or_empty(&self, column: usize) -> Result<f64, TrialError> {
        match self.number(column)? {
            Some(found) if !found.is_finite() => Err(TrialError::NotFinite {
                path: self.path.to_owned(),
                place: RowPlace::Line(self.line),
                column: self.header.names[column].clone(),
                found,
                hint: "; leave the cell of a control empty where there is no sample",
            }),
            value => Ok(value.unwrap_or(f64::NAN)),
        }
    }

    fn half_a_state(&self, column: usize) -> TrialError {
        TrialError::Damaged {
            path: self.path.to_owned(),
            place: Some(RowPlace::Line(self.line).to_string()),
            reason: format!(
                "column `{}` is empty where other columns of the state are not",
                self.header.names[column]
            ),
        }
    }
}

/// Fills what an actuator lacks in rows where others have a sample: linear between its own samples and held
/// before and after them, which is what a control does anyway.
fn fill_controls(
    path: &Path,
    signature: &Signature,
    control: &mut Series,
    remarks: &mut Vec<RemarkKind>,
) -> Result<(), TrialError> {
    let width = control.width();
    let has_sample = |column: usize| control.column_values(column).any(|value| !value.is_nan());
    if !(0..width).all(has_sample) {
        return Err(missing_actuators(path, signature, has_sample));
    }
    for column in 0..width {
        let own: Vec<(f64, f64)> = control
            .times
            .iter()
            .copied()
            .zip(control.column_values(column))
            .filter(|(_, value)| !value.is_nan())
            .collect();
        let rows = control.len() - own.len();
        if rows == 0 {
            continue;
        }
        let (times, data) = own.into_iter().unzip();
        let own = Series {
            times,
            columns: vec![control.columns[column].clone()],
            data,
        };
        for row in 0..control.len() {
            let place = row * width + column;
            if control.data[place].is_nan() {
                own.interpolate(control.times[row], &mut control.data[place..=place]);
            }
        }
        remarks.push(RemarkKind::FilledControls {
            actuator: control.columns[column].clone(),
            rows,
            of: control.len(),
        });
    }
    Ok(())
}

/// The first full state is where the run starts; a single one is no series.
fn split_states(header: &Header, state: Table) -> (Option<Vec<f64>>, Option<Table>) {
    let rows = state.series.len();
    if rows == 0 {
        return (None, None);
    }
    let initial = header.state_is_full.then(|| state.series.row(0).to_vec());
    let series = (rows > 1 || initial.is_none()).then_some(state);
    (initial, series)
}

pub(super) fn damaged(path: &Path, error: &::csv::Error) -> TrialError {
    let line = error.position().map(Position::line);
    let reason = match error.kind() {
        ErrorKind::Io(error) => {
            return TrialError::Io {
                path: path.to_owned(),
                reason: error.to_string(),
            };
        }
        ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} cells, expected {expected_len} as in the first line"),
        ErrorKind::Utf8 { .. } => "not UTF-8 text".to_owned(),
        _ => error.to_string(),
    };
    TrialError::Damaged {
        path: path.to_owned(),
        place: line.map(|line| RowPlace::Line(line).to_string()),
        reason,
    }
}
