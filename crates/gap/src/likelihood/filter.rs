//! A Kalman filter over the segments of a track, with the parameters carried along as regressors.
//!
//! Latent are the start of every segment and the unmodelled forces along it. What they cannot explain of the residual and
//! of every parameter's column, whitened, goes into one Gram matrix (de Jong 1991, section 3), with which any set of
//! parameters is judged without filtering again.

use nalgebra::{DMatrix, DVector};

use crate::likelihood::{
    by_trial::{self, Deviation, Deviations},
    carry::Carry,
    columns::{LinkColumns, Whitened},
    disturbances::Disturbances,
    symmetric::add_symmetric,
};

/// Standard deviation of a start where the last segment ends, beside the unmodelled forces: rounding, steps of the
/// integrator [m, rad, m/s, rad/s].
const SEAM: f64 = 1e-7;

/// The likelihood of a track, quadratic in the parameters.
#[derive(Clone, Debug)]
pub(crate) struct Filtered {
    /// Row of the trial.
    pub(crate) trial: usize,
    /// Gram matrix of residual and parameters.
    pub(crate) gram: DMatrix<f64>,
    /// Half the logarithm of the determinant of the residuals' covariance.
    pub(crate) half_log_determinant: f64,
    /// Deviations of the trial's own that are integrated out.
    pub(crate) deviations: Deviations,
}

impl Filtered {
    /// With deviations of the trial's own integrated out; as it is where there are none.
    pub(crate) fn with_own(self, directions: &[Deviation]) -> Option<Self> {
        if directions.is_empty() {
            return Some(self);
        }
        let (gram, deviations, half) = by_trial::marginal(&self.gram, directions)?;
        Some(Self {
            gram,
            half_log_determinant: self.half_log_determinant + half,
            deviations,
            ..self
        })
    }

    /// With the columns of some parameters times a factor, none of them one that deviates.
    pub(crate) fn scaled(&self, parameters: &[usize], factor: f64) -> Self {
        let mut scaled = self.clone();
        for parameter in parameters {
            scaled.gram.column_mut(1 + parameter).scale_mut(factor);
            scaled.gram.row_mut(1 + parameter).scale_mut(factor);
        }
        scaled.deviations.scale(parameters, factor);
        scaled
    }
}

/// Starts and unmodelled forces given all readings.
#[derive(Clone, Debug)]
pub(crate) struct Smoothed {
    /// Tangent of every segment's start [2 nv].
    pub(crate) starts: Vec<DVector<f64>>,
    /// Forces of every segment, piece by piece, in their scales [pieces * nv].
    pub(crate) forces: Vec<DVector<f64>>,
}

/// Latents of one segment as its readings have them.
pub(super) struct Update {
    /// Prior mean of (start, forces) [latents, 1 + parameters], affine in the parameters: the first column and the others
    /// times the parameters.
    mean: DMatrix<f64>,
    /// Square root of the prior covariance [latents, sources of randomness].
    root: DMatrix<f64>,
    /// Lower triangular factor of the sources' posterior precision.
    lower: DMatrix<f64>,
    /// Square root of the latents' posterior covariance, transposed [sources, latents].
    spread: DMatrix<f64>,
    /// Shift of the mean by the readings, in that root [sources, 1 + parameters]; the first column is turned round.
    half: DMatrix<f64>,
}

impl Update {
    /// Posterior mean of the latents, all parameters at zero.
    fn latents(&self) -> DVector<f64> {
        self.mean.column(0) + self.spread.tr_mul(&self.half.column(0))
    }

    /// Posterior mean of the sources, all parameters at zero.
    fn sources(&self) -> Option<DVector<f64>> {
        self.lower.tr_solve_lower_triangular(&self.half.column(0))
    }
}

/// Covariances at a segment that the filter passed; a backward pass makes of them that of its latents given all readings.
pub(crate) struct Passed {
    /// Square root of the latents' prior covariance, given the segments before [latents, sources of randomness].
    pub(super) root: DMatrix<f64>,
    /// Posterior covariance of the sources, those of the state before the segment first.
    pub(super) sources: DMatrix<f64>,
    /// Covariance of the sources with the next segment's state, over the square root of that state's covariance
    /// [sources, state].
    pub(super) onward: DMatrix<f64>,
    /// True where the segment's prediction starts anew.
    pub(super) anew: bool,
}

/// State of the filter before a segment: its start, the force of the piece before and the drifts, affine in the parameters
/// [3 nv + drifting, 1 + parameters], and the square root of their covariance.
pub(super) struct Start {
    mean: DMatrix<f64>,
    root: DMatrix<f64>,
}

impl Start {
    pub(super) fn first(arrival: &DVector<f64>, parameters: usize, prior: Disturbances) -> Self {
        let (tangents, nv) = (arrival.len(), arrival.len() / 2);
        let size = tangents + nv + prior.drifting;
        let sd = DVector::from_fn(size, |axis, _| {
            if axis < tangents {
                arrival[axis]
            } else if axis < tangents + nv {
                prior.force
            } else {
                prior.drift
            }
        });
        Self {
            mean: DMatrix::zeros(size, 1 + parameters),
            root: DMatrix::from_diagonal(&sd),
        }
    }

    /// Mean and square root of the covariance of a segment's latents.
    pub(super) fn latents(&self, carry: &Carry) -> (DMatrix<f64>, DMatrix<f64>) {
        let (carried, fresh) = (carry.on(&self.root), carry.fresh());
        let mut root = DMatrix::zeros(carry.latents, carried.ncols() + fresh.ncols());
        root.columns_mut(0, carried.ncols()).copy_from(&carried);
        root.columns_mut(carried.ncols(), fresh.ncols())
            .copy_from(&fresh);
        (carry.on(&self.mean), root)
    }
}

/// Gram matrix of residual and parameters over all links [1 + parameters], for one of the sizes of correlated noise: what the
/// readings would say with every latent at zero.
pub(crate) fn head(links: &[LinkColumns], noise: usize, parameters: usize) -> DMatrix<f64> {
    let size = 1 + parameters;
    let mut sum = DMatrix::zeros(size, size);
    for link in links {
        sum += link.noise[noise].gram.view((0, 0), (size, size));
    }
    sum
}

/// Filters the track of a trial with one of the sizes of correlated noise that it was swept for. `head`: see [`head`];
/// `arrival`: standard deviation of the first start by axis [2 nv]; `prior`: of the disturbances; `passed`: what is wanted of
/// every segment beside.
pub(crate) fn filter(
    trial: usize,
    (links, noise): (&[LinkColumns], usize),
    head: &DMatrix<f64>,
    arrival: &DVector<f64>,
    prior: Disturbances,
    mut passed: Option<&mut Vec<Passed>>,
) -> Option<Filtered> {
    let parameters = head.nrows() - 1;
    let mut filtered = Filtered {
        trial,
        gram: head.clone(),
        half_log_determinant: 0.0,
        deviations: Deviations::default(),
    };
    let mut start = Start::first(arrival, parameters, prior);
    for link in links {
        let of = &link.noise[noise];
        if link.anew {
            start = Start::first(arrival, parameters, prior);
        }
        let update = update(&of.gram, parameters, &start, prior, Some(&mut filtered))?;
        filtered.half_log_determinant += of.half_log_determinant;
        let (next, spread) = predict(link, parameters, &update, prior)?;
        if let Some(passed) = &mut passed {
            let across = update.lower.tr_solve_lower_triangular(&spread)?;
            let onward = next.root.solve_lower_triangular(&across.transpose())?;
            let all = update.lower.nrows();
            let inverse = (update.lower).solve_lower_triangular(&DMatrix::identity(all, all))?;
            passed.push(Passed {
                root: update.root,
                sources: inverse.transpose() * &inverse,
                onward: onward.transpose(),
                anew: link.anew,
            });
        }
        start = next;
    }
    filtered.gram.fill_lower_triangle_with_upper_triangle();
    Some(filtered)
}

/// At known parameters, given all readings (the smoother of H. E. Rauch, F. Tung and C. T. Striebel, AIAA J. 3, 1965).
pub(crate) fn smooth(
    links: &[LinkColumns],
    noise: usize,
    z: &DVector<f64>,
    arrival: &DVector<f64>,
    prior: Disturbances,
) -> Option<Smoothed> {
    let tangents = arrival.len();
    let known: Vec<LinkColumns> = links.iter().map(|link| at(link, noise, z)).collect();
    let mut start = Start::first(arrival, 0, prior);
    let mut passed = Vec::with_capacity(links.len());
    for link in &known {
        let update = update(&link.noise[0].gram, 0, &start, prior, None)?;
        let (next, spread) = predict(link, 0, &update, prior)?;
        let across = update.lower.tr_solve_lower_triangular(&spread)?;
        // Those of the start with the force before come first.
        let before = start.root.ncols();
        passed.push(Moments {
            latents: update.latents(),
            latents_across: update.spread.tr_mul(&spread),
            before_across: &start.root * across.rows(0, before),
            before: start.mean.column(0) + &start.root * update.sources()?.rows(0, before),
            predicted: next.mean.column(0).into_owned(),
            root: next.root.clone(),
        });
        start = next;
    }
    let mut smoothed = Smoothed {
        starts: vec![DVector::zeros(tangents); links.len()],
        forces: vec![DVector::zeros(0); links.len()],
    };
    // The next segment's start, and the force before it.
    let mut later: Option<DVector<f64>> = None;
    for (at, passed) in passed.iter().enumerate().rev() {
        let (mut latents, mut before) = (passed.latents.clone(), passed.before.clone());
        if let Some(later) = &later {
            let half = passed
                .root
                .solve_lower_triangular(&(later - &passed.predicted))?;
            let innovation = passed.root.tr_solve_lower_triangular(&half)?;
            latents += &passed.latents_across * &innovation;
            before += &passed.before_across * &innovation;
        }
        smoothed.starts[at] = latents.rows(0, tangents).into_owned();
        let forces = prior.pieces(tangents, latents.len()) * (tangents / 2);
        smoothed.forces[at] = latents.rows(tangents, forces).into_owned();
        later = Some(before);
    }
    Some(smoothed)
}

/// Moments of a segment for the backward pass.
struct Moments {
    /// Start and forces given the readings so far, and their covariance with the next start.
    latents: DVector<f64>,
    latents_across: DMatrix<f64>,
    /// The same of the start with the force before it.
    before: DVector<f64>,
    before_across: DMatrix<f64>,
    /// The next start with the force before it, and the square root of its covariance.
    predicted: DVector<f64>,
    root: DMatrix<f64>,
}

/// A link with its parameters at known values, for one of its sizes of correlated noise.
pub(super) fn at(link: &LinkColumns, noise: usize, z: &DVector<f64>) -> LinkColumns {
    let of = &link.noise[noise];
    let (all, known) = (of.gram.nrows(), z.len());
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
    let known = Whitened {
        gram: turn.transpose() * &of.gram * &turn,
        half_log_determinant: of.half_log_determinant,
        scaled: Vec::new(),
        readings: match of.readings.is_empty() {
            true => DMatrix::zeros(0, 0),
            false => &of.readings * &turn,
        },
    };
    LinkColumns {
        noise: vec![known],
        end: ends,
        anew: link.anew,
    }
}

pub(super) fn update(
    gram: &DMatrix<f64>,
    parameters: usize,
    start: &Start,
    prior: Disturbances,
    filtered: Option<&mut Filtered>,
) -> Option<Update> {
    let all = gram.nrows();
    let head = 1 + parameters;
    let latents = all - head;
    let tangents = (start.mean.nrows() - prior.drifting) / 3 * 2;
    let carry = Carry::new(tangents, latents, prior);
    let (mean, root) = start.latents(&carry);
    // Innovations: the columns less what the latents' mean explains; G T, T = [1; +- mean].
    let mut signed = mean.clone();
    signed.column_mut(0).neg_mut();
    let across = gram.view((head, 0), (latents, head));
    let own = gram.view((head, head), (latents, latents));
    let latent_rows = across + own * &signed;
    let back = root.transpose();
    let mut w = &back * (own * &root);
    for axis in 0..w.nrows() {
        w[(axis, axis)] += 1.0;
    }
    let lower = w.cholesky()?.unpack();
    let mut spread = back;
    if !lower.solve_lower_triangular_mut(&mut spread) {
        return None;
    }
    let half = &spread * &latent_rows;
    if let Some(filtered) = filtered {
        // T' G T beside the head is A' m + m' A + m' B m, and is symmetric in m and A + B m / 2; m follows from the state before.
        let middle = carry.back(&(0.5 * (across + latent_rows)));
        let mut signed = start.mean.clone();
        signed.column_mut(0).neg_mut();
        let left = stacked([&middle, &signed, &half]);
        let right = stacked([&signed, &middle, &(-&half)]);
        add_symmetric(&mut filtered.gram, &left.transpose(), &right);
        let logs = lower.diagonal().map(f64::ln).sum();
        filtered.half_log_determinant += logs;
    }
    Some(Update {
        mean,
        root,
        lower,
        spread,
        half,
    })
}

/// Rows of matrices, one below the other.
fn stacked(parts: [&DMatrix<f64>; 3]) -> DMatrix<f64> {
    let rows = parts.iter().map(|of| of.nrows()).sum();
    let mut all = DMatrix::zeros(rows, parts[0].ncols());
    let mut first = 0;
    for part in parts {
        all.rows_mut(first, part.nrows()).copy_from(part);
        first += part.nrows();
    }
    all
}

/// The next segment's start with this one's last force, and the square root of their covariance that this segment leaves,
/// transposed [sources, state].
pub(super) fn predict(
    link: &LinkColumns,
    parameters: usize,
    update: &Update,
    prior: Disturbances,
) -> Option<(Start, DMatrix<f64>)> {
    let head = 1 + parameters;
    let latents = link.end.ncols() - head;
    let tangents = link.end.nrows();
    let nv = tangents / 2;
    let drifting = prior.drifting;
    let state = tangents + nv + drifting;
    // Rows of the latents that go on as they are.
    let last_force = tangents + prior.pieces(tangents, latents).saturating_sub(1) * nv;
    let kept = (last_force..last_force + nv).chain(latents - drifting..latents);
    let kept: Vec<usize> = kept.collect();
    let end = link.end.columns(head, latents);
    let onward = |of: &DMatrix<f64>| {
        let mut to = DMatrix::zeros(state, of.ncols());
        to.rows_mut(0, tangents).gemm(1.0, &end, of, 0.0);
        for (row, latent) in kept.iter().enumerate() {
            to.row_mut(tangents + row).copy_from(&of.row(*latent));
        }
        to
    };
    let spread = onward(&update.spread.transpose());
    let mut mean = onward(&update.mean);
    let mut moved = -(&spread * &update.half);
    moved.column_mut(0).neg_mut();
    mean += moved;
    let mut of_parameters = mean.rows_mut(0, tangents);
    of_parameters += link.end.columns(0, head);
    let across = spread.transpose();
    let mut covariance = &spread * &across;
    for axis in 0..state {
        covariance[(axis, axis)] += SEAM * SEAM + 1e-12 * covariance[(axis, axis)];
    }
    let covariance = 0.5 * (&covariance + covariance.transpose());
    let root = covariance.cholesky()?.l();
    Some((Start { mean, root }, across))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use crate::statistics::standard_normal;

    /// Three segments of a system with one degree of freedom, one parameter, a drift and two pieces of force and of a noisy command
    /// each: the filter gives the marginal likelihood of all readings at once, and the smoother their joint mean.
    #[test]
    fn it_agrees_with_all_readings_at_once() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let (rows, tangents, pieces) = (4, 2, 2);
        let latents_of = tangents + 2 * pieces + 2;
        let width = 2 + latents_of;
        let mut random = |rows: usize, columns: usize, size: f64| {
            DMatrix::from_fn(rows, columns, |_, _| size * standard_normal(&mut rng))
        };
        let outputs: Vec<DMatrix<f64>> = (0..3).map(|_| random(rows, width, 1.0)).collect();
        let mut ends: Vec<DMatrix<f64>> = (0..3).map(|_| random(tangents, width, 0.7)).collect();
        for end in &mut ends {
            // Drifts move nothing.
            end.columns_mut(width - 2, 2).fill(0.0);
        }
        let links: Vec<LinkColumns> = (outputs.iter().zip(&ends))
            .map(|(outputs, end)| LinkColumns {
                noise: vec![Whitened {
                    gram: outputs.tr_mul(outputs),
                    half_log_determinant: 0.0,
                    readings: DMatrix::zeros(0, 0),
                    scaled: Vec::new(),
                }],
                end: end.clone(),
                anew: false,
            })
            .collect();
        let arrival = DVector::from_vec(vec![0.4, 0.9]);
        let prior = Disturbances {
            force: 0.6,
            force_correlation: 0.8,
            commands: 1,
            drifting: 1,
            drift: 0.7,
            drift_correlation: 0.6,
        };
        let z = DVector::from_vec(vec![0.3]);
        // Sources: first start, the force before it, fresh forces, noise of the command, first drift, fresh drifts. Rows of every
        // latent in them, and their means.
        let first_noise = tangents + 1 + 3 * pieces;
        let first_drift = first_noise + 3 * pieces;
        let sources = first_drift + 4;
        let mut start = DMatrix::<f64>::zeros(tangents, sources);
        start[(0, 0)] = arrival[0];
        start[(1, 1)] = arrival[1];
        let mut mean = DVector::<f64>::zeros(tangents);
        let mut last = DMatrix::<f64>::zeros(1, sources);
        last[(0, tangents)] = prior.force;
        let mut drift = DMatrix::<f64>::zeros(1, sources);
        drift[(0, first_drift)] = prior.drift;
        let mut design = DMatrix::<f64>::zeros(3 * rows, sources);
        let mut residual = DVector::<f64>::zeros(3 * rows);
        let mut starts = Vec::new();
        for at in 0..3 {
            starts.push((start.clone(), mean.clone()));
            let mut latents = DMatrix::<f64>::zeros(latents_of, sources);
            latents
                .view_mut((0, 0), (tangents, sources))
                .copy_from(&start);
            for piece in 0..pieces {
                last *= prior.force_correlation;
                last[(0, tangents + 1 + at * pieces + piece)] = prior.force * 0.6;
                latents
                    .view_mut((tangents + piece, 0), (1, sources))
                    .copy_from(&last);
                latents[(tangents + pieces + piece, first_noise + at * pieces + piece)] = 1.0;
            }
            let mut put = |row: usize, drift: &DMatrix<f64>| {
                latents
                    .view_mut((tangents + 2 * pieces + row, 0), (1, sources))
                    .copy_from(drift);
            };
            put(0, &drift);
            drift *= prior.drift_correlation;
            drift[(0, first_drift + 1 + at)] = prior.drift * 0.8;
            put(1, &drift);
            let of = &outputs[at];
            let of_latents = of.columns(2, latents_of);
            design
                .view_mut((at * rows, 0), (rows, sources))
                .copy_from(&(of_latents * &latents));
            let left = of.column(0) - of.column(1) * z[0] - of.columns(2, tangents) * &mean;
            residual.rows_mut(at * rows, rows).copy_from(&left);
            let end = &ends[at];
            mean = end.column(0) + end.column(1) * z[0] + end.columns(2, tangents) * &mean;
            start = end.columns(2, latents_of) * &latents;
        }
        let covariance = DMatrix::identity(3 * rows, 3 * rows) + &design * design.transpose();
        let factor = covariance.cholesky().unwrap();
        let misfit = residual.dot(&factor.solve(&residual));
        let logs: f64 = factor.l_dirty().diagonal().map(f64::ln).sum();
        let filtered = filter(0, (&links, 0), &head(&links, 0, 1), &arrival, prior, None).unwrap();
        let along = DVector::from_vec(vec![1.0, -z[0]]);
        let found = (&filtered.gram * &along).dot(&along);
        assert!((found / misfit - 1.0).abs() < 1e-6, "{found} {misfit}");
        assert!((filtered.half_log_determinant - logs).abs() < 1e-6);
        let drawn = design.tr_mul(&factor.solve(&residual));
        let smoothed = smooth(&links, 0, &z, &arrival, prior).unwrap();
        for ((rows_of, mean), found) in starts.iter().zip(&smoothed.starts) {
            assert!((rows_of * &drawn + mean - found).norm() < 1e-5, "{found}");
        }
    }

    /// A prediction that starts anew knows nothing of the segments before.
    #[test]
    fn predictions_that_start_anew_are_trials_of_their_own() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let (tangents, width) = (2, 6);
        let mut links: Vec<LinkColumns> = (0..4)
            .map(|_| {
                let outputs = DMatrix::from_fn(5, width, |_, _| standard_normal(&mut rng));
                LinkColumns {
                    noise: vec![Whitened {
                        gram: outputs.tr_mul(&outputs),
                        half_log_determinant: 0.0,
                        readings: DMatrix::zeros(0, 0),
                        scaled: Vec::new(),
                    }],
                    end: DMatrix::from_fn(tangents, width, |_, _| standard_normal(&mut rng)),
                    anew: false,
                }
            })
            .collect();
        let arrival = DVector::from_vec(vec![0.4, 0.9]);
        let prior = Disturbances {
            force: 0.6,
            force_correlation: 0.8,
            commands: 0,
            drifting: 0,
            drift: 0.0,
            drift_correlation: 0.0,
        };
        let filtered = |links: &[LinkColumns]| {
            filter(0, (links, 0), &head(links, 0, 1), &arrival, prior, None).unwrap()
        };
        let (one, other) = (filtered(&links[..2]), filtered(&links[2..]));
        let whole = filtered(&links);
        links[2].anew = true;
        let apart = filtered(&links);
        assert!((&apart.gram - &one.gram - &other.gram).norm() < 1e-10);
        assert!((&whole.gram - &one.gram - &other.gram).norm() > 1e-3);
        let logs = one.half_log_determinant + other.half_log_determinant;
        assert!((apart.half_log_determinant - logs).abs() < 1e-10);
    }
}
