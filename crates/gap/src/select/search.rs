//! The search over sets of effects: linear evidence for very many, full refits for the leaders.

use crate::{
    discrepancy::variance_inflation::{form_factor, variance_inflation},
    error::GapError,
    fit::linearized_problem::Bench,
    progress::Watch,
    select::{
        evidence::{Scored, adequate, best_of, clash, firsts, log_prior, mechanisms},
        linear_evidence::{Judged, Linear},
        moves, refit,
        screen::{Direction, Screen},
    },
};

/// All that was tried.
#[derive(Debug)]
pub(crate) struct Search {
    /// Refitted sets; the first is the empty one.
    pub(crate) scored: Vec<Scored>,
    /// Sets judged by linear evidence alone.
    pub(crate) linear: Vec<Judged>,
    /// Squared whitened residuals are divided by this.
    pub(crate) factor: f64,
}

/// Searches from nothing: screen, refit the leaders, and where something is left over, screen again about
/// the best set and refit larger ones; then look at the best a second time.
pub(crate) fn search(bench: &Bench<'_>, seed: u64, watch: &Watch<'_>) -> Result<Search, GapError> {
    let empty = bench.empty()?.clone();
    let directions: Vec<Direction> = (0..bench.problem.candidates.len())
        .flat_map(|candidate| bench.directions(candidate))
        .collect();
    let screen = bench.screen(&empty, directions, watch)?;
    let nothing = empty.misfit;
    let mut scored = vec![Scored::new(Vec::new(), empty)];
    let mut linear_sets = Vec::new();
    let mut factor = first_factor(bench, &screen);
    if let Some(linear) = Linear::new(bench, &screen, factor) {
        linear_sets = sets(bench, &linear);
        let refused = refit_leaders(bench, &linear, &linear_sets, &mut scored, watch)?;
        // Their evidence to first order was of what does not stand when refitted.
        linear_sets.retain(|(set, _)| !refused.contains(set));
    }
    factor = inflation(bench, &scored, nothing, seed);
    // Larger sets about the best found.
    for size in 2..=bench.problem.options.search.largest {
        let Some(about) = to_enlarge(bench, &mut scored, size, factor, seed, watch)? else {
            continue;
        };
        let base = &scored[about];
        let base_set = base.set.clone();
        let directions = (0..bench.problem.candidates.len())
            .filter(|candidate| base_set.iter().all(|of| !clash(bench, *candidate, *of)))
            .flat_map(|candidate| bench.directions(candidate))
            .collect();
        let about = bench.screen(&base.fit, directions, watch)?;
        let from = base.fit.point.clone();
        if let Some(linear) = Linear::new(bench, &about, factor) {
            let mut gains: Vec<Judged> = linear
                .choices
                .keys()
                .filter_map(|candidate| {
                    let (gain, ..) = linear.evidence(&[*candidate])?;
                    Some((vec![*candidate], gain))
                })
                .collect();
            gains.sort_by(|a, b| b.1.total_cmp(&a.1));
            let is_new = |addition: &[usize]| {
                let mut set = [&base_set[..], addition].concat();
                set.sort_unstable();
                !scored.iter().any(|scored| scored.set == set)
            };
            let promising =
                (gains.iter()).filter(|(addition, gain)| *gain >= 0.0 && is_new(addition));
            for (addition, _) in firsts(bench, promising, |of| &of.0)
                .into_iter()
                .take(bench.problem.options.search.refitted_additions)
            {
                if let Some(point) = linear.point(bench, &from, addition) {
                    refit::add(bench, point, &mut scored, watch)?;
                }
            }
        }
        factor = inflation(bench, &scored, nothing, seed);
    }
    let temper = |scored: &[Scored]| inflation(bench, scored, nothing, seed);
    factor = moves::at_the_best(bench, &mut scored, factor, temper, watch)?;
    Ok(Search {
        scored,
        linear: linear_sets,
        factor,
    })
}

/// The set about which sets of a size are looked for: the best, where it is smaller by one and leaves structure;
/// where it is of that size already, its better part, about which the other part may turn out to be another.
fn to_enlarge(
    bench: &Bench<'_>,
    scored: &mut [Scored],
    size: usize,
    factor: f64,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Option<usize>, GapError> {
    let Some(best) = best_of(bench, scored, factor) else {
        return Ok(None);
    };
    let held = scored[best].set.len();
    if held + 1 == size {
        let adequacy = adequate(bench, &mut scored[best], seed, watch)?;
        return Ok(
            (adequacy.p_value <= bench.problem.options.search.enlarged_p_value).then_some(best),
        );
    }
    if held != size {
        return Ok(None);
    }
    let whole = &scored[best].set;
    let worth = |at: &usize| {
        scored[*at]
            .fit
            .evidence(factor)
            .map(|(evidence, _)| evidence)
    };
    let parts = (1..scored.len()).filter(|at| {
        let part = &scored[*at].set;
        part.len() + 1 == size && part.iter().all(|of| whole.contains(of))
    });
    Ok(parts
        .filter_map(|at| Some((at, worth(&at)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(at, _)| at))
}

/// The factor before anything was refitted: from what the best single explains to first order.
fn first_factor(bench: &Bench<'_>, screen: &Screen) -> f64 {
    let Some(linear) = Linear::new(bench, screen, 1.0) else {
        return 1.0;
    };
    let explained = linear
        .choices
        .keys()
        .filter_map(|candidate| linear.evidence(&[*candidate]))
        .map(|(gain, ..)| 2.0 * gain)
        .fold(0.0, f64::max);
    form_factor(explained, &bench.problem.options.discrepancy)
}

/// Singles and pairs of the best singles, by linear evidence; larger sets grow from refitted ones.
fn sets(bench: &Bench<'_>, linear: &Linear<'_>) -> Vec<Judged> {
    let judged = |set: &[usize]| -> Option<Judged> {
        let (gain, columns, z) = linear.evidence(set)?;
        let resolved = columns.iter().zip(z.iter()).all(|(column, z)| {
            let of = &linear.screen.directions[*column];
            let p = &bench.problem.candidates[of.candidate].parameters[of.parameter];
            let value = of.base[of.parameter] + z * p.prior_sd;
            !refit::is_delay(bench, of.candidate) || refit::is_resolved(bench, [value; 2])
        });
        resolved.then(|| (set.to_vec(), gain))
    };
    let worth = |entry: &Judged| entry.1 + log_prior(bench, &entry.0);
    let mut singles: Vec<_> = linear
        .choices
        .keys()
        .filter_map(|candidate| judged(&[*candidate]))
        .collect();
    singles.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let beam = bench.problem.options.search.beam;
    let mut pairs = Vec::new();
    for (at, (a, _)) in singles.iter().take(beam).enumerate() {
        for (b, _) in singles.iter().take(beam).skip(at + 1) {
            if !clash(bench, a[0], b[0]) {
                let mut set = vec![a[0], b[0]];
                set.sort_unstable();
                pairs.extend(judged(&set));
            }
        }
    }
    pairs.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let mut all = singles;
    all.extend(pairs);
    all.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    all
}

/// Returns the leaders that could not be refitted.
fn refit_leaders(
    bench: &Bench<'_>,
    linear: &Linear<'_>,
    sets: &[Judged],
    scored: &mut Vec<Scored>,
    watch: &Watch<'_>,
) -> Result<Vec<Vec<usize>>, GapError> {
    let worth = |entry: &Judged| entry.1 + log_prior(bench, &entry.0);
    let leading = |size: usize, above: f64, most: usize| -> Vec<&Vec<usize>> {
        let of_size = sets.iter().filter(|(set, _)| set.len() == size);
        let above = of_size.filter(|entry| worth(entry) > above);
        let firsts = firsts(bench, above, |of| &of.0).into_iter();
        firsts.take(most).map(|(set, _)| set).collect()
    };
    let options = &bench.problem.options.search;
    let singles = sets.iter().filter(|(set, _)| set.len() == 1);
    let best_single = singles.map(worth).fold(f64::NEG_INFINITY, f64::max);
    // A screen about nothing misjudges a law that bends much over so large a difference (drag of a ball that falls
    // freely); where fits cost next to nothing it chooses none.
    let (reach, most) = if bench.problem.freedom_seconds() < options.small_data {
        (f64::NEG_INFINITY, usize::MAX)
    } else {
        (
            best_single - options.refitted_within,
            options.refitted_singles,
        )
    };
    let mut leaders = leading(1, reach, most);
    // A pair that is no better than a single is found from that, by a screen about its refit.
    leaders.extend(leading(2, best_single, options.refitted_pairs));
    let total = leaders.len();
    let mut refused = Vec::new();
    for (at, leader) in leaders.into_iter().enumerate() {
        (watch.tell)("refitting", at, total);
        // Every form of an effect in reach; of a pair the likeliest. Farther ones where none has stood.
        let of = mechanisms(bench, leader);
        let mut least = f64::NEG_INFINITY;
        for entry in sets.iter().filter(|(set, _)| mechanisms(bench, set) == of) {
            if worth(entry) <= least {
                break;
            }
            let form = &entry.0;
            let stands = match linear.point(bench, &scored[0].fit.point, form) {
                Some(point) => refit::add(bench, point, scored, watch)?,
                None => false,
            };
            match form.len() {
                _ if !stands => refused.push(form.clone()),
                1 => least = reach,
                _ => break,
            }
        }
    }
    (watch.tell)("refitting", total, total);
    Ok(refused)
}

/// The inflation of variance under the set that fits best.
fn inflation(bench: &Bench<'_>, scored: &[Scored], nothing: f64, seed: u64) -> f64 {
    scored
        .iter()
        .min_by(|a, b| a.fit.misfit.total_cmp(&b.fit.misfit))
        .map_or(1.0, |best| {
            variance_inflation(bench, &best.fit, nothing, seed)
        })
}
