//! Locate (the stage `find`): where and when the nominal fails.
//!
//! Short segments of a trial are predicted from the ones before, the nominal's uncertain numbers fitted to all trials;
//! squared innovations over their covariance are added up by window and sensor. Without a gap each sum is chi-square
//! distributed; the number of windows looked at is paid for (Bonferroni). Structure too weak for any one window is judged
//! over all of them.

use std::collections::BTreeMap;

use crate::{
    error::GapError,
    likelihood::truncated_normal::cdf,
    likelihood::{
        followed::{Followed, diverges},
        innovations::Innovation,
    },
    output::{
        records::{Found, HeatMap},
        verdict::Place,
    },
    problem::problem::Problem,
    progress::Watch,
    stage::regime_tree,
};

/// Schema of [`Found`].
const SCHEMA: &str = "hydro-gap-find/1";
/// Places told at most.
const PLACES: usize = 20;

/// One window of one sensor.
struct Cell {
    trial: usize,
    source: usize,
    start: f64,
    end: f64,
    /// Sum of squared innovations over their covariance, and of readings.
    sum: f64,
    count: usize,
}

/// Probability of a chi-square variable of `count` degrees of freedom above `sum` (the cube root of E. B. Wilson and M. M.
/// Hilferty, Proc. Natl. Acad. Sci. 17, 1931).
fn above(sum: f64, count: usize) -> f64 {
    let n = count.max(1) as f64;
    let spread = (2.0 / (9.0 * n)).sqrt();
    cdf(-((sum / n).cbrt() - (1.0 - 2.0 / (9.0 * n))) / spread)
}

/// Says where the nominal fails.
///
/// # Errors
/// The nominal diverges, or a stop was asked for.
pub fn locate(
    followed: &Followed<'_>,
    held_out: &[String],
    watch: &Watch<'_>,
) -> Result<Found, GapError> {
    let problem = followed.problem;
    let options = &problem.settings.options.locate;
    let innovations = followed
        .working_point(watch)
        .innovations()?
        .ok_or_else(|| diverges(problem))?;
    let cells = cells(problem, &innovations);
    let looked = cells.len().max(1) as f64;
    let p_value = |cell: &Cell| (looked * above(cell.sum, cell.count)).min(1.0);
    let excess = |cell: &Cell| (cell.sum - cell.count as f64).max(0.0);
    let total: f64 = cells.iter().map(excess).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut by_sensor: BTreeMap<String, f64> = BTreeMap::new();
    for cell in &cells {
        *by_sensor.entry(sensor(problem, cell)).or_insert(0.0) += excess(cell) / total;
    }
    let mut places: Vec<Place> = cells
        .iter()
        .map(|cell| Place {
            trial: problem.trials[cell.trial].name.clone(),
            sensor: sensor(problem, cell),
            t_start: cell.start,
            t_end: cell.end,
            share: excess(cell) / total,
            p_value: p_value(cell),
        })
        .filter(|place| place.p_value <= options.level)
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.truncate(PLACES);
    let sum: f64 = cells.iter().map(|cell| cell.sum).sum();
    let count: usize = cells.iter().map(|cell| cell.count).sum();
    // Two looks: at single windows, and at what adds up over all of them.
    let largest = cells.iter().map(p_value).fold(1.0, f64::min);
    let overall = (2.0 * largest.min(above(sum, count))).min(1.0);
    // Shares of an excess that shows in no window are shares of noise.
    let regime = if overall <= options.level && !places.is_empty() {
        regime_tree::rules(problem, &innovations)
    } else {
        Vec::new()
    };
    Ok(Found {
        schema: SCHEMA.to_owned(),
        fit_trials: problem
            .trials
            .iter()
            .map(|trial| trial.name.clone())
            .collect(),
        held_out_trials: held_out.to_vec(),
        channels: problem.channels.list.clone(),
        medium: problem.medium(),
        segment: problem.settings.options.segments.length,
        excess: sum / count.max(1) as f64,
        p_value: overall,
        by_sensor,
        places,
        regime,
        heat_maps: heat_maps(problem, &cells),
        remarks: problem.remarks.clone(),
    })
}

fn sensor(problem: &Problem<'_>, cell: &Cell) -> String {
    let source = &problem.channels.sources[cell.source];
    problem.plant.description().sensors[source.sensor]
        .name
        .clone()
}

/// Windows of every trial, from where a prediction starts anew to where the next one does, in equal parts.
fn cells(problem: &Problem<'_>, innovations: &[Vec<Innovation>]) -> Vec<Cell> {
    let windows = problem.settings.options.locate.windows;
    let mut cells = Vec::new();
    for (trial, innovations) in innovations.iter().enumerate() {
        let times = &problem.trials[trial].times;
        let mut firsts: Vec<usize> = (0..innovations.len())
            .filter(|at| innovations[*at].first)
            .collect();
        firsts.push(innovations.len());
        for pair in firsts.windows(2) {
            let count = pair[1] - pair[0];
            for window in 0..windows {
                let part = |at: usize| pair[0] + at * count / windows;
                let segments = &innovations[part(window)..part(window + 1)];
                let (Some(first), Some(last)) = (segments.first(), segments.last()) else {
                    continue;
                };
                for source in 0..problem.channels.sources.len() {
                    let of = segments.iter().map(|segment| segment.sources[source]);
                    let (sum, count) = of.fold((0.0, 0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
                    if count > 0 {
                        cells.push(Cell {
                            trial,
                            source,
                            start: times[first.rows.start],
                            end: times[last.rows.end - 1],
                            sum,
                            count,
                        });
                    }
                }
            }
        }
    }
    cells
}

fn heat_maps(problem: &Problem<'_>, cells: &[Cell]) -> Vec<HeatMap> {
    problem
        .trials
        .iter()
        .enumerate()
        .filter_map(|(trial, of)| {
            let mine: Vec<&Cell> = cells.iter().filter(|cell| cell.trial == trial).collect();
            let mut starts: Vec<(f64, f64)> =
                mine.iter().map(|cell| (cell.start, cell.end)).collect();
            starts.sort_by(|a, b| a.0.total_cmp(&b.0));
            starts.dedup();
            let last = starts.last()?.1;
            let mut edges: Vec<f64> = starts.iter().map(|(start, _)| *start).collect();
            edges.push(last);
            let mut sensors: BTreeMap<String, Vec<Option<f64>>> = BTreeMap::new();
            for cell in mine {
                let row = sensors
                    .entry(sensor(problem, cell))
                    .or_insert_with(|| vec![None; starts.len()]);
                if let Some(at) = starts.iter().position(|(start, _)| *start == cell.start) {
                    row[at] = Some(cell.sum / cell.count as f64);
                }
            }
            Some(HeatMap {
                trial: of.name.clone(),
                edges,
                sensors,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::above;

    /// Tabulated quantiles of the chi-square distribution.
    #[test]
    fn probabilities_are_those_of_chi_square() {
        for (sum, count, expected) in [
            (18.307, 10, 0.05),
            (23.209, 10, 0.01),
            (124.342, 100, 0.05),
            (149.449, 100, 0.001),
            (9.342, 10, 0.5),
        ] {
            let found = above(sum, count);
            assert!((found / expected - 1.0).abs() < 0.05, "{sum} {found}");
        }
    }
}
