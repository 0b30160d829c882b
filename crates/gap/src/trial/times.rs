//! Checks of times: order, evenness, gaps, rates.

use std::path::Path;

use super::{Part, RemarkKind, RowPlace, Series, TrialError, series::median, tables::Table};

/// Share of the median step by which another may differ and still be called even, as in `mujoco.sysid`.
const EVEN: f64 = 0.01;
/// A step longer than this many median steps is a gap.
const GAP: f64 = 1.5;
/// Steps of the model that no log lasts: a week of milliseconds.
const MOST_STEPS: f64 = 6e8;
/// Steps of the model that a log of seconds lasts only where its rows are close together ...
const MANY_STEPS: f64 = 1e6;
/// ... that is nearer than this many steps.
const FAR_APART: f64 = 200.0;

/// The same of a shorter log ...
const SOME_STEPS: f64 = 1e5;
/// ... whose rows are further apart than this many steps: 3 s for a step of 2 ms.
const VERY_FAR_APART: f64 = 1500.0;

/// Rows within a step of the model that no log has.
const MOST_ROWS_A_STEP: f64 = 200.0;

/// Refuses times that are not finite or do not increase from row to row.
pub(super) fn check(
    path: &Path,
    name: &str,
    times: &[f64],
    place: impl Fn(usize) -> RowPlace,
) -> Result<(), TrialError> {
    for (row, time) in times.iter().enumerate() {
        if !time.is_finite() {
            return Err(TrialError::NotFinite {
                path: path.to_owned(),
                place: place(row),
                column: name.to_owned(),
                found: *time,
                hint: "",
            });
        }
        if row > 0 && *time <= times[row - 1] {
            return Err(TrialError::TimeOrder {
                path: path.to_owned(),
                place: place(row),
                column: name.to_owned(),
                before: times[row - 1],
                found: *time,
            });
        }
    }
    Ok(())
}

/// Refuses times that only another unit than seconds, or a damaged file, explains.
pub(super) fn check_length(path: &Path, table: &Table, timestep: f64) -> Result<(), TrialError> {
    let times = &table.series.times;
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return Ok(());
    };
    let seconds = last - first;
    let period = table.series.period().unwrap_or(0.0);
    let (steps, between) = (seconds / timestep, period / timestep);
    // Comparisons that a NaN or infinity fails.
    if times.len() > 2 && between < 1.0 / MOST_ROWS_A_STEP {
        return Err(TrialError::TooDense {
            path: path.to_owned(),
            place: table.place(1),
            column: table.time_name.to_owned(),
            period,
            share: between.recip(),
            timestep,
        });
    }
    let plausible = steps <= MOST_STEPS
        && !(steps > MANY_STEPS && between > FAR_APART)
        && !(steps > SOME_STEPS && between > VERY_FAR_APART);
    if plausible {
        return Ok(());
    }
    let row = times.len() - 1;
    Err(TrialError::TooLong {
        path: path.to_owned(),
        place: table.place(row),
        column: table.time_name.to_owned(),
        seconds,
        period,
        steps,
        timestep,
    })
}

/// Notes uneven steps and missing rows.
pub(super) fn note(part: Part, times: &[f64], remarks: &mut Vec<RemarkKind>) {
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(median) = median(steps.clone()) else {
        return;
    };
    let is_gap = |step: f64| step > GAP * median;
    // Rounding of the times themselves: those since 1970 resolve a quarter of a microsecond.
    let resolution = 4.0
        * f64::EPSILON
        * times
            .iter()
            .fold(0.0, |largest: f64, t| largest.max(t.abs()));
    let even = |step: f64| (step - median).abs() <= EVEN * median + resolution;
    let uneven = || {
        steps
            .iter()
            .copied()
            .filter(|step| !is_gap(*step) && !even(*step))
    };
    if uneven().count() > 0 {
        remarks.push(RemarkKind::UnevenTimes {
            part,
            steps: uneven().count(),
            of: steps.len(),
            median,
            shortest: uneven().fold(median, f64::min),
            longest: uneven().fold(median, f64::max),
        });
    }
    let gaps = || {
        steps
            .iter()
            .copied()
            .enumerate()
            .filter(|(_, step)| is_gap(*step))
    };
    if let Some((row, longest)) = gaps().max_by(|one, other| one.1.total_cmp(&other.1)) {
        let rows = gaps().map(|(_, step)| ((step / median).round() as u64).saturating_sub(1));
        remarks.push(RemarkKind::MissingRows {
            part,
            gaps: gaps().count(),
            rows: rows.fold(0, u64::saturating_add),
            longest_at: times[row],
            longest,
        });
    }
}

/// Notes different rates of controls and sensors.
pub(super) fn note_rates(control: &Series, sensors: &Series, remarks: &mut Vec<RemarkKind>) {
    if let (Some(control_period), Some(sensor_period)) = (control.period(), sensors.period())
        && (control_period - sensor_period).abs() > EVEN * control_period.max(sensor_period)
    {
        remarks.push(RemarkKind::DifferentRates {
            control_period,
            sensor_period,
        });
    }
}

/// Notes sensor rows outside the controls: a row labelled `t` is of `t - timestep`, and the last control holds for one more
/// period.
pub(super) fn note_range(
    control: &[f64],
    sensors: &[f64],
    timestep: f64,
    remarks: &mut Vec<RemarkKind>,
) {
    let (Some(first), Some(last)) = (control.first(), control.last()) else {
        return;
    };
    let steps = control.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // Half a step more, for times that are rounded.
    let hold = median(steps).unwrap_or(0.0) + 1.5 * timestep;
    let beyond = |time: f64| (first - 0.5 * timestep - time).max(time - last - hold);
    let outside = || {
        sensors
            .iter()
            .map(|time| beyond(*time))
            .filter(|far| *far > 0.0)
    };
    // A run with one row of controls is one with a constant control, which is said elsewhere.
    if control.len() > 1 && outside().count() > 0 {
        remarks.push(RemarkKind::OutsideControls {
            rows: outside().count(),
            of: sensors.len(),
            furthest: outside().fold(0.0, f64::max),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noted(times: &[f64]) -> Vec<RemarkKind> {
        let mut remarks = Vec::new();
        note(Part::Sensors, times, &mut remarks);
        remarks
    }

    #[test]
    fn even_times_are_not_worth_a_word() {
        assert!(noted(&[]).is_empty());
        assert!(noted(&[1.0]).is_empty());
        let since_1970: Vec<f64> = (0..50).map(|k| 1.7e9 + 0.002 * f64::from(k)).collect();
        assert!(noted(&since_1970).is_empty());
    }

    #[test]
    fn jitter_and_gaps_are_counted_apart() {
        let times = [0.0, 1.0, 2.1, 3.0, 4.0, 5.0, 9.0, 10.0, 12.0, 13.0];
        let remarks = noted(&times);
        let expected = [
            RemarkKind::UnevenTimes {
                part: Part::Sensors,
                steps: 2,
                of: 9,
                median: 1.0,
                shortest: 3.0 - 2.1,
                longest: 2.1 - 1.0,
            },
            RemarkKind::MissingRows {
                part: Part::Sensors,
                gaps: 2,
                rows: 4,
                longest_at: 5.0,
                longest: 4.0,
            },
        ];
        // 3.0 - 2.1 is 0.8999...: compared with what was put in.
        assert_eq!(remarks.len(), 2);
        assert_eq!(remarks, expected);
    }

    #[test]
    fn sensors_of_a_rollout_lie_within_its_controls() {
        let mut remarks = Vec::new();
        let control: Vec<f64> = (0..100).map(|k| 0.002 * f64::from(k)).collect();
        let sensors: Vec<f64> = (1..101).map(|k| 0.002 * f64::from(k)).collect();
        note_range(&control, &sensors, 0.002, &mut remarks);
        assert!(remarks.is_empty());
        note_range(&control[..50], &sensors, 0.002, &mut remarks);
        assert!(matches!(
            remarks.as_slice(),
            [RemarkKind::OutsideControls { of: 100, .. }]
        ));
    }
}
