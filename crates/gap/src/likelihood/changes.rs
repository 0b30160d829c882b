//! The changes whose effect on the readings a sweep finds: of every uncertain number of the nominal and of every parameter.

use hydro_effects::{Entry, Id, Part, effect};

use crate::{
    likelihood::directions::{Direction, STEP, inward},
    plant::Quantity,
    problem::{point::Point, problem::Problem},
    rollout::shooting::remembers,
};

/// How a parameter's simulation is brought to a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Only what sensors report changes.
    Measurement,
    /// The same state as the base's, memories too.
    Loaded,
    /// The base's physics; no memory.
    Joined,
    /// Like `Joined`, but actuators remember their commands.
    Commanded,
    /// Stepped along, because it remembers.
    Stepped,
}

/// A parameter's change: the system with a small step of it.
pub(crate) struct Change {
    pub(crate) entries: Vec<Entry>,
    pub(crate) nuisances: Vec<f64>,
    pub(crate) lead: f64,
    pub(crate) step: f64,
    pub(crate) kind: Kind,
    /// True where it follows the commands, which may turn at every row: taken at every boundary.
    pub(crate) fine: bool,
}

/// All changes about a point: nuisance parameters, its own parameters, directions.
pub(crate) fn changes(
    problem: &Problem<'_>,
    point: &Point,
    directions: &[Direction],
    base: &[Entry],
) -> Vec<Change> {
    let model = problem.model;
    // Only actuators' memories can be brought on without a step.
    let stepped = |entries: &[Entry]| {
        let of_states = |entry: &Entry| {
            let is_actuator = matches!(effect(entry.effect).part(), Part::Actuator(_));
            !is_actuator && remembers(std::slice::from_ref(entry), model.timestep)
        };
        let backlash = |entry: &Entry| entry.effect == Id::JointBacklash;
        if entries
            .iter()
            .any(|entry| of_states(entry) || backlash(entry))
        {
            Kind::Stepped
        } else {
            Kind::Commanded
        }
    };
    let kind = |moved: &Point, added: Option<usize>| match added {
        Some(candidate)
            if matches!(
                effect(problem.candidates[candidate].effect).part(),
                Part::Sensor(_)
            ) =>
        {
            Kind::Measurement
        }
        Some(candidate) => {
            let entries = problem.entries(moved);
            let backlash = problem.candidates[candidate].effect == Id::JointBacklash;
            let added = entries.get(base.len()..).unwrap_or_default();
            if backlash || remembers(added, model.timestep) {
                stepped(&entries)
            } else {
                Kind::Joined
            }
        }
        None => Kind::Loaded,
    };
    let mut changes = Vec::new();
    for (at, (nuisance, _)) in problem.nuisances.iter().enumerate() {
        let mut moved = point.clone();
        moved.nuisances[at] += STEP;
        let quantity = model.nuisances[*nuisance].quantity;
        let of_readings = matches!(
            quantity,
            Quantity::ReadingLead | Quantity::PositionLag | Quantity::VelocityLag
        );
        changes.push(Change {
            entries: base.to_vec(),
            nuisances: problem.nuisance_values(&moved),
            lead: if quantity == Quantity::ReadingLead {
                STEP * problem.nuisances[at].1
            } else {
                0.0
            },
            step: STEP,
            kind: if of_readings {
                Kind::Measurement
            } else {
                kind(&moved, None)
            },
            fine: matches!(quantity, Quantity::CommandLead | Quantity::Gain),
        });
    }
    let nuisances = problem.nuisance_values(point);
    for (row, candidate) in point.candidates.iter().enumerate() {
        for (parameter, p) in problem.candidates[*candidate].parameters.iter().enumerate() {
            let step = inward(point.values[row][parameter], STEP * p.prior_sd, p.upper);
            let mut moved = point.clone();
            moved.values[row][parameter] += step;
            let entries = problem.entries(&moved);
            // A delay's memory grows with it; other memories are as long as before.
            let of_commands = acts_on_commands(problem, *candidate)
                && remembers(
                    &problem.candidates[*candidate].entries(&moved.values[row]),
                    model.timestep,
                );
            changes.push(Change {
                nuisances: nuisances.clone(),
                lead: 0.0,
                step: step / p.prior_sd,
                kind: if of_commands {
                    stepped(&entries)
                } else if kind(&moved, Some(*candidate)) == Kind::Measurement {
                    Kind::Measurement
                } else {
                    Kind::Loaded
                },
                entries,
                fine: acts_on_commands(problem, *candidate),
            });
        }
    }
    for direction in directions {
        let p = &problem.candidates[direction.candidate].parameters[direction.parameter];
        let mut moved = point.clone();
        let mut values = direction.base.clone();
        values[direction.parameter] += direction.step;
        moved.candidates.push(direction.candidate);
        moved.values.push(values);
        changes.push(Change {
            entries: problem.entries(&moved),
            nuisances: nuisances.clone(),
            lead: 0.0,
            step: direction.step / p.prior_sd,
            kind: kind(&moved, Some(direction.candidate)),
            fine: acts_on_commands(problem, direction.candidate),
        });
    }
    changes
}

fn acts_on_commands(problem: &Problem<'_>, candidate: usize) -> bool {
    let effect = effect(problem.candidates[candidate].effect);
    matches!(effect.part(), Part::Actuator(_))
}
