//! A checked and compiled definition.

use super::{
    bytecode::Program,
    check::Range,
    declared::{Inputs, Layout, OwnParameter, check_name, check_value, own_parameters},
    error::OwnError,
    expression::Expression,
    quantities::Kind,
    source::Source,
    texts::Texts,
};
use crate::{card::Id, did_you_mean::hint};

/// Outputs of a body's program: wrench in its frame, then force in the world.
pub(crate) const BODY_OUTPUTS: usize = 9;

/// A definition whose programs may run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Definition {
    pub(crate) name: String,
    pub(crate) source: Source,
    pub(crate) kind: Kind,
    pub(crate) point: [f64; 3],
    pub(crate) parameters: Vec<OwnParameter>,
    pub(crate) constants: Vec<f64>,
    /// Actuators whose commands it uses, in order.
    pub(crate) commands: Vec<String>,
    pub(crate) layout: Layout,
    /// Bounds of the inputs.
    pub(crate) ranges: Vec<Range>,
    /// Wrench and world force, or the one force on a joint.
    pub(crate) force: Program,
    /// Mass and moments of inertia by axis.
    pub(crate) inertia: Option<Program>,
    /// The memory's input and its time constant [s].
    pub(crate) memory: Option<Program>,
}

impl Definition {
    /// Checks and compiles a definition under a name.
    pub(crate) fn new(name: &str, source: Source) -> Result<Self, OwnError> {
        check_name(name)?;
        if Id::ALL.iter().any(|id| id.as_str() == name) {
            return Err(OwnError::BuiltIn {
                found: name.to_owned(),
            });
        }
        let kind = kind(&source)?;
        has_parts(&source, kind)?;
        let point = source.point.unwrap_or([0.0; 3]);
        for value in point {
            check_value("point", value)?;
        }
        let Inputs {
            names,
            facts: inputs,
            layout,
        } = Inputs::new(&source, kind)?;
        let texts = Texts::parse(&source, kind, &names, layout)?;

        // Units and bounds of all that is computed.
        let ranges = |change: &dyn Fn(usize, Range) -> Range| {
            let mut inputs = inputs.clone();
            let places = &mut inputs[layout.parameters..layout.constants];
            for (at, facts) in places.iter_mut().enumerate() {
                facts.range = change(at, facts.range);
            }
            texts.facts(inputs, layout)
        };
        let memory = texts.check(&ranges(&|_, range| range)?)?;
        let mut inputs = inputs.clone();
        if let Some(memory) = memory {
            inputs[layout.memory] = memory;
        }

        // Shapes do nothing while the others are at their nulls, and with all amplitudes there nothing is left.
        let mut parameters = own_parameters(&source)?;
        let nulls: Vec<f64> = parameters.iter().map(|of| of.null).collect();
        for (at, parameter) in parameters.iter_mut().enumerate() {
            let alone = ranges(&|other, range| {
                if other == at {
                    range
                } else {
                    Range::point(nulls[other])
                }
            })?;
            parameter.shapes = alone.outputs.iter().all(|of| of.facts.range.is_zero());
        }
        let shapes: Vec<bool> = parameters.iter().map(|of| of.shapes).collect();
        if shapes.iter().all(|shapes| *shapes) {
            return Err(OwnError::NoAmplitude);
        }
        let nothing = ranges(&|at, range| {
            if shapes[at] {
                range
            } else {
                Range::point(nulls[at])
            }
        })?;
        if let Some(left) = nothing.outputs.iter().find(|of| !of.facts.range.is_zero()) {
            return Err(OwnError::NotZero {
                place: left.place.clone(),
                lower: left.facts.range.lower,
                upper: left.facts.range.upper,
            });
        }

        let outputs = |list: &'_ [(usize, Expression)]| -> Result<Program, OwnError> {
            let all = list.iter().map(|(at, of)| (*at, of));
            Program::compile(all, &texts.locals)
        };
        let force = outputs(&texts.force)?;
        let inertia = match texts.inertia.as_slice() {
            [] => None,
            list => Some(outputs(list)?),
        };
        let memory = texts.memory.as_ref();
        let memory = memory
            .map(|pair| Program::compile(pair.iter().enumerate(), &texts.locals))
            .transpose()?;
        Ok(Self {
            name: name.to_owned(),
            kind,
            point,
            parameters,
            constants: source.constants.values().map(|of| of.value).collect(),
            commands: source.commands.values().cloned().collect(),
            layout,
            ranges: inputs.iter().map(|of| of.range).collect(),
            force,
            inertia,
            memory,
            source,
        })
    }
}

fn kind(source: &Source) -> Result<Kind, OwnError> {
    let found = source.target.as_str();
    let known = Kind::ALL.iter().find(|(name, _)| *name == found);
    known
        .map(|(_, kind)| *kind)
        .ok_or_else(|| OwnError::Target {
            found: found.to_owned(),
            hint: hint(found, Kind::ALL.iter().map(|(name, _)| *name)),
        })
}

/// A target's effect has its own parts and no others.
fn has_parts(source: &Source, kind: Kind) -> Result<(), OwnError> {
    let fault = |what: &str| {
        Err(OwnError::Parts {
            what: what.to_owned(),
        })
    };
    let on_body = [&source.wrench, &source.world_force, &source.inertia];
    if kind == Kind::Body {
        if source.force.is_some() {
            return fault(
                "`force` is of a hinge or slide; a body takes [wrench], [world_force] or [inertia]",
            );
        }
        if on_body.iter().all(|table| table.is_empty()) {
            return fault("nothing acts: a body needs [wrench], [world_force] or [inertia]");
        }
        return Ok(());
    }
    if on_body.iter().any(|table| !table.is_empty()) || source.point.is_some() {
        return fault(
            "[wrench], [world_force], [inertia] and `point` are of a body; a hinge or slide takes `force`",
        );
    }
    if source.medium.is_some() {
        return fault(
            "`medium` is of a body: what a hinge or slide feels does not fade at a surface",
        );
    }
    if source.force.is_none() {
        return fault("nothing acts: a hinge or slide needs `force`");
    }
    Ok(())
}
