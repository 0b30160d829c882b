//! Locate (the stage `find`): where and when the nominal fails.
//!
//! The nominal is fitted to every segment within its own uncertainty (nuisance parameters and starts); what stays is
//! whitened and added up by window and sensor. The largest window is judged against windows of simulated
//! noise (maxT), so that the number of windows looked at is paid for. Structure too weak for any one window
//! is judged over all of them (`adequacy`).

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{
    discrepancy::adequacy,
    error::GapError,
    fit::{hypothesis::Fit, linearized_problem::LinearizedProblem},
    output::{
        records::{Found, HeatMap},
        verdict::Place,
    },
    problem::problem::Problem,
    progress::Watch,
    stage::regime_tree,
    statistics::standard_normal,
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
    /// Sum of squared whitened residuals, and how many.
    sum: f64,
    count: usize,
}

impl Cell {
    /// Excess of the sum over noise in standard deviations (Wilson and Hilferty's cube root, which makes
    /// windows of different length comparable).
    fn deviation(&self) -> f64 {
        deviation(self.sum, self.count)
    }
}

fn deviation(sum: f64, count: usize) -> f64 {
    let n = count.max(1) as f64;
    let spread = (2.0 / (9.0 * n)).sqrt();
    ((sum / n).cbrt() - (1.0 - 2.0 / (9.0 * n))) / spread
}

/// Fits the nominal within its uncertainty and says where it fails.
///
/// # Errors
/// The nominal diverges, or a stop was asked for.
pub fn locate(
    problem: &Problem<'_>,
    linearized: &LinearizedProblem<'_>,
    held_out: &[String],
    watch: &Watch<'_>,
) -> Result<Found, GapError> {
    let options = &problem.settings.options.locate;
    let fit = linearized.empty()?;
    let structure = adequacy::assess_empty(linearized, problem.settings.seed, watch)?;
    let cells = cells(linearized, fit);
    let nulls = null_maxima(linearized, fit, problem.settings.seed, watch)?;
    let p_value = |deviation: f64| {
        let above = nulls.iter().filter(|null| **null >= deviation).count();
        (above + 1) as f64 / (nulls.len() + 1) as f64
    };
    let excess = |cell: &Cell| (cell.sum - cell.count as f64).max(0.0);
    let total: f64 = cells.iter().map(excess).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut by_sensor: BTreeMap<String, f64> = BTreeMap::new();
    for cell in &cells {
        *by_sensor.entry(sensor(linearized, cell)).or_insert(0.0) += excess(cell) / total;
    }
    let mut places: Vec<Place> = cells
        .iter()
        .map(|cell| Place {
            trial: problem.trials[cell.trial].name.clone(),
            sensor: sensor(linearized, cell),
            t_start: cell.start,
            t_end: cell.end,
            share: excess(cell) / total,
            p_value: p_value(cell.deviation()),
        })
        .filter(|place| place.p_value <= options.level)
        .collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places.truncate(PLACES);
    let largest = cells
        .iter()
        .map(Cell::deviation)
        .fold(f64::NEG_INFINITY, f64::max);
    let fitted = 2 * linearized.problem.model.nv * linearized.problem.segments.len();
    // Two looks: at single windows, and at what adds up over all of them.
    let overall = (2.0 * p_value(largest).min(structure.p_value)).min(1.0);
    // Shares of an excess that shows in no window are shares of noise.
    let regime = if overall <= options.level && !places.is_empty() {
        regime_tree::rules(problem, linearized, fit)
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
        segment: problem.settings.options.segments.length,
        excess: fit.misfit / fit.readings.saturating_sub(fitted).max(1) as f64,
        p_value: overall,
        by_sensor,
        places,
        regime,
        heat_maps: heat_maps(problem, linearized, &cells),
        remarks: problem.remarks.clone(),
    })
}

fn sensor(linearized: &LinearizedProblem<'_>, cell: &Cell) -> String {
    let source = &linearized.problem.channels.sources[cell.source];
    linearized.problem.model.sensors[source.sensor].name.clone()
}

/// Edges of the windows of a segment, as offsets into its rows.
fn edges(rows: usize, windows: usize) -> Vec<usize> {
    (0..=windows).map(|at| at * rows / windows).collect()
}

fn cells(linearized: &LinearizedProblem<'_>, fit: &Fit) -> Vec<Cell> {
    let width = linearized.problem.channels.len();
    let mut cells = Vec::new();
    for (segment, residual) in linearized.problem.segments.iter().zip(&fit.residuals) {
        let times = &linearized.problem.trials[segment.trial].times;
        for pair in edges(
            segment.rows.len(),
            linearized.problem.options.locate.windows,
        )
        .windows(2)
        {
            let rows = pair[0]..pair[1];
            if rows.is_empty() {
                continue;
            }
            for (source, of) in linearized.problem.channels.sources.iter().enumerate() {
                let (mut sum, mut count) = (0.0, 0);
                for row in rows.clone() {
                    let first = row * width + of.channel;
                    for value in &residual[first..first + of.channels] {
                        sum += value * value;
                        count += usize::from(*value != 0.0);
                    }
                }
                if count > 0 {
                    cells.push(Cell {
                        trial: segment.trial,
                        source,
                        start: times[segment.rows.start + rows.start],
                        end: times[segment.rows.start + rows.end - 1],
                        sum,
                        count,
                    });
                }
            }
        }
    }
    cells
}

/// The largest deviation of every simulated null: white noise where readings are, off the starts as the
/// residuals are.
fn null_maxima(
    linearized: &LinearizedProblem<'_>,
    fit: &Fit,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Vec<f64>, GapError> {
    // Correlated noise moves slowly and sums wander more: the width of the null grows with it.
    let autocorrelations = crate::discrepancy::autocorrelation::by_channel(
        linearized.problem.channels.len(),
        &linearized.problem.options.discrepancy,
        &fit.residuals,
    );
    let longest = linearized
        .problem
        .options
        .locate
        .longest_autocorrelation_time;
    let correlation = autocorrelations
        .iter()
        .map(|autocorrelation| autocorrelation.time.min(longest))
        .sum::<f64>()
        / autocorrelations.len().max(1) as f64;
    let draws = linearized.problem.options.locate.null_draws;
    let mut maxima = vec![f64::NEG_INFINITY; draws];
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for at in 0..linearized.problem.segments.len() {
        watch.check()?;
        let residual = &fit.residuals[at];
        let noise = DMatrix::from_fn(residual.len(), draws, |row, _| {
            if residual[row] == 0.0 {
                0.0
            } else {
                standard_normal(&mut rng)
            }
        });
        let left = linearized.projection(at).project(&noise);
        let segment = &linearized.problem.segments[at];
        let width = linearized.problem.channels.len();
        for pair in edges(
            segment.rows.len(),
            linearized.problem.options.locate.windows,
        )
        .windows(2)
        {
            for of in &linearized.problem.channels.sources {
                for (null, largest) in maxima.iter_mut().enumerate() {
                    let (mut sum, mut count) = (0.0, 0);
                    for row in pair[0]..pair[1] {
                        for channel in of.channel..of.channel + of.channels {
                            let value = left[(row * width + channel, null)];
                            sum += value * value;
                            count += usize::from(residual[row * width + channel] != 0.0);
                        }
                    }
                    if count > 0 {
                        *largest = largest.max(deviation(sum, count) * correlation.sqrt());
                    }
                }
            }
        }
    }
    Ok(maxima)
}

fn heat_maps(
    problem: &Problem<'_>,
    linearized: &LinearizedProblem<'_>,
    cells: &[Cell],
) -> Vec<HeatMap> {
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
                    .entry(sensor(linearized, cell))
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
