//! The changes whose effect on the readings a sweep finds: of every uncertain number of the nominal and of every parameter.

use hydro_effects::{Entry, Id, Part, effect};

use crate::{
    error::GapError,
    likelihood::directions::{Direction, STEP, inward},
    plant::{Quantity, Simulation},
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
    /// The base's physics and memory.
    Joined,
    /// The base's physics, with a memory of its own of the motion so far.
    Remembering,
    /// The base's physics and motion, with all that is remembered of its own of the commands before the log.
    Begun,
}

impl Kind {
    /// True where memories are its own.
    pub(crate) fn has_own_memory(self) -> bool {
        matches!(self, Self::Remembering | Self::Begun)
    }
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
    /// True where one step of a block does not stand for the others: every step is taken.
    pub(crate) every_step: bool,
    /// Number of the earlier change whose memory it shares; none where it has its own.
    pub(crate) remembers_as: Option<usize>,
}

impl Change {
    /// Its simulation in a trial. Values that the plant refuses change nothing against the `base`: numbers of the nominal and
    /// effects.
    pub(super) fn simulation<'p>(
        &self,
        problem: &'p Problem<'_>,
        trial: usize,
        base: (&[f64], &[Entry]),
    ) -> Result<Box<dyn Simulation + 'p>, GapError> {
        let plant = problem.plant.cheaper().unwrap_or(problem.plant);
        let mut simulation = match plant.simulation(&self.nuisances, &self.entries) {
            Ok(simulation) => simulation,
            Err(_) => plant.simulation(base.0, base.1)?,
        };
        simulation.prescribe(problem.trials[trial].prescribed.clone());
        Ok(simulation)
    }
}

/// All changes about a point: nuisance parameters, its own parameters, directions.
pub(crate) fn changes(
    problem: &Problem<'_>,
    point: &Point,
    directions: &[Direction],
    base: &[Entry],
) -> Vec<Change> {
    let model = problem.model;
    let part = |candidate: usize| effect(problem.candidates[candidate].effect).part();
    let measures = |candidate: usize| matches!(part(candidate), Part::Sensor(_));
    let commands = |candidate: usize| matches!(part(candidate), Part::Actuator(_));
    let plays = |candidate: usize| problem.candidates[candidate].effect == Id::JointBacklash;
    // What acts through accelerations follows the commands too; so does an effect of the user's own that reads them.
    let follows = |candidate: usize| {
        let reads = effect(problem.candidates[candidate].effect).commands();
        commands(candidate) || part(candidate).adds_inertia() || !reads.is_empty()
    };
    let filters = |entry: &Entry| match effect(entry.effect).part() {
        Part::Actuator(part) => part.memory_len(&entry.parameters, model.timestep) > 0,
        _ => {
            let reads = !effect(entry.effect).commands().is_empty();
            reads && remembers(std::slice::from_ref(entry), model.timestep)
        }
    };
    let remembers_commands = model.state_len > 1 + model.nq + model.nv || base.iter().any(filters);
    let mut changes = Vec::new();
    for (at, (nuisance, sd)) in problem.nuisances.iter().enumerate() {
        let mut moved = point.clone();
        let quantity = model.nuisances[*nuisance].quantity;
        // Beyond its limit a command is no other.
        let step = match quantity {
            Quantity::CommandsBefore => -STEP,
            _ => STEP,
        };
        moved.nuisances[at] += step;
        changes.push(Change {
            entries: base.to_vec(),
            nuisances: problem.nuisance_values(&moved),
            lead: if quantity == Quantity::ReadingLead {
                STEP * sd
            } else {
                0.0
            },
            step,
            kind: match quantity {
                of if of.is_of_readings() => Kind::Measurement,
                Quantity::CommandsBefore if !remembers_commands => Kind::Measurement,
                Quantity::CommandsBefore => Kind::Begun,
                _ => Kind::Loaded,
            },
            fine: matches!(
                quantity,
                Quantity::CommandLead
                    | Quantity::CommandsBefore
                    | Quantity::Gain
                    | Quantity::Mass
                    | Quantity::Inertia(_)
                    | Quantity::CentreOfMass(_)
            ),
            every_step: false,
            remembers_as: None,
        });
    }
    let mut push = |candidate: usize, moved: &Point, step: f64, kind: &dyn Fn(&[Entry]) -> Kind| {
        let entries = problem.entries(moved);
        changes.push(Change {
            nuisances: problem.nuisance_values(point),
            lead: 0.0,
            step,
            kind: if measures(candidate) {
                Kind::Measurement
            } else {
                kind(&entries)
            },
            fine: follows(candidate),
            every_step: plays(candidate),
            entries,
            remembers_as: None,
        });
    };
    for (row, candidate) in point.candidates.iter().enumerate() {
        let of = &problem.candidates[*candidate];
        for (parameter, p) in of.parameters.iter().enumerate() {
            let step = inward(point.values[row][parameter], STEP * p.prior_sd, p.upper);
            let mut moved = point.clone();
            moved.values[row][parameter] += step;
            // A delay's memory grows with it, and the way through backlash; other memories are as before.
            let own = of.entries(&moved.values[row]);
            let grows =
                (commands(*candidate) || plays(*candidate)) && remembers(&own, model.timestep);
            let kind = match grows {
                true => Kind::Remembering,
                false => Kind::Loaded,
            };
            push(*candidate, &moved, step / p.prior_sd, &|_| kind);
        }
    }
    let first = problem.nuisances.len() + point.values.iter().map(Vec::len).sum::<usize>();
    for direction in directions {
        let p = &problem.candidates[direction.candidate].parameters[direction.parameter];
        let mut moved = point.clone();
        let mut values = direction.base.clone();
        values[direction.parameter] += direction.step;
        moved.candidates.push(direction.candidate);
        moved.values.push(values);
        moved.forms.push([1.0; 2]);
        let step = direction.step / p.prior_sd;
        push(direction.candidate, &moved, step, &|entries| {
            let added = entries.get(base.len()..).unwrap_or_default();
            match remembers(added, model.timestep) {
                true => Kind::Remembering,
                false => Kind::Joined,
            }
        });
    }
    // Amplitudes of one shape remember the same motion.
    for (at, direction) in directions.iter().enumerate() {
        let part = part(direction.candidate);
        let alike = |other: &Direction| {
            other.candidate == direction.candidate && other.base == direction.base
        };
        let earlier = directions[..at].iter().position(alike);
        if matches!(part, Part::Body(part) if part.remembers_motion_alone()) {
            changes[first + at].remembers_as = earlier.map(|earlier| first + earlier);
        }
    }
    changes
}
