//! Tables of hydrodynamic derivatives, as articles and other simulators have them, as effects with whole matrices.
//!
//! A part of the REMUS 100 (T. Prestero, MIT 2001):
//!
//! ```
//! let table = hydro_effects::fossen::VehicleTable::parse(
//!     r#"
//!     convention = "ned"  # x forward, y starboard, z down; or "flu", this library's: forward, left, up
//!     point = [0, 0, 0]   # origin of the table in the body's frame (forward, left, up) [m]
//!     Y_vdot = -35.5      # added mass: the force along y by the acceleration along y [kg]
//!     Y_rdot = 1.93       # [kg m]
//!     N_rdot = -4.88      # [kg m^2]
//!     N_r = -2.0          # linear damping [N m s/rad]
//!     N_rr = -94.0        # quadratic damping [N m s^2/rad^2]
//!     "Y_r|r|" = 0.632    # off the diagonal with its bars [N s^2/rad^2]
//!     "#,
//! )?;
//! let text = table.to_json("hull")?;
//! assert!(text.contains("added_mass") && text.contains("quadratic_drag"));
//! # Ok::<(), hydro_effects::fossen::FossenError>(())
//! ```
//!
//! A derivative is what a force is multiplied with: X = X_udot u' + X_u u + X_u|u| |u| u, so that a body that is dragged has
//! negative ones. The effects hold M_A = -[X_udot ...], D_L = -[X_u ...], D_Q = -[X_u|u| ...], and a change from forward,
//! starboard, down to forward, left, up turns each into T M T with T = diag(1, -1, -1, 1, -1, -1): couplings of surge and
//! roll with the other four change their sign, all else stays. SNAME, Nomenclature for Treating the Motion of a Submerged
//! Body Through a Fluid, Bulletin 1-5, 1950; T. I. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd
//! ed., Wiley 2021, sections 6.3 and 6.4.
//!
//! Names, with or without `_`, in any case: one of X Y Z K M N, then `udot` or `dotu` for added mass; `u` for linear damping;
//! `u|u|`, `|u|u`, `uabsu`, `absu`, and on the diagonal `uu` for quadratic damping. gz-sim's tags are among them
//! (`xDotU`, `xU`, `xUabsU`, signs as here, frame `flu`). uuv_simulator's lists are taken too, with its signs: `added_mass`
//! (36 numbers, positive on the diagonal), `linear_damping` and `quadratic_damping` (6 or 36 numbers, negative; frame `ned`;
//! uuv_simulator itself uses only the diagonal of the last).
//!
//! An added mass is symmetric, so that one of a pair (Y_rdot, N_vdot) is enough; two that differ by no more than 1 % are
//! rounded, and their mean is taken.

use nalgebra::Matrix6;
use serde_json::{Map, Value};
use thiserror::Error;

use crate::{
    EffectSet, Entry, Id, SetError, Target, TargetKind, Targets, card::BodyScale,
    did_you_mean::hint,
};

/// Relative difference of two mirrored elements of an added mass that rounding explains.
const ROUNDED: f64 = 0.01;

const CONVENTION: &str = "convention";
const SIGNS: &str = "signs";
const POINT: &str = "point";
const LEFT_OUT: &str = "left_out";
const LISTS: [(&str, Kind); 3] = [
    ("added_mass", Kind::AddedMass),
    ("linear_damping", Kind::Linear),
    ("quadratic_damping", Kind::Quadratic),
];

/// Forces and moments, and the velocities, in the order of rows and columns.
const FORCES: &str = "xyzkmn";
const VELOCITIES: &str = "uvwpqr";

/// Derivatives of each kind, for a message.
const EXAMPLES: &str =
    "names such as X_udot, Y_rdot (added mass), X_u (linear damping), X_u|u| (quadratic damping)";

/// A table cannot be turned into effects.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum FossenError {
    #[error("the table is neither TOML nor JSON: {what}")]
    Format { what: String },
    #[error("`{key}` is {found}, expected {expected}")]
    Value {
        key: String,
        found: String,
        expected: &'static str,
    },
    #[error(
        "`{found}` is no hydrodynamic derivative{hint}; expected {EXAMPLES}, or {CONVENTION}, {SIGNS}, {POINT}, \
         {LEFT_OUT}, added_mass, linear_damping, quadratic_damping"
    )]
    Unknown { found: String, hint: String },
    #[error("`{first}` and `{second}` are one number given twice")]
    Twice { first: String, second: String },
    #[error(
        "`{found}` multiplies two velocities: what added mass contributes to it follows from the matrix (Kirchhoff's \
         equations) and must not be added again; body lift is the effect `lift`. Where it may be left out, name it in \
         {LEFT_OUT} = [\"{found}\"]"
    )]
    Product { found: String },
    #[error(
        "`{found}` is a force by the square of another axis's velocity, with its sign or without: write `{signed}` where it \
         turns round with the velocity; without the sign (an added mass brings such forces by itself) name it in \
         {LEFT_OUT} = [\"{found}\"]"
    )]
    Square { found: String, signed: String },
    #[error("{LEFT_OUT} names `{found}`, which the table does not have{hint}")]
    NotThere { found: String, hint: String },
    #[error("the table has no hydrodynamic derivative; expected {EXAMPLES}; it has: {found}")]
    Empty { found: String },
    #[error(transparent)]
    Effects(#[from] SetError),
}

/// The matrix that a number belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    AddedMass,
    Linear,
    Quadratic,
}

impl Kind {
    fn effect(self) -> Id {
        match self {
            Self::AddedMass => Id::AddedMass,
            Self::Linear => Id::LinearDrag,
            Self::Quadratic => Id::QuadraticDrag,
        }
    }
}

/// The meaning of a name.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Term {
    Element(Kind, usize, usize),
    /// A square that may turn round with the velocity or not.
    Square(usize, usize),
    /// A product of two velocities, or more.
    Product,
}

/// A table, turned into the matrices of the effects: positive on the diagonal, body frame x forward, y left, z up.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleTable {
    /// M_A [kg, kg m, kg m^2]; `None` where the table has no added mass.
    pub added_mass: Option<Matrix6<f64>>,
    /// D_L [N s/m, N s, N m s].
    pub linear_drag: Option<Matrix6<f64>>,
    /// D_Q [N s^2/m^2, ...].
    pub quadratic_drag: Option<Matrix6<f64>>,
    /// Point of the body that the table is about, in the body's frame [m].
    pub point: [f64; 3],
}

impl VehicleTable {
    /// Reads a table in TOML or, where it starts with `{`, in JSON.
    ///
    /// # Errors
    /// The first name or number that cannot be.
    pub fn parse(text: &str) -> Result<Self, FossenError> {
        let mut fields = fields(text)?;
        let names = names(&fields);
        let left_out = take_names(&mut fields, LEFT_OUT)?;
        for name in &left_out {
            fields.remove(name).ok_or_else(|| FossenError::NotThere {
                found: name.clone(),
                hint: hint(name, fields.keys().map(String::as_str)),
            })?;
        }
        let axes = "\"ned\" (x forward, y starboard, z down) or \"flu\" (forward, left, up)";
        let is_ned = take_choice(&mut fields, CONVENTION, ["ned", "flu"], axes)?;
        let signs = "\"derivatives\" (a dragged body has negative ones) or \"positive\" (elements of M_A and D)";
        let negated = take_choice(&mut fields, SIGNS, ["derivatives", "positive"], signs)?;
        let point = match fields.remove(POINT) {
            Some(value) => three(&value)?,
            None => [0.0; 3],
        };

        let mut found = Found::default();
        for (key, value) in &fields {
            let list = LISTS.iter().find(|(name, _)| *name == key.as_str());
            match list {
                Some((_, kind)) => {
                    let negated = negated && *kind != Kind::AddedMass;
                    found.add_list(key, *kind, value, negated)?;
                }
                None => found.add_number(key, value, negated)?,
            }
        }
        let [added_mass, linear_drag, quadratic_drag] = found.matrices(is_ned);
        let table = Self {
            added_mass,
            linear_drag,
            quadratic_drag,
            point,
        };
        match table.entries("hull").is_empty() {
            true => Err(FossenError::Empty { found: names }),
            false => Ok(table),
        }
    }

    fn entries(&self, target: &str) -> Vec<Entry> {
        let matrices = [
            (Kind::AddedMass, &self.added_mass),
            (Kind::Linear, &self.linear_drag),
            (Kind::Quadratic, &self.quadratic_drag),
        ];
        let given = matrices
            .into_iter()
            .filter_map(|(kind, matrix)| Some((kind, matrix.as_ref()?)));
        given
            .map(|(kind, matrix)| Entry {
                effect: kind.effect(),
                target: target.to_owned(),
                // nalgebra stores columns.
                parameters: matrix
                    .transpose()
                    .iter()
                    .chain(&self.point)
                    .copied()
                    .collect(),
            })
            .collect()
    }

    /// The effects on a body of that name, checked.
    ///
    /// # Errors
    /// A matrix that no body can have.
    pub fn effects(&self, target: &str) -> Result<EffectSet, FossenError> {
        let set = EffectSet {
            entries: self.entries(target),
        };
        set.check(&OneBody(target))?;
        Ok(set)
    }

    /// The text of an `effects.json` with them.
    ///
    /// # Errors
    /// As [`VehicleTable::effects`].
    pub fn to_json(&self, target: &str) -> Result<String, FossenError> {
        Ok(self.effects(target)?.to_json(&OneBody(target))?)
    }
}

/// A model with one body, of no matter what sizes.
pub(crate) struct OneBody<'a>(pub(crate) &'a str);

impl Targets for OneBody<'_> {
    fn find(&self, kind: TargetKind, name: &str) -> Option<Target> {
        (kind == TargetKind::Body && name == self.0).then_some(Target::Body(BodyScale::ONE))
    }

    fn names(&self, kind: TargetKind) -> Vec<String> {
        let is_body = kind == TargetKind::Body;
        is_body.then(|| self.0.to_owned()).into_iter().collect()
    }
}

fn fields(text: &str) -> Result<Map<String, Value>, FossenError> {
    let format = |what: String| FossenError::Format { what };
    if text.trim_start().starts_with('{') {
        serde_json::from_str(text).map_err(|fault| format(fault.to_string()))
    } else {
        toml::from_str(text).map_err(|fault| format(fault.to_string()))
    }
}

/// Names of a table, for a message.
fn names(fields: &Map<String, Value>) -> String {
    match fields.is_empty() {
        true => "none".to_owned(),
        false => fields.keys().cloned().collect::<Vec<_>>().join(", "),
    }
}

fn value_error(key: &str, found: &Value, expected: &'static str) -> FossenError {
    FossenError::Value {
        key: key.to_owned(),
        found: found.to_string(),
        expected,
    }
}

/// True for the first of two words, which is meant where there is none.
fn take_choice(
    fields: &mut Map<String, Value>,
    key: &str,
    [first, second]: [&str; 2],
    expected: &'static str,
) -> Result<bool, FossenError> {
    match fields.remove(key) {
        None => Ok(true),
        Some(Value::String(word)) if word == first => Ok(true),
        Some(Value::String(word)) if word == second => Ok(false),
        Some(other) => Err(value_error(key, &other, expected)),
    }
}

fn take_names(fields: &mut Map<String, Value>, key: &str) -> Result<Vec<String>, FossenError> {
    let Some(value) = fields.remove(key) else {
        return Ok(Vec::new());
    };
    let names = value.as_array().map(|list| {
        let names = list.iter().map(|name| name.as_str().map(str::to_owned));
        names.collect::<Option<Vec<_>>>()
    });
    names
        .flatten()
        .ok_or_else(|| value_error(key, &value, "a list of names"))
}

fn three(value: &Value) -> Result<[f64; 3], FossenError> {
    list_of(value)
        .and_then(|list| list.try_into().ok())
        .ok_or_else(|| value_error(POINT, value, "three numbers, x forward, y left, z up [m]"))
}

fn list_of(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

/// The meaning of a name; `None` where it has none.
fn term(name: &str) -> Option<Term> {
    let plain = name.to_ascii_lowercase().replace('_', "");
    let mut letters = plain.chars();
    let row = FORCES.find(letters.next()?)?;
    let rest = letters.as_str();
    let by_acceleration = rest.contains("dot");
    let by_size = rest.contains('|') || rest.contains("abs");
    let velocities = rest.replace("dot", "").replace("abs", "").replace('|', "");
    let columns: Vec<usize> = velocities
        .chars()
        .map(|letter| VELOCITIES.find(letter))
        .collect::<Option<_>>()?;
    match (columns.as_slice(), by_acceleration, by_size) {
        ([column], true, false) => Some(Term::Element(Kind::AddedMass, row, *column)),
        ([column], false, false) => Some(Term::Element(Kind::Linear, row, *column)),
        ([column], false, true) => Some(Term::Element(Kind::Quadratic, row, *column)),
        ([column, other], false, _) if column == other => match by_size || row == *column {
            true => Some(Term::Element(Kind::Quadratic, row, *column)),
            false => Some(Term::Square(row, *column)),
        },
        ([_, _, ..], false, _) => Some(Term::Product),
        _ => None,
    }
}

/// A letter of a table's name.
fn letter(letters: &str, at: usize) -> char {
    letters.as_bytes()[at] as char
}

/// Elements by matrix, row and column, with the names that gave them.
#[derive(Default)]
struct Found {
    elements: Vec<(Kind, usize, usize, f64, String)>,
}

impl Found {
    fn add(
        &mut self,
        key: &str,
        (kind, row, column): (Kind, usize, usize),
        value: f64,
        negated: bool,
    ) -> Result<(), FossenError> {
        let same = self
            .elements
            .iter()
            .find(|of| (of.0, of.1, of.2) == (kind, row, column));
        if let Some((.., first)) = same {
            return Err(FossenError::Twice {
                first: first.clone(),
                second: key.to_owned(),
            });
        }
        let value = if negated { -value } else { value };
        self.elements
            .push((kind, row, column, value, key.to_owned()));
        Ok(())
    }

    /// A single derivative.
    fn add_number(&mut self, key: &str, value: &Value, negated: bool) -> Result<(), FossenError> {
        let element = match term(key) {
            Some(Term::Element(kind, row, column)) => (kind, row, column),
            Some(Term::Square(row, column)) => {
                let force = letter(FORCES, row).to_ascii_uppercase();
                let velocity = letter(VELOCITIES, column);
                return Err(FossenError::Square {
                    found: key.to_owned(),
                    signed: format!("{force}_{velocity}|{velocity}|"),
                });
            }
            Some(Term::Product) => {
                return Err(FossenError::Product {
                    found: key.to_owned(),
                });
            }
            None => {
                let words = [CONVENTION, SIGNS, POINT, LEFT_OUT];
                let known = words.into_iter().chain(LISTS.iter().map(|(name, _)| *name));
                return Err(FossenError::Unknown {
                    found: key.to_owned(),
                    hint: hint(key, known),
                });
            }
        };
        let number = value.as_f64().filter(|number| number.is_finite());
        let number = number.ok_or_else(|| value_error(key, value, "a finite number"))?;
        self.add(key, element, number, negated)
    }

    /// A list of a diagonal or of a whole matrix, row by row.
    fn add_list(
        &mut self,
        key: &str,
        kind: Kind,
        value: &Value,
        negated: bool,
    ) -> Result<(), FossenError> {
        let whole = (0..6).flat_map(|row| (0..6).map(move |column| (row, column)));
        let diagonal = (0..6).map(|axis| (axis, axis));
        let numbers = list_of(value).filter(|list| list.iter().all(|number| number.is_finite()));
        let (numbers, places): (Vec<f64>, Vec<(usize, usize)>) = match numbers {
            Some(numbers) if numbers.len() == 36 => (numbers, whole.collect()),
            Some(numbers) if numbers.len() == 6 => (numbers, diagonal.collect()),
            _ => {
                let expected = "a list of 6 numbers (the diagonal) or of 36 (row by row)";
                return Err(value_error(key, value, expected));
            }
        };
        for (number, (row, column)) in numbers.into_iter().zip(places) {
            self.add(key, (kind, row, column), number, negated)?;
        }
        Ok(())
    }

    fn get(&self, kind: Kind, row: usize, column: usize) -> Option<f64> {
        let found = self
            .elements
            .iter()
            .find(|of| (of.0, of.1, of.2) == (kind, row, column));
        found.map(|of| of.3)
    }

    /// An element of an added mass: where its mirror image alone is given, that; where both are and differ by rounding, the
    /// mean.
    fn mirrored(&self, row: usize, column: usize) -> Option<f64> {
        let of = |row, column| self.get(Kind::AddedMass, row, column);
        match (of(row, column), of(column, row)) {
            (Some(a), Some(b)) if (a - b).abs() <= ROUNDED * a.abs().max(b.abs()) => {
                Some(0.5 * (a + b))
            }
            (Some(a), _) => Some(a),
            (None, mirror) => mirror,
        }
    }

    /// Added mass, linear and quadratic drag in the body's frame.
    fn matrices(&self, is_ned: bool) -> [Option<Matrix6<f64>>; 3] {
        [Kind::AddedMass, Kind::Linear, Kind::Quadratic].map(|kind| {
            let is_given = self.elements.iter().any(|of| of.0 == kind);
            is_given.then(|| {
                Matrix6::from_fn(|row, column| {
                    let value = match kind {
                        Kind::AddedMass => self.mirrored(row, column),
                        Kind::Linear | Kind::Quadratic => self.get(kind, row, column),
                    };
                    // Zero without a sign.
                    match value {
                        Some(value) if value != 0.0 => value * turned(is_ned, row, column),
                        _ => 0.0,
                    }
                })
            })
        })
    }
}

/// Sign of an element when y and z are turned round: T M T, T = diag(1, -1, -1, 1, -1, -1).
fn turned(is_ned: bool, row: usize, column: usize) -> f64 {
    let stays = |axis: usize| axis.is_multiple_of(3);
    if is_ned && stays(row) != stays(column) {
        -1.0
    } else {
        1.0
    }
}
