//! A Kalman filter over the segments of a track, with the parameters carried along as regressors.
//!
//! Latent are the start of every segment and the unmodelled forces along it. What they cannot explain of the residual and
//! of every parameter's column, whitened, goes into one Gram matrix (de Jong 1991, section 3), with which any set of
//! parameters is judged without filtering again.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::likelihood::columns::LinkColumns;

/// Standard deviation of a start where the last segment ends, beside the unmodelled forces: rounding, steps of the
/// integrator [m, rad, m/s, rad/s].
const SEAM: f64 = 1e-7;

/// The likelihood of a track, quadratic in the parameters.
#[derive(Clone, Debug)]
pub(crate) struct Filtered {
    /// Gram matrix of residual and parameters.
    pub(crate) gram: DMatrix<f64>,
    /// Half the logarithm of the determinant of the residuals' covariance.
    pub(crate) half_log_determinant: f64,
}

/// Starts and unmodelled forces given all readings.
#[derive(Clone, Debug)]
pub(crate) struct Smoothed {
    /// Tangent of every segment's start [2 nv].
    pub(crate) starts: Vec<DVector<f64>>,
    /// Forces of every segment, piece by piece, in their scales [pieces * nv].
    pub(crate) forces: Vec<DVector<f64>>,
}

/// Moments of the latents of one segment given those before.
struct Update {
    /// Posterior mean of (start, forces) [latents, 1 + parameters]: the first column less the others times the parameters.
    mean: DMatrix<f64>,
    /// Square root of the prior covariance [latents, latents].
    root: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
}

/// State of the filter before a segment: mean of the start, affine in the parameters [2 nv, 1 + parameters], and the
/// square root of its covariance.
struct Start {
    mean: DMatrix<f64>,
    root: DMatrix<f64>,
}

/// Filters a track. `arrival`: standard deviation of the first start by axis [2 nv]; `force`: of the unmodelled forces, in
/// their scales.
pub(crate) fn filter(
    links: &[LinkColumns],
    parameters: usize,
    arrival: &DVector<f64>,
    force: f64,
) -> Option<Filtered> {
    let mut filtered = Filtered {
        gram: DMatrix::zeros(1 + parameters, 1 + parameters),
        half_log_determinant: 0.0,
    };
    let mut start = Start {
        mean: DMatrix::zeros(arrival.len(), 1 + parameters),
        root: DMatrix::from_diagonal(arrival),
    };
    for link in links {
        let update = update(link, parameters, &start, force, Some(&mut filtered))?;
        start = predict(link, parameters, &start, &update)?.0;
    }
    Some(filtered)
}

/// At known parameters, given all readings (the smoother of H. E. Rauch, F. Tung and C. T. Striebel, AIAA J. 3, 1965).
pub(crate) fn smooth(
    links: &[LinkColumns],
    z: &DVector<f64>,
    arrival: &DVector<f64>,
    force: f64,
) -> Option<Smoothed> {
    let tangents = arrival.len();
    let known: Vec<LinkColumns> = links.iter().map(|link| at(link, z)).collect();
    let mut start = Start {
        mean: DMatrix::zeros(tangents, 1),
        root: DMatrix::from_diagonal(arrival),
    };
    let mut passed = Vec::with_capacity(links.len());
    for link in &known {
        let update = update(link, 0, &start, force, None)?;
        let (next, across) = predict(link, 0, &start, &update)?;
        let mut posterior = update.mean.column(0).into_owned();
        let mut first = posterior.rows_mut(0, tangents);
        first += start.mean.column(0);
        passed.push((
            posterior,
            across,
            next.mean.column(0).into_owned(),
            &next.root * next.root.transpose(),
        ));
        start = next;
    }
    let mut starts = vec![DVector::zeros(tangents); links.len()];
    let mut forces = vec![DVector::zeros(0); links.len()];
    let mut later: Option<DVector<f64>> = None;
    for (at, (posterior, across, predicted, covariance)) in passed.iter().enumerate().rev() {
        let mut smoothed = posterior.clone();
        if let Some(later) = &later {
            let innovation = covariance.clone().cholesky()?.solve(&(later - predicted));
            smoothed += across * innovation;
        }
        starts[at] = smoothed.rows(0, tangents).into_owned();
        forces[at] = smoothed
            .rows(tangents, smoothed.len() - tangents)
            .into_owned();
        later = Some(starts[at].clone());
    }
    Some(Smoothed { starts, forces })
}

/// A link with its parameters at known values.
fn at(link: &LinkColumns, z: &DVector<f64>) -> LinkColumns {
    let (all, known) = (link.gram.nrows(), z.len());
    let mut turn = DMatrix::zeros(all, all - known);
    turn[(0, 0)] = 1.0;
    for (row, value) in z.iter().enumerate() {
        turn[(1 + row, 0)] = -value;
    }
    for rest in 1 + known..all {
        turn[(rest, rest - known)] = 1.0;
    }
    let mut end = link.end.columns(0, 1).into_owned();
    end += link.end.columns(1, known) * z;
    let mut ends = DMatrix::zeros(link.end.nrows(), all - known);
    ends.set_column(0, &end.column(0));
    ends.columns_mut(1, all - known - 1)
        .copy_from(&link.end.columns(1 + known, all - known - 1));
    LinkColumns {
        gram: turn.transpose() * &link.gram * &turn,
        end: ends,
        squares: link.squares.clone(),
    }
}

fn update(
    link: &LinkColumns,
    parameters: usize,
    start: &Start,
    force: f64,
    filtered: Option<&mut Filtered>,
) -> Option<Update> {
    let all = link.gram.nrows();
    let (head, tangents) = (1 + parameters, start.mean.nrows());
    let latents = all - head;
    let mut root = DMatrix::zeros(latents, latents);
    root.view_mut((0, 0), (tangents, tangents))
        .copy_from(&start.root);
    for latent in tangents..latents {
        root[(latent, latent)] = force;
    }
    // Innovations: the columns less what the start's mean explains.
    let across = link.gram.view((0, head), (all, tangents));
    let mut signed = start.mean.clone();
    signed.column_mut(0).neg_mut();
    // G T, T = [I; +- mean; 0].
    let turned = link.gram.columns(0, head) + across * &signed;
    let latent_rows = turned.rows(head, latents);
    let u = root.tr_mul(&latent_rows.into_owned());
    let curvature = link.gram.view((head, head), (latents, latents)) * &root;
    let mut w = root.tr_mul(&curvature);
    for axis in 0..latents {
        w[(axis, axis)] += 1.0;
    }
    let factor = w.cholesky()?;
    let solved = factor.solve(&u);
    if let Some(filtered) = filtered {
        let own = turned.rows(0, head) + signed.tr_mul(&turned.rows(head, tangents).into_owned());
        filtered.gram += own - u.tr_mul(&solved);
        let logs = factor.l_dirty().diagonal().map(f64::ln).sum();
        filtered.half_log_determinant += logs;
    }
    Some(Update {
        mean: &root * solved,
        root,
        factor,
    })
}

/// The next segment's start, and the covariance of this segment's latents with it.
fn predict(
    link: &LinkColumns,
    parameters: usize,
    start: &Start,
    update: &Update,
) -> Option<(Start, DMatrix<f64>)> {
    let (head, tangents) = (1 + parameters, start.mean.nrows());
    let latents = link.gram.nrows() - head;
    let to = link.end.columns(head, latents).into_owned();
    // Start and forces, affine in the parameters.
    let mut posterior = -&update.mean;
    posterior.column_mut(0).neg_mut();
    let mut first = posterior.rows_mut(0, tangents);
    first += &start.mean;
    let mean = link.end.columns(0, head) + &to * posterior;
    let spread = (&to * &update.root).transpose();
    let solved = update.factor.solve(&spread);
    let mut covariance = spread.tr_mul(&solved);
    for axis in 0..tangents {
        covariance[(axis, axis)] += SEAM * SEAM + 1e-12 * covariance[(axis, axis)];
    }
    let across = &update.root * solved;
    let covariance = 0.5 * (&covariance + covariance.transpose());
    let root = covariance.cholesky()?.l();
    Some((Start { mean, root }, across))
}
