//! AR(1) noise of sensors that declare none: standard deviation and correlation, from the residuals of a fit.
//!
//! The residuals underestimate both, because starts and parameters absorb part of the noise, most of it in short trials.
//! The bias is corrected by a bootstrap (B. Efron and R. J. Tibshirani, An Introduction to the Bootstrap, 1993,
//! section 10.6): noise as estimated from the residuals is simulated and projected as the fit would, and both estimates
//! are multiplied by the ratio of simulated noise to simulated residuals. One iteration only: noise slower than a trial
//! cannot be told from its start, so further iterations would grow without limit.

use rayon::prelude::*;

use crate::{
    discrepancy::{
        autocorrelation::{self, Autocorrelation},
        noise_model::Noise,
        simulated_residuals::SimulatedResiduals,
    },
    fit::{hypothesis::Fit, linearized_problem::LinearizedProblem},
};

/// Noise of every channel: as declared, else AR(1) from the residuals of a fit, corrected for what the fit absorbs.
pub(crate) fn estimate(linearized: &LinearizedProblem<'_>, fit: &Fit, seed: u64) -> Vec<Noise> {
    let seen = autocorrelation::by_channel(
        linearized.problem.channels.len(),
        &linearized.problem.options.discrepancy,
        &fit.residuals,
    );
    taken(linearized, &corrected(linearized, fit, &seen, seed))
}

/// The residuals of a fit taken for the noise where none is declared.
fn taken(linearized: &LinearizedProblem<'_>, left: &[Autocorrelation]) -> Vec<Noise> {
    left.iter()
        .zip(&linearized.problem.channels.list)
        .map(|(left, channel)| match channel.declared_noise {
            Some(_) => Noise::WHITE,
            None => Noise::new(left.variance, left.time),
        })
        .collect()
}

/// `seen`, with the channels that declare no noise corrected for what the fit absorbs.
pub(crate) fn corrected(
    linearized: &LinearizedProblem<'_>,
    fit: &Fit,
    seen: &[Autocorrelation],
    seed: u64,
) -> Vec<Autocorrelation> {
    let channels = &linearized.problem.channels.list;
    if channels
        .iter()
        .all(|channel| channel.declared_noise.is_some())
    {
        return seen.to_vec();
    }
    let Some(simulated) = SimulatedResiduals::new(
        linearized,
        fit,
        linearized.problem.options.discrepancy.noise_draws,
        0.0,
        seed,
    ) else {
        return seen.to_vec();
    };
    let left = mean_remaining(&simulated, linearized, &taken(linearized, seen));
    let raised = |seen: f64, left: f64| seen * (seen / left.max(f64::MIN_POSITIVE)).max(1.0);
    seen.iter()
        .zip(left)
        .zip(channels)
        .map(|((seen, left), channel)| match channel.declared_noise {
            Some(_) => *seen,
            None => Autocorrelation {
                variance: raised(seen.variance, left.variance),
                time: raised(seen.time, left.time),
                ..*seen
            },
        })
        .collect()
}

/// Variance and autocorrelation time of simulated noise after a fit, the mean of all draws.
fn mean_remaining(
    simulated: &SimulatedResiduals<'_>,
    linearized: &LinearizedProblem<'_>,
    noise: &[Noise],
) -> Vec<Autocorrelation> {
    let absorbed = simulated.absorbed(noise);
    let left: Vec<_> = (0..linearized.problem.segments.len())
        .into_par_iter()
        .map(|at| simulated.remaining(at, noise, &absorbed))
        .collect();
    let draws: Vec<Vec<Autocorrelation>> = (0..simulated.draws)
        .into_par_iter()
        .map(|draw| {
            let residuals: Vec<Vec<f64>> = left
                .iter()
                .map(|of| of.column(draw).iter().copied().collect())
                .collect();
            autocorrelation::by_channel(
                linearized.problem.channels.len(),
                &linearized.problem.options.discrepancy,
                &residuals,
            )
        })
        .collect();
    let mut draws = draws.into_iter();
    let mut mean = draws.next().unwrap_or_default();
    for (draw, of_draw) in (1..).zip(draws) {
        for (mean, of) in mean.iter_mut().zip(of_draw) {
            let part = 1.0 / f64::from(draw + 1);
            mean.variance += part * (of.variance - mean.variance);
            mean.time += part * (of.time - mean.time);
        }
    }
    mean
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::{
        Problem, Watch,
        statistics::standard_normal,
        tests::{fake::RigidBody, settings, trial},
    };

    /// Rows of a trial: 1 s.
    const ROWS: usize = 50;
    const SD: f64 = 0.05;
    const CORRELATION: f64 = 0.95;

    /// Slow noise of a log that declares none: starts absorb a good part of it in a second.
    #[test]
    fn a_part_of_what_starts_absorb_of_slow_noise_is_put_back() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let trials = (0..16).map(|at| {
            let mut trial = trial(&format!("trial {at}"), &[], &[0.0, 0.0], at, 0.5);
            let columns = trial.sensors.columns.len();
            let all = trial.sensors.columns.iter().enumerate();
            let columns_of: Vec<usize> = all
                .filter(|(_, name)| name.starts_with("position"))
                .map(|(column, _)| column)
                .collect();
            trial.sensors.times.truncate(ROWS);
            trial.sensors.data.truncate(ROWS * columns);
            for column in columns_of {
                let mut noise = SD * standard_normal(&mut rng);
                for row in 0..ROWS {
                    trial.sensors.data[row * columns + column] += noise;
                    let fresh = SD * (1.0 - CORRELATION * CORRELATION).sqrt();
                    noise = CORRELATION * noise + fresh * standard_normal(&mut rng);
                }
            }
            trial
        });
        let plant = RigidBody::without_noise("position");
        let stop = AtomicBool::new(false);
        let watch = Watch::silent(&stop);
        let problem = Problem::prepare(&plant, trials.collect(), settings(), &watch).unwrap();
        let linearized = problem.linearize(&watch).unwrap();
        let fit = linearized.empty().unwrap();
        let observed = autocorrelation::by_channel(
            linearized.problem.channels.len(),
            &linearized.problem.options.discrepancy,
            &fit.residuals,
        );
        let mean_sd = |of: &[Autocorrelation]| {
            let sds: Vec<f64> = of
                .iter()
                .zip(&linearized.problem.channels.list)
                .filter(|(_, channel)| channel.sensor == "position")
                .map(|(of, channel)| of.variance.sqrt() * channel.noise)
                .collect();
            sds.iter().sum::<f64>() / sds.len() as f64
        };
        let corrected = corrected(&linearized, fit, &observed, 0);
        let (seen, said) = (mean_sd(&observed), mean_sd(&corrected));
        assert!(seen < 0.75 * SD, "{seen} of {SD}");
        // One correction goes a part of the way.
        assert!(
            said > 1.1 * seen && said < 1.1 * SD,
            "{seen}, {said} of {SD}"
        );
        for ((corrected, observed), channel) in corrected
            .iter()
            .zip(&observed)
            .zip(&linearized.problem.channels.list)
        {
            let same = corrected.variance == observed.variance && corrected.time == observed.time;
            assert_eq!(same, channel.declared_noise.is_some(), "{channel:?}");
        }
    }
}
