//! The search over sets of effects: linear evidence for very many, full refits for the leaders.

use crate::{
    discrepancy::variance_inflation::{form_inflation, variance_inflation},
    error::GapError,
    fit::linearized_problem::LinearizedProblem,
    progress::Watch,
    select::{
        evidence::{Scored, adequate, best_of, clash, firsts, log_prior, mechanisms},
        linear_evidence::{Judged, Linear},
        moves, refit,
        screen::{Direction, Screen},
    },
};

/// All sets that were tried.
#[derive(Debug)]
pub(crate) struct Search {
    /// Refitted sets; the first is the empty one.
    pub(crate) scored: Vec<Scored>,
    /// Sets judged by linear evidence alone.
    pub(crate) linear: Vec<Judged>,
    /// Squared whitened residuals are divided by this.
    pub(crate) inflation: f64,
}

/// Greedy search from the empty set: screen, refit the leaders; where the best set is inadequate, screen about it and refit
/// larger sets; then refine the best by removals and swaps.
pub(crate) fn search(
    linearized: &LinearizedProblem<'_>,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Search, GapError> {
    let empty = linearized.empty()?.clone();
    let directions: Vec<Direction> = (0..linearized.problem.candidates.len())
        .flat_map(|candidate| linearized.problem.directions(candidate))
        .collect();
    let screen = linearized.screen(&empty, directions, watch)?;
    let nothing = empty.misfit;
    let mut scored = vec![Scored::new(Vec::new(), empty)];
    let mut linear_sets = Vec::new();
    let mut inflation = initial_inflation(linearized, &screen);
    if let Some(linear) = Linear::new(linearized, &screen, inflation) {
        linear_sets = sets(linearized, &linear);
        let refused = refit_leaders(linearized, &linear, &linear_sets, &mut scored, watch)?;
        // Their first-order evidence did not survive the refit.
        linear_sets.retain(|(set, _)| !refused.contains(set));
    }
    inflation = best_inflation(linearized, &scored, nothing, seed);
    // Larger sets about the best found.
    for size in 2..=linearized.problem.options.search.largest {
        let Some(about) = to_enlarge(linearized, &mut scored, size, inflation, seed, watch)? else {
            continue;
        };
        let base = &scored[about];
        let base_set = base.set.clone();
        let directions = (0..linearized.problem.candidates.len())
            .filter(|candidate| {
                base_set
                    .iter()
                    .all(|of| !clash(linearized, *candidate, *of))
            })
            .flat_map(|candidate| linearized.problem.directions(candidate))
            .collect();
        let about = linearized.screen(&base.fit, directions, watch)?;
        let from = base.fit.point.clone();
        if let Some(linear) = Linear::new(linearized, &about, inflation) {
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
            for (addition, _) in firsts(linearized, promising, |of| &of.0)
                .into_iter()
                .take(linearized.problem.options.search.refitted_additions)
            {
                if let Some(point) = linear.point(linearized, &from, addition) {
                    refit::add(linearized, point, &mut scored, watch)?;
                }
            }
        }
        inflation = best_inflation(linearized, &scored, nothing, seed);
    }
    let inflate = |scored: &[Scored]| best_inflation(linearized, scored, nothing, seed);
    inflation = moves::refine(linearized, &mut scored, inflation, inflate, watch)?;
    Ok(Search {
        scored,
        linear: linear_sets,
        inflation,
    })
}

/// The set to which one effect is added for sets of `size`: the best set, where it is smaller by one and inadequate; where
/// it has that size already, the better of its subsets smaller by one, beside which another effect may fit better.
fn to_enlarge(
    linearized: &LinearizedProblem<'_>,
    scored: &mut [Scored],
    size: usize,
    inflation: f64,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Option<usize>, GapError> {
    let Some(best) = best_of(linearized, scored, inflation) else {
        return Ok(None);
    };
    let held = scored[best].set.len();
    if held + 1 == size {
        let adequacy = adequate(linearized, &mut scored[best], seed, watch)?;
        return Ok(
            (adequacy.p_value <= linearized.problem.options.search.enlarged_p_value)
                .then_some(best),
        );
    }
    if held != size {
        return Ok(None);
    }
    let whole = &scored[best].set;
    let worth = |at: &usize| {
        scored[*at]
            .fit
            .evidence(inflation)
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

/// The inflation before anything was refitted: from what the best single explains to first order.
fn initial_inflation(linearized: &LinearizedProblem<'_>, screen: &Screen) -> f64 {
    let Some(linear) = Linear::new(linearized, screen, 1.0) else {
        return 1.0;
    };
    let explained = linear
        .choices
        .keys()
        .filter_map(|candidate| linear.evidence(&[*candidate]))
        .map(|(gain, ..)| 2.0 * gain)
        .fold(0.0, f64::max);
    form_inflation(explained, &linearized.problem.options.discrepancy)
}

/// Singles and pairs of the best singles, by linear evidence; larger sets grow from refitted ones.
fn sets(linearized: &LinearizedProblem<'_>, linear: &Linear<'_>) -> Vec<Judged> {
    let judged = |set: &[usize]| -> Option<Judged> {
        let (gain, columns, z) = linear.evidence(set)?;
        let resolved = columns.iter().zip(z.iter()).all(|(column, z)| {
            let of = &linear.screen.directions[*column];
            let p = &linearized.problem.candidates[of.candidate].parameters[of.parameter];
            let value = of.base[of.parameter] + z * p.prior_sd;
            !refit::is_delay(linearized, of.candidate) || refit::is_resolved(linearized, [value; 2])
        });
        resolved.then(|| (set.to_vec(), gain))
    };
    let worth = |entry: &Judged| entry.1 + log_prior(linearized, &entry.0);
    let mut singles: Vec<_> = linear
        .choices
        .keys()
        .filter_map(|candidate| judged(&[*candidate]))
        .collect();
    singles.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let beam = linearized.problem.options.search.beam;
    let mut pairs = Vec::new();
    for (at, (a, _)) in singles.iter().take(beam).enumerate() {
        for (b, _) in singles.iter().take(beam).skip(at + 1) {
            if !clash(linearized, a[0], b[0]) {
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
    linearized: &LinearizedProblem<'_>,
    linear: &Linear<'_>,
    sets: &[Judged],
    scored: &mut Vec<Scored>,
    watch: &Watch<'_>,
) -> Result<Vec<Vec<usize>>, GapError> {
    let worth = |entry: &Judged| entry.1 + log_prior(linearized, &entry.0);
    let leading = |size: usize, above: f64, most: usize| -> Vec<&Vec<usize>> {
        let of_size = sets.iter().filter(|(set, _)| set.len() == size);
        let above = of_size.filter(|entry| worth(entry) > above);
        let firsts = firsts(linearized, above, |of| &of.0).into_iter();
        firsts.take(most).map(|(set, _)| set).collect()
    };
    let options = &linearized.problem.options.search;
    let singles = sets.iter().filter(|(set, _)| set.len() == 1);
    let best_single = singles.map(worth).fold(f64::NEG_INFINITY, f64::max);
    // A screen about nothing misjudges a law that bends much over so large a difference (drag of a ball that falls
    // freely); where fits cost next to nothing it chooses none.
    let (reach, most) = if linearized.problem.freedom_seconds() < options.small_data {
        (f64::NEG_INFINITY, usize::MAX)
    } else {
        (
            best_single - options.refitted_within,
            options.refitted_singles,
        )
    };
    let mut leaders = leading(1, reach, most);
    // A pair hidden behind its better single is found by the screen about that single's refit.
    leaders.extend(leading(2, best_single, options.refitted_pairs));
    let total = leaders.len();
    let mut refused = Vec::new();
    for (at, leader) in leaders.into_iter().enumerate() {
        (watch.tell)("refitting", at, total);
        // Every form of a single in reach, the likeliest form of a pair; farther ones only where none held up.
        let of = mechanisms(linearized, leader);
        let mut least = f64::NEG_INFINITY;
        for entry in sets
            .iter()
            .filter(|(set, _)| mechanisms(linearized, set) == of)
        {
            if worth(entry) <= least {
                break;
            }
            let form = &entry.0;
            let stands = match linear.point(linearized, &scored[0].fit.point, form) {
                Some(point) => refit::add(linearized, point, scored, watch)?,
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
fn best_inflation(
    linearized: &LinearizedProblem<'_>,
    scored: &[Scored],
    nothing: f64,
    seed: u64,
) -> f64 {
    scored
        .iter()
        .min_by(|a, b| a.fit.misfit.total_cmp(&b.fit.misfit))
        .map_or(1.0, |best| {
            variance_inflation(linearized, &best.fit, nothing, seed)
        })
}
