//! A trial as text.

use std::{io::Write as _, path::Path};

use ::csv::{Terminator, WriterBuilder};

use super::{
    super::{
        Series, Trial, TrialError, series::component_name, signature::CONTROL_SUFFIX, write_whole,
    },
    TIME, WHOLE_STATE, state_column,
};

/// Writes a trial as text, one row for each time at which anything was sampled; numbers are written so that
/// they are read back to the last bit. The state at the start becomes the first row of the states.
///
/// # Errors
/// Where the file cannot be written, the trial is not whole, or two of its columns would have one name.
pub fn write_csv(path: &Path, trial: &Trial) -> Result<(), TrialError> {
    write_whole::check(path, trial)?;
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
    write_whole::whole(path, |file| {
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
