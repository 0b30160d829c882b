//! The likelihood that a set gains from the point of a sweep to its best values, as far as first order tells.
//!
//! At a point that has settled it is nothing. At one whose steps went too far, or whose sweeps ended before it had settled, it is a
//! promise that was not kept, so that the set counts by what its point has reached.

use nalgebra::DVector;

use crate::{
    likelihood::{found::Found, level::Level},
    problem::{point::Point, problem::Problem},
};

impl Level {
    /// Log likelihood at the values that a found set, which is that of the point, has by first order, less that at the point's
    /// values, the priors of the uncertain numbers and of the errors of form counted [nat]. Nothing where trials have values of
    /// their own.
    pub(crate) fn promised(&self, problem: &Problem<'_>, point: &Point, found: &Found) -> f64 {
        if !found.own.is_empty() {
            return 0.0;
        }
        let beside = self.beside(&found.set);
        let Some((mut joint, _)) = self.joint(&beside, &found.own, &found.columns) else {
            return 0.0;
        };
        for axis in 0..beside.len() {
            joint.a[(axis, axis)] += 1.0;
        }
        let (there, _) = self.parameters(problem, found);
        let places = self.places(&beside, &found.columns);
        let there = DVector::from_iterator(places.len(), places.iter().map(|at| there[*at]));
        let own = own_values(problem, point);
        let of_columns = found.columns.iter().map(|column| own[*column]);
        let forms = beside.len() - point.nuisances.len();
        let numbers = point.nuisances.iter().map(|value| Some(*value));
        let known: Vec<Option<f64>> = numbers
            .chain(std::iter::repeat_n(None, forms))
            .chain(of_columns.map(Some))
            .collect();
        let log = |z: &DVector<f64>| joint.b.dot(z) - 0.5 * (&joint.a * z).dot(z);
        let here = joint.best_beside(&known);
        here.map_or(0.0, |here| (log(&there) - log(&here)).max(0.0))
    }
}

/// Values of the point's own parameters, in the order of their columns and in standard deviations of their priors; zero where a
/// column is about the point itself.
fn own_values(problem: &Problem<'_>, point: &Point) -> DVector<f64> {
    let all = point.candidates.iter().zip(&point.values);
    let values = all.flat_map(|(candidate, values)| {
        let parameters = problem.candidates[*candidate].parameters.iter();
        parameters.zip(values).map(|(p, value)| match p.shapes {
            true => 0.0,
            false => (value - p.null) / p.prior_sd,
        })
    });
    DVector::from_vec(values.collect())
}
