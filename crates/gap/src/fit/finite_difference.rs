//! Difference quotients of rollouts: columns of the sensitivities of whitened readings.

use nalgebra::DVector;

use crate::{
    error::GapError,
    fit::{hypothesis::Point, linearized_problem::LinearizedProblem},
    plant::Plant,
};

/// Step of a difference quotient, in standard deviations of the prior.
pub(crate) const STEP: f64 = 0.01;
/// Norm of the change of the whitened readings of a segment above which a difference quotient is taken again ...
const MUCH: f64 = 0.3;
/// ... with a step that changes them by this, but no smaller than `FINEST` of the first, where rounding shows.
const LITTLE: f64 = 0.02;
const FINEST: f64 = 1e-5;
/// A step refined by the length of an old column is repeated where readings change by less than this.
const TOO_LITTLE: f64 = 0.1 * LITTLE;

/// A plant, and the whitened residuals of a segment on it.
pub(crate) type Differencing<'p> = (&'p dyn Plant, Vec<f64>);

impl LinearizedProblem<'_> {
    /// The plant that differences of rollouts about a point are taken on, and the whitened residuals there: the
    /// cheaper one where there is one and it follows the other.
    pub(crate) fn differencing(
        &self,
        at: usize,
        point: &Point,
        residual: &[f64],
    ) -> Result<Differencing<'_>, GapError> {
        if let Some(cheaper) = self.problem.plant.cheaper() {
            let entries = self.problem.entries(point);
            let mut simulation =
                cheaper.simulation(&self.problem.nuisance_values(point), &entries)?;
            let mut before = Vec::new();
            let start = &point.starts[at];
            if self.shoot(simulation.as_mut(), at, start, &entries, &mut before) {
                let most = self.problem.options.fit.cheaper_integrator;
                let apart = before.iter().zip(residual).map(|(a, b)| (a - b).powi(2));
                if apart.sum::<f64>() < most * most * residual.len() as f64 {
                    return Ok((cheaper, before));
                }
            }
        }
        Ok((self.problem.plant, residual.to_vec()))
    }

    /// As [`LinearizedProblem::column`], by a finer step where the first changes much: what bends with the step would be taken for a
    /// difference between two columns that nearly cancel (a kilogram, and as much buoyancy).
    /// `length`: of a column made before, about elsewhere.
    pub(crate) fn slope(
        &self,
        at: usize,
        moved: &dyn Fn(f64) -> Point,
        step: f64,
        length: Option<f64>,
        from: &Differencing<'_>,
    ) -> Result<DVector<f64>, GapError> {
        let finer = |length: f64| {
            let part = LITTLE / (length * step.abs());
            step * part.clamp(FINEST, 1.0)
        };
        let first = match length {
            Some(length) if length * step.abs() > MUCH => finer(length),
            _ => step,
        };
        let found = self.column(at, &moved(first), first, from)?;
        let change = found.norm() * first.abs();
        if change <= MUCH && (first == step || change > TOO_LITTLE) {
            return Ok(found);
        }
        let finer = finer(found.norm());
        self.column(at, &moved(finer), finer, from)
    }

    /// Change of the whitened prediction to a moved point, over a step; `from` is what
    /// [`LinearizedProblem::differencing`] gave.
    pub(crate) fn column(
        &self,
        at: usize,
        moved: &Point,
        step: f64,
        from: &Differencing<'_>,
    ) -> Result<DVector<f64>, GapError> {
        let (plant, before) = from;
        let entries = self.problem.entries(moved);
        let mut simulation = plant.simulation(&self.problem.nuisance_values(moved), &entries)?;
        let mut other = Vec::new();
        let start = &moved.starts[at];
        if !self.shoot(simulation.as_mut(), at, start, &entries, &mut other) {
            return Ok(DVector::zeros(before.len()));
        }
        Ok(quotient(before, &other, step))
    }
}

/// Change of a prediction a step: minus that of the residual.
pub(crate) fn quotient(before: &[f64], after: &[f64], step: f64) -> DVector<f64> {
    let changes = before.iter().zip(after).map(|(a, b)| (a - b) / step);
    DVector::from_iterator(before.len(), changes)
}

/// A step that does not leave the bounds.
pub(crate) fn inward(value: f64, step: f64, upper: f64) -> f64 {
    if value + step > upper { -step } else { step }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tests::{fake::RigidBody, on_linearized, trial};
    use hydro_effects::Id;

    /// A column is a tangent, also where a step of a hundredth of a prior bends: two of a thousand noises that
    /// nearly cancel leave what tells two effects apart.
    #[test]
    fn a_column_that_is_long_is_a_tangent() {
        let trials = vec![trial("trial", &[], &[0.0, 0.0], 1, 0.0)];
        on_linearized(&RigidBody::new(), trials, |linearized, _| {
            let fit = linearized.empty().unwrap();
            let offset = (0..linearized.problem.candidates.len())
                .find(|at| linearized.problem.candidates[*at].effect == Id::BuoyancyOffset)
                .unwrap();
            let sd = linearized.problem.candidates[offset].parameters[0].prior_sd;
            let moved = |step: f64| {
                let mut point = fit.point.clone();
                point.candidates.push(offset);
                point.values.push(vec![step * sd, 0.0, 0.0]);
                point
            };
            let from = linearized
                .differencing(0, &fit.point, &fit.residuals[0])
                .unwrap();
            let secant = |step: f64| linearized.column(0, &moved(step), step, &from).unwrap();
            // Of fourth order.
            let central = |step: f64| 0.5 * (secant(step) + secant(-step));
            let tangent = (4.0 * central(0.001) - central(0.002)) / 3.0;
            let off = |of: &DVector<f64>| (of - &tangent).norm();
            let slope = linearized.slope(0, &moved, STEP, None, &from).unwrap();
            assert!(tangent.norm() * STEP > 10.0 * MUCH, "{}", tangent.norm());
            assert!(off(&secant(STEP)) > 1.0, "{}", off(&secant(STEP)));
            assert!(off(&slope) < 0.1 * off(&secant(STEP)), "{}", off(&slope));
            // The same where its length is known, or thought to be another.
            for part in [1.0, 0.1, 1e-6, 1e3] {
                let length = Some(part * tangent.norm());
                let known = linearized.slope(0, &moved, STEP, length, &from).unwrap();
                assert!(off(&known) < 0.1 * off(&secant(STEP)), "{}", off(&known));
            }
        });
    }
}
