//! The error of a form: what each parameter of an effect contributes may be off, at every level of its size by itself, and
//! so may what a spring of the nominal does.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::{
    likelihood::{
        direction_error,
        step_changes::{Inputs, StateChanges},
        track::Track,
    },
    plant::Quantity,
    problem::{candidates::Candidate, point::Point, problem::Problem},
};

/// Parameters that are integrated out, the first of a sweep's.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Beside {
    /// Number of uncertain numbers of the nominal.
    pub(crate) numbers: usize,
    /// Columns of errors of form: of the nominal, and of the candidates of the working point.
    pub(crate) forms: Vec<(Option<usize>, Range<usize>)>,
}

impl Beside {
    /// Number of columns.
    pub(crate) fn len(&self) -> usize {
        self.forms.last().map_or(self.numbers, |(_, of)| of.end)
    }

    /// Number of errors of form.
    pub(crate) fn forms(&self) -> usize {
        self.len() - self.numbers
    }

    /// Candidates of a set whose form may be off.
    pub(super) fn present(&self, set: &[usize]) -> Vec<usize> {
        let of = self.forms.iter().filter_map(|(candidate, _)| *candidate);
        of.filter(|candidate| set.contains(candidate)).collect()
    }

    /// Uncertain numbers, and the errors of form of these candidates.
    pub(super) fn columns(&self, present: &[usize]) -> Vec<usize> {
        let forms = self.forms.iter();
        let forms = forms.filter(|(of, _)| of.is_none_or(|candidate| present.contains(&candidate)));
        (0..self.numbers)
            .chain(forms.flat_map(|(_, of)| of.clone()))
            .collect()
    }
}

/// Columns that are integrated out at a point: uncertain numbers, errors of form by candidate.
pub(crate) fn beside(problem: &Problem<'_>, point: &Point) -> Beside {
    let levels = problem.settings.options.likelihood.form_levels;
    let mut first = problem.nuisances.len();
    let mut next = |of: Option<usize>, count: usize| {
        let columns = first..first + count;
        first = columns.end;
        (of, columns)
    };
    let mut forms = vec![next(None, levels * springs(problem).count())];
    forms.extend(point.candidates.iter().map(|candidate| {
        let of = &problem.candidates[*candidate];
        let count = of
            .parameters
            .iter()
            .filter(|p| of.has_form_error(p))
            .count();
        let each = levels + other_axes(problem, of);
        next(Some(*candidate), each * count)
    }));
    Beside {
        numbers: problem.nuisances.len(),
        forms,
    }
}

/// Columns of one parameter for the error of its direction.
fn other_axes(problem: &Problem<'_>, of: &Candidate) -> usize {
    match direction_error::applies(problem, of) {
        true => direction_error::COUNT,
        false => 0,
    }
}

/// Nuisance parameters in use that scale a spring: its force is uncertain at every level of its size, not by a number alone.
fn springs(problem: &Problem<'_>) -> impl Iterator<Item = usize> {
    let nuisances = problem.nuisances.iter().enumerate();
    nuisances
        .filter(|(_, (of, _))| {
            matches!(
                problem.model.nuisances[*of].quantity,
                Quantity::Stiffness(_)
            )
        })
        .map(|(at, _)| at)
}

/// Own parameters that have an error of form: places among the point's own parameters, their values in standard deviations
/// of the prior times the factor on the error, and their columns for the error of direction.
fn amplitudes<'a>(
    problem: &'a Problem<'_>,
    point: &'a Point,
) -> impl Iterator<Item = (usize, f64, usize)> + 'a {
    let own = point.candidates.iter().zip(&point.values).zip(&point.forms);
    own.flat_map(|((candidate, values), form)| {
        let candidate = &problem.candidates[*candidate];
        let parameters = candidate.parameters.iter().zip(values);
        let others = other_axes(problem, candidate);
        parameters.map(move |(p, value)| {
            let z = form * (value - p.null) / p.prior_sd;
            (candidate.has_form_error(p), z, others)
        })
    })
    .enumerate()
    .filter(|(_, (has, ..))| *has)
    .map(|(at, (_, z, others))| (at, z, others))
}

/// The inputs with errors of form after those of the nuisance parameters: what each own parameter contributes, by levels of
/// its size, and turned to other axes.
///
/// `states`: changes with forces of size `scale` on every degree of freedom.
pub(crate) fn with_forms(
    problem: &Problem<'_>,
    point: &Point,
    track: &Track,
    (states, scale): (&[StateChanges], &DVector<f64>),
    mut inputs: Vec<Option<Inputs>>,
) -> Vec<Option<Inputs>> {
    let nuisances = problem.nuisances.len();
    let error = problem.settings.options.likelihood.form_error;
    let levels = problem.settings.options.likelihood.form_levels;
    let mut made = Vec::new();
    let own = amplitudes(problem, point).map(|(at, z, others)| (nuisances + at, error * z, others));
    for (at, size_of_error, others) in springs(problem).map(|at| (at, 1.0, 0)).chain(own) {
        let Some(of) = &inputs[at] else {
            made.extend((0..levels + others).map(|_| None));
            continue;
        };
        // What moves nothing, because the motion is prescribed, has its size in the readings.
        let moves = (of.0.iter()).any(|(states, _)| states.iter().any(|value| *value != 0.0));
        let size = |states: &DMatrix<f32>, direct: &DMatrix<f32>, boundary: usize| {
            let of = if moves { states } else { direct };
            f64::from(of.column(boundary).norm())
        };
        let mut sizes: Vec<f64> = (of.0.iter())
            .flat_map(|(states, direct)| {
                (0..states.ncols()).map(|boundary| size(states, direct, boundary))
            })
            .collect();
        sizes.sort_by(f64::total_cmp);
        let knots: Vec<f64> = (0..levels)
            .map(|level| sizes[(sizes.len() - 1) * level / (levels - 1).max(1)])
            .collect();
        for level in 0..levels {
            let links = of.0.iter().map(|(states, direct)| {
                let (mut states, mut direct) = (states.clone(), direct.clone());
                for boundary in 0..states.ncols() {
                    let part = hat(&knots, level, size(&states, &direct, boundary));
                    let factor = (size_of_error * part) as f32;
                    states.column_mut(boundary).scale_mut(factor);
                    direct.column_mut(boundary).scale_mut(factor);
                }
                (states, direct)
            });
            made.push(Some(Inputs(links.collect())));
        }
        if others > 0 {
            let turn = problem.settings.options.likelihood.direction_error / error * size_of_error;
            let turned = direction_error::along_others(problem, track, of, states, scale, turn);
            match turned {
                Some(turned) => made.extend(turned.into_iter().map(Some)),
                None => made.extend((0..others).map(|_| None)),
            }
        }
    }
    inputs.splice(nuisances..nuisances, made);
    inputs
}

/// Value of a hat function over ascending knots.
fn hat(knots: &[f64], level: usize, x: f64) -> f64 {
    let rise = |from: f64, to: f64| {
        if to > from {
            ((x - from) / (to - from)).clamp(0.0, 1.0)
        } else {
            f64::from(u8::from(x >= to))
        }
    };
    let up = if level == 0 {
        1.0
    } else {
        rise(knots[level - 1], knots[level])
    };
    let down = if level + 1 == knots.len() {
        0.0
    } else {
        rise(knots[level], knots[level + 1])
    };
    (up - down).max(0.0)
}
