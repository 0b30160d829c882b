//! The residual wrench: the wrench on the base that explains the data where no effect of the catalogue does.
//!
//! Along every fit trial the windows of [`smoother`] give a wrench and its standard deviation, about the
//! nominal model with its fitted numbers. A force model is learned from them by the command line.

mod chain;
mod smoother;
#[cfg(test)]
mod tests;
mod windows;

use hydro_frames::STANDARD_GRAVITY;
use rayon::prelude::*;

use crate::{error::GapError, plant::FreeBase, problem::problem::Problem, progress::Watch};
use smoother::{RandomWalk, TrialSmoother};
use windows::WindowProblem;

/// Step of the difference quotients of the wrench, relative to its scale.
const STEP: f64 = 1e-3;
/// Gauss-Newton steps at most.
const ITERATIONS: usize = 6;
/// A part of the cost that a step must bring.
const CONVERGED: f64 = 1e-4;

/// The missing wrench along one trial, at samples of one period.
#[derive(Clone, Debug)]
pub struct WrenchSeries {
    /// Name of the trial.
    pub trial: String,
    /// When [s].
    pub times: Vec<f64>,
    /// Positions [nq] of every sample.
    pub qpos: Vec<Vec<f64>>,
    /// Velocities [nv] of every sample.
    pub qvel: Vec<Vec<f64>>,
    /// Wrench [N, N m] of every sample, in the base's frame about its origin.
    pub wrench: Vec<[f64; 6]>,
    /// Its standard deviation.
    pub sd: Vec<[f64; 6]>,
}

/// The missing wrench along the fit trials.
#[derive(Clone, Debug)]
pub struct MissingWrench {
    /// The body that it acts on.
    pub base: FreeBase,
    /// Time between samples [s], a multiple of the model's step.
    pub sample_period: f64,
    /// One series a trial.
    pub series: Vec<WrenchSeries>,
}

/// Result of the estimation.
#[derive(Clone, Debug)]
pub enum Residual {
    /// A wrench, worth learning or not.
    Found(MissingWrench),
    /// No wrench can be estimated; the reason.
    NotOffered(String),
}

/// Estimates the wrench on the base that the nominal model lacks along every trial.
///
/// `nuisances` are the values of the nominal's uncertain numbers in the model to which a learned wrench will be
/// added: what they explain is not to be learned, and what is learned is right only beside them.
///
/// # Errors
/// The plant refuses, or a stop was asked for.
pub fn residual(
    problem: &Problem<'_>,
    nuisances: &[f64],
    watch: &Watch<'_>,
) -> Result<Residual, GapError> {
    let model = problem.plant.description();
    let not = |reason: &str| Ok(Residual::NotOffered(reason.to_owned()));
    let Some(base) = &model.base else {
        return not("a learned residual needs a free joint; not offered");
    };
    if model.nv != 6 + model.joints.len() {
        return not(
            "a learned residual needs a model of one free joint, hinges and slides; this one has other \
             joints, so it is not offered",
        );
    }
    if base.body.is_empty() {
        return not("the body with the free joint has no name, so no learned residual is offered");
    }
    if base.learned {
        return Ok(Residual::NotOffered(format!(
            "`{}` carries a learned wrench already, and a body has room for one; no learned residual is \
             offered",
            base.body
        )));
    }
    if base.water_moves {
        return not(
            "effects of the nominal model move the water, which a learned residual cannot see; it is not \
             offered",
        );
    }
    let options = &problem.settings.options;
    let scale = scale(problem, base);
    let setup = WindowProblem {
        plant: problem.plant,
        model,
        base,
        channels: &problem.channels,
        nuisances,
        options,
        wrench_step: scale.map(|of| STEP * of),
    };
    let most = (options.residual.most_windows / problem.trials.len().max(1))
        .max(options.residual.least_windows);
    let mut paths = Vec::new();
    for (at, (trial, motion)) in problem.trials.iter().zip(&problem.motions).enumerate() {
        watch.check()?;
        paths.extend(TrialSmoother::new(&setup, trial, motion, most, watch)?);
        (watch.tell)("missing wrench", at + 1, problem.trials.len());
    }
    paths.retain(|path| path.windows.len() >= options.residual.least_windows);
    if paths.is_empty() {
        return not(
            "no trial is long enough, or followed by the nominal model for long enough, to tell a missing \
             wrench; no learned residual is offered",
        );
    }
    let walk = likeliest(&setup, &paths, scale);
    let mut series = Vec::with_capacity(paths.len());
    let total = paths.len();
    for (at, mut path) in paths.into_iter().enumerate() {
        let mut cost = path.cost(&setup, walk);
        for _ in 0..ITERATIONS {
            watch.check()?;
            let Some(solved) = path.solve(&setup, path.linearized(&setup), walk) else {
                break;
            };
            let Some(reached) = path.step(&setup, &solved, walk, cost, watch)? else {
                break;
            };
            let small = cost - reached < CONVERGED * cost;
            cost = reached;
            if small {
                break;
            }
        }
        series.extend(sampled(&setup, &path, walk)?);
        (watch.tell)("smoothing the missing wrench", at + 1, total);
    }
    Ok(Residual::Found(MissingWrench {
        base: base.clone(),
        sample_period: setup.sample_steps() as f64 * model.timestep,
        series,
    }))
}

/// A force and a torque that are large for the vehicle [N, N m].
fn scale(problem: &Problem<'_>, base: &FreeBase) -> [f64; 6] {
    let bodies = &problem.plant.description().bodies;
    let mass: f64 = bodies.iter().map(|body| body.scale.mass).sum();
    let extent = bodies
        .iter()
        .filter(|body| body.name == base.body)
        .flat_map(|body| body.scale.extent)
        .fold(0.0, f64::max);
    let force = mass.max(1e-6) * STANDARD_GRAVITY;
    // A body without any size of its own still turns.
    let torque = force * if extent > 0.0 { 0.5 * extent } else { 0.1 };
    [force, force, force, torque, torque, torque]
}

/// The walk that the readings of all trials make likeliest; forces and torques have one pace each.
fn likeliest(
    setup: &WindowProblem<'_>,
    paths: &[TrialSmoother<'_>],
    scale: [f64; 6],
) -> RandomWalk {
    let chains: Vec<_> = paths.iter().map(|path| path.linearized(setup)).collect();
    let options = &setup.options.residual;
    let pairs: Vec<(f64, f64)> = options
        .wrench_changes
        .iter()
        .flat_map(|force| {
            options
                .wrench_changes
                .iter()
                .map(move |torque| (*force, *torque))
        })
        .collect();
    let walk = |(force, torque): (f64, f64)| RandomWalk {
        first: scale.map(|of| options.first_wrench * of),
        change: std::array::from_fn(|axis| scale[axis] * if axis < 3 { force } else { torque }),
    };
    let evidence: Vec<f64> = pairs
        .par_iter()
        .map(|pair| {
            let each = paths.iter().zip(&chains);
            each.map(|(path, chain)| path.evidence(setup, chain, walk(*pair)))
                .sum()
        })
        .collect();
    let best = (0..pairs.len())
        .max_by(|a, b| evidence[*a].total_cmp(&evidence[*b]))
        .unwrap_or(0);
    walk(pairs[best])
}

/// States and wrench along a fitted path; none where the last linearisation is of no use.
fn sampled(
    setup: &WindowProblem<'_>,
    path: &TrialSmoother<'_>,
    walk: RandomWalk,
) -> Result<Option<WrenchSeries>, GapError> {
    let Some(solved) = path.solve(setup, path.linearized(setup), walk) else {
        return Ok(None);
    };
    let tangents = 2 * setup.model.nv;
    let excess = path.excess().sqrt();
    let spreads: Vec<[f64; 6]> = solved
        .covariances
        .iter()
        .map(|matrix| {
            std::array::from_fn(|axis| {
                excess * matrix[(tangents + axis, tangents + axis)].max(0.0).sqrt()
            })
        })
        .collect();
    let (mut samples, mut count) = (Vec::new(), 0);
    for (window, wrench) in path.windows.iter().zip(&path.wrenches) {
        count = setup.sample(
            path.trial,
            path.motion(),
            window,
            *wrench,
            setup.sample_steps(),
            count,
            &mut samples,
        )?;
    }
    // A window's wrench is that of its middle.
    let ends = path.windows.iter().skip(1).map(|next| next.start);
    let end = path.trial.times[path.windows[path.windows.len() - 1].rows.end - 1];
    let middles: Vec<f64> = path
        .windows
        .iter()
        .zip(ends.chain([end]))
        .map(|(window, end)| 0.5 * (window.start + end))
        .collect();
    let mut series = WrenchSeries {
        trial: path.trial.name.clone(),
        times: Vec::with_capacity(samples.len()),
        qpos: Vec::with_capacity(samples.len()),
        qvel: Vec::with_capacity(samples.len()),
        wrench: Vec::with_capacity(samples.len()),
        sd: Vec::with_capacity(samples.len()),
    };
    for sample in samples {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if !(finite(&sample.qpos) && finite(&sample.qvel)) {
            break;
        }
        series
            .wrench
            .push(between(&middles, &path.wrenches, sample.time));
        series.sd.push(between(&middles, &spreads, sample.time));
        series.times.push(sample.time);
        series.qpos.push(sample.qpos);
        series.qvel.push(sample.qvel);
    }
    Ok(Some(series))
}

/// The straight line between values at ascending times, held at both ends.
fn between(times: &[f64], values: &[[f64; 6]], time: f64) -> [f64; 6] {
    let after = times.partition_point(|known| *known <= time);
    let (a, b) = (after.saturating_sub(1), after.min(times.len() - 1));
    let span = times[b] - times[a];
    let part = if span > 0.0 {
        ((time - times[a]) / span).clamp(0.0, 1.0)
    } else {
        0.0
    };
    std::array::from_fn(|axis| values[a][axis] + part * (values[b][axis] - values[a][axis]))
}
