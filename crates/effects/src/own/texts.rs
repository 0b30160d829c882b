//! The expressions of a definition, and units and bounds of all of them.

use std::collections::BTreeMap;

use super::{
    check::{Facts, Known, Range, facts},
    declared::{Layout, MEMORY},
    error::OwnError,
    expression::{Expression, Meaning},
    quantities::Kind,
    source::Source,
    units::Dimension,
};
use crate::did_you_mean::hint;

/// Axes of a body.
const AXES: [&str; 6] = ["surge", "sway", "heave", "roll", "pitch", "yaw"];
/// Axes of the world.
const WORLD: [&str; 3] = ["x", "y", "z"];

/// The expressions of a definition.
pub(crate) struct Texts {
    pub(crate) locals: Vec<Expression>,
    /// Outputs of the force's program, with the unit of each.
    pub(crate) force: Vec<(usize, Expression)>,
    units: Vec<Dimension>,
    pub(crate) inertia: Vec<(usize, Expression)>,
    /// Input and time constant.
    pub(crate) memory: Option<[Expression; 2]>,
}

/// Unit and bounds of an expression, and where it stands.
pub(crate) struct Output {
    pub(crate) place: String,
    pub(crate) facts: Facts,
}

/// Units and bounds of a definition's expressions.
pub(crate) struct AllFacts {
    /// Force and inertia.
    pub(crate) outputs: Vec<Output>,
    /// Memory, and its time constant.
    memory: Option<[Facts; 2]>,
}

impl Texts {
    pub(crate) fn parse(
        source: &Source,
        kind: Kind,
        names: &[(String, Meaning)],
        layout: Layout,
    ) -> Result<Self, OwnError> {
        // Without a memory its name means nothing.
        let used: Vec<(String, Meaning)> = names
            .iter()
            .filter(|(name, _)| source.memory.is_some() || name != MEMORY)
            .cloned()
            .collect();
        let locals = source.locals.iter();
        let locals = locals
            .map(|(name, text)| Expression::parse(&format!("[let] {name}"), text, &used))
            .collect::<Result<_, _>>()?;
        let mut force = Vec::new();
        let mut units = Vec::new();
        if let Some(text) = &source.force {
            force.push((0, Expression::parse("force", text, &used)?));
            units.push(if kind == Kind::Hinge {
                Dimension::TORQUE
            } else {
                Dimension::FORCE
            });
        }
        for (at, of) in table("wrench", &source.wrench, &AXES, &used)? {
            units.push(if at < 3 {
                Dimension::FORCE
            } else {
                Dimension::TORQUE
            });
            force.push((at, of));
        }
        for (at, of) in table("world_force", &source.world_force, &WORLD, &used)? {
            units.push(Dimension::FORCE);
            force.push((AXES.len() + at, of));
        }
        let memory = source.memory.as_ref().map(|of| {
            let constant = |(_, meaning): &&(String, Meaning)| {
                matches!(meaning, Meaning::Input(at) if (layout.parameters..layout.len).contains(at))
            };
            let constants: Vec<_> = used.iter().filter(constant).cloned().collect();
            let input = Expression::parse("[memory] input", &of.input, &used)?;
            let place = "[memory] time_constant";
            Ok([input, Expression::parse(place, &of.time_constant, &constants)?])
        });
        Ok(Self {
            locals,
            force,
            units,
            inertia: table("inertia", &source.inertia, &AXES, &used)?,
            memory: memory.transpose()?,
        })
    }

    /// Units and bounds for inputs with these.
    pub(crate) fn facts(&self, inputs: Vec<Facts>, layout: Layout) -> Result<AllFacts, OwnError> {
        let mut search = Search {
            inputs,
            memory_at: layout.memory,
            memory: match &self.memory {
                Some(_) => State::Unknown,
                None => State::Busy,
            },
            memory_input: self.memory.as_ref().map(|[input, _]| input),
            locals: &self.locals,
            found: vec![State::Unknown; self.locals.len()],
        };
        // Those that nothing uses are checked too.
        for at in 0..self.locals.len() {
            search.local(at)?;
        }
        let mut outputs = Vec::new();
        for (_, of) in self.force.iter().chain(&self.inertia) {
            outputs.push(Output {
                place: of.place.clone(),
                facts: facts(of, &mut search)?,
            });
        }
        let memory = match &self.memory {
            Some([_, time]) => Some([search.input(layout.memory)?, facts(time, &mut search)?]),
            None => None,
        };
        Ok(AllFacts { outputs, memory })
    }

    /// Holds units and bounds to what they must be. Returns those of the memory.
    pub(crate) fn check(&self, all: &AllFacts) -> Result<Option<Facts>, OwnError> {
        let inertia = self.inertia.iter().map(|(at, _)| {
            if *at < 3 {
                Dimension::MASS
            } else {
                Dimension::INERTIA
            }
        });
        let expected = self.units.iter().copied().chain(inertia);
        let texts = self.force.iter().chain(&self.inertia);
        for ((output, expected), (_, of)) in all.outputs.iter().zip(expected).zip(texts) {
            has_dimension(of, output.facts, expected)?;
        }
        for output in &all.outputs[self.force.len()..] {
            let Range { lower, upper } = output.facts.range;
            if lower < 0.0 {
                return Err(OwnError::Value {
                    place: output.place.clone(),
                    what: format!("it lies between {lower} and {upper}; inertia is never negative"),
                });
            }
        }
        let (Some([memory, time]), Some([_, text])) = (all.memory, &self.memory) else {
            return Ok(None);
        };
        has_dimension(text, time, Dimension::SECOND)?;
        let Range { lower, upper } = time.range;
        if lower <= 0.0 {
            return Err(OwnError::Value {
                place: text.place.clone(),
                what: format!("it lies between {lower} and {upper} s; expected above zero"),
            });
        }
        Ok(Some(memory))
    }
}

fn has_dimension(of: &Expression, found: Facts, expected: Dimension) -> Result<(), OwnError> {
    match found.dimension {
        Some(dimension) if dimension != expected => Err(OwnError::Dimension {
            place: of.place.clone(),
            part: of.text.clone(),
            found: dimension.to_string(),
            expected: expected.to_string(),
        }),
        _ => Ok(()),
    }
}

/// The expressions of a table by axis, in the order of the axes.
fn table(
    name: &str,
    texts: &BTreeMap<String, String>,
    axes: &[&str],
    names: &[(String, Meaning)],
) -> Result<Vec<(usize, Expression)>, OwnError> {
    let mut found = Vec::new();
    for (axis, text) in texts {
        let at = axes.iter().position(|known| known == axis);
        let at = at.ok_or_else(|| OwnError::Axis {
            table: name.to_owned(),
            found: axis.clone(),
            hint: hint(axis, axes.iter().copied()),
            known: axes.join(", "),
        })?;
        let place = format!("[{name}] {axis}");
        found.push((at, Expression::parse(&place, text, names)?));
    }
    found.sort_by_key(|(at, _)| *at);
    Ok(found)
}

/// What is known of something.
#[derive(Clone, Copy)]
enum State {
    Unknown,
    /// It is being looked at: who asks for it now depends on itself.
    Busy,
    Found(Facts),
}

/// Finds units and bounds, each once.
struct Search<'a> {
    inputs: Vec<Facts>,
    memory_at: usize,
    memory: State,
    memory_input: Option<&'a Expression>,
    locals: &'a [Expression],
    found: Vec<State>,
}

fn circle(of: &Expression, name: &str) -> OwnError {
    OwnError::Circle {
        place: of.place.clone(),
        name: name.to_owned(),
    }
}

impl Known for Search<'_> {
    fn input(&mut self, at: usize) -> Result<Facts, OwnError> {
        let (true, Some(input)) = (at == self.memory_at, self.memory_input) else {
            return Ok(self.inputs[at]);
        };
        match self.memory {
            State::Found(facts) => Ok(facts),
            State::Busy => Err(circle(input, MEMORY)),
            State::Unknown => {
                self.memory = State::Busy;
                let Facts { dimension, range } = facts(input, self)?;
                // It starts at zero and never leaves the interval between that and its input.
                let facts = Facts {
                    dimension: Some(dimension.unwrap_or(Dimension::NUMBER)),
                    range: range.with(0.0),
                };
                self.memory = State::Found(facts);
                Ok(facts)
            }
        }
    }

    fn local(&mut self, at: usize) -> Result<Facts, OwnError> {
        let of = &self.locals[at];
        match self.found[at] {
            State::Found(facts) => Ok(facts),
            State::Busy => Err(circle(of, of.place.trim_start_matches("[let] "))),
            State::Unknown => {
                self.found[at] = State::Busy;
                let facts = facts(of, self)?;
                self.found[at] = State::Found(facts);
                Ok(facts)
            }
        }
    }
}
