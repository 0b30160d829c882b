//! The error of a form: what each parameter of an effect contributes may be off, at every level of its size by itself, and
//! so may what a spring of the nominal does.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::{
    likelihood::{
        neglected_terms,
        step_changes::{Inputs, References, StateChanges},
        track::Rolled,
    },
    options::LikelihoodOptions,
    plant::Quantity,
    problem::{point::Point, problem::Problem},
};

/// Parameters that are integrated out, the first of a sweep's.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Beside {
    /// Number of uncertain numbers of the nominal.
    pub(crate) numbers: usize,
    /// Columns of errors of form: of the nominal, and of the candidates of the working point, two each: by levels of their
    /// size, and in the terms that they neglect.
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
        let mut present: Vec<usize> = of.filter(|candidate| set.contains(candidate)).collect();
        present.dedup();
        present
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
    for candidate in &point.candidates {
        let of = &problem.candidates[*candidate];
        let has_error = of.parameters.iter().filter(|p| of.has_form_error(p));
        forms.push(next(Some(*candidate), levels * has_error.count()));
        forms.push(next(Some(*candidate), neglected_terms::count(problem, of)));
    }
    Beside {
        numbers: problem.nuisances.len(),
        forms,
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

/// A track as swept: how it was rolled out, a step of the base from every boundary, and changes with the state and with forces
/// of a size on every degree of freedom.
#[derive(Clone, Copy)]
pub(crate) struct Base<'s> {
    pub(crate) rolled: &'s [Rolled],
    pub(crate) references: &'s References,
    pub(crate) states: &'s [StateChanges],
    pub(crate) force_scale: &'s DVector<f64>,
}

/// The inputs with errors of form after those of the nuisance parameters: what each own parameter contributes, by levels of
/// its size, and the terms that each candidate's law neglects.
pub(crate) fn with_forms(
    problem: &Problem<'_>,
    point: &Point,
    base: Base<'_>,
    mut inputs: Vec<Option<Inputs>>,
) -> Vec<Option<Inputs>> {
    let nuisances = problem.nuisances.len();
    let options = &problem.settings.options.likelihood;
    let mut made = Vec::new();
    for at in springs(problem) {
        made.extend(by_levels(inputs[at].as_ref(), 1.0, options));
    }
    let mut at = nuisances;
    let own = point.candidates.iter().zip(&point.values).zip(&point.forms);
    for ((candidate, values), form) in own {
        let of = &problem.candidates[*candidate];
        let [by_level, neglected] = form.map(|form| form * options.form_error);
        for (p, value) in of.parameters.iter().zip(values) {
            if of.has_form_error(p) {
                let size = by_level * (value - p.null) / p.prior_sd;
                made.extend(by_levels(inputs[at].as_ref(), size, options));
            }
            at += 1;
        }
        made.extend(neglected_terms::inputs(
            problem,
            (base.rolled, base.references),
            (base.states, base.force_scale),
            (of, values, neglected),
        ));
    }
    inputs.splice(nuisances..nuisances, made);
    inputs
}

/// The part `size_of_error` of one parameter's contribution, by levels of its size.
fn by_levels(
    of: Option<&Inputs>,
    size_of_error: f64,
    options: &LikelihoodOptions,
) -> Vec<Option<Inputs>> {
    let levels = options.form_levels;
    let Some(of) = of else {
        return (0..levels).map(|_| None).collect();
    };
    let mut made = Vec::with_capacity(levels);
    // What moves nothing, because the motion is prescribed, has its size in the readings.
    let moves = (of.0.iter()).any(|(states, _)| states.iter().any(|value| *value != 0.0));
    let size = |states: &DMatrix<f32>, direct: &DMatrix<f32>, boundary: usize| {
        let of = if moves { states } else { direct };
        f64::from(of.column(boundary).norm())
    };
    let largest = (of.0.iter())
        .flat_map(|(states, direct)| {
            (0..states.ncols()).map(|boundary| size(states, direct, boundary))
        })
        .fold(f64::MIN_POSITIVE, f64::max);
    // Equally far apart on a logarithmic scale, where a power that differs is a straight line.
    let knots: Vec<f64> = (0..levels)
        .map(|level| {
            let below = levels.saturating_sub(1 + level) as f64 / (levels - 1).max(1) as f64;
            largest.ln() - below * options.form_range.ln()
        })
        .collect();
    for level in 0..levels {
        let links = of.0.iter().map(|(states, direct)| {
            let (mut states, mut direct) = (states.clone(), direct.clone());
            for boundary in 0..states.ncols() {
                let part = hat(&knots, level, size(&states, &direct, boundary).ln());
                let factor = (size_of_error * part) as f32;
                states.column_mut(boundary).scale_mut(factor);
                direct.column_mut(boundary).scale_mut(factor);
            }
            (states, direct)
        });
        made.push(Some(Inputs(links.collect())));
    }
    made
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
