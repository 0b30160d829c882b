//! What a definition declares: names, parameters, constants, commands, and their places among the inputs of its programs.

use super::{
    bytecode::LOCALS,
    check::{Facts, Range},
    error::OwnError,
    expression::{Meaning, functions},
    quantities::{self, Kind, quantities},
    source::{ParameterSource, Source},
    units::Dimension,
};

/// Most letters of a name.
const LONGEST_NAME: usize = 40;
/// Most parameters.
const MOST_PARAMETERS: usize = 12;
/// Most constants.
const MOST_CONSTANTS: usize = 24;
/// Most actuators whose commands are used.
const MOST_COMMANDS: usize = 8;
/// Greatest magnitude of a bound or constant.
const LARGEST: f64 = 1e9;

/// Name of the memory in expressions.
pub(crate) const MEMORY: &str = "memory";

/// A parameter of a definition.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OwnParameter {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) null: f64,
    pub(crate) prior_sd: f64,
    pub(crate) range: Range,
    /// True where it does nothing while the others are at their nulls.
    pub(crate) shapes: bool,
}

/// Places of the inputs of all programs: quantities of the target from zero, then commands, memory, parameters, constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layout {
    pub(crate) commands: usize,
    pub(crate) memory: usize,
    pub(crate) parameters: usize,
    pub(crate) constants: usize,
    pub(crate) len: usize,
}

pub(crate) fn check_name(name: &str) -> Result<(), OwnError> {
    let mut letters = name.chars();
    let starts = letters
        .next()
        .is_some_and(|letter| letter.is_ascii_alphabetic());
    if starts
        && name.len() <= LONGEST_NAME
        && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
    {
        return Ok(());
    }
    Err(OwnError::Name {
        found: name.chars().take(2 * LONGEST_NAME).collect(),
        most: LONGEST_NAME,
    })
}

pub(crate) fn check_value(place: &str, value: f64) -> Result<(), OwnError> {
    if value.is_finite() && value.abs() <= LARGEST {
        return Ok(());
    }
    Err(OwnError::Value {
        place: place.to_owned(),
        what: format!("{value}, expected a number of at most {LARGEST:e} in size"),
    })
}

fn at_most(what: &str, found: usize, most: usize) -> Result<(), OwnError> {
    if found <= most {
        return Ok(());
    }
    Err(OwnError::TooMuch {
        what: what.to_owned(),
        found,
        most,
    })
}

fn unit(place: &str, text: &str) -> Result<Dimension, OwnError> {
    at_most(
        &format!("{place}: letters of a unit"),
        text.len(),
        LONGEST_NAME,
    )?;
    Dimension::parse(text).map_err(|what| OwnError::Unit {
        place: place.to_owned(),
        found: text.to_owned(),
        what,
    })
}

/// Bounds of a parameter.
fn bounds(name: &str, of: &ParameterSource) -> Result<Range, OwnError> {
    let place = format!("[parameters.{name}]");
    let fault = |what: String| OwnError::Value {
        place: place.clone(),
        what,
    };
    let (Some(lower), Some(upper)) = (of.lower, of.upper) else {
        return Err(fault("needs `lower` and `upper`, both finite".to_owned()));
    };
    check_value(&format!("{place} lower"), lower)?;
    check_value(&format!("{place} upper"), upper)?;
    if lower >= upper {
        return Err(fault(format!("lower {lower} is not below upper {upper}")));
    }
    Ok(Range::new(lower, upper))
}

/// The parameters, before it is known which of them shape.
pub(crate) fn own_parameters(source: &Source) -> Result<Vec<OwnParameter>, OwnError> {
    let parameters = source.parameters.iter();
    parameters
        .map(|(name, of)| {
            let place = format!("[parameters.{name}]");
            let range = bounds(name, of)?;
            let null = of.null.unwrap_or(0.0);
            if !range.holds(null) {
                return Err(OwnError::Value {
                    place,
                    what: format!(
                        "null {null}, the value without effect, is not between {} and {}",
                        range.lower, range.upper
                    ),
                });
            }
            check_value(&format!("{place} prior_sd"), of.prior_sd)?;
            if of.prior_sd <= 0.0 {
                return Err(OwnError::Value {
                    place,
                    what: format!("prior_sd {}, expected a number above zero", of.prior_sd),
                });
            }
            Ok(OwnParameter {
                name: name.clone(),
                unit: of.unit.trim().to_owned(),
                null,
                prior_sd: of.prior_sd,
                range,
                shapes: false,
            })
        })
        .collect()
}

/// All that expressions may name.
pub(crate) struct Inputs {
    pub(crate) names: Vec<(String, Meaning)>,
    pub(crate) facts: Vec<Facts>,
    pub(crate) layout: Layout,
}

impl Inputs {
    pub(crate) fn new(source: &Source, kind: Kind) -> Result<Self, OwnError> {
        at_most("parameters", source.parameters.len(), MOST_PARAMETERS)?;
        at_most("constants", source.constants.len(), MOST_CONSTANTS)?;
        at_most("commands", source.commands.len(), MOST_COMMANDS)?;
        at_most("[let]", source.locals.len(), LOCALS)?;
        let mut names: Vec<(String, Meaning, String)> = Vec::new();
        let mut facts: Vec<Facts> = Vec::new();
        let mut add = |name: &str, place: &str, what: &str, of: Option<Facts>, local: usize| {
            check_name(name)?;
            let taken = functions().find(|known| *known == name);
            let taken = taken.map(|_| "a function".to_owned()).or_else(|| {
                let known = names.iter().find(|(known, _, _)| known == name);
                known.map(|(_, _, what)| what.clone())
            });
            if let Some(taken) = taken {
                return Err(OwnError::Taken {
                    place: place.to_owned(),
                    found: name.to_owned(),
                    what: taken,
                });
            }
            let meaning = match of {
                Some(of) => {
                    facts.push(of);
                    Meaning::Input(facts.len() - 1)
                }
                None => Meaning::Local(local),
            };
            names.push((name.to_owned(), meaning, what.to_owned()));
            Ok(facts.len())
        };
        let mut commands = 0;
        for of in quantities(kind) {
            commands = add(
                of.name,
                "",
                "a quantity of the simulation",
                Some(of.facts()),
                0,
            )?;
        }
        let mut memory = commands;
        for name in source.commands.keys() {
            let facts = quantities::command();
            memory = add(name, "[commands]", "a command", Some(facts), 0)?;
        }
        // Unit and bounds are found where it is first asked for.
        let unknown = Facts {
            dimension: None,
            range: Range::point(0.0),
        };
        let parameters = add(MEMORY, "", "the memory", Some(unknown), 0)?;
        let mut constants = parameters;
        for (name, of) in &source.parameters {
            let place = format!("[parameters.{name}]");
            let dimension = unit(&place, &of.unit)?;
            // Names that the search for shapes knows.
            let expected = match name.as_str() {
                "frequency" => Some(Dimension::RATE),
                "phase" => Some(Dimension::NUMBER),
                _ => None,
            };
            if let Some(expected) = expected.filter(|of| *of != dimension) {
                return Err(OwnError::Dimension {
                    place,
                    part: name.clone(),
                    found: dimension.to_string(),
                    expected: expected.to_string(),
                });
            }
            let facts = Facts {
                dimension: Some(dimension),
                range: bounds(name, of)?,
            };
            constants = add(name, &place, "a parameter", Some(facts), 0)?;
        }
        let mut len = constants;
        for (name, of) in &source.constants {
            let place = format!("[constants.{name}]");
            check_value(&place, of.value)?;
            let facts = Facts {
                dimension: Some(unit(&place, &of.unit)?),
                range: Range::point(of.value),
            };
            len = add(name, &place, "a constant", Some(facts), 0)?;
        }
        for (at, name) in source.locals.keys().enumerate() {
            add(name, "[let]", "an intermediate", None, at)?;
        }
        Ok(Self {
            names: names
                .into_iter()
                .map(|(name, meaning, _)| (name, meaning))
                .collect(),
            facts,
            layout: Layout {
                commands,
                memory,
                parameters,
                constants,
                len,
            },
        })
    }
}
