//! Find: where and when the nominal fails.
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
    fit::{hypothesis::Fit, linearized_problem::Bench},
    output::{
        records::{Found, HeatMap},
        verdict::Place,
    },
    problem::problem::Study,
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
    /// By how many standard deviations the sum exceeds noise (Wilson and Hilferty's cube root, which makes
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
/// Where the nominal blows up, or a stop was asked for.
pub fn find(
    study: &Study<'_>,
    bench: &Bench<'_>,
    held_out: &[String],
    watch: &Watch<'_>,
) -> Result<Found, GapError> {
    let options = &study.settings.options.locate;
    let fit = bench.empty()?;
    let structure = adequacy::of_empty(bench, study.settings.seed, watch)?;
    let cells = cells(bench, fit);
    let nulls = null_maxima(bench, fit, study.settings.seed, watch)?;
    let p_value = |deviation: f64| {
        let above = nulls.iter().filter(|null| **null >= deviation).count();
        (above + 1) as f64 / (nulls.len() + 1) as f64
    };
    let excess = |cell: &Cell| (cell.sum - cell.count as f64).max(0.0);
    let total: f64 = cells.iter().map(excess).sum::<f64>().max(f64::MIN_POSITIVE);
    let mut by_sensor: BTreeMap<String, f64> = BTreeMap::new();
    for cell in &cells {
        *by_sensor.entry(sensor(bench, cell)).or_insert(0.0) += excess(cell) / total;
    }
    let mut places: Vec<Place> = cells
        .iter()
        .map(|cell| Place {
            trial: study.trials[cell.trial].name.clone(),
            sensor: sensor(bench, cell),
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
    let fitted = 2 * bench.problem.model.nv * bench.problem.segments.len();
    // Two looks: at single windows, and at what adds up over all of them.
    let overall = (2.0 * p_value(largest).min(structure.p_value)).min(1.0);
    // Shares of an excess that shows in no window are shares of noise.
    let regime = if overall <= options.level && !places.is_empty() {
        regime_tree::rules(study, bench, fit)
    } else {
        Vec::new()
    };
    Ok(Found {
        schema: SCHEMA.to_owned(),
        fit_trials: study
            .trials
            .iter()
            .map(|trial| trial.name.clone())
            .collect(),
        held_out_trials: held_out.to_vec(),
        channels: study.channels.list.clone(),
        segment: study.settings.options.segments.length,
        excess: fit.misfit / fit.readings.saturating_sub(fitted).max(1) as f64,
        p_value: overall,
        by_sensor,
        places,
        regime,
        heat_maps: heat_maps(study, bench, &cells),
        remarks: study.remarks.clone(),
    })
}

fn sensor(bench: &Bench<'_>, cell: &Cell) -> String {
    let source = &bench.problem.channels.sources[cell.source];
    bench.problem.model.sensors[source.sensor].name.clone()
}

/// Edges of the windows of a segment, as offsets into its rows.
fn edges(rows: usize, windows: usize) -> Vec<usize> {
    (0..=windows).map(|at| at * rows / windows).collect()
}

fn cells(bench: &Bench<'_>, fit: &Fit) -> Vec<Cell> {
    let width = bench.problem.channels.len();
    let mut cells = Vec::new();
    for (segment, residual) in bench.problem.segments.iter().zip(&fit.residuals) {
        let times = &bench.problem.trials[segment.trial].times;
        for pair in edges(segment.rows.len(), bench.problem.options.locate.windows).windows(2) {
            let rows = pair[0]..pair[1];
            if rows.is_empty() {
                continue;
            }
            for (source, of) in bench.problem.channels.sources.iter().enumerate() {
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
    bench: &Bench<'_>,
    fit: &Fit,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Vec<f64>, GapError> {
    // Correlated noise moves slowly and sums wander more: the width of the null grows with it.
    let leftovers = crate::discrepancy::autocorrelation::by_channel(
        bench.problem.channels.len(),
        &bench.problem.options.discrepancy,
        &fit.residuals,
    );
    let correlation = leftovers
        .iter()
        .map(|leftover| leftover.time.min(2.0))
        .sum::<f64>()
        / leftovers.len().max(1) as f64;
    let draws = bench.problem.options.locate.null_draws;
    let mut maxima = vec![f64::NEG_INFINITY; draws];
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for at in 0..bench.problem.segments.len() {
        watch.check()?;
        let residual = &fit.residuals[at];
        let noise = DMatrix::from_fn(residual.len(), draws, |row, _| {
            if residual[row] == 0.0 {
                0.0
            } else {
                standard_normal(&mut rng)
            }
        });
        let left = bench.projection(at).project(&noise);
        let segment = &bench.problem.segments[at];
        let width = bench.problem.channels.len();
        for pair in edges(segment.rows.len(), bench.problem.options.locate.windows).windows(2) {
            for of in &bench.problem.channels.sources {
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

fn heat_maps(study: &Study<'_>, bench: &Bench<'_>, cells: &[Cell]) -> Vec<HeatMap> {
    study
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
                    .entry(sensor(bench, cell))
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
