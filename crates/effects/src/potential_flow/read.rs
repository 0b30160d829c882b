//! The file `hydro-potential-flow/1`.

use std::hash::{DefaultHasher, Hash, Hasher};

use nalgebra::{Complex, DMatrix, DVector, Matrix6, Schur, Vector6};
use serde_json::Value;

use super::{
    excitation::Excitation,
    flow::PotentialFlow,
    radiation::{MOST_STATES, Radiation},
};
use crate::sea::{
    SeaError,
    json::{Fields, ascending, check, document, fault, number},
};

/// Value of the key `schema`.
pub const SCHEMA: &str = "hydro-potential-flow/1";

const KEYS: [&str; 6] = [
    "schema",
    "volume",
    "point",
    "added_mass",
    "radiation",
    "excitation",
];
const RADIATION_KEYS: [&str; 3] = ["a", "b", "c"];
const EXCITATION_KEYS: [&str; 4] = ["frequency", "direction", "real", "imaginary"];

const VOLUMES: [f64; 2] = [1e-12, 1e9];
const PLACES: [f64; 2] = [-1e4, 1e4];
const NUMBERS: [f64; 2] = [-1e15, 1e15];
const FREQUENCIES: [f64; 2] = [1e-6, 1e4];
const DIRECTIONS: [f64; 2] = [-720.0, 720.0];
/// Most frequencies, and most directions.
const MOST: usize = 1000;
/// A difference of mirrored elements of this share of the greatest is a rounding.
const ROUNDED: f64 = 0.02;
/// An eigenvalue above minus this share of the greatest is zero.
const ZERO: f64 = 1e-6;

impl PotentialFlow {
    /// Reads and checks a file, `hydro-potential-flow/1`.
    ///
    /// # Errors
    /// The first fault, with its place, what was found and what was expected.
    pub fn parse(text: &str) -> Result<Self, SeaError> {
        read(text)
    }
}

fn read(text: &str) -> Result<PotentialFlow, SeaError> {
    let document = document(text, SCHEMA)?;
    let fields = Fields::new("", &document, &KEYS)?;
    let volume = fields.number("volume", "m^3")?;
    let mut digest = DefaultHasher::new();
    text.hash(&mut digest);
    Ok(PotentialFlow {
        volume: check("volume", volume, "m^3", VOLUMES)?,
        point: match fields.get("point") {
            Some(_) => fields.vector("point", "m", PLACES)?,
            None => [0.0; 3],
        },
        added_mass: added_mass(&fields)?,
        radiation: match fields.get("radiation") {
            Some(value) => radiation(value)?,
            None => Radiation {
                a: DMatrix::zeros(0, 0),
                b: DMatrix::zeros(0, 6),
                c: DMatrix::zeros(6, 0),
            },
        },
        excitation: fields.get("excitation").map(excitation).transpose()?,
        digest: digest.finish(),
    })
}

/// Rows of numbers, of this many columns.
fn rows(
    fields: &Fields<'_>,
    key: &'static str,
    count: usize,
    columns: usize,
) -> Result<DMatrix<f64>, SeaError> {
    let field = fields.field(key);
    let expected = format!("{count} rows of {columns} numbers");
    let value = fields.required(key, &expected)?;
    let wrong = |place: &str, value: &Value| fault(place, value, &expected);
    let list = value.as_array().filter(|list| list.len() == count);
    let list = list.ok_or_else(|| wrong(&field, value))?;
    let mut matrix = DMatrix::zeros(count, columns);
    for (at, row) in list.iter().enumerate() {
        let place = format!("{field}[{at}]");
        let numbers = row.as_array().filter(|row| row.len() == columns);
        for (column, value) in numbers
            .ok_or_else(|| wrong(&place, row))?
            .iter()
            .enumerate()
        {
            let place = format!("{place}[{column}]");
            matrix[(at, column)] = check(&place, number(&place, value, "")?, "", NUMBERS)?;
        }
    }
    Ok(matrix)
}

fn added_mass(fields: &Fields<'_>) -> Result<Matrix6<f64>, SeaError> {
    let given = rows(fields, "added_mass", 6, 6)?;
    let given = Matrix6::from_column_slice(given.as_slice());
    let greatest = given.amax();
    let wrong = |found: String, expected: &str| SeaError::Value {
        field: "added_mass".to_owned(),
        found,
        expected: expected.to_owned(),
    };
    for row in 0..6 {
        for column in 0..row {
            let pair = (given[(row, column)], given[(column, row)]);
            if (pair.0 - pair.1).abs() > ROUNDED * greatest {
                return Err(wrong(
                    format!(
                        "{} in row {row}, column {column}, and {} in its mirror",
                        pair.0, pair.1
                    ),
                    "a symmetric matrix",
                ));
            }
        }
    }
    let matrix = (given + given.transpose()) * 0.5;
    let least = matrix.symmetric_eigenvalues().min();
    if least < -ZERO * greatest {
        return Err(wrong(
            format!("the eigenvalue {least:.3}"),
            "none below zero: water has no kinetic energy below zero",
        ));
    }
    Ok(matrix)
}

/// Poles of a state matrix [1/s]. There are matrices, sums of a permutation and a multiple of one, on which the QR iteration
/// goes round for ever.
fn poles(a: &DMatrix<f64>) -> Result<DVector<Complex<f64>>, SeaError> {
    let most = 100 + 30 * a.nrows();
    let schur = Schur::try_new(a.clone(), f64::EPSILON, most);
    let schur = schur.ok_or_else(|| SeaError::Value {
        field: "radiation.a".to_owned(),
        found: format!("a matrix whose poles are not found in {most} steps"),
        expected: "another one of the same poles: change the basis of its states".to_owned(),
    })?;
    Ok(schur.complex_eigenvalues())
}

fn radiation(value: &Value) -> Result<Radiation, SeaError> {
    let fields = Fields::new("radiation", value, &RADIATION_KEYS)?;
    let states = fields.list("a", "rows", MOST_STATES)?.len();
    let a = rows(&fields, "a", states, states)?;
    let (b, c) = (
        rows(&fields, "b", states, 6)?,
        rows(&fields, "c", 6, states)?,
    );
    let greatest = poles(&a)?
        .iter()
        .map(|pole| pole.re)
        .fold(f64::MIN, f64::max);
    if greatest.is_nan() || greatest >= 0.0 {
        return Err(SeaError::Value {
            field: "radiation.a".to_owned(),
            found: format!("a pole with the real part {greatest:.3e} 1/s"),
            expected: "poles with real parts below zero: waves run away".to_owned(),
        });
    }
    Ok(Radiation { a, b, c })
}

fn excitation(value: &Value) -> Result<Excitation, SeaError> {
    let fields = Fields::new("excitation", value, &EXCITATION_KEYS)?;
    let frequencies = ascending(&fields, "frequency", "rad/s", FREQUENCIES, MOST)?;
    let directions = ascending(&fields, "direction", "degrees", DIRECTIONS, MOST)?;
    let span = directions[directions.len() - 1] - directions[0];
    if span > 360.0 {
        return Err(SeaError::Value {
            field: "excitation.direction".to_owned(),
            found: format!("{span} degrees from first to last"),
            expected: "at most 360".to_owned(),
        });
    }
    let count = frequencies.len() * directions.len();
    let (real, imaginary) = (
        rows(&fields, "real", count, 6)?,
        rows(&fields, "imaginary", count, 6)?,
    );
    let forces = (0..count)
        .map(|row| {
            Vector6::from_fn(|axis, _| Complex::new(real[(row, axis)], imaginary[(row, axis)]))
        })
        .collect();
    Ok(Excitation {
        frequencies,
        directions: directions
            .iter()
            .map(|degrees| degrees.to_radians())
            .collect(),
        forces,
    })
}
