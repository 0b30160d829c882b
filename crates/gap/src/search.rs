//! The search over sets of effects: linear evidence for very many, full refits for the leaders.

use std::collections::{BTreeMap, BTreeSet};

use hydro_effects::Id;
use nalgebra::DVector;

use super::{
    adequacy::{self, Adequacy},
    bench::Bench,
    colour,
    error::GapError,
    fit::{Fit, Point},
    fitted,
    information::{Bounds, Quadratic},
    leftover,
    measured::Measured,
    payload,
    screen::{Direction, PHASE, Screen},
    second_look,
    watch::Watch,
};

/// Prior probability of so many effects missing at once.
const PRIOR_BY_SIZE: [f64; 4] = [0.5, 0.3, 0.15, 0.05];
/// Times that the payloads of a fit are looked for on the other side.
const MIRRORS: usize = 2;
/// A cost lower by this is another optimum, not the same once more.
const ANOTHER: f64 = 1.0;
/// Effects at most in a set.
const LARGEST: usize = 3;
/// Singles that pairs are made of.
const BEAM: usize = 40;
/// Singles and pairs that are refitted about one screen, at most.
const LEADERS: [usize; 2] = [5, 3];
/// Additions to the best set that are refitted, at most.
pub(super) const ADDITIONS: usize = 3;
/// All singles are refitted to data of fewer seconds times degrees of freedom than this.
const SMALL: f64 = 10.0;
/// Of what an effect does, its form leaves about this part that others can take for theirs (less than it is off by) ...
const LEFT_OVER: f64 = 0.08;
/// ... spread over about so many independent directions of the data.
const FORM_DIRECTIONS: f64 = 12.0;
/// Larger sets are tried about one that leaves structure at this level.
const INADEQUATE: f64 = 0.1;
/// Part of a period between rows below which a delay of a sensor is none.
const RESOLVED: f64 = 0.1;
/// Leaders lie within so many nats of the best by linear evidence.
const WITHIN: f64 = 25.0;

/// A set with its nonlinear fit.
#[derive(Debug)]
pub(super) struct Scored {
    /// Rows of the candidates, ascending.
    pub(super) set: Vec<usize>,
    pub(super) fit: Fit,
    /// Once it was asked for.
    adequacy: Option<Adequacy>,
}

impl Scored {
    pub(super) fn new(set: Vec<usize>, fit: Fit) -> Self {
        Self {
            set,
            fit,
            adequacy: None,
        }
    }

    /// Evidence and prior, up to a constant [nat].
    pub(super) fn log_posterior(&self, bench: &Bench<'_>, factor: f64) -> Option<f64> {
        let (evidence, _) = self.fit.evidence(factor)?;
        Some(evidence + log_prior(bench, &self.set))
    }
}

/// A set and its evidence to first order, relative to the empty set [nat].
pub(super) type Judged = (Vec<usize>, f64);

/// All that was tried.
#[derive(Debug)]
pub(super) struct Search {
    /// Refitted sets; the first is the empty one.
    pub(super) scored: Vec<Scored>,
    /// Sets judged by linear evidence alone.
    pub(super) linear: Vec<Judged>,
    /// Squared whitened residuals are divided by this.
    pub(super) factor: f64,
}

/// Log prior of a set of candidates: by number of effects, then by effect, by target, and by form.
pub(super) fn log_prior(bench: &Bench<'_>, set: &[usize]) -> f64 {
    let mut log = PRIOR_BY_SIZE[set.len().min(LARGEST)].ln();
    for (at, candidate) in set.iter().enumerate() {
        log += ((at + 1) as f64).ln() + bench.log_shares[*candidate];
    }
    log
}

/// Two candidates that cannot stand in one set.
pub(super) fn clash(bench: &Bench<'_>, a: usize, b: usize) -> bool {
    bench.candidates[a].clashes(&bench.candidates[b])
}

/// What the candidates of a set stand for, in whatever forms.
pub(super) fn mechanisms<'b>(bench: &'b Bench<'_>, set: &[usize]) -> Vec<(Id, &'b [String])> {
    let mut mechanisms: Vec<_> = set
        .iter()
        .map(|at| bench.candidates[*at].mechanism())
        .collect();
    mechanisms.sort_unstable();
    mechanisms
}

/// Of what has sets of the same mechanisms, the first.
pub(super) fn firsts<T>(
    bench: &Bench<'_>,
    all: impl Iterator<Item = T>,
    set: impl Fn(&T) -> &[usize],
) -> Vec<T> {
    let mut seen = BTreeSet::new();
    all.filter(|of| seen.insert(mechanisms(bench, set(of))))
        .collect()
}

/// A quadratic in the directions of one screen, nuisance parameters and fitted parameters out of the way.
struct Linear<'s> {
    quadratic: Quadratic,
    screen: &'s Screen,
    /// Squared residuals were divided by this.
    factor: f64,
    /// Choices of directions by candidate; several where shapes were tried. Phases are no shapes: amplitudes at two of
    /// them are one choice.
    choices: BTreeMap<usize, Vec<Vec<usize>>>,
    bounds: Vec<Bounds>,
}

impl<'s> Linear<'s> {
    fn new(bench: &Bench<'_>, screen: &'s Screen, factor: f64) -> Option<Self> {
        let quadratic = screen.quadratic.tempered(factor).marginal(screen.before)?;
        let mut choices: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
        for (at, direction) in screen.directions.iter().enumerate() {
            let of = choices.entry(direction.candidate).or_default();
            // A shape of its own is a choice of its own.
            let parameters = &bench.candidates[direction.candidate].parameters;
            let same = |other: &Direction| {
                let both = other.base.iter().zip(&direction.base).zip(parameters);
                both.into_iter()
                    .all(|((a, b), p)| a == b || p.name == PHASE)
            };
            match of
                .iter_mut()
                .find(|choice| same(&screen.directions[choice[0]]))
            {
                Some(choice) => choice.push(at),
                None => of.push(vec![at]),
            }
        }
        let bounds = screen
            .directions
            .iter()
            .map(|direction| {
                let p = &bench.candidates[direction.candidate].parameters[direction.parameter];
                let about = direction.base[direction.parameter];
                Bounds {
                    lower: (p.lower - about) / p.prior_sd,
                    upper: (p.upper - about) / p.prior_sd,
                }
            })
            .collect();
        Some(Self {
            quadratic,
            screen,
            factor,
            choices,
            bounds,
        })
    }

    /// Evidence of a set beyond nothing, its best choice of shapes and values.
    fn evidence(&self, set: &[usize]) -> Option<(f64, Vec<usize>, DVector<f64>)> {
        let mut combinations: Vec<Vec<usize>> = vec![Vec::new()];
        let mut shapes = 0.0;
        for candidate in set {
            let choices = self.choices.get(candidate)?;
            shapes += (choices.len() as f64).ln();
            combinations = combinations
                .iter()
                .flat_map(|so_far| {
                    choices
                        .iter()
                        .map(move |choice| so_far.iter().chain(choice).copied().collect())
                })
                .collect();
        }
        combinations
            .into_iter()
            .filter_map(|columns| {
                let bounds: Vec<Bounds> = columns.iter().map(|at| self.bounds[*at]).collect();
                let best = self.quadratic.select(&columns).best(&bounds)?;
                Some((best.log_evidence - shapes, columns, best.z))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// A point from which to refit a set: the linear optimum.
    fn point(&self, bench: &Bench<'_>, from: &Point, set: &[usize]) -> Option<Point> {
        let (_, columns, z) = self.evidence(set)?;
        let mut point = from.clone();
        // What goes with these values of the nuisance parameters and of what was fitted before, to first order: an effect that a
        // nuisance parameter nearly cancels would start far from anything without.
        let before = self.screen.before;
        let whole = self.screen.quadratic.tempered(self.factor);
        let mut precision = whole.a.view((0, 0), (before, before)).into_owned();
        let mut slope = DVector::zeros(before);
        for axis in 0..before {
            precision[(axis, axis)] += 1.0;
        }
        for (column, z) in columns.iter().zip(z.iter()) {
            let across = whole.a.view((0, before + column), (before, 1));
            slope -= across.column(0) * *z;
        }
        if let Some(factor) = precision.cholesky() {
            let moved = bench.normalised(&point) + factor.solve(&slope);
            bench.set(&mut point, &moved);
        }
        for candidate in set {
            let found: Vec<(&Direction, f64)> = columns
                .iter()
                .zip(z.iter())
                .map(|(column, z)| (&self.screen.directions[*column], *z))
                .filter(|(direction, _)| direction.candidate == *candidate)
                .collect();
            let values = values(bench, *candidate, &found);
            point.candidates.push(*candidate);
            point.values.push(values);
        }
        Some(point)
    }
}

/// Values of a candidate from the best steps along its directions.
fn values(bench: &Bench<'_>, candidate: usize, found: &[(&Direction, f64)]) -> Vec<f64> {
    let parameters = &bench.candidates[candidate].parameters;
    let mut values = found.first().map_or_else(
        || bench.candidates[candidate].null(),
        |(direction, _)| direction.base.clone(),
    );
    let Some(phase) = parameters.iter().position(|p| p.name == PHASE) else {
        for (direction, z) in found {
            let p = &parameters[direction.parameter];
            let value = direction.base[direction.parameter] + z * p.prior_sd;
            values[direction.parameter] = value.clamp(p.lower, p.upper);
        }
        return values;
    };
    // Amplitudes at several phases add up to one phasor a component; the strongest sets the phase.
    let mut phasors = vec![(0.0, 0.0); parameters.len()];
    for (direction, z) in found {
        let amplitude = z * parameters[direction.parameter].prior_sd;
        let (sine, cosine) = direction.base[phase].sin_cos();
        let phasor = &mut phasors[direction.parameter];
        phasor.0 += amplitude * cosine;
        phasor.1 += amplitude * sine;
    }
    let strongest = phasors
        .iter()
        .copied()
        .max_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)))
        .unwrap_or((1.0, 0.0));
    let angle = strongest.1.atan2(strongest.0);
    for (direction, _) in found {
        let (real, imaginary) = phasors[direction.parameter];
        let p = &parameters[direction.parameter];
        let along = real * angle.cos() + imaginary * angle.sin();
        values[direction.parameter] = along.clamp(p.lower, p.upper);
    }
    values[phase] = angle;
    values
}

/// Squared whitened residuals count less where a strong effect is at work, whose catalogue form is only
/// about nature's: a fraction of what it explains must not be taken for a further effect.
pub(super) fn form_factor(explained: f64) -> f64 {
    1.0 + LEFT_OVER * LEFT_OVER * explained.max(0.0) / FORM_DIRECTIONS
}

/// Searches from nothing: screen, refit the leaders, and where something is left over, screen again about
/// the best set and refit larger ones; then look at the best a second time.
pub(super) fn search(bench: &Bench<'_>, seed: u64, watch: &Watch<'_>) -> Result<Search, GapError> {
    let empty = bench.empty()?.clone();
    let directions: Vec<Direction> = (0..bench.candidates.len())
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
    factor = tempering(bench, &scored, nothing, seed);
    // Larger sets about the best found.
    for size in 2..=LARGEST {
        let Some(about) = to_enlarge(bench, &mut scored, size, factor, seed, watch)? else {
            continue;
        };
        let base = &scored[about];
        let base_set = base.set.clone();
        let directions = (0..bench.candidates.len())
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
                .take(ADDITIONS)
            {
                if let Some(point) = linear.point(bench, &from, addition) {
                    add(bench, point, &mut scored, watch)?;
                }
            }
        }
        factor = tempering(bench, &scored, nothing, seed);
    }
    let temper = |scored: &[Scored]| tempering(bench, scored, nothing, seed);
    factor = second_look::at_the_best(bench, &mut scored, factor, temper, watch)?;
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
        return Ok((adequacy.p_value <= INADEQUATE).then_some(best));
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
    form_factor(explained)
}

/// Singles and pairs of the best singles, by linear evidence; larger sets grow from refitted ones.
fn sets(bench: &Bench<'_>, linear: &Linear<'_>) -> Vec<Judged> {
    let judged = |set: &[usize]| -> Option<Judged> {
        let (gain, columns, z) = linear.evidence(set)?;
        let resolved = columns.iter().zip(z.iter()).all(|(column, z)| {
            let of = &linear.screen.directions[*column];
            let p = &bench.candidates[of.candidate].parameters[of.parameter];
            let value = of.base[of.parameter] + z * p.prior_sd;
            !is_delay(bench, of.candidate) || is_resolved(bench, [value; 2])
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
    let mut pairs = Vec::new();
    for (at, (a, _)) in singles.iter().take(BEAM).enumerate() {
        for (b, _) in singles.iter().take(BEAM).skip(at + 1) {
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
    let singles = sets.iter().filter(|(set, _)| set.len() == 1);
    let best_single = singles.map(worth).fold(f64::NEG_INFINITY, f64::max);
    // A screen about nothing misjudges a law that bends much over so large a difference (drag of a ball that falls
    // freely); where fits cost next to nothing it chooses none.
    let (reach, most) = if bench.freedom_seconds() < SMALL {
        (f64::NEG_INFINITY, usize::MAX)
    } else {
        (best_single - WITHIN, LEADERS[0])
    };
    let mut leaders = leading(1, reach, most);
    // A pair that is no better than a single is found from that, by a screen about its refit.
    leaders.extend(leading(2, best_single, LEADERS[1]));
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
                Some(point) => add(bench, point, scored, watch)?,
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

/// Refits a set; false where it does not stand.
pub(super) fn add(
    bench: &Bench<'_>,
    point: Point,
    scored: &mut Vec<Scored>,
    watch: &Watch<'_>,
) -> Result<bool, GapError> {
    let set = point.set();
    let Some(mut fit) = bench.fit(point, watch)? else {
        return Ok(false);
    };
    for _ in 0..MIRRORS {
        let mirrored = payload::mirrored(bench.candidates, &fit.point);
        let other = mirrored.map(|point| bench.fit(point, watch)).transpose()?;
        let Some(better) = other
            .flatten()
            .filter(|other| other.cost() + ANOTHER < fit.cost())
        else {
            break;
        };
        fit = better;
    }
    let mut delays = set.iter().filter(|of| is_delay(bench, **of));
    let stands = delays.all(|delay| {
        let known = &fitted::parameters(bench, &fit, *delay, 1.0)[0];
        is_resolved(bench, known.ci95)
    });
    if stands {
        scored.push(Scored::new(set, fit));
    }
    Ok(stands)
}

fn is_delay(bench: &Bench<'_>, candidate: usize) -> bool {
    bench.candidates[candidate].effect == Id::SensorDelay
}

/// False where a sensor may be late by less than its rows or the model's steps can tell: clocks, filters and
/// when within a step things happen are no better known. From, to [s], by the fit alone: what is left over may widen the
/// interval that is reported.
fn is_resolved(bench: &Bench<'_>, [from, to]: [f64; 2]) -> bool {
    let period = bench.trials.first().map_or(0.0, Measured::period);
    let least = (RESOLVED * period).max(bench.model.timestep);
    from >= least || to <= -least
}

/// The refitted set with the highest posterior.
pub(super) fn best_of(bench: &Bench<'_>, scored: &[Scored], factor: f64) -> Option<usize> {
    (0..scored.len())
        .filter_map(|at| Some((at, scored[at].log_posterior(bench, factor)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(at, _)| at)
}

/// By what squared residuals are divided: what is left under the best fit beyond declared white noise,
/// and the error of forms.
fn tempering(bench: &Bench<'_>, scored: &[Scored], nothing: f64, seed: u64) -> f64 {
    let Some(best) = scored
        .iter()
        .min_by(|a, b| a.fit.misfit.total_cmp(&b.fit.misfit))
    else {
        return 1.0;
    };
    // What a fit leaves is slow noise that nobody declared, or an error of form: whichever may overstate more.
    let seen = leftover::by_channel(bench, &best.fit.residuals);
    let of_form = leftover::overstatement(&seen) * form_factor(nothing - best.fit.misfit);
    let of_noise = leftover::overstatement(&colour::corrected(bench, &best.fit, &seen, seed));
    of_form.max(of_noise)
}

/// Whether a set leaves only noise; computed once.
pub(super) fn adequate(
    bench: &Bench<'_>,
    scored: &mut Scored,
    seed: u64,
    watch: &Watch<'_>,
) -> Result<Adequacy, GapError> {
    if let Some(known) = scored.adequacy {
        return Ok(known);
    }
    let found = if scored.set.is_empty() {
        bench.empty_adequacy(seed, watch)?
    } else {
        adequacy::of(bench, &scored.fit, seed, watch)?
    };
    scored.adequacy = Some(found);
    Ok(found)
}
