//! The first line: which column means what.

use std::{collections::BTreeMap, path::Path};

use super::{
    super::{
        Part, RemarkKind, Signature, TrialError, message::listed, series::component_name,
        signature::CONTROL_SUFFIX,
    },
    BLOCKS, TIME, WHOLE_STATE, state_column,
};

/// Which column of the file holds what; `None` where no column does.
pub(super) struct Header {
    pub(super) names: Vec<String>,
    pub(super) time: usize,
    /// A column for each actuator.
    pub(super) control: Vec<usize>,
    /// Names of the sensor columns that the file has, whole vectors, in the model's order.
    pub(super) sensors: Vec<String>,
    /// The column of each of them; absent for a component that the file lacks.
    pub(super) sensor_sources: Vec<Option<usize>>,
    /// Names of the state columns, in order.
    pub(super) state: Vec<String>,
    pub(super) state_sources: Vec<usize>,
    /// The states are the model's full-physics vector but for its time, which is the row's.
    pub(super) state_lacks_time: bool,
    pub(super) state_is_full: bool,
    /// Prescribed joints, in the model's order, and the column of each.
    pub(super) joints: Vec<String>,
    pub(super) joint_sources: Vec<usize>,
}

/// Matches the names of columns with those of the model.
pub(super) struct Resolver<'a> {
    pub(super) path: &'a Path,
    pub(super) signature: &'a Signature,
}

impl Resolver<'_> {
    pub(super) fn resolve(
        &self,
        names: Vec<String>,
        remarks: &mut Vec<RemarkKind>,
    ) -> Result<Header, TrialError> {
        let is_time = |name: &String| name == TIME;
        let time = names.iter().position(is_time);
        let time = time.ok_or_else(|| self.no_time(&names))?;
        let sensor_columns = self.signature.sensor_columns();
        let mut control = vec![None; self.signature.actuators.len()];
        let mut sensors = vec![None; sensor_columns.len()];
        let mut joints = vec![None; self.signature.joints.len()];
        let mut state = BTreeMap::new();
        let mut aside = Vec::new();
        for (column, name) in names.iter().enumerate() {
            let sensor = sensor_columns.iter().position(|sensor| sensor == name);
            let sensor = sensor.or_else(|| self.lone_component(name, &sensor_columns));
            let namesake = self.signature.actuators.contains(name);
            if name == TIME {
                if column != time {
                    return Err(self.twice(TIME, name, name));
                }
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
            } else if let Some(joint) = self.signature.joint(name) {
                let meant = &self.signature.joints[joint];
                self.claim(&mut joints[joint], column, meant, &names)?;
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
        let prescribed = self.signature.joints.iter().zip(&joints);
        let prescribed = prescribed.filter(|(_, column)| column.is_some());
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
            joints: prescribed.clone().map(|(name, _)| name.clone()).collect(),
            joint_sources: prescribed.filter_map(|(_, column)| *column).collect(),
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
            Some(first) => Err(self.twice(meant, &names[first], &names[column])),
        }
    }

    fn twice(&self, meant: &str, first: &str, second: &str) -> TrialError {
        TrialError::Twice {
            path: self.path.to_owned(),
            column: meant.to_owned(),
            first: first.to_owned(),
            second: second.to_owned(),
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
            "; a table of steady states has none, but a column `JOINT` or `JOINT_vel` of a joint of the model"
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

pub(super) fn missing_actuators(
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
