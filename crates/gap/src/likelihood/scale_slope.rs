//! The slope of the readings' covariance with a sensor's scale.
//!
//! A scale multiplies what starts and unmodelled forces bring to the readings too. The readings' mean alone, to first order,
//! is a gain in likelihood for every larger scale: with half of the forces it explains as much. The determinant of the
//! covariance, which grows with the scale, takes it away again; its slope belongs to the likelihood's.

use hydro_effects::Id;
use nalgebra::{DMatrix, DVector};

use crate::{
    likelihood::{
        columns::{LinkColumns, Whitened},
        directions::Direction,
        filter::{self, Disturbances, Filtered},
    },
    problem::{point::Point, problem::Problem},
};

/// Relative step of the difference quotient.
const STEP: f64 = 1e-3;

/// A parameter that is a sensor's scale.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScaleColumn {
    /// Its place among the parameters of a sweep.
    column: usize,
    /// The sensor, among the sources of the channels.
    pub(crate) source: usize,
    /// Relative change of the scale with a unit of the parameter.
    relative: f64,
}

/// The scales among a point's own parameters, of which the first stands at `first`, and the directions after them.
pub(crate) fn scale_columns(
    problem: &Problem<'_>,
    point: &Point,
    first: usize,
    directions: &[Direction],
) -> Vec<ScaleColumn> {
    let of = |candidate: usize, column: usize, value: f64| {
        let of = &problem.candidates[candidate];
        if of.effect != Id::SensorScale {
            return None;
        }
        let source = problem.channels.sources.iter().position(|source| {
            of.targets
                .contains(&problem.model.sensors[source.sensor].name)
        })?;
        Some(ScaleColumn {
            column,
            source,
            relative: of.parameters.first()?.prior_sd / value,
        })
    };
    let mut next = first;
    let mut found = Vec::new();
    for (candidate, values) in point.candidates.iter().zip(&point.values) {
        found.extend(
            values
                .first()
                .and_then(|value| of(*candidate, next, *value)),
        );
        next += values.len();
    }
    for (at, direction) in directions.iter().enumerate() {
        found.extend(of(direction.candidate, next + at, direction.base[0]));
    }
    found
}

/// Adds the slope of the covariance's determinant to a track's likelihood. `bare`: its links without parameters, for one size
/// of correlated noise; none where the filter fails.
pub(crate) fn add_slopes(
    filtered: &mut Filtered,
    columns: &[ScaleColumn],
    bare: &[LinkColumns],
    arrival: &DVector<f64>,
    prior: Disturbances,
) -> Option<()> {
    for (number, of) in columns.iter().enumerate() {
        if 1 + of.column >= filtered.gram.nrows() {
            continue;
        }
        let scaled: Vec<LinkColumns> = (bare.iter())
            .map(|link| enlarged(link, number, 2 * prior.drifting))
            .collect();
        let larger = filter::filter(filtered.trial, &scaled, 0, 0, arrival, prior)?;
        let slope = (larger.half_log_determinant - filtered.half_log_determinant) / STEP;
        let place = 1 + of.column;
        filtered.gram[(0, place)] -= of.relative * slope;
        filtered.gram[(place, 0)] -= of.relative * slope;
    }
    Some(())
}

/// A link in which what starts and forces bring to one sensor is a little larger; what its drifts, the last `drifts` columns,
/// bring is no part of what it scales.
fn enlarged(link: &LinkColumns, number: usize, drifts: usize) -> LinkColumns {
    let noise = link.noise.iter().map(|of| {
        let mut gram = of.gram.clone();
        if let Some(own) = of.scaled.get(number) {
            let latents = own.nrows();
            let first = gram.nrows() - latents;
            let mut block = gram.view_mut((first, first), (latents, latents));
            let factor = |axis: usize| match axis + drifts < latents {
                true => 1.0 + STEP,
                false => 1.0,
            };
            block +=
                own.map_with_location(|row, column, of| of * (factor(row) * factor(column) - 1.0));
        }
        Whitened {
            gram,
            half_log_determinant: of.half_log_determinant,
            readings: DMatrix::zeros(0, 0),
            scaled: Vec::new(),
        }
    });
    LinkColumns {
        noise: noise.collect(),
        end: link.end.clone(),
        anew: link.anew,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// One segment of one degree of freedom and one piece of force, read by one sensor that drifts: the slope is the trace of
    /// C^-1 K, for the covariance C = s^2 K + D + 1 of its readings, D that of its drift.
    #[test]
    fn it_is_the_slope_of_the_covariance() {
        let outputs = DMatrix::from_row_slice(
            4,
            7,
            &[
                0.3, 1.0, 0.8, 0.1, 0.4, 1.0, 0.0, -0.2, 0.9, 0.7, 1.3, 0.2, 0.7, 0.3, 0.5, 0.4,
                -0.6, 0.3, 1.1, 0.3, 0.7, 0.1, 0.2, 1.4, 0.5, 0.9, 0.0, 1.0,
            ],
        );
        let latents = outputs.columns(2, 5).into_owned();
        let link = LinkColumns {
            noise: vec![Whitened {
                gram: outputs.tr_mul(&outputs),
                half_log_determinant: 0.0,
                readings: DMatrix::zeros(0, 0),
                scaled: vec![latents.tr_mul(&latents)],
            }],
            end: DMatrix::from_fn(2, 7, |_, column| if column < 5 { 0.1 } else { 0.0 }),
            anew: false,
        };
        let arrival = DVector::from_vec(vec![0.7, 1.5]);
        let prior = Disturbances {
            force: 2.0,
            force_correlation: 0.6,
            drifting: 1,
            drift: 0.9,
            drift_correlation: 0.8,
        };
        let mut filtered =
            filter::filter(0, std::slice::from_ref(&link), 0, 1, &arrival, prior).unwrap();
        let before = filtered.gram[(0, 1)];
        let column = ScaleColumn {
            column: 0,
            source: 0,
            relative: 0.1,
        };
        add_slopes(
            &mut filtered,
            &[column],
            &[link.bare(1, 0)],
            &arrival,
            prior,
        )
        .unwrap();
        let sd = DVector::from_vec(vec![0.7, 1.5, 2.0]);
        let root = latents.columns(0, 3) * DMatrix::from_diagonal(&sd);
        let covariance = &root * root.transpose();
        let drifts = latents.columns(3, 2);
        let of_drifts = 0.81 * DMatrix::from_row_slice(2, 2, &[1.0, 0.8, 0.8, 1.0]);
        let drift: DMatrix<f64> = drifts * of_drifts * drifts.transpose();
        let inverse = (&covariance + drift + DMatrix::identity(4, 4))
            .try_inverse()
            .unwrap();
        let expected = 0.1 * (inverse * covariance).trace();
        let found = before - filtered.gram[(0, 1)];
        assert!(
            (found - expected).abs() < 2e-3 * expected,
            "{found} {expected}"
        );
        assert_eq!(filtered.gram[(0, 1)], filtered.gram[(1, 0)]);
    }
}
