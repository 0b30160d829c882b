//! A table of steady states: a csv file without a column `time`, one row a condition.

use std::{fs::File, io::BufReader, path::Path};

use ::csv::{Position, Reader, ReaderBuilder, StringRecord, Trim};

use super::{
    super::{
        Part, RemarkKind, RowPlace, Series, Signature, Steady, Trial, TrialError,
        file_name::trial_name, kinds::open_table, message::listed,
    },
    TIME,
    header::missing_actuators,
    rows::damaged,
};

/// Suffix of a joint's imposed velocity.
const VELOCITY: &str = "_vel";
/// Suffix of the standard deviation of a mean reading.
const DEVIATION: &str = "_sd";
/// Rows that a table has at least: one verifies nothing.
const LEAST_ROWS: usize = 2;

/// What a column of the table holds, by its place in the model.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Column {
    Sensor(usize),
    Deviation(usize),
    Control(usize),
    Position(usize),
    Velocity(usize),
    /// Nothing: it has no name.
    Aside,
}

/// The names of the columns; `None` where the file cannot be read or has a column `time`.
fn names_without_time(path: &Path) -> Option<Vec<String>> {
    let mut reader = reader(path).ok()?;
    let names = names(&mut reader).ok()?;
    let has_names = names.iter().any(|name| !name.is_empty());
    (has_names && !names.iter().any(|name| name == TIME)).then_some(names)
}

/// The number of rows of a table of steady states; `None` for anything else.
pub(in super::super) fn table_rows(path: &Path) -> Option<usize> {
    names_without_time(path)?;
    Some(reader(path).ok()?.records().count())
}

/// True for a file without a column `time` but with one of a joint of the model.
pub(in super::super) fn is_table(path: &Path, signature: &Signature) -> bool {
    let names = names_without_time(path).unwrap_or_default();
    names.iter().any(|name| {
        matches!(
            column(name, signature),
            Some(Column::Position(_) | Column::Velocity(_))
        )
    })
}

/// Refuses a file called as a table of steady states that has times.
pub(in super::super) fn check_name(path: &Path) -> Result<(), TrialError> {
    let is_named = trial_name(path).eq_ignore_ascii_case("steady");
    if is_named && names_without_time(path).is_none() {
        let names = names(&mut reader(path)?)?;
        if names.iter().any(|name| name == TIME) {
            return Err(TrialError::Table {
                path: path.to_owned(),
                reason: format!(
                    "a table of steady states has one row a condition and no column `{TIME}`; give a log in time another name"
                ),
            });
        }
    }
    Ok(())
}

fn reader(path: &Path) -> Result<Reader<BufReader<File>>, TrialError> {
    Ok(ReaderBuilder::new()
        .trim(Trim::All)
        .from_reader(open_table(path)?))
}

fn names(reader: &mut Reader<BufReader<File>>) -> Result<Vec<String>, TrialError> {
    let headers = reader.headers();
    let headers = headers.map_err(|error| damaged(Path::new(""), &error))?;
    let names = headers.iter();
    Ok(names
        .map(|name| name.trim_start_matches('\u{feff}').to_owned())
        .collect())
}

/// The meaning of a name: that of a sensor or actuator comes before that of a joint.
fn column(name: &str, signature: &Signature) -> Option<Column> {
    let columns = signature.sensor_columns();
    let sensor = |name: &str| {
        let whole = columns.iter().position(|of| of == name);
        whole.or_else(|| {
            let scalar = name.strip_suffix("[0]")?;
            columns.iter().position(|of| of == scalar)
        })
    };
    let joint = |name: &str| signature.joints.iter().position(|of| of == name);
    if name.is_empty() {
        return Some(Column::Aside);
    }
    (sensor(name).map(Column::Sensor))
        .or_else(|| signature.actuator(name).map(Column::Control))
        .or_else(|| signature.joint(name).map(Column::Position))
        .or_else(|| joint(name.strip_suffix(VELOCITY)?).map(Column::Velocity))
        .or_else(|| sensor(name.strip_suffix(DEVIATION)?).map(Column::Deviation))
}

/// Reads the rows of a table; of `part`, (place, parts), those whose index leaves that remainder.
pub(in super::super) fn read(
    path: &Path,
    signature: &Signature,
    part: Option<(usize, usize)>,
) -> Result<(Trial, Vec<RemarkKind>), TrialError> {
    let mut reader = reader(path)?;
    let names = names(&mut reader).map_err(|error| match error {
        TrialError::Damaged { place, reason, .. } => TrialError::Damaged {
            path: path.to_owned(),
            place,
            reason,
        },
        error => error,
    })?;
    let columns = columns(path, signature, &names)?;
    let table = Table {
        path,
        signature,
        names: &names,
        columns: &columns,
    };
    let mut remarks = table.remarks();
    table.check_actuators()?;
    let sensor_columns = signature.sensor_columns();
    let read = |column: &Column| matches!(column, Column::Sensor(_));
    if !columns.iter().any(read) {
        return Err(table.refused(format!(
            "no column with the mean reading of a sensor, such as a force: nothing can be compared; columns: {}; {}",
            listed(&names),
            signature.describe()
        )));
    }
    let (mut control, mut sensors, mut motion, mut deviations) = (
        series(signature.actuators.clone()),
        series(sensor_columns.clone()),
        series(table.motion_names()),
        series(sensor_columns),
    );
    let mut record = StringRecord::new();
    let mut rows = 0;
    while reader
        .read_record(&mut record)
        .map_err(|error| damaged(path, &error))?
    {
        let line = record.position().map_or(0, Position::line);
        let row = table.row(&record, line)?;
        if part.is_none_or(|(place, parts)| rows % parts == place) {
            for (all, of) in [
                (&mut control, row.control),
                (&mut sensors, row.sensors),
                (&mut motion, row.motion),
                (&mut deviations, row.deviations),
            ] {
                all.times.push((rows + 1) as f64);
                all.data.extend(of);
            }
        }
        rows += 1;
    }
    if rows < LEAST_ROWS {
        return Err(TrialError::Empty {
            path: path.to_owned(),
            what: "the table of steady states".to_owned(),
            found: rows,
            expected: LEAST_ROWS,
        });
    }
    drop_empty(&mut sensors);
    for sensor in &signature.sensors {
        let has = |name: &String| sensors.column(name).is_some();
        let lacking: Vec<String> = sensor.columns().into_iter().filter(|of| !has(of)).collect();
        if lacking.len() == sensor.dim {
            remarks.push(RemarkKind::MissingSensor {
                sensor: sensor.name.clone(),
            });
        } else if !lacking.is_empty() {
            remarks.push(RemarkKind::MissingComponents {
                sensor: sensor.name.clone(),
                columns: lacking,
            });
        }
    }
    let name = trial_name(path);
    let trial = Trial {
        name: part.map_or(name.clone(), |(place, _)| part_name(&name, place)),
        control,
        sensors,
        steady: Some(Steady { motion, deviations }),
        ..Trial::default()
    };
    Ok((trial, remarks))
}

/// Name of a part of a table.
pub(in super::super) fn part_name(table: &str, place: usize) -> String {
    format!("{table}-{:02}", place + 1)
}

fn series(columns: Vec<String>) -> Series {
    Series {
        columns,
        ..Series::default()
    }
}

/// Drops columns without a single number.
fn drop_empty(series: &mut Series) {
    let kept: Vec<usize> = (0..series.width())
        .filter(|column| !series.column_values(*column).all(f64::is_nan))
        .collect();
    let rows = 0..series.len();
    series.data = rows
        .flat_map(|row| kept.iter().map(move |column| (row, *column)))
        .map(|(row, column)| series.at(row, column))
        .collect();
    series.columns = kept.iter().map(|of| series.columns[*of].clone()).collect();
}

/// The meaning of every column, none meant twice.
fn columns(
    path: &Path,
    signature: &Signature,
    names: &[String],
) -> Result<Vec<Column>, TrialError> {
    let mut all: Vec<Column> = Vec::with_capacity(names.len());
    for name in names {
        let found = column(name, signature).ok_or_else(|| signature.unknown(path, name))?;
        let first = all.iter().position(|of| *of == found);
        if let Some(first) = first.filter(|_| found != Column::Aside) {
            return Err(TrialError::Twice {
                path: path.to_owned(),
                column: name.clone(),
                first: names[first].clone(),
                second: name.clone(),
            });
        }
        all.push(found);
    }
    Ok(all)
}

struct Table<'a> {
    path: &'a Path,
    signature: &'a Signature,
    names: &'a [String],
    columns: &'a [Column],
}

/// The numbers of one row.
struct Row {
    control: Vec<f64>,
    sensors: Vec<f64>,
    motion: Vec<f64>,
    deviations: Vec<f64>,
}

impl Table<'_> {
    fn refused(&self, reason: String) -> TrialError {
        TrialError::Table {
            path: self.path.to_owned(),
            reason,
        }
    }

    fn remarks(&self) -> Vec<RemarkKind> {
        let mut remarks = Vec::new();
        let aside = (0..self.names.len()).filter(|at| self.columns[*at] == Column::Aside);
        let names: Vec<String> = aside
            .map(|at| format!("column {} without a name", at + 1))
            .collect();
        if !names.is_empty() {
            remarks.push(RemarkKind::SetAside { names });
        }
        let given = |joint: usize| {
            let of = [Column::Position(joint), Column::Velocity(joint)];
            of.iter().any(|of| self.columns.contains(of))
        };
        let held: Vec<String> = (self.signature.joints.iter().enumerate())
            .filter(|(joint, _)| !given(*joint))
            .map(|(_, name)| name.clone())
            .collect();
        if !held.is_empty() {
            remarks.push(RemarkKind::HeldJoints { joints: held });
        }
        if (self.columns.iter()).any(|of| matches!(of, Column::Control(_))) {
            let order = |of: &Column| match of {
                Column::Control(at) => Some(*at),
                _ => None,
            };
            if !self.columns.iter().filter_map(order).is_sorted() {
                remarks.push(RemarkKind::Reordered {
                    part: Part::Control,
                });
            }
        }
        remarks
    }

    fn check_actuators(&self) -> Result<(), TrialError> {
        let has = |at: usize| self.columns.contains(&Column::Control(at));
        match (0..self.signature.actuators.len()).all(has) {
            true => Ok(()),
            false => Err(missing_actuators(self.path, self.signature, has)),
        }
    }

    /// Joints that are given, with what is given of them.
    fn motion_columns(&self) -> Vec<(usize, String)> {
        let name = |at: usize| match self.columns[at] {
            Column::Position(joint) => Some(self.signature.joints[joint].clone()),
            Column::Velocity(joint) => Some(self.signature.joints[joint].clone() + VELOCITY),
            _ => None,
        };
        let all = 0..self.columns.len();
        all.filter_map(|at| Some((at, name(at)?))).collect()
    }

    fn motion_names(&self) -> Vec<String> {
        let columns = self.motion_columns().into_iter();
        columns.map(|(_, name)| name).collect()
    }

    fn row(&self, record: &StringRecord, line: u64) -> Result<Row, TrialError> {
        let width = self.signature.sensor_columns().len();
        let mut row = Row {
            control: vec![f64::NAN; self.signature.actuators.len()],
            sensors: vec![f64::NAN; width],
            motion: Vec::new(),
            deviations: vec![f64::NAN; width],
        };
        for (at, column) in self.columns.iter().enumerate() {
            let text = record.get(at).unwrap_or_default();
            match column {
                Column::Aside => {}
                Column::Sensor(of) if !text.is_empty() => {
                    row.sensors[*of] = self.number(at, line, text)?;
                }
                Column::Deviation(of) if !text.is_empty() => {
                    let value = self.number(at, line, text)?;
                    if value <= 0.0 {
                        return Err(self.refused(format!(
                            "{}, column `{}`: a standard deviation of {value}, expected more than zero; leave the cell \
                             empty where none is known",
                            RowPlace::Line(line),
                            self.names[at]
                        )));
                    }
                    row.deviations[*of] = value;
                }
                Column::Sensor(_) | Column::Deviation(_) => {}
                Column::Control(of) => row.control[*of] = self.number(at, line, text)?,
                Column::Position(_) | Column::Velocity(_) => {
                    row.motion.push(self.number(at, line, text)?);
                }
            }
        }
        if row.sensors.iter().all(|value| value.is_nan()) {
            return Err(self.refused(format!(
                "{}: no mean reading of any sensor in this row; leave the row out",
                RowPlace::Line(line)
            )));
        }
        Ok(row)
    }

    fn number(&self, at: usize, line: u64, text: &str) -> Result<f64, TrialError> {
        let (place, column) = (RowPlace::Line(line), self.names[at].clone());
        let path = self.path.to_owned();
        match text.parse::<f64>() {
            Ok(found) if found.is_finite() => Ok(found),
            Ok(found) => Err(TrialError::NotFinite {
                path,
                place,
                column,
                found,
                hint: "; leave the cell of a sensor empty where it was not read",
            }),
            Err(_) if text.is_empty() => Err(self.refused(format!(
                "{place}, column `{column}` is empty; a steady state needs every position, velocity and command"
            ))),
            Err(_) => Err(TrialError::NotANumber {
                path,
                place,
                column,
                found: text.chars().take(40).collect(),
            }),
        }
    }
}
