//! A trial as comma-separated text, read and written. [The room's head](super) says what the columns are.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufReader, Write as _},
    path::Path,
};

use ::csv::{ErrorKind, Reader, ReaderBuilder, StringRecord, Terminator, Trim, WriterBuilder};

use super::{
    Part, Place, RemarkKind, Series, Signature, Trial, TrialError,
    assemble::{Parts, Table},
    columns::{CONTROL_SUFFIX, listed},
    series::component_name,
    write,
};

const TIME: &str = "time";
/// Blocks of a state in the order of a full-physics vector after its time; the whole vector has its own name.
const BLOCKS: [&str; 3] = ["qpos", "qvel", "act"];
const WHOLE_STATE: &str = "state";

/// Which column of the file holds what; `None` where no column does.
struct Header {
    names: Vec<String>,
    time: usize,
    /// A column for each actuator.
    control: Vec<usize>,
    /// Names of the sensor columns that the file has, whole vectors, in the model's order.
    sensors: Vec<String>,
    /// The column of each of them; absent for a component that the file lacks.
    sensor_sources: Vec<Option<usize>>,
    /// Names of the state columns, in order.
    state: Vec<String>,
    state_sources: Vec<usize>,
    /// The states are the model's full-physics vector but for its time, which is the row's.
    state_lacks_time: bool,
    state_is_full: bool,
}

pub(super) fn read(path: &Path, signature: &Signature) -> Result<Parts, TrialError> {
    let file = File::open(path).map_err(|error| TrialError::Io {
        path: path.to_owned(),
        reason: error.to_string(),
    })?;
    let mut reader = ReaderBuilder::new()
        .trim(Trim::All)
        .from_reader(BufReader::new(file));
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

/// Matches the names of columns with those of the model.
struct Resolver<'a> {
    path: &'a Path,
    signature: &'a Signature,
}

impl Resolver<'_> {
    fn resolve(
        &self,
        names: Vec<String>,
        remarks: &mut Vec<RemarkKind>,
    ) -> Result<Header, TrialError> {
        let sensor_columns = self.signature.sensor_columns();
        let mut time = None;
        let mut control = vec![None; self.signature.actuators.len()];
        let mut sensors = vec![None; sensor_columns.len()];
        let mut state = BTreeMap::new();
        let mut aside = Vec::new();
        for (column, name) in names.iter().enumerate() {
            let sensor = sensor_columns.iter().position(|sensor| sensor == name);
            let sensor = sensor.or_else(|| self.lone_component(name, &sensor_columns));
            let namesake = self.signature.actuators.contains(name);
            if name == TIME {
                self.claim(&mut time, column, TIME, &names)?;
            } else if let Some(sensor) = sensor {
                let as_control = format!("{name}{CONTROL_SUFFIX}");
                if namesake && !names.contains(&as_control) {
                    return Err(TrialError::Ambiguous {
                        path: self.path.to_owned(),
                        column: name.clone(),
                    });
                }
                self.claim(
                    &mut sensors[sensor],
                    column,
                    &sensor_columns[sensor],
                    &names,
                )?;
            } else if let Some(actuator) = self.signature.actuator(name) {
                let meant = &self.signature.actuators[actuator];
                self.claim(&mut control[actuator], column, meant, &names)?;
            } else if let Some((block, index)) = state_column(name) {
                let place = state.entry(block).or_insert_with(BTreeMap::new);
                self.claim(place.entry(index).or_insert(None), column, name, &names)?;
            } else if name.is_empty() {
                // The row numbers that data frames write.
                aside.push(format!("column {} without a name", column + 1));
            } else {
                return Err(self.unknown(name));
            }
        }
        if !aside.is_empty() {
            remarks.push(RemarkKind::SetAside { names: aside });
        }
        let time = time.ok_or_else(|| self.no_time(&names))?;
        let control = self.every_actuator(&control)?;
        let (sensors, sensor_sources) = self.whole_vectors(&sensors);
        for (part, sources) in [
            (Part::Control, control.clone()),
            (
                Part::Sensors,
                sensor_sources.iter().flatten().copied().collect(),
            ),
        ] {
            if !sources.is_sorted() {
                remarks.push(RemarkKind::Reordered { part });
            }
        }
        let mut header = Header {
            names,
            time,
            control,
            sensors,
            sensor_sources,
            state: Vec::new(),
            state_sources: Vec::new(),
            state_lacks_time: false,
            state_is_full: false,
        };
        self.states(&state, &mut header, remarks)?;
        Ok(header)
    }

    /// Gives a column to a signal that has none yet.
    fn claim(
        &self,
        place: &mut Option<usize>,
        column: usize,
        meant: &str,
        names: &[String],
    ) -> Result<(), TrialError> {
        match place.replace(column) {
            None => Ok(()),
            Some(first) => Err(TrialError::Twice {
                path: self.path.to_owned(),
                column: meant.to_owned(),
                first: names[first].clone(),
                second: names[column].clone(),
            }),
        }
    }

    /// `name[0]` for a sensor of one number.
    fn lone_component(&self, name: &str, sensor_columns: &[String]) -> Option<usize> {
        let scalar = name.strip_suffix("[0]")?;
        sensor_columns.iter().position(|column| column == scalar)
    }

    /// The refusal of a name, which may be that of a vector without, or with too large, an index.
    fn unknown(&self, name: &str) -> TrialError {
        let signal = name.split('[').next().unwrap_or(name);
        let sensor = self
            .signature
            .sensors
            .iter()
            .find(|sensor| sensor.name == signal);
        match sensor {
            Some(sensor) => TrialError::Width {
                path: self.path.to_owned(),
                what: format!("column `{name}` of sensor `{signal}`"),
                found: 1,
                expected: format!("{}: {}", sensor.dim, listed(&sensor.columns())),
                model: self.signature.describe(),
            },
            None => self.signature.unknown(self.path, name),
        }
    }

    fn no_time(&self, names: &[String]) -> TrialError {
        let hint = if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            "; the first line must name the columns"
        } else if names.len() == 1 && names[0].contains([';', '\t']) {
            "; the columns must be separated by commas"
        } else {
            ""
        };
        TrialError::NoTime {
            path: self.path.to_owned(),
            found: listed(names),
            hint,
        }
    }

    fn every_actuator(&self, control: &[Option<usize>]) -> Result<Vec<usize>, TrialError> {
        let all: Option<Vec<usize>> = control.iter().copied().collect();
        all.ok_or_else(|| missing_actuators(self.path, self.signature, |i| control[i].is_some()))
    }

    /// Columns of every sensor of which the file has at least one.
    fn whole_vectors(&self, sources: &[Option<usize>]) -> (Vec<String>, Vec<Option<usize>>) {
        let (mut names, mut kept) = (Vec::new(), Vec::new());
        let mut start = 0;
        for sensor in &self.signature.sensors {
            let sources = &sources[start..start + sensor.dim];
            start += sensor.dim;
            if sources.iter().any(Option::is_some) {
                names.extend(sensor.columns());
                kept.extend(sources);
            }
        }
        (names, kept)
    }

    /// Puts the state columns in order.
    fn states(
        &self,
        blocks: &BTreeMap<&str, BTreeMap<usize, Option<usize>>>,
        header: &mut Header,
        remarks: &mut Vec<RemarkKind>,
    ) -> Result<(), TrialError> {
        if blocks.is_empty() {
            return Ok(());
        }
        let expected = self.signature.state_len;
        let width = |what: String, found: usize, expected: String| TrialError::Width {
            path: self.path.to_owned(),
            what,
            found,
            expected,
            model: format!(
                "the model's full state has {} numbers",
                self.signature.state_len
            ),
        };
        let whole = blocks.contains_key(WHOLE_STATE);
        if whole && blocks.len() > 1 {
            let found = blocks.values().map(BTreeMap::len).sum();
            let expected = format!("either `{WHOLE_STATE}[i]` or qpos, qvel and act");
            return Err(width("states".to_owned(), found, expected));
        }
        let order = if whole {
            &[WHOLE_STATE][..]
        } else {
            &BLOCKS[..]
        };
        for name in order {
            let Some(block) = blocks.get(name) else {
                continue;
            };
            if let Some(missing) = (0..block.len()).find(|index| !block.contains_key(index)) {
                let expected = format!("`{}` among them", component_name(name, missing));
                return Err(width(format!("states `{name}`"), block.len(), expected));
            }
            header
                .state
                .extend((0..block.len()).map(|i| component_name(name, i)));
            header.state_sources.extend(block.values().flatten());
        }
        let found = header.state.len() + usize::from(!whole);
        if found > expected || (whole && found < expected) {
            let expected = format!("{expected}, the time counted");
            return Err(width("states with the time".to_owned(), found, expected));
        }
        header.state_is_full = found == expected;
        header.state_lacks_time = header.state_is_full && !whole;
        if header.state_lacks_time {
            header.state = (0..expected)
                .map(|i| component_name(WHOLE_STATE, i))
                .collect();
        }
        if !header.state_is_full {
            remarks.push(RemarkKind::PartialState { found, expected });
        }
        Ok(())
    }
}

/// The block and the index of a state column: `qpos[3]`.
fn state_column(name: &str) -> Option<(&'static str, usize)> {
    let (block, index) = name.strip_suffix(']')?.split_once('[')?;
    let known = BLOCKS
        .iter()
        .copied()
        .chain([WHOLE_STATE])
        .find(|known| *known == block)?;
    Some((known, index.parse().ok()?))
}

fn missing_actuators(
    path: &Path,
    signature: &Signature,
    is_there: impl Fn(usize) -> bool,
) -> TrialError {
    let named = |wanted: bool| {
        let names = signature.actuators.iter().enumerate();
        let names = names.filter(|(i, _)| is_there(*i) == wanted);
        listed(&names.map(|(_, name)| name).collect::<Vec<_>>())
    };
    TrialError::MissingActuator {
        path: path.to_owned(),
        missing: named(false),
        found: named(true),
        model: signature.describe(),
    }
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
    let mut times: Vec<f64> = Vec::new();
    let mut lines: Vec<u64> = Vec::new();
    let mut record = StringRecord::new();
    while reader
        .read_record(&mut record)
        .map_err(|error| damaged(path, &error))?
    {
        let row = Row {
            path,
            header,
            line: record.position().map_or(0, ::csv::Position::line),
            record: &record,
        };
        let time = row.number(header.time)?.unwrap_or(f64::NAN);
        times.push(time);
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
    super::times::check(path, TIME, &times, |row| Place::Line(lines[row]))?;
    if times.len() < 2 {
        return Err(TrialError::Empty {
            path: path.to_owned(),
            what: "the file".to_owned(),
            found: times.len(),
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
                    place: Place::Line(self.line),
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
                place: Place::Line(self.line),
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
            place: Some(Place::Line(self.line).to_string()),
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

fn damaged(path: &Path, error: &::csv::Error) -> TrialError {
    let line = error.position().map(::csv::Position::line);
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
        place: line.map(|line| Place::Line(line).to_string()),
        reason,
    }
}

/// Writes a trial as text, one row for each time at which anything was sampled; numbers are written so that
/// they are read back to the last bit. The state at the start becomes the first row of the states.
///
/// # Errors
/// Where the file cannot be written, the trial is not whole, or two of its columns would have one name.
pub fn write_csv(path: &Path, trial: &Trial) -> Result<(), TrialError> {
    write::check(path, trial)?;
    let unwritable = |reason: String| TrialError::Unwritable {
        path: path.to_owned(),
        reason,
    };
    let state = states_with_initial(trial).map_err(unwritable)?;
    let mut header = vec![TIME.to_owned()];
    header.extend(trial.control.columns.iter().map(|name| {
        // What a sensor, a state or the time is called too, and a control besides.
        let taken =
            trial.sensors.columns.contains(name) || name == TIME || state_column(name).is_some();
        let suffix = if taken { CONTROL_SUFFIX } else { "" };
        format!("{name}{suffix}")
    }));
    header.extend_from_slice(&trial.sensors.columns);
    header.extend_from_slice(&state.columns);
    let mut sorted = header.clone();
    sorted.sort();
    if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(unwritable(format!("two columns named `{}`", pair[0])));
    }
    let parts = [&trial.control, &trial.sensors, &state];
    let mut times: Vec<f64> = parts.iter().flat_map(|part| part.times.clone()).collect();
    times.sort_by(f64::total_cmp);
    // -0 and 0 are one time.
    times.dedup_by(|one, other| one == other);
    write::whole(path, |file| {
        let mut writer = WriterBuilder::new()
            .terminator(Terminator::Any(b'\n'))
            .from_writer(file);
        writer.write_record(&header)?;
        let mut next = [0; 3];
        for time in times {
            let mut cells = vec![format!("{time:?}")];
            for (part, next) in parts.iter().zip(&mut next) {
                if part.times.get(*next) == Some(&time) {
                    cells.extend(part.row(*next).iter().map(|value| cell(*value)));
                    *next += 1;
                } else {
                    cells.resize(cells.len() + part.width(), String::new());
                }
            }
            writer.write_record(&cells)?;
        }
        writer
            .into_inner()
            .map_err(|error| std::io::Error::other(error.to_string()))?
            .flush()
    })
}

fn cell(value: f64) -> String {
    if value.is_nan() {
        "nan".to_owned()
    } else {
        format!("{value:?}")
    }
}

/// The states with the one at the start in front, where it is not their first already.
fn states_with_initial(trial: &Trial) -> Result<Series, String> {
    let mut state = trial.state.clone().unwrap_or_default();
    let Some(initial) = &trial.initial_state else {
        return Ok(state);
    };
    let columns: Vec<String> = (0..initial.len())
        .map(|i| component_name(WHOLE_STATE, i))
        .collect();
    let Some(time) = initial.first().copied() else {
        return Err("the state at the start is empty".to_owned());
    };
    if state.is_empty() {
        state.columns = columns;
    } else if state.columns != columns {
        return Err("the states have other columns than the state at the start".to_owned());
    } else if state.row(0) == initial {
        return Ok(state);
    }
    if state.times.first().is_some_and(|first| *first <= time) {
        return Err(format!(
            "the state at the start is of {time} s, and not before the first of the states"
        ));
    }
    state.times.insert(0, time);
    state.data.splice(0..0, initial.iter().copied());
    Ok(state)
}
