//! The archive of `mujoco.sysid`'s `SystemTrajectory.save_to_disk`, read and written.
//!
//! Arrays: `control_times` `[N]`, `control_data` `[N, nu]`, `sensordata_times` `[M]`, `sensordata_data`
//! `[M, nsensordata]`, `initial_state` `[nstate]`, and, where they are known, `state_times` `[K]` and `state_data`
//! `[K, nstate]`. A `*_signal_mapping` is a JSON text `{name: [signal type, [columns]]}`; without one the columns
//! are the model's own, in order. The mapping of states is not needed: their columns are always the model's
//! (and that mapping counts without the leading time).

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{Seek, Write},
    path::Path,
};

use hydro_files::Array;
use npyz::{DType, WriteOptions, WriterBuilder as _, npz::file_name_from_array_name};
use serde_json::json;
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

use super::{
    Part, RemarkKind, Series, Signature, Trial, TrialError,
    message::listed,
    npz_arrays::Archive,
    series::component_name,
    signature::CONTROL_SUFFIX,
    tables::{Parts, Table},
    write_whole,
};

/// `SignalType.MjSensor` of `mujoco.sysid`.
const SENSOR_SIGNAL: i64 = 0;
/// `SignalType.MjCtrl` of `mujoco.sysid`.
const CONTROL_SIGNAL: i64 = 5;

/// Signal types and columns by the name of the signal.
type Mapping = BTreeMap<String, (i64, Vec<usize>)>;

pub(super) fn read(path: &Path, signature: &Signature) -> Result<Parts, TrialError> {
    let mut reader = Reader {
        path,
        signature,
        archive: Archive::open(path)?,
        remarks: Vec::new(),
    };
    let control = reader.control()?;
    let (sensors, prescribed) = reader.sensors()?;
    let initial_state = reader.initial_state()?;
    let state = reader.state()?;
    reader.set_aside_unknown_arrays();
    Ok(Parts {
        control,
        sensors,
        initial_state,
        state,
        prescribed,
        remarks: reader.remarks,
    })
}

struct Reader<'a> {
    path: &'a Path,
    signature: &'a Signature,
    archive: Archive,
    remarks: Vec<RemarkKind>,
}

/// Rows against time, columns as they stand in the file.
struct Block {
    times: Vec<f64>,
    /// `[rows, width]`
    data: Vec<f64>,
    width: usize,
}

/// Which columns of a file are sensors.
struct SensorColumns {
    /// Their names, in the model's order.
    columns: Vec<String>,
    /// Where they stand in the file.
    sources: Vec<usize>,
    /// Columns of signals that are no sensors.
    aside: Vec<usize>,
    /// Prescribed joints, and where they stand.
    joints: Vec<(String, usize)>,
}

impl Reader<'_> {
    fn control(&mut self) -> Result<Table, TrialError> {
        let block = self.block("control")?;
        let actuators = &self.signature.actuators;
        let sources = match self.mapping("control", block.width)? {
            Some(mapping) => self.map_controls(&mapping)?,
            None => {
                self.check_width("control_data", block.width, actuators.len())?;
                (0..actuators.len()).collect()
            }
        };
        self.note_columns(Part::Control, "control_data", block.width, &sources, &[]);
        Ok(block.table("control_times", actuators.clone(), &sources))
    }

    /// Columns of the actuators, in the model's order.
    fn map_controls(&self, mapping: &Mapping) -> Result<Vec<usize>, TrialError> {
        let actuators = &self.signature.actuators;
        let position = |name: &str| actuators.iter().position(|actuator| actuator == name);
        let mut columns: Vec<Option<(&str, usize)>> = vec![None; actuators.len()];
        for (name, (_, indices)) in mapping {
            let actuator = name
                .strip_suffix(CONTROL_SUFFIX)
                .and_then(position)
                .or_else(|| position(name))
                .ok_or_else(|| self.signature.unknown(self.path, name))?;
            let [index] = indices.as_slice() else {
                return Err(self.width(
                    &format!("control `{name}`"),
                    indices.len(),
                    "1".to_owned(),
                ));
            };
            if let Some((first, _)) = columns[actuator] {
                return Err(TrialError::Twice {
                    path: self.path.to_owned(),
                    column: actuators[actuator].clone(),
                    first: first.to_owned(),
                    second: name.clone(),
                });
            }
            columns[actuator] = Some((name, *index));
        }
        let named = |present: bool| {
            let pairs = actuators.iter().zip(&columns);
            let names = pairs.filter(move |(_, column)| column.is_some() == present);
            listed(&names.map(|(name, _)| name).collect::<Vec<_>>())
        };
        let sources: Option<Vec<usize>> = columns.iter().map(|column| Some((*column)?.1)).collect();
        sources.ok_or_else(|| TrialError::MissingActuator {
            path: self.path.to_owned(),
            missing: named(false),
            found: named(true),
            model: self.signature.describe(),
        })
    }

    /// Sensors, and the prescribed joints that stand among them.
    fn sensors(&mut self) -> Result<(Table, Option<Table>), TrialError> {
        let block = self.block("sensordata")?;
        let SensorColumns {
            columns,
            sources,
            aside,
            joints,
        } = match self.mapping("sensordata", block.width)? {
            Some(mapping) => self.map_sensors(mapping)?,
            None => {
                let columns = self.signature.sensor_columns();
                self.check_width("sensordata_data", block.width, columns.len())?;
                SensorColumns {
                    sources: (0..columns.len()).collect(),
                    columns,
                    aside: Vec::new(),
                    joints: Vec::new(),
                }
            }
        };
        let (joints, places): (Vec<String>, Vec<usize>) = joints.into_iter().unzip();
        self.note_columns(
            Part::Sensors,
            "sensordata_data",
            block.width,
            &sources,
            &[aside, places.clone()].concat(),
        );
        let prescribed =
            (!joints.is_empty()).then(|| block.table("sensordata_times", joints, &places));
        Ok((
            block.table("sensordata_times", columns, &sources),
            prescribed,
        ))
    }

    fn map_sensors(&mut self, mut mapping: Mapping) -> Result<SensorColumns, TrialError> {
        let (mut columns, mut sources) = (Vec::new(), Vec::new());
        for sensor in &self.signature.sensors {
            if let Some((_, indices)) = mapping.remove(&sensor.name) {
                if indices.len() != sensor.dim {
                    let what = format!("sensor `{}`", sensor.name);
                    return Err(self.width(&what, indices.len(), sensor.dim.to_string()));
                }
                columns.extend(sensor.columns());
                sources.extend(indices);
            }
        }
        let mut joints = Vec::new();
        for joint in &self.signature.joints {
            let is_meant = |name: &&String| {
                self.signature
                    .joint(name)
                    .map(|at| &self.signature.joints[at])
                    == Some(joint)
            };
            let signal = mapping
                .iter()
                .find(|(name, (kind, _))| *kind == SENSOR_SIGNAL && is_meant(name));
            let Some(name) = signal.map(|(name, _)| name.clone()) else {
                continue;
            };
            if let Some((_, indices)) = mapping.remove(&name) {
                let [index] = indices.as_slice() else {
                    let what = format!("joint `{joint}`");
                    return Err(self.width(&what, indices.len(), "1".to_owned()));
                };
                joints.push((joint.clone(), *index));
            }
        }
        // Positions, velocities and own observations may stand among the sensors of that library.
        if let Some((name, _)) = mapping.iter().find(|(_, (kind, _))| *kind == SENSOR_SIGNAL) {
            return Err(self.signature.unknown(self.path, name));
        }
        let aside = mapping.values().flat_map(|(_, indices)| indices.clone());
        let aside = aside.collect();
        if !mapping.is_empty() {
            let names = mapping.into_keys().collect();
            self.remarks.push(RemarkKind::SetAside { names });
        }
        Ok(SensorColumns {
            columns,
            sources,
            aside,
            joints,
        })
    }

    fn initial_state(&mut self) -> Result<Option<Vec<f64>>, TrialError> {
        let Some(array) = self.archive.numbers("initial_state")? else {
            return Ok(None);
        };
        let expected = self.signature.state_len;
        match array.shape.as_slice() {
            [0] => Ok(None),
            [_] if array.values.len() == expected => Ok(Some(array.values)),
            _ => {
                let expected = format!("[{expected}], the model's full-physics state");
                Err(self.shape("initial_state", array.shape, expected))
            }
        }
    }

    fn state(&mut self) -> Result<Option<Table>, TrialError> {
        let present = ["state_times", "state_data"]
            .map(|array| self.archive.names().iter().any(|name| name == array));
        if present == [false, false] {
            return Ok(None);
        }
        let block = self.block("state")?;
        let expected = self.signature.state_len;
        self.check_width("state_data", block.width, expected)?;
        let columns = (0..expected).map(|i| component_name("state", i)).collect();
        let sources: Vec<usize> = (0..expected).collect();
        Ok(Some(block.table("state_times", columns, &sources)))
    }

    /// `{part}_times` and `{part}_data`, of equal length.
    fn block(&mut self, part: &str) -> Result<Block, TrialError> {
        let (times_name, data_name) = (format!("{part}_times"), format!("{part}_data"));
        let times = self.archive.required(&times_name)?;
        if times.shape.len() != 1 {
            return Err(self.shape(&times_name, times.shape, "[rows]".to_owned()));
        }
        let data = self.archive.required(&data_name)?;
        let Array { shape, values } = data;
        let rows = times.values.len();
        let width = match shape.as_slice() {
            [found] if *found == rows as u64 => 1,
            [found, width] if *found == rows as u64 => *width as usize,
            _ => {
                let expected = format!("[{rows}, columns], a row for each of `{times_name}`");
                return Err(self.shape(&data_name, shape, expected));
            }
        };
        Ok(Block {
            times: times.values,
            data: values,
            width,
        })
    }

    /// The signal mapping of a part, its columns within `width` and none of them used twice.
    fn mapping(&mut self, part: &str, width: usize) -> Result<Option<Mapping>, TrialError> {
        let array = format!("{part}_signal_mapping");
        let Some(text) = self.archive.text(&array)? else {
            return Ok(None);
        };
        let refused = |reason: String| TrialError::Mapping {
            path: self.path.to_owned(),
            array: array.clone(),
            reason,
        };
        let mapping: Mapping = serde_json::from_str(&text).map_err(|error| {
            refused(format!(
                "not a JSON text {{name: [signal type, [columns]]}} ({error})"
            ))
        })?;
        let mut used = BTreeSet::new();
        for (name, (_, indices)) in &mapping {
            for index in indices {
                if *index >= width {
                    return Err(refused(format!(
                        "`{name}` is column {index}, but `{part}_data` has {width} columns (from 0)"
                    )));
                }
                if !used.insert(*index) {
                    return Err(refused(format!(
                        "column {index} is named twice, once by `{name}`"
                    )));
                }
            }
        }
        Ok(Some(mapping))
    }

    /// Notes columns in another order and columns of no signal. `aside`: columns set aside by name.
    fn note_columns(
        &mut self,
        part: Part,
        array: &str,
        width: usize,
        sources: &[usize],
        aside: &[usize],
    ) {
        if !sources.is_sorted() {
            self.remarks.push(RemarkKind::Reordered { part });
        }
        let said: BTreeSet<usize> = sources.iter().chain(aside).copied().collect();
        if said.len() < width {
            let unnamed = (0..width).filter(|column| !said.contains(column));
            let names = unnamed
                .map(|column| component_name(array, column))
                .collect();
            self.remarks.push(RemarkKind::SetAside { names });
        }
    }

    fn set_aside_unknown_arrays(&mut self) {
        let mut names = self.archive.names();
        names.retain(|name| {
            let suffixes = ["times", "data", "signal_mapping"];
            let known = ["control", "sensordata", "state"].iter().any(|part| {
                let rest = name
                    .strip_prefix(part)
                    .and_then(|rest| rest.strip_prefix('_'));
                rest.is_some_and(|rest| suffixes.contains(&rest))
            });
            !known && name != "initial_state"
        });
        if !names.is_empty() {
            self.remarks.push(RemarkKind::SetAside { names });
        }
    }

    fn check_width(&self, what: &str, found: usize, expected: usize) -> Result<(), TrialError> {
        if found == expected {
            return Ok(());
        }
        let what = format!("array `{what}`");
        let expected = format!("{expected}, the model's, where no signal mapping names them");
        Err(self.width(&what, found, expected))
    }

    fn width(&self, what: &str, found: usize, expected: String) -> TrialError {
        TrialError::Width {
            path: self.path.to_owned(),
            what: what.to_owned(),
            found,
            expected,
            model: self.signature.describe(),
        }
    }

    fn shape(&self, array: &str, found: Vec<u64>, expected: String) -> TrialError {
        TrialError::Shape {
            path: self.path.to_owned(),
            array: array.to_owned(),
            found,
            expected,
        }
    }
}

impl Block {
    /// Its columns `sources` under the names `columns`.
    fn table(&self, time_name: &'static str, columns: Vec<String>, sources: &[usize]) -> Table {
        let in_place = sources.len() == self.width && sources.iter().copied().eq(0..self.width);
        let data = if in_place {
            self.data.clone()
        } else {
            let rows = 0..self.times.len();
            let places = rows.flat_map(|row| sources.iter().map(move |column| (row, column)));
            places
                .map(|(row, column)| self.data[row * self.width + column])
                .collect()
        };
        Table {
            series: Series {
                times: self.times.clone(),
                columns,
                data,
            },
            time_name,
            lines: None,
        }
    }
}

/// Writes the archive that `SystemTrajectory.load_from_disk` reads, uncompressed as that library writes it. The same trial
/// gives the same bytes. That library requires an `initial_state` and every sensor of the model; a trial without them is
/// written without them, and [`read`](super::read()) accepts it.
///
/// # Errors
/// Where the file cannot be written, or the trial is not whole.
pub fn write_npz(path: &Path, trial: &Trial) -> Result<(), TrialError> {
    write_whole::check(path, trial)?;
    write_whole::whole(path, |file| {
        let mut npz = ZipWriter::new(file);
        let control = trial.control.columns.iter().enumerate();
        let control = control.map(|(column, name)| {
            (
                format!("{name}{CONTROL_SUFFIX}"),
                json!([CONTROL_SIGNAL, [column]]),
            )
        });
        let control = serde_json::Value::Object(control.collect());
        block(&mut npz, "control", &trial.control)?;
        text(&mut npz, "control_signal_mapping", &control.to_string())?;
        block(&mut npz, "sensordata", &trial.sensors)?;
        let sensors = sensor_mapping(&trial.sensors.columns);
        text(&mut npz, "sensordata_signal_mapping", &sensors.to_string())?;
        if let Some(state) = &trial.initial_state {
            array(&mut npz, "initial_state", &[state.len()], state)?;
        }
        if let Some(state) = &trial.state {
            block(&mut npz, "state", state)?;
        }
        let mut file = npz.finish()?;
        file.flush()
    })
}

/// The mapping of sensor columns: `a[0]`, `a[1]`, ... side by side are the vector `a`.
fn sensor_mapping(columns: &[String]) -> serde_json::Value {
    let mut mapping = serde_json::Map::new();
    let mut start = 0;
    while start < columns.len() {
        let signal = columns[start].strip_suffix("[0]");
        let components = signal.map_or(0, |signal| {
            let mut names = columns[start..].iter().enumerate();
            names
                .position(|(i, column)| *column != component_name(signal, i))
                .unwrap_or(columns.len() - start)
        });
        let (name, width) = match signal {
            Some(signal) if components > 1 => (signal, components),
            _ => (columns[start].as_str(), 1),
        };
        let indices: Vec<usize> = (start..start + width).collect();
        mapping.insert(name.to_owned(), json!([SENSOR_SIGNAL, indices]));
        start += width;
    }
    serde_json::Value::Object(mapping)
}

fn block<W: Write + Seek>(
    npz: &mut ZipWriter<W>,
    part: &str,
    series: &Series,
) -> std::io::Result<()> {
    let (rows, width) = (series.len(), series.width());
    array(npz, &format!("{part}_times"), &[rows], &series.times)?;
    array(npz, &format!("{part}_data"), &[rows, width], &series.data)
}

fn array<W: Write + Seek>(
    npz: &mut ZipWriter<W>,
    name: &str,
    shape: &[usize],
    values: &[f64],
) -> std::io::Result<()> {
    let shape: Vec<u64> = shape.iter().map(|size| *size as u64).collect();
    npz.start_file(file_name_from_array_name(name), options())?;
    let writer = WriteOptions::<f64>::new().default_dtype();
    let mut writer = writer.shape(&shape).writer(npz).begin_nd()?;
    writer.extend(values.iter().copied())?;
    writer.finish()
}

/// A NumPy string: an array without dimensions.
fn text<W: Write + Seek>(npz: &mut ZipWriter<W>, name: &str, text: &str) -> std::io::Result<()> {
    let dtype = format!("<U{}", text.chars().count().max(1));
    let dtype = dtype.parse().map_err(std::io::Error::other)?;
    npz.start_file(file_name_from_array_name(name), options())?;
    let writer = WriteOptions::<str>::new().dtype(DType::new_scalar(dtype));
    let mut writer = writer.shape(&[]).writer(npz).begin_nd()?;
    writer.push(text)?;
    writer.finish()
}

/// Stored, and undated so that the same trial gives the same bytes.
fn options() -> SimpleFileOptions {
    SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .large_file(true)
}
