//! Timing of actuators: delay and lag are one mechanism, and which of them it is is said only where refits tell them apart.
//!
//! Both move the mean of the response in time; they differ in its spread, which slow commands hardly show. A delay that all
//! sensors share is told from one of the actuators by what happens without a command alone, so it bears the actuators' name.

use std::collections::BTreeSet;

use hydro_effects::{Id, effect};

use crate::{
    error::GapError,
    likelihood::explanation::Explanation,
    problem::{point::Point, problem::Problem},
    progress::Watch,
};

/// The mechanism in the best set.
#[derive(Clone, Debug)]
pub(crate) struct Timing {
    /// Row of the set to choose.
    pub(crate) best: usize,
    /// The same with the other member in its place, refitted.
    pub(crate) other: Point,
    pub(crate) members: [Id; 2],
    /// True where the refits lie so far apart that the member can be named.
    pub(crate) is_told: bool,
    /// Probability that the mechanism is missing, whichever its member.
    pub(crate) probability: f64,
}

/// True for an effect that is a member of the mechanism.
pub(crate) fn is_member(id: Id) -> bool {
    effect(id).is_timing()
}

/// Refits the best set with the other member of the mechanism in the place of the one that it holds. `None` where it holds
/// none, or both.
///
/// # Errors
/// The plant refuses, or a stop was asked for.
pub(crate) fn resolve(
    explanation: &Explanation<'_>,
    best: usize,
    watch: &Watch<'_>,
) -> Result<Option<Timing>, GapError> {
    let (members, rest) = parts(explanation, best);
    let [own] = members[..] else {
        return Ok(None);
    };
    let point = explanation.point(best);
    let Some((member, exchanged)) = exchanged(explanation.problem, &point, own) else {
        return Ok(None);
    };
    let refit = |point: &Point| -> Result<(f64, Point), GapError> {
        let mut working = explanation.followed.working_point(watch);
        working.point = point.clone();
        let log = working.settled_likelihood()?;
        Ok((log.unwrap_or(f64::NEG_INFINITY), working.point))
    };
    let ((own_log, _), (other_log, other)) = (refit(&point)?, refit(&exchanged)?);
    let options = &explanation.problem.settings.options.name;
    let is_told = is_told(own_log, other_log, options.distinguishable);
    let rows = || 0..explanation.sets.len();
    let of_other = rows().find(|row| {
        let (members, beside) = parts(explanation, *row);
        members == [member] && beside == rest
    });
    let by_convention = own == Id::SensorDelay && !is_told;
    // The other member is better: its set is chosen where the search has found it, or else none is named.
    let turned = by_convention || (is_told && other_log > own_log);
    let probability = rows().filter(|row| !parts(explanation, *row).0.is_empty());
    Ok(Some(Timing {
        best: of_other.filter(|_| turned).unwrap_or(best),
        other,
        members: [own, member],
        is_told: match turned {
            true => of_other.is_some(),
            false => is_told,
        },
        probability: probability
            .map(|row| explanation.sets[row].probability)
            .sum(),
    }))
}

/// The other member, and a point with it in the place of one: on the same actuators, of the same mean response; a delay of all
/// sensors becomes one of all actuators.
fn exchanged(problem: &Problem<'_>, point: &Point, own: Id) -> Option<(Id, Point)> {
    let member = match own {
        Id::ActuatorDelay => Id::ActuatorLag,
        _ => Id::ActuatorDelay,
    };
    let all = &problem.candidates;
    let mut next = Point {
        candidates: Vec::new(),
        values: Vec::new(),
        forms: Vec::new(),
        by_trial: Vec::new(),
        nuisances: point.nuisances.clone(),
    };
    let mut times = Vec::new();
    for (row, candidate) in point.candidates.iter().enumerate() {
        let of = &all[*candidate];
        if of.effect != own {
            next.candidates.push(*candidate);
            next.values.push(point.values[row].clone());
            next.forms.push(point.forms[row]);
            next.by_trial.push(point.by_trial[row].clone());
            continue;
        }
        times.push(point.values[row][0]);
        let alike = (0..all.len()).filter(|at| all[*at].effect == member);
        let on_sensors = own == Id::SensorDelay;
        let place = match on_sensors {
            true => alike.max_by_key(|at| all[*at].targets.len()),
            false => alike.into_iter().find(|at| all[*at].targets == of.targets),
        }?;
        if !next.candidates.contains(&place) {
            next.candidates.push(place);
            next.values.push(vec![0.0]);
            next.forms.push([1.0; 2]);
            next.by_trial.push(Default::default());
        }
    }
    let time = times.iter().sum::<f64>() / times.len().max(1) as f64;
    let held = next.candidates.iter().zip(&mut next.values);
    for (candidate, values) in held.filter(|(of, _)| all[**of].effect == member) {
        let p = &all[*candidate].parameters[0];
        values[0] = time.clamp(p.lower, p.upper);
    }
    Some((member, next))
}

/// True where log likelihoods of two refits differ as much as predictions that lie a squared whitened distance apart.
fn is_told(a: f64, b: f64, squared_distance: f64) -> bool {
    2.0 * (a - b).abs() >= squared_distance
}

/// Members of the mechanism in a set, each once, and the other effects with their targets.
fn parts<'a>(explanation: &'a Explanation<'_>, row: usize) -> (Vec<Id>, Vec<(Id, &'a [String])>) {
    let problem = explanation.problem;
    let set = &explanation.sets[row].set;
    let of = |at: &usize| problem.candidates[*at].mechanism();
    let delayed: BTreeSet<&String> = (set.iter().map(of))
        .filter(|(id, _)| *id == Id::SensorDelay)
        .flat_map(|(_, targets)| targets)
        .collect();
    let sensors = problem.channels.sources.iter();
    let are_all_delayed = sensors
        .map(|source| &problem.model.sensors[source.sensor].name)
        .all(|name| delayed.contains(name));
    let is_member = |id: Id| is_member(id) || (id == Id::SensorDelay && are_all_delayed);
    let (members, mut rest): (Vec<_>, Vec<_>) =
        (set.iter().map(of)).partition(|of| is_member(of.0));
    let members: BTreeSet<Id> = members.into_iter().map(|of| of.0).collect();
    rest.sort_unstable();
    (members.into_iter().collect(), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_delays_and_lags_of_actuators() {
        let members: Vec<Id> = Id::ALL
            .iter()
            .copied()
            .filter(|id| is_member(*id))
            .collect();
        assert_eq!(members, [Id::ActuatorLag, Id::ActuatorDelay]);
    }

    /// Half of the squared distance stands in the log likelihood.
    #[test]
    fn refits_a_distance_of_three_apart_are_told() {
        for (apart, told) in [
            (4.4, false),
            (4.6, true),
            (-4.6, true),
            (f64::INFINITY, true),
        ] {
            assert_eq!(is_told(10.0, 10.0 - apart, 9.0), told, "{apart}");
        }
    }
}
