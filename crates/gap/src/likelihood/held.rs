//! Uncertain numbers and errors of form at the bounds of their priors.
//!
//! Priors are standard normal and cut far out (`largest_shift`). Where the readings ask for more, the number stands at its bound and
//! everything else is fitted beside it there: values fitted beside a number that is farther off, which is then cut, explain nothing
//! together, and the numbers that are free would make up for it.

use nalgebra::DVector;

use crate::likelihood::{
    by_trial::Own, found::Held, given::Given, level::Level, quadratic::Quadratic,
    truncated_evidence::Truncated, truncated_normal::log_cdf,
};

/// Rounding of a value and of a slope.
const ROUNDING: f64 = 1e-9;

/// A set's columns, and the bound of what stands beside them.
pub(super) struct OfSet<'s> {
    pub(super) set: &'s [usize],
    pub(super) own: &'s Own,
    pub(super) columns: &'s [usize],
    /// Precision of the columns' priors.
    pub(super) precision: &'s [f64],
    /// Largest uncertain number or error of form.
    pub(super) most: f64,
}

/// A set's likelihood with what would be beyond its bound `held` there, what `fit` makes of it, and the log of what the cut priors
/// leave of the likelihood beside the values held. Begins with what is held already.
///
/// An active set, one bound at a time, as in the dual method for quadratic programs (D. Goldfarb and A. Idnani, Math. Program. 27,
/// 1983): what would rather lie within its bounds is let go before the next one is held. What is free is taken to be far within its
/// bounds, and each value held to be cut by itself.
pub(super) fn bounded(
    level: &Level,
    of: &OfSet<'_>,
    held: &mut Held,
    fit: impl Fn(&Quadratic) -> Option<Truncated>,
) -> Option<(Given, Truncated, f64)> {
    if held.is_empty() {
        let given = level.given_own(of.set, of.own, of.columns)?;
        let found = fit(&given.quadratic)?;
        match beyond(&given, &found.mean, of.most) {
            None => return Some((given, found, 0.0)),
            Some((place, bound)) => held.insert(place, bound),
        };
    }
    let places = level.beside(of.set);
    // Errors of form go with the members of a set.
    held.retain(|of, _| places.contains(of));
    let (joint, half) = level.joint(&places, of.own, of.columns)?;
    // The mean of an effect near its own bound can leave a value neither within nor held: in the end nothing more is let go.
    let mut steps = 4 * places.len();
    loop {
        steps = steps.saturating_sub(1);
        let given = Given::beside(&joint, half, (&places, held))?;
        let found = fit(&given.quadratic)?;
        let z = values(&places, held, &given, &found.mean);
        let slope = slope(&joint, &z, places.len());
        let outward = |at: usize| slope[at] * z[at].signum();
        let at_bound = (0..places.len()).filter(|at| held.contains_key(&places[*at]));
        let inward = at_bound.clone().filter(|at| outward(*at) < -ROUNDING);
        let eager = inward.min_by(|a, b| outward(*a).total_cmp(&outward(*b)));
        match (eager, beyond(&given, &found.mean, of.most)) {
            (Some(at), _) if steps > 0 => {
                held.remove(&places[at]);
            }
            (_, Some((place, bound))) => {
                held.insert(place, bound);
            }
            _ => {
                let at_bound: Vec<usize> = at_bound.collect();
                let curvatures = curvatures(&joint, &at_bound, places.len(), of.precision)?;
                let cut = at_bound.iter().zip(curvatures);
                let cut = cut
                    .map(|(at, curvature)| cut_at(outward(*at), curvature))
                    .sum();
                return Some((given, found, cut));
            }
        }
    }
}

/// The one that lies farthest beyond `most`, if any, beside some values of the rest, at its bound.
fn beyond(given: &Given, rest: &DVector<f64>, most: f64) -> Option<(usize, f64)> {
    let values = given.beside_values(rest);
    let values = given.beside.iter().zip(values.iter());
    let beyond = values.filter(|(_, value)| value.abs() > most + ROUNDING);
    let worst = beyond.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some((*worst.0, most.copysign(*worst.1)))
}

/// Values of all that stands beside a set, then of the rest.
fn values(places: &[usize], held: &Held, given: &Given, rest: &DVector<f64>) -> DVector<f64> {
    let free = given.beside_values(rest);
    let mut free = free.iter().copied();
    let beside = places
        .iter()
        .map(|of| held.get(of).copied().or_else(|| free.next()));
    let beside: Vec<f64> = beside.map(Option::unwrap_or_default).collect();
    let all = beside.into_iter().chain(rest.iter().copied());
    DVector::from_iterator(places.len() + rest.len(), all)
}

/// Slope of log likelihood and prior along what stands beside a set, the first of the values.
fn slope(joint: &Quadratic, z: &DVector<f64>, beside: usize) -> DVector<f64> {
    let slope = &joint.b - &joint.a * z;
    slope.rows(0, beside) - z.rows(0, beside)
}

/// Curvature of log likelihood and prior along some values, all others fitted.
fn curvatures(
    joint: &Quadratic,
    places: &[usize],
    beside: usize,
    precision: &[f64],
) -> Option<Vec<f64>> {
    let mut a = joint.a.clone();
    let priors = std::iter::repeat_n(1.0, beside).chain(precision.iter().copied());
    for (axis, precision) in priors.enumerate() {
        a[(axis, axis)] += precision;
    }
    let others: Vec<usize> = (0..a.nrows()).filter(|at| !places.contains(at)).collect();
    let factor = a.select_columns(&others).select_rows(&others).cholesky()?;
    let of = |at: &usize| {
        let across = a.column(*at).select_rows(&others);
        a[(*at, *at)] - across.dot(&factor.solve(&across))
    };
    Some(places.iter().map(of).collect())
}

/// Log of the integral of likelihood and prior over a value within its bound, over the likelihood times exp(-z^2 / 2) at the bound;
/// `outward`: slope out of the bounds.
fn cut_at(outward: f64, curvature: f64) -> f64 {
    // The prior's own is one.
    let root = curvature.max(1.0).sqrt();
    let x = outward.max(0.0) / root;
    0.5 * x * x + log_cdf(-x) - root.ln()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::DMatrix;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::likelihood::{
        by_trial::Deviations, filter::Filtered, form_error, level::Sizes,
        truncated_evidence::evidence, truncated_normal::Bounds,
    };
    use crate::statistics::standard_normal;

    /// Prior of the one column.
    const SD: f64 = 0.8;

    /// Readings of one uncertain number and one column, along directions that are not at right angles.
    fn level(residual: [f64; 3], numbers: &[[f64; 3]]) -> Level {
        let column = [0.5, -0.4, 1.2];
        let all: Vec<[f64; 3]> = [&[residual], numbers, &[column]].concat();
        let of = DMatrix::from_fn(3, all.len(), |row, column| all[column][row]);
        level_of(&of, numbers.len())
    }

    /// A level from a residual, changes with so many numbers, and with one column.
    fn level_of(of: &DMatrix<f64>, numbers: usize) -> Level {
        let trial = Filtered {
            trial: 0,
            gram: of.tr_mul(of),
            half_log_determinant: 0.0,
            deviations: Deviations::default(),
        };
        let sizes = Sizes {
            force: 0.1,
            drift: 0.0,
            slow_drift: 0.0,
        };
        let beside = form_error::Beside {
            numbers,
            forms: Vec::new(),
        };
        Level::new(0, sizes, true, vec![trial], &beside).unwrap()
    }

    /// Log evidence, mean of the column, and what is held, beginning with `held`.
    fn found(level: &Level, held: Held) -> (f64, f64, Held) {
        let (own, mut held) = (Vec::new(), held);
        let of = OfSet {
            set: &[0],
            own: &own,
            columns: &[0],
            precision: &[SD.powi(-2)],
            most: 5.0,
        };
        let sd = DVector::from_element(1, SD);
        let (given, posterior, cut) = bounded(level, &of, &mut held, |of| {
            evidence(&of.a, &of.b, &sd, &[Bounds::FREE])
        })
        .unwrap();
        (
            given.empty + posterior.log_evidence + cut,
            posterior.mean[0],
            held,
        )
    }

    const NUMBER: [f64; 3] = [1.0, 0.3, 0.4];

    /// Evidence and mean of the column by quadrature, the number within five standard deviations.
    fn by_quadrature(residual: [f64; 3]) -> (f64, f64) {
        let column = [0.5, -0.4, 1.2];
        let (mut sum, mut moment, mut top) = (0.0, 0.0, f64::NEG_INFINITY);
        for pass in 0..2 {
            for i in 0..2000 {
                for j in 0..2000 {
                    let number = -5.0 + 10.0 * (f64::from(i) + 0.5) / 2000.0;
                    let value = -8.0 + 16.0 * (f64::from(j) + 0.5) / 2000.0;
                    let misfit = (0..3).map(|row| {
                        (residual[row] - NUMBER[row] * number - column[row] * value).powi(2)
                    });
                    let log = -0.5 * (misfit.sum::<f64>() + number.powi(2) + (value / SD).powi(2));
                    match pass {
                        0 => top = top.max(log),
                        _ => {
                            sum += (log - top).exp();
                            moment += value * (log - top).exp();
                        }
                    }
                }
            }
        }
        let cell = 10.0 / 2000.0 * 16.0 / 2000.0 / (2.0 * std::f64::consts::PI * SD);
        (top + (sum * cell).ln(), moment / sum)
    }

    /// A number that would lie far beyond its bound stands there: evidence and values are those of the cut prior.
    #[test]
    fn the_evidence_is_that_of_the_cut_prior() {
        for (far, held) in [(30.0, Some(5.0)), (-30.0, Some(-5.0)), (3.0, None)] {
            let residual = [far, 0.4 * far, 0.3 * far];
            let (evidence, mean, at) = found(&level(residual, &[NUMBER]), Held::new());
            let (expected, expected_mean) = by_quadrature(residual);
            assert_eq!(at.get(&0).copied(), held, "{far}");
            assert!(
                (evidence - expected).abs() < 0.05,
                "{far}: {evidence} {expected}"
            );
            assert!(
                (mean - expected_mean).abs() < 0.05,
                "{far}: {mean} {expected_mean}"
            );
        }
    }

    /// A value that was held before and need not be is let go; the values held do not depend on where one begins.
    #[test]
    fn what_need_not_be_held_is_let_go() {
        let near = level([3.0, 1.0, 1.0], &[NUMBER]);
        let (alone, ..) = found(&near, Held::new());
        let (again, _, held) = found(&near, Held::from([(0, 5.0)]));
        assert!(held.is_empty() && (alone - again).abs() < 1e-12, "{held:?}");
        let far = level([30.0, -20.0, 9.0], &[NUMBER, [0.2, 1.0, -0.5]]);
        let (alone, _, held) = found(&far, Held::new());
        let (again, _, other) = found(&far, Held::from([(0, -5.0)]));
        assert_eq!(held, other);
        assert!((alone - again).abs() < 1e-9 && !held.is_empty());
    }

    /// Many numbers that pull at each other: what is free lies within its bounds, what is held would go beyond.
    #[test]
    fn what_is_held_would_go_beyond() {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut all_held = 0;
        for _ in 0..200 {
            let numbers = 12;
            let shared = DVector::from_fn(20, |_, _| standard_normal(&mut rng));
            let of = DMatrix::from_fn(20, 2 + numbers, |row, column| match column {
                0 => 60.0 * standard_normal(&mut rng),
                _ => standard_normal(&mut rng) + 3.0 * shared[row],
            });
            let level = level_of(&of, numbers);
            let (.., held) = found(&level, Held::new());
            let places: Vec<usize> = (0..numbers).collect();
            let given = level.given_held(&[0], (&Vec::new(), &held), &[0]).unwrap();
            let sd = DVector::from_element(1, SD);
            let quadratic = &given.quadratic;
            let rest = evidence(&quadratic.a, &quadratic.b, &sd, &[Bounds::FREE])
                .unwrap()
                .mean;
            assert!(beyond(&given, &rest, 5.0).is_none());
            let z = values(&places, &held, &given, &rest);
            let (joint, _) = level.joint(&places, &Vec::new(), &[0]).unwrap();
            let slope = slope(&joint, &z, numbers);
            for at in places {
                match held.get(&at) {
                    Some(bound) => assert!(slope[at] * bound.signum() > -1e-6, "{slope}"),
                    None => assert!(slope[at].abs() < 1e-6, "{slope}"),
                }
            }
            all_held += held.len();
        }
        assert!(all_held > 200, "{all_held}");
    }
}
