//! The names of the model, and which column of a file means which of them.

use super::{SensorSignature, Signature, TrialError, series::component_name};
use std::path::Path;

/// What `mujoco.sysid` appends to an actuator's name.
pub(super) const CONTROL_SUFFIX: &str = "_ctrl";

/// How many names an error lists before it counts the rest.
const LISTED: usize = 40;

impl SensorSignature {
    /// Names of this sensor's columns: its name for a scalar, `name[i]` for a vector.
    pub fn columns(&self) -> Vec<String> {
        if self.dim == 1 {
            return vec![self.name.clone()];
        }
        (0..self.dim)
            .map(|component| component_name(&self.name, component))
            .collect()
    }
}

impl Signature {
    /// Names of all sensor columns in the model's order, `[nsensordata]`.
    pub fn sensor_columns(&self) -> Vec<String> {
        self.sensors
            .iter()
            .flat_map(SensorSignature::columns)
            .collect()
    }

    /// The actuator that a column means: its name, or that with `_ctrl`.
    pub(super) fn actuator(&self, column: &str) -> Option<usize> {
        let find = |name: &str| self.actuators.iter().position(|actuator| actuator == name);
        find(column).or_else(|| find(column.strip_suffix(CONTROL_SUFFIX)?))
    }

    /// What the model has, as an error says it.
    pub(super) fn describe(&self) -> String {
        let sensors: Vec<String> = self
            .sensors
            .iter()
            .map(|sensor| match sensor.dim {
                1 => sensor.name.clone(),
                dim => format!("{}[0..{dim}]", sensor.name),
            })
            .collect();
        format!(
            "the model has the actuators {} and the sensors {}",
            listed(&self.actuators),
            listed(&sensors)
        )
    }

    /// The refusal of a column or signal that is nothing of the model's.
    pub(super) fn unknown(&self, path: &Path, column: &str) -> TrialError {
        let signal = column.split('[').next().unwrap_or(column);
        let sensors = self.sensors.iter().map(|sensor| &sensor.name);
        let nearest = self
            .actuators
            .iter()
            .chain(sensors)
            .map(|name| (distance(signal, name), name))
            .min()
            // Half of the letters may be wrong; beyond that the two have nothing in common.
            .filter(|(distance, name)| 2 * distance <= name.chars().count().max(2));
        TrialError::UnknownColumn {
            path: path.to_owned(),
            column: column.to_owned(),
            nearest: nearest.map(|(_, name)| name.clone()),
            model: self.describe(),
        }
    }
}

/// "1 row", "2 rows".
pub(super) fn counted(count: impl Into<u64>, thing: &str) -> String {
    let count = count.into();
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {thing}{ending}")
}

/// Names for a message: `a`, `b`, ... or "none".
pub(super) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    let shown: Vec<String> = names
        .iter()
        .take(LISTED)
        .map(|name| format!("`{}`", name.as_ref()))
        .collect();
    let rest = names.len() - shown.len();
    let more = if rest > 0 {
        format!(" and {rest} more")
    } else {
        String::new()
    };
    shown.join(", ") + &more
}

/// Levenshtein distance, blind to case: how many letters to insert, delete or replace.
/// V. I. Levenshtein, Binary codes capable of correcting deletions, insertions and reversals, 1966.
fn distance(one: &str, other: &str) -> usize {
    // A name of thousands of letters resembles nothing, and need not be compared in full.
    let lower = |text: &str| -> Vec<char> { text.to_lowercase().chars().take(128).collect() };
    let (one, other) = (lower(one), lower(other));
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in one.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in other.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[other.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_textbook() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("Gyro", "gyro"), 0);
    }

    #[test]
    fn long_lists_are_counted() {
        assert_eq!(listed::<&str>(&[]), "none");
        assert_eq!(listed(&["a", "b"]), "`a`, `b`");
        assert!(listed(&vec!["x"; 50]).ends_with("and 10 more"));
    }
}
