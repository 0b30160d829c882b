//! Evidence of sets of effects to first order, from one screen.

use std::collections::BTreeMap;

use nalgebra::DVector;

use crate::{
    fit::{
        hypothesis::Point, laplace::Quadratic, linearized_problem::LinearizedProblem,
        segmented_problem::SegmentedProblem, truncated_normal::Bounds,
    },
    select::screen::{Direction, PHASE, Screen},
};

/// A set and its evidence to first order, relative to the empty set [nat].
pub(crate) type Judged = (Vec<usize>, f64);

/// A quadratic in the directions of one screen, nuisance parameters and fitted parameters out of the way.
pub(crate) struct Linear<'s> {
    quadratic: Quadratic,
    pub(crate) screen: &'s Screen,
    /// Squared residuals were divided by this.
    inflation: f64,
    /// Choices of directions by candidate; several where shapes were tried. Phases are no shapes: amplitudes at two of
    /// them are one choice.
    pub(crate) choices: BTreeMap<usize, Vec<Vec<usize>>>,
    bounds: Vec<Bounds>,
}

impl<'s> Linear<'s> {
    pub(crate) fn new(
        linearized: &LinearizedProblem<'_>,
        screen: &'s Screen,
        inflation: f64,
    ) -> Option<Self> {
        let quadratic = screen
            .quadratic
            .inflated(inflation)
            .marginal(screen.before)?;
        let mut choices: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
        for (at, direction) in screen.directions.iter().enumerate() {
            let of = choices.entry(direction.candidate).or_default();
            // A shape of its own is a choice of its own.
            let parameters = &linearized.problem.candidates[direction.candidate].parameters;
            let same = |other: &Direction| {
                let both = other.base.iter().zip(&direction.base).zip(parameters);
                both.into_iter()
                    .all(|((a, b), p)| a == b || p.name == PHASE)
            };
            match of
                .iter_mut()
                .find(|choice| same(&screen.directions[choice[0]]))
            {
                Some(choice) => choice.push(at),
                None => of.push(vec![at]),
            }
        }
        let bounds = screen
            .directions
            .iter()
            .map(|direction| {
                let p = &linearized.problem.candidates[direction.candidate].parameters
                    [direction.parameter];
                let about = direction.base[direction.parameter];
                Bounds {
                    lower: (p.lower - about) / p.prior_sd,
                    upper: (p.upper - about) / p.prior_sd,
                }
            })
            .collect();
        Some(Self {
            quadratic,
            screen,
            inflation,
            choices,
            bounds,
        })
    }

    /// Evidence of a set beyond nothing, its best choice of shapes and values.
    pub(crate) fn evidence(&self, set: &[usize]) -> Option<(f64, Vec<usize>, DVector<f64>)> {
        let mut combinations: Vec<Vec<usize>> = vec![Vec::new()];
        let mut shapes = 0.0;
        for candidate in set {
            let choices = self.choices.get(candidate)?;
            shapes += (choices.len() as f64).ln();
            combinations = combinations
                .iter()
                .flat_map(|so_far| {
                    choices
                        .iter()
                        .map(move |choice| so_far.iter().chain(choice).copied().collect())
                })
                .collect();
        }
        combinations
            .into_iter()
            .filter_map(|columns| {
                let bounds: Vec<Bounds> = columns.iter().map(|at| self.bounds[*at]).collect();
                let best = self.quadratic.select(&columns).best(&bounds)?;
                Some((best.log_evidence - shapes, columns, best.z))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// A point from which to refit a set: the linear optimum.
    pub(crate) fn point(
        &self,
        linearized: &LinearizedProblem<'_>,
        from: &Point,
        set: &[usize],
    ) -> Option<Point> {
        let (_, columns, z) = self.evidence(set)?;
        let mut point = from.clone();
        // What goes with these values of the nuisance parameters and of what was fitted before, to first order: an effect that a
        // nuisance parameter nearly cancels would start far from anything without.
        let before = self.screen.before;
        let whole = self.screen.quadratic.inflated(self.inflation);
        let mut precision = whole.a.view((0, 0), (before, before)).into_owned();
        let mut slope = DVector::zeros(before);
        for axis in 0..before {
            precision[(axis, axis)] += 1.0;
        }
        for (column, z) in columns.iter().zip(z.iter()) {
            let across = whole.a.view((0, before + column), (before, 1));
            slope -= across.column(0) * *z;
        }
        if let Some(cholesky) = precision.cholesky() {
            let moved = linearized.problem.normalised(&point) + cholesky.solve(&slope);
            linearized.problem.set(&mut point, &moved);
        }
        for candidate in set {
            let found: Vec<(&Direction, f64)> = columns
                .iter()
                .zip(z.iter())
                .map(|(column, z)| (&self.screen.directions[*column], *z))
                .filter(|(direction, _)| direction.candidate == *candidate)
                .collect();
            let values = values(&linearized.problem, *candidate, &found);
            point.candidates.push(*candidate);
            point.values.push(values);
        }
        Some(point)
    }
}

/// Values of a candidate from the best steps along its directions.
pub(crate) fn values(
    problem: &SegmentedProblem<'_>,
    candidate: usize,
    found: &[(&Direction, f64)],
) -> Vec<f64> {
    let parameters = &problem.candidates[candidate].parameters;
    let mut values = found.first().map_or_else(
        || problem.candidates[candidate].null(),
        |(direction, _)| direction.base.clone(),
    );
    let Some(phase) = parameters.iter().position(|p| p.name == PHASE) else {
        for (direction, z) in found {
            let p = &parameters[direction.parameter];
            let value = direction.base[direction.parameter] + z * p.prior_sd;
            values[direction.parameter] = value.clamp(p.lower, p.upper);
        }
        return values;
    };
    // Amplitudes at several phases add up to one phasor a component; the strongest sets the phase.
    let mut phasors = vec![(0.0, 0.0); parameters.len()];
    for (direction, z) in found {
        let amplitude = z * parameters[direction.parameter].prior_sd;
        let (sine, cosine) = direction.base[phase].sin_cos();
        let phasor = &mut phasors[direction.parameter];
        phasor.0 += amplitude * cosine;
        phasor.1 += amplitude * sine;
    }
    let strongest = phasors
        .iter()
        .copied()
        .max_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)))
        .unwrap_or((1.0, 0.0));
    let angle = strongest.1.atan2(strongest.0);
    for (direction, _) in found {
        let (real, imaginary) = phasors[direction.parameter];
        let p = &parameters[direction.parameter];
        let along = real * angle.cos() + imaginary * angle.sin();
        values[direction.parameter] = along.clamp(p.lower, p.upper);
    }
    values[phase] = angle;
    values
}
