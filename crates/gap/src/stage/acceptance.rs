//! Errors on held-out trials before and after, by sensor and horizon, with a bootstrap over trials, and
//! whether the addition is accepted.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{
    options::VerifyOptions,
    output::{
        records::{Horizon, Overlay, Verified},
        verdict::{Gap, SensorGap},
    },
    problem::{channels::Channels, problem::Settings},
    statistics::{interval95, quantile},
};

/// Schema of [`Verified`].
const SCHEMA: &str = "hydro-gap-verify/1";

/// Sums of squares of one channel: before, after, measured about its mean, readings, and the nominal with its
/// numbers refitted and nothing added.
pub(crate) type Terms = [f64; 5];

/// Sums of one trial, by horizon and channel.
pub(crate) type Sums = Vec<Vec<Terms>>;

/// Rollouts of one trial.
pub(crate) struct TrialErrors {
    pub(crate) sums: Sums,
    /// Sums over whole rollouts, by regime: weak commands, strong commands.
    pub(crate) regimes: [Vec<Terms>; 2],
    pub(crate) overlays: Vec<Overlay>,
}

/// Squared error of a channel, noise taken out, over the spread of the measurement.
fn normalised(sums: Terms, side: usize, noise: f64) -> Option<f64> {
    let [_, _, spread, count, _] = sums;
    if count < 2.0 || spread <= 0.0 {
        return None;
    }
    let variance = spread / count;
    // A channel that hardly moves is measured against its noise.
    let scale = variance.max(noise * noise);
    Some(((sums[side] / count - noise * noise) / scale).max(0.0))
}

/// Root of the mean of the normalised squared errors of some channels.
fn nrmse(sums: &[Terms], channels: &Channels, side: usize, of: &dyn Fn(usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (channel, sums) in sums.iter().enumerate().filter(|(channel, _)| of(*channel)) {
        if let Some(value) = normalised(*sums, side, channels.list[channel].noise) {
            sum += value;
            count += 1;
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

pub(crate) fn add(sum: &mut Terms, terms: Terms) {
    sum.iter_mut()
        .zip(terms)
        .for_each(|(sum, term)| *sum += term);
}

/// Sum over drawn trials.
fn total<'a>(drawn: impl Iterator<Item = &'a Vec<Terms>>, width: usize) -> Vec<Terms> {
    let mut sums = vec![[0.0; 5]; width];
    for of in drawn {
        for (sum, terms) in sums.iter_mut().zip(of) {
            add(sum, *terms);
        }
    }
    sums
}

fn reduction(before: f64, after: f64) -> f64 {
    if before <= 0.0 {
        0.0
    } else {
        1.0 - after / before
    }
}

/// Draws of trials with replacement, the same for every figure.
fn draws(trials: usize, count: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count)
        .map(|_| (0..trials).map(|_| rng.random_range(0..trials)).collect())
        .collect()
}

/// 95 % interval of a figure over the draws.
fn interval(draws: &[Vec<usize>], figure: &dyn Fn(&[usize]) -> f64) -> [f64; 2] {
    interval95(&mut over(draws, figure)).unwrap_or([f64::NAN; 2])
}

/// A figure over the draws.
fn over(draws: &[Vec<usize>], figure: &dyn Fn(&[usize]) -> f64) -> Vec<f64> {
    draws.iter().map(|draw| figure(draw)).collect()
}

/// Part of draws that lie below a one-sided bound at 95 % confidence, one of so many bounds that all hold together (Bonferroni).
fn together(bounds: usize) -> f64 {
    0.05 / bounds as f64
}

/// The value of a figure that it exceeds with all but a part of the draws.
fn exceeded(draws: &[Vec<usize>], part: f64, figure: &dyn Fn(&[usize]) -> f64) -> f64 {
    let mut values = over(draws, figure);
    values.sort_by(f64::total_cmp);
    quantile(&values, part).unwrap_or(f64::NAN)
}

/// Figures of the verification, with intervals, and whether the addition is accepted.
///
/// `files`: the first so many outcomes are replays of the patched file, the others cross-fits. `beyond`: mean gain in log
/// predictive density [nat] on a trial left out, of the effects over the nominal's refitted numbers alone. Starts are fitted
/// there: rollouts from estimated starts are too noisy to judge a weak effect by.
pub(crate) fn summary(
    channels: &Channels,
    outcomes: Vec<TrialErrors>,
    files: usize,
    has_alone: bool,
    beyond: Option<f64>,
    settings: &Settings,
) -> Verified {
    let options = &settings.options.verify;
    let width = channels.len();
    let draws = draws(outcomes.len(), options.bootstrap_draws, settings.seed);
    let everyone: Vec<usize> = (0..outcomes.len()).collect();
    let sums = |draw: &[usize], horizon: usize| {
        total(draw.iter().map(|at| &outcomes[*at].sums[horizon]), width)
    };
    let all = |_: usize| true;
    // Root mean square over the horizons.
    let pooled = |draw: &[usize], side: usize, of: &dyn Fn(usize) -> bool| -> f64 {
        let squares: f64 = (0..options.horizons.len())
            .map(|horizon| nrmse(&sums(draw, horizon), channels, side, of).powi(2))
            .sum();
        (squares / options.horizons.len() as f64).sqrt()
    };
    let change = |draw: &[usize], of: &dyn Fn(usize) -> bool| {
        reduction(pooled(draw, 0, of), pooled(draw, 1, of))
    };
    let regimes = ["weak commands", "strong commands"];
    let unlikely = together(channels.sources.len() + regimes.len());
    let mut per_sensor = BTreeMap::new();
    let mut worse = Vec::new();
    for source in &channels.sources {
        let mine =
            |channel: usize| (source.channel..source.channel + source.channels).contains(&channel);
        let (before, after) = (pooled(&everyone, 0, &mine), pooled(&everyone, 1, &mine));
        let ci95 = interval(&draws, &|draw| change(draw, &mine));
        let name = channels.list[source.channel].sensor.clone();
        // Harm is judged with the noise left in: below it nobody sees a difference.
        let longest = options.horizons.len() - 1;
        let raw = |draw: &[usize]| growth(&sums(draw, longest), &mine);
        if outcomes.len() > 1 && exceeded(&draws, unlikely, &raw) > options.harm {
            worse.push(format!("sensor `{name}`"));
        }
        per_sensor.insert(
            name,
            SensorGap {
                before,
                after,
                reduction: reduction(before, after),
                ci95,
            },
        );
    }
    for (regime, name) in regimes.into_iter().enumerate() {
        let raw = |draw: &[usize]| {
            let drawn = draw.iter().map(|at| &outcomes[*at].regimes[regime]);
            growth(&total(drawn, width), &all)
        };
        if outcomes.len() > 1 && exceeded(&draws, unlikely, &raw) > options.harm {
            worse.push(format!("the regime of {name}"));
        }
    }
    let horizons = options
        .horizons
        .iter()
        .enumerate()
        .map(|(at, seconds)| {
            let side = |draw: &[usize], side: usize| nrmse(&sums(draw, at), channels, side, &all);
            Horizon {
                seconds: *seconds,
                before: side(&everyone, 0),
                after: side(&everyone, 1),
                ci95: interval(&draws, &|draw| reduction(side(draw, 0), side(draw, 1))),
            }
        })
        .collect();
    let (before, after) = (pooled(&everyone, 0, &all), pooled(&everyone, 1, &all));
    let recalibrated = has_alone.then(|| pooled(&everyone, 4, &all));
    let ci95 = interval(&draws, &|draw| change(draw, &all));
    let beside_alone = |draw: &[usize]| pooled(draw, 1, &all) / pooled(draw, 4, &all);
    let ratio = match has_alone {
        true => interval(&draws, &beside_alone),
        false => [1.0; 2],
    };
    let numbers_suffice = suffice(ratio, beyond, options);
    let contradicted = outcomes.len() > 1
        && (ci95[1] < 0.0 || (after > before && ratio[0] > options.clear_error.recip()));
    let of_file: Vec<usize> = (0..files.min(outcomes.len())).collect();
    let by_file = change(&of_file, &all);
    let refused_because = if outcomes.len() < 2 {
        Some(format!(
            "{} held-out trial: no interval over trials can be given, so no reduction is claimed",
            outcomes.len()
        ))
    } else if ci95[0] <= 0.0 {
        Some(format!(
            "the reduction on held-out trials is {:.0} % with a 95 % interval from {:.0} % to {:.0} %, \
             which does not exclude none",
            100.0 * reduction(before, after),
            100.0 * ci95[0],
            100.0 * ci95[1]
        ))
    } else if numbers_suffice {
        Some(
            "trials left out are predicted clearly better by the nominal with its numbers refitted alone, so the addition \
             itself is not confirmed"
                .to_owned(),
        )
    } else if by_file <= 0.0 {
        Some(format!(
            "the patched file itself reduces the error on the {files} trials that nothing saw before by {:.0} %",
            100.0 * by_file
        ))
    } else if !worse.is_empty() {
        Some(format!(
            "{} gets worse by more than {:.0} % on held-out trials",
            worse.join(", "),
            100.0 * options.harm
        ))
    } else {
        None
    };
    Verified {
        schema: SCHEMA.to_owned(),
        gap: Gap {
            metric: "nrmse".to_owned(),
            before: Some(before),
            after: Some(after),
            reduction: Some(reduction(before, after)),
            ci95: (outcomes.len() > 1).then_some(ci95),
            n_holdout_trials: outcomes.len(),
            per_sensor,
        },
        horizons,
        accepted: refused_because.is_none(),
        refused_because,
        contradicted,
        recalibrated,
        cross_fitted: outcomes.len() > files,
        remarks: cross_fit_remark(outcomes.len(), files),
        overlays: outcomes.into_iter().flat_map(|of| of.overlays).collect(),
    }
}

/// True where the nominal's refitted numbers predict held-out trials clearly better than the effects do; `ratio`: 95 % interval
/// of the rollouts' error with the effects over that with the numbers alone. Where one is clearly the smaller that decides;
/// else the predictive density, which sees weaker effects.
fn suffice(ratio: [f64; 2], beyond: Option<f64>, options: &VerifyOptions) -> bool {
    let [low, high] = ratio;
    if high < options.clear_error {
        return false;
    }
    let by_density = beyond.is_some_and(|gain| gain.is_nan() || gain < options.least_gain);
    low > options.clear_error.recip() || by_density
}

/// Remark on the cross-fit, where there is one.
fn cross_fit_remark(trials: usize, files: usize) -> Vec<String> {
    if trials <= files {
        return Vec::new();
    }
    vec![format!(
        "with {trials} trials every one is judged by a fit that left it out: {files} by the patched file, which \
         nothing saw before, and {} by the same effects fitted without that trial (the effects were chosen with \
         these)",
        trials - files
    )]
}

/// Relative growth of the root mean square error of some channels, noise left in.
fn growth(sums: &[Terms], of: &dyn Fn(usize) -> bool) -> f64 {
    let (mut before, mut after) = (0.0, 0.0);
    for (_, [a, b, spread, ..]) in sums.iter().enumerate().filter(|(at, _)| of(*at)) {
        if *spread > 0.0 {
            before += a / spread;
            after += b / spread;
        }
    }
    if before <= 0.0 {
        return 0.0;
    }
    (after / before).sqrt() - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two files and two trials that were left out, error halved on all; numbers alone leave an error that many times as large.
    fn judged(beyond: Option<f64>, alone: f64) -> Verified {
        of_each([40.0, 10.0, 100.0, 100.0, 10.0 * alone * alone], beyond)
    }

    fn of_each(terms: Terms, beyond: Option<f64>) -> Verified {
        let channels = Channels::single(0.01);
        let outcome = || TrialErrors {
            sums: vec![vec![terms]; 3],
            regimes: [vec![terms], vec![terms]],
            overlays: Vec::new(),
        };
        summary(
            &channels,
            (0..4).map(|_| outcome()).collect(),
            2,
            true,
            beyond,
            &crate::tests::settings(),
        )
    }

    #[test]
    fn an_addition_falls_where_numbers_alone_predict_clearly_better() {
        for (beyond, alone, accepted) in [
            (None, 1.0, true),
            (Some(4.0), 1.0, true),
            (Some(-1.0), 1.0, true),
            (Some(-4.0), 1.0, false),
            (Some(f64::NAN), 1.0, false),
            // The rollouts themselves leave no doubt.
            (Some(-4.0), 3.0, true),
            (Some(4.0), 0.3, false),
            (Some(-4.0), 1.5, false),
            (Some(4.0), 0.7, true),
        ] {
            let found = judged(beyond, alone);
            assert_eq!(found.accepted, accepted, "{beyond:?} {alone}");
            let why = found.refused_because.unwrap_or_default();
            assert_eq!(why.contains("numbers refitted alone"), !accepted, "{why}");
        }
    }

    #[test]
    fn trials_contradict_what_predicts_them_clearly_worse() {
        let alike = [40.0, 10.0, 100.0, 100.0, 40.0];
        for (after, alone, contradicted) in [
            (10.0, 40.0, false),
            // Better than the nominal as it is, whatever its numbers do.
            (30.0, 1.0, false),
            // Every trial says so.
            (80.0, 40.0, true),
        ] {
            let mut terms = alike;
            (terms[1], terms[4]) = (after, alone);
            let found = of_each(terms, None);
            assert_eq!(found.contradicted, contradicted, "{after} {alone}");
        }
        // Trials differ, and rollouts of the nominal's refitted numbers leave no doubt.
        let channels = Channels::single(0.01);
        let judged = |alone: f64| {
            let outcome = |after: f64| {
                let terms: Terms = [40.0, after, 100.0, 100.0, alone];
                TrialErrors {
                    sums: vec![vec![terms]; 3],
                    regimes: [vec![terms], vec![terms]],
                    overlays: Vec::new(),
                }
            };
            let outcomes = [20.0, 20.0, 120.0, 120.0].map(outcome);
            let settings = crate::tests::settings();
            summary(&channels, outcomes.into(), 4, true, None, &settings)
        };
        assert!(judged(1.0).contradicted && !judged(40.0).contradicted);
    }

    /// Sixteen sensors, of which one grows by chance in three of four trials, or in all.
    #[test]
    fn harm_is_judged_for_all_sensors_together() {
        let sensors = 16;
        let channels = Channels::alike(sensors, 0.01);
        let judged = |grows_in: usize| {
            let outcome = |trial: usize| {
                let mut terms = vec![[40.0, 10.0, 100.0, 100.0, 40.0]; sensors];
                terms[3][1] = if trial < grows_in { 50.0 } else { 38.0 };
                TrialErrors {
                    sums: vec![terms.clone(); 3],
                    regimes: [terms.clone(), terms],
                    overlays: Vec::new(),
                }
            };
            let outcomes = (0..4).map(outcome).collect();
            summary(
                &channels,
                outcomes,
                4,
                false,
                None,
                &crate::tests::settings(),
            )
        };
        assert!(judged(3).accepted, "{:?}", judged(3).refused_because);
        let refused = judged(4).refused_because.unwrap_or_default();
        assert!(
            refused.contains("sensor `sensor_3` gets worse"),
            "{refused}"
        );
    }
}
