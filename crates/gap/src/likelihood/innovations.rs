//! Innovations: the differences of a segment's readings from their prediction by the segments before.
//!
//! The squared innovation of any sensor over its covariance is chi-square distributed where the model is right, with as many
//! degrees of freedom as readings, and independent from segment to segment (R. K. Mehra, IEEE Trans. Autom. Control 15,
//! 1970, section III).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::{
    likelihood::{
        carry::Carry,
        columns::LinkColumns,
        disturbances::Disturbances,
        filter::{self, Start},
        track::Track,
    },
    problem::problem::Problem,
};

/// Innovation of one segment.
#[derive(Clone, Debug)]
pub(crate) struct Innovation {
    /// Rows of the trial.
    pub(crate) rows: Range<usize>,
    /// True where the prediction starts anew.
    pub(crate) first: bool,
    /// Squared innovation over its covariance and readings, by source of the channels.
    pub(crate) sources: Vec<(f64, usize)>,
}

/// Innovations of a track at known parameters `z`, for one of the sizes of correlated noise that it was swept for.
pub(crate) fn innovations(
    problem: &Problem<'_>,
    track: &Track,
    links: &[LinkColumns],
    noise: usize,
    z: &DVector<f64>,
    (arrival, prior): (&DVector<f64>, Disturbances),
) -> Option<Vec<Innovation>> {
    let width = problem.channels.len();
    let mut start = Start::first(arrival, 0, prior);
    let mut all = Vec::with_capacity(links.len());
    for (link, of) in links.iter().zip(&track.links) {
        let link = filter::at(link, noise, z);
        if link.anew {
            start = Start::first(arrival, 0, prior);
        }
        let latents = link.end.ncols() - 1;
        let carry = Carry::new(arrival.len(), latents, prior);
        let (mean, root) = start.latents(&carry);
        let readings = &link.noise[0].readings;
        let columns = readings.columns(1, latents);
        let left = readings.column(0) - columns * mean.column(0);
        let spread = columns * root;
        let sources = problem
            .channels
            .sources
            .iter()
            .map(|source| {
                let channels = source.channel..source.channel + source.channels;
                let rows: Vec<usize> = (0..readings.nrows())
                    .filter(|row| channels.contains(&(row % width)))
                    .filter(|row| readings.row(*row).iter().any(|value| *value != 0.0))
                    .collect();
                (squared(&left, &spread, &rows), rows.len())
            })
            .collect();
        all.push(Innovation {
            rows: of.segment.rows.clone(),
            first: link.anew,
            sources,
        });
        let update = filter::update(&link.noise[0].gram, 0, &start, prior, None)?;
        start = filter::predict(&link, 0, &update, prior)?.0;
    }
    Some(all)
}

/// Square of some innovations over their covariance, unit noise and what the latents spread.
fn squared(left: &DVector<f64>, spread: &DMatrix<f64>, rows: &[usize]) -> f64 {
    let some = DVector::from_iterator(rows.len(), rows.iter().map(|row| left[*row]));
    let spread = spread.select_rows(rows);
    let mut covariance = &spread * spread.transpose();
    for axis in 0..rows.len() {
        covariance[(axis, axis)] += 1.0;
    }
    // The covariance is no smaller than unity.
    covariance
        .cholesky()
        .map_or(0.0, |factor| some.dot(&factor.solve(&some)))
}
