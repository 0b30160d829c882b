//! Uncertain numbers and errors of form at the bounds of their priors.
//!
//! Priors are standard normal and cut far out (`largest_shift`). Where the readings ask for more, the number stands at its bound and
//! everything else is fitted beside it there: values fitted beside a number that is farther off, which is then cut, explain nothing
//! together, and the numbers that are free would make up for it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DVector;

use crate::likelihood::{
    by_trial::Own,
    level::{Given, Level},
    quadratic::Quadratic,
    truncated_normal::log_cdf,
};

/// Values of what is held, by place among all parameters.
pub(crate) type Held = BTreeMap<usize, f64>;

/// Known values of what stands beside a set, and of so many columns, which are not known.
pub(super) fn known(held: &Held, beside: &[usize], columns: usize) -> Vec<Option<f64>> {
    let beside = beside.iter().map(|of| held.get(of).copied());
    beside.chain(std::iter::repeat_n(None, columns)).collect()
}

/// The one that lies farthest beyond `most`, if any, beside some values of the rest, at its bound.
fn beyond(given: &Given, rest: &DVector<f64>, most: f64) -> Option<(usize, f64)> {
    let values = given.beside_values(rest);
    let values = given.beside.iter().zip(values.iter());
    let beyond = values.filter(|(_, value)| value.abs() > most + 1e-9);
    let worst = beyond.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some((*worst.0, most.copysign(*worst.1)))
}

/// A set's columns and what stands beside them, as `fit` finds them.
pub(super) struct Beside<'s> {
    pub(super) set: &'s [usize],
    pub(super) own: &'s Own,
    pub(super) columns: &'s [usize],
    /// Precision of the columns' priors.
    pub(super) precision: &'s [f64],
    /// Bound of uncertain numbers and errors of form.
    pub(super) most: f64,
}

/// A set's likelihood with what is beyond its bound held there, what `fit` makes of it, and the log of what the cut priors leave of
/// the likelihood beside the values held. Begins with what is held already.
pub(super) fn bounded<T>(
    level: &Level,
    of: &Beside<'_>,
    held: &mut Held,
    fit: impl Fn(&Given) -> Option<(T, DVector<f64>)>,
) -> Option<(Given, T, f64)> {
    // Each is let go once at most, so that this comes to an end.
    let mut let_go = BTreeSet::new();
    loop {
        let given = level.given_own(of.set, (of.own, held), of.columns)?;
        let (found, rest) = fit(&given)?;
        if let Some((place, bound)) = beyond(&given, &rest, of.most) {
            held.insert(place, bound);
            continue;
        }
        if held.is_empty() {
            return Some((given, found, 0.0));
        }
        let slopes = slopes(level, of, held, (&given, &rest))?;
        let mut inward = slopes.iter().filter(|of| of.outward < 0.0);
        match inward.find(|of| let_go.insert(of.place)) {
            Some(slope) => held.remove(&slope.place),
            None => {
                let cut = slopes.iter().map(Slope::cut).sum();
                return Some((given, found, cut));
            }
        };
    }
}

/// Log likelihood and prior about a value that is held.
struct Slope {
    place: usize,
    /// Slope out of the bounds.
    outward: f64,
    /// Curvature, all but what is held fitted.
    curvature: f64,
}

impl Slope {
    /// Log of the integral over the value within its bound, over the density at it.
    fn cut(&self) -> f64 {
        let root = self.curvature.sqrt();
        let x = self.outward / root;
        0.5 * x * x + log_cdf(-x) - root.ln()
    }
}

fn slopes(
    level: &Level,
    of: &Beside<'_>,
    held: &Held,
    (given, rest): (&Given, &DVector<f64>),
) -> Option<Vec<Slope>> {
    let beside = level.beside(of.set);
    let (mut joint, _): (Quadratic, f64) = level.joint(&beside, of.own, of.columns)?;
    let free = given.beside_values(rest);
    let free: BTreeMap<usize, f64> = given
        .beside
        .iter()
        .copied()
        .zip(free.iter().copied())
        .collect();
    let of_beside = beside
        .iter()
        .map(|of| held.get(of).or(free.get(of)).copied());
    let of_beside: Vec<f64> = of_beside.map(Option::unwrap_or_default).collect();
    let z = DVector::from_iterator(
        joint.b.len(),
        of_beside.into_iter().chain(rest.iter().copied()),
    );
    let precisions = std::iter::repeat_n(1.0, beside.len()).chain(of.precision.iter().copied());
    for (axis, precision) in precisions.enumerate() {
        joint.a[(axis, axis)] += precision;
    }
    let places: Vec<usize> = (0..beside.len())
        .filter(|at| held.contains_key(&beside[*at]))
        .collect();
    let others: Vec<usize> = (0..joint.b.len())
        .filter(|at| !places.contains(at))
        .collect();
    let factor = joint.select(&others).a.cholesky()?;
    let slope = &joint.b - &joint.a * &z;
    let each = places.into_iter().map(|at| {
        let across = joint.a.column(at).select_rows(&others);
        Slope {
            place: beside[at],
            outward: slope[at] * z[at].signum(),
            curvature: joint.a[(at, at)] - across.dot(&factor.solve(&across)),
        }
    });
    Some(each.collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::likelihood::{
        by_trial::Deviations,
        filter::Filtered,
        form_error,
        level::Sizes,
        truncated_evidence::{Truncated, evidence},
        truncated_normal::Bounds,
    };

    /// Prior of the one column.
    const SD: f64 = 0.8;

    /// Readings of one uncertain number and one column, along directions that are not at right angles.
    fn level(residual: [f64; 3], numbers: &[[f64; 3]]) -> Level {
        let column = [0.5, -0.4, 1.2];
        let all: Vec<[f64; 3]> = [&[residual], numbers, &[column]].concat();
        let of = DMatrix::from_fn(3, all.len(), |row, column| all[column][row]);
        let trial = Filtered {
            trial: 0,
            gram: of.tr_mul(&of),
            half_log_determinant: 0.0,
            deviations: Deviations::default(),
        };
        let sizes = Sizes {
            force: 0.1,
            drift: 0.0,
            slow_drift: 0.0,
        };
        let beside = form_error::Beside {
            numbers: numbers.len(),
            forms: Vec::new(),
        };
        Level::new(0, sizes, true, vec![trial], &beside).unwrap()
    }

    /// Log evidence, mean of the column, and what is held, beginning with `held`.
    fn found(level: &Level, held: Held) -> (f64, f64, Held) {
        let (own, mut held) = (Vec::new(), held);
        let of = Beside {
            set: &[0],
            own: &own,
            columns: &[0],
            precision: &[SD.powi(-2)],
            most: 5.0,
        };
        let sd = DVector::from_element(1, SD);
        let (given, posterior, cut) = bounded(level, &of, &mut held, |given| {
            let of = &given.quadratic;
            let found: Truncated = evidence(&of.a, &of.b, &sd, &[Bounds::FREE])?;
            let mean = found.mean.clone();
            Some((found, mean))
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

    /// What was held before and need not be is let go, and what is held does not depend on where one begins.
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
}
