//! The slope of the readings' covariance with a sensor's scale.
//!
//! A scale multiplies what starts and unmodelled forces bring to the readings too. The readings' mean alone, to first order,
//! is a gain in likelihood for every larger scale: with half of the forces it explains as much. The determinant of the
//! covariance, which grows with the scale, takes it away again; its slope belongs to the likelihood's.
//!
//! For readings of covariance C = H P H' + 1, latents of prior covariance P and of V given all readings, the slope of half the
//! logarithm of its determinant with a scale of some of the rows is the trace of H' H V over them: P H' C^-1 = V H'.

use hydro_effects::Id;
use nalgebra::DMatrix;

use crate::{
    likelihood::{
        columns::LinkColumns,
        directions::Direction,
        filter::{Filtered, Passed},
    },
    problem::{point::Point, problem::Problem},
};

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

/// Adds the slope of the covariance's determinant to a track's likelihood, from what the filter passed at its links, for one
/// size of correlated noise. The last `drifts` latents are no part of what a sensor scales.
pub(crate) fn add_slopes(
    filtered: &mut Filtered,
    columns: &[ScaleColumn],
    (links, noise): (&[LinkColumns], usize),
    (passed, drifts): (&[Passed], usize),
) -> Option<()> {
    let mut slopes = vec![0.0; columns.len()];
    // Covariance that the readings from a segment's start on leave of the state before it, less what those before do, in square
    // roots of that; none after the last, and where the next prediction starts anew.
    let mut later: Option<DMatrix<f64>> = None;
    for (link, passed) in links.iter().zip(passed).rev() {
        let mut sources = passed.sources.clone();
        if let Some(later) = &later {
            sources += &passed.onward * later * passed.onward.transpose();
        }
        let latents = &passed.root * &sources * passed.root.transpose();
        let scaled = latents.nrows().checked_sub(drifts)?;
        for (slope, own) in slopes.iter_mut().zip(&link.noise[noise].scaled) {
            let both = own.columns(0, scaled).dot(&latents.columns(0, scaled));
            *slope += both;
        }
        let state = passed.onward.ncols();
        later = (!passed.anew).then(|| {
            let before = sources.view((0, 0), (state, state));
            before - DMatrix::<f64>::identity(state, state)
        });
    }
    for (of, slope) in columns.iter().zip(slopes) {
        let place = 1 + of.column;
        if place < filtered.gram.nrows() {
            filtered.gram[(0, place)] -= of.relative * slope;
            filtered.gram[(place, 0)] -= of.relative * slope;
        }
    }
    Some(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::DVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::likelihood::{columns::Whitened, disturbances::Disturbances, filter};
    use crate::statistics::standard_normal;

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
            commands: 0,
            drifting: 1,
            drift: 0.9,
            drift_correlation: 0.8,
        };
        let links = [link];
        let mut passed = Vec::new();
        let mut filtered = filter::filter(
            0,
            (&links, 0),
            &filter::head(&links, 0, 1),
            &arrival,
            prior,
            Some(&mut passed),
        )
        .unwrap();
        let before = filtered.gram[(0, 1)];
        let column = ScaleColumn {
            column: 0,
            source: 0,
            relative: 0.1,
        };
        add_slopes(&mut filtered, &[column], (&links, 0), (&passed, 2)).unwrap();
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

    /// Four segments, the third predicted anew: the slope is the difference quotient of the filter's own determinant.
    #[test]
    fn it_is_the_difference_of_the_filters_determinants() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut random =
            |rows, columns| DMatrix::from_fn(rows, columns, |_, _| standard_normal(&mut rng));
        // Residual, start, two pieces of force, drift at the start and at the next.
        let (rows, tangents, width) = (6, 2, 7);
        let outputs: Vec<DMatrix<f64>> = (0..4).map(|_| random(rows, width)).collect();
        let ends: Vec<DMatrix<f64>> = (0..4).map(|_| 0.5 * random(tangents, width)).collect();
        let prior = Disturbances {
            force: 0.8,
            force_correlation: 0.6,
            commands: 0,
            drifting: 1,
            drift: 0.9,
            drift_correlation: 0.7,
        };
        let arrival = DVector::from_vec(vec![0.4, 0.9]);
        // The first two rows are the sensor's.
        let links = |scale: f64| -> Vec<LinkColumns> {
            let all = outputs.iter().zip(&ends).enumerate();
            all.map(|(at, (outputs, end))| {
                let own = outputs.view((0, 1), (2, width - 1)).into_owned();
                let mut outputs = outputs.clone();
                let mut scaled = outputs.view_mut((0, 1), (2, width - 3));
                scaled *= scale;
                let mut end = end.clone();
                end.columns_mut(width - 2, 2).fill(0.0);
                LinkColumns {
                    noise: vec![Whitened {
                        gram: outputs.tr_mul(&outputs),
                        half_log_determinant: 0.0,
                        readings: DMatrix::zeros(0, 0),
                        scaled: vec![own.tr_mul(&own)],
                    }],
                    end,
                    anew: at == 2,
                }
            })
            .collect()
        };
        let filtered = |scale: f64| {
            let links = links(scale);
            let mut passed = Vec::new();
            let filtered = filter::filter(
                0,
                (&links, 0),
                &filter::head(&links, 0, 0),
                &arrival,
                prior,
                Some(&mut passed),
            )
            .unwrap();
            (links, passed, filtered.half_log_determinant)
        };
        let step = 1e-5;
        let expected = (filtered(1.0 + step).2 - filtered(1.0 - step).2) / (2.0 * step);
        let (links, passed, _) = filtered(1.0);
        let mut found = Filtered {
            trial: 0,
            gram: DMatrix::zeros(2, 2),
            half_log_determinant: 0.0,
            deviations: Default::default(),
        };
        let column = ScaleColumn {
            column: 0,
            source: 0,
            relative: 1.0,
        };
        add_slopes(&mut found, &[column], (&links, 0), (&passed, 2)).unwrap();
        let found = -found.gram[(0, 1)];
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}
