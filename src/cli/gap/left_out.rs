//! What a run does not compare, said on the terminal: in the report alone it would pass unseen beside a verdict of no gap.

use std::collections::BTreeSet;

use hydro_gap::trial::RemarkKind;

/// Names that are told.
const TOLD: usize = 6;

/// Signals of the model that a log lacks, and of the logs that the model does not have.
#[derive(Debug, Default)]
pub(super) struct LeftOut {
    of_model: BTreeSet<String>,
    of_logs: BTreeSet<String>,
}

impl LeftOut {
    /// Takes note of a remark on a trial.
    pub(super) fn note(&mut self, remark: &RemarkKind) {
        match remark {
            RemarkKind::MissingSensor { sensor } => {
                self.of_model.insert(sensor.clone());
            }
            RemarkKind::MissingComponents { columns, .. } => {
                self.of_model.extend(columns.iter().cloned());
            }
            RemarkKind::SetAside { names } => self.of_logs.extend(names.iter().cloned()),
            _ => {}
        }
    }

    /// A line for each of the two, where there is something.
    pub(super) fn lines(&self) -> Vec<String> {
        let told = [
            ("not compared, for a log lacks them", &self.of_model),
            (
                "left out of the logs, for they are no signal of the model",
                &self.of_logs,
            ),
        ];
        told.into_iter()
            .filter(|(_, names)| !names.is_empty())
            .map(|(what, names)| format!("{what}: {}", few(names)))
            .collect()
    }
}

/// The first names, and how many more there are.
fn few(names: &BTreeSet<String>) -> String {
    let told: Vec<String> = names
        .iter()
        .take(TOLD)
        .map(|name| format!("`{}`", name.escape_debug()))
        .collect();
    match names.len().saturating_sub(TOLD) {
        0 => told.join(", "),
        more => format!("{} and {more} more", told.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_compared_is_said() {
        let mut left = LeftOut::default();
        left.note(&RemarkKind::MissingStates);
        assert_eq!(left.lines(), Vec::<String>::new());
        left.note(&RemarkKind::MissingSensor {
            sensor: "gyro".to_owned(),
        });
        left.note(&RemarkKind::SetAside {
            names: vec!["gyr.x".to_owned(), "a\nb".to_owned()],
        });
        assert_eq!(
            left.lines(),
            [
                "not compared, for a log lacks them: `gyro`",
                "left out of the logs, for they are no signal of the model: `a\\nb`, `gyr.x`"
            ]
        );
    }

    #[test]
    fn ten_thousand_sensors_are_one_line() {
        let mut left = LeftOut::default();
        for sensor in 0..10_000 {
            left.note(&RemarkKind::MissingSensor {
                sensor: format!("s{sensor:05}"),
            });
        }
        let lines = left.lines();
        assert_eq!(lines.len(), 1);
        assert!(lines[0].ends_with("`s00005` and 9994 more"), "{lines:?}");
    }
}
