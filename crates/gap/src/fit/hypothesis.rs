//! A hypothesis: a set of candidate effects with values at one point, and its fit to the data.

use nalgebra::{DMatrix, DVector};

use crate::fit::{
    laplace::{Optimum, Quadratic},
    truncated_normal::Bounds,
};

/// A set of candidates with values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Rows of `LinearizedProblem::candidates`.
    pub(crate) candidates: Vec<usize>,
    /// Values of each candidate, in the order of its parameters.
    pub(crate) values: Vec<Vec<f64>>,
    /// Nuisance parameters in standard deviations.
    pub(crate) nuisances: DVector<f64>,
    /// Start of each segment, as a tangent from where the linearised problem has it.
    pub(crate) starts: Vec<DVector<f64>>,
}

impl Point {
    /// Its candidates, ascending.
    pub(crate) fn set(&self) -> Vec<usize> {
        let mut set = self.candidates.clone();
        set.sort_unstable();
        set
    }

    /// The point without its candidate number `row`.
    pub(crate) fn without(&self, row: usize) -> Self {
        let mut rest = self.clone();
        rest.candidates.remove(row);
        rest.values.remove(row);
        rest
    }
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) point: Point,
    /// About zero in (nuisance parameters, parameters); per trial, so that trials can be drawn again.
    pub(crate) quadratics: Vec<Quadratic>,
    pub(crate) bounds: Vec<Bounds>,
    /// Squared whitened residuals at the point.
    pub(crate) misfit: f64,
    /// Penalty of the priors of nuisance parameters and effect parameters.
    pub(crate) penalty: f64,
    /// Penalty of the priors of the starts.
    pub(crate) arrival: f64,
    /// Whitened residuals by segment [readings], at the point.
    pub(crate) residuals: Vec<Vec<f64>>,
    /// Change of the whitened predictions, by segment.
    pub(crate) columns: Vec<Columns>,
    /// Nuisance parameters about which the columns of the nuisance parameters were made.
    pub(crate) about: DVector<f64>,
    /// Readings that count.
    pub(crate) readings: usize,
}

/// Change of the whitened predictions of a segment with a point's parameters.
#[derive(Clone, Debug)]
pub(crate) struct Columns {
    /// With its own [readings, parameters].
    pub(crate) own: DMatrix<f32>,
    /// With the nuisance parameters, where the shared ones do not serve.
    pub(crate) nuisances: Option<DMatrix<f32>>,
}

impl Fit {
    pub(crate) fn quadratic(&self) -> Quadratic {
        sum(self.quadratics.iter())
    }

    /// Absolute log evidence (up to the constant of the noise) and the optimum, where every squared
    /// residual counts `1 / inflation`.
    pub(crate) fn evidence(&self, inflation: f64) -> Option<(f64, Optimum)> {
        self.quadratic().inflated(inflation).evidence(&self.bounds)
    }

    /// The cost that a fit minimises: squared whitened residuals and the penalties of all priors.
    pub(crate) fn cost(&self) -> f64 {
        self.misfit + self.penalty + self.arrival
    }

    /// Nuisance parameters whose predictions correlate with those of an effect by more than `correlation`.
    pub(crate) fn correlated(&self, correlation: f64) -> Vec<usize> {
        let (nuisances, all) = (self.point.nuisances.len(), self.bounds.len());
        let a = self.quadratic().a;
        let alike = |nuisance: usize, own: usize| {
            a[(nuisance, own)].powi(2)
                > correlation * correlation * a[(nuisance, nuisance)] * a[(own, own)]
        };
        (0..nuisances)
            .filter(|nuisance| (nuisances..all).any(|own| alike(*nuisance, own)))
            .collect()
    }

    pub(crate) fn is_stale(&self, shift: f64) -> bool {
        !stale(&self.point.nuisances, &self.about, shift).is_empty()
    }
}

/// Sum of quadratics of the same parameters.
pub(crate) fn sum<'a>(quadratics: impl Iterator<Item = &'a Quadratic>) -> Quadratic {
    quadratics
        .cloned()
        .reduce(|mut a, b| {
            a.q += b.q;
            a.b += b.b;
            a.a += b.a;
            a
        })
        .unwrap_or(Quadratic {
            q: 0.0,
            b: DVector::zeros(0),
            a: DMatrix::zeros(0, 0),
        })
}

/// Nuisance parameters that have moved by more than `shift` since their sensitivities were computed about `about`.
pub(crate) fn stale(nuisances: &DVector<f64>, about: &DVector<f64>, shift: f64) -> Vec<usize> {
    let apart = nuisances - about;
    (0..apart.len())
        .filter(|at| apart[*at].abs() > shift)
        .collect()
}

/// Half way between two points of the same candidates.
pub(crate) fn midway(a: &Point, b: &Point) -> Point {
    Point {
        candidates: a.candidates.clone(),
        values: a
            .values
            .iter()
            .zip(&b.values)
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect())
            .collect(),
        nuisances: 0.5 * (&a.nuisances + &b.nuisances),
        starts: a
            .starts
            .iter()
            .zip(&b.starts)
            .map(|(a, b)| 0.5 * (a + b))
            .collect(),
    }
}

/// The point `about`, at `nuisances` along some of its axes.
pub(crate) fn moved(
    about: &DVector<f64>,
    nuisances: &DVector<f64>,
    axes: &[usize],
) -> DVector<f64> {
    let mut about = about.clone();
    for axis in axes {
        about[*axis] = nuisances[*axis];
    }
    about
}
