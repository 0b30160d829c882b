//! A whole 6 x 6 matrix in an `effects.json`: `{"matrix": [[6 numbers] x 6], "point": [x, y, z]}` in place of six names.

use nalgebra::Matrix6;
use serde_json::{Map, Value, json};

use crate::{
    Entry, MATRIX_LEN, MatrixPart, Physical,
    catalogue::AXES,
    flow::REACH,
    json_shape::{numbers, shape},
    set_error::SetError,
};

/// Key of the matrix.
pub(crate) const MATRIX: &str = "matrix";
/// Key of the point that it acts at.
pub(crate) const POINT: &str = "point";

/// Words for a list of what an effect has.
pub(crate) const IN_WORDS: &str =
    "or in their place `matrix` (6 rows of 6), with `point` [m] (optional)";

/// Values of a matrix, and of its point where there is one.
pub(crate) fn read(place: &str, values: &Map<String, Value>) -> Result<Vec<f64>, SetError> {
    if let Some(other) = values
        .keys()
        .find(|key| ![MATRIX, POINT].contains(&key.as_str()))
    {
        return Err(SetError::Shape {
            place: place.to_owned(),
            found: format!("`{other}` beside `{MATRIX}`"),
            expected: format!("only `{MATRIX}` and `{POINT}`, or the names of the diagonal alone"),
        });
    }
    let matrix = &values[MATRIX];
    let place_of = |key: &str| format!("{place}.{key}");
    let rows = matrix
        .as_array()
        .ok_or_else(|| shape(place_of(MATRIX), matrix, "a list of 6 rows"))?;
    if rows.len() != 6 {
        return Err(SetError::Shape {
            place: place_of(MATRIX),
            found: format!("{} rows", rows.len()),
            expected: format!("6: {}", AXES.join(", ")),
        });
    }
    let mut elements = Vec::with_capacity(MATRIX_LEN + 3);
    for (at, row) in rows.iter().enumerate() {
        let place = format!("{place}.{MATRIX}[{at}]");
        elements.extend(numbers::<6>(&place, row, "a list of 6 numbers")?);
    }
    if let Some(point) = values.get(POINT) {
        let what = "a list of 3 numbers [m], x, y, z in the body's frame";
        elements.extend(numbers::<3>(&place_of(POINT), point, what)?);
    }
    Ok(elements)
}

/// The values as they stand in a file.
pub(crate) fn write(values: &[f64]) -> Map<String, Value> {
    let (elements, point) = values.split_at(MATRIX_LEN.min(values.len()));
    let rows: Vec<&[f64]> = elements.chunks(6).collect();
    let mut written = Map::new();
    written.insert(MATRIX.to_owned(), json!(rows));
    if !point.is_empty() {
        written.insert(POINT.to_owned(), json!(point));
    }
    written
}

/// Checks that values are finite, not too great, and a matrix that a body can have.
pub(crate) fn check(index: usize, entry: &Entry, part: &dyn MatrixPart) -> Result<(), SetError> {
    let (elements, point) = entry.parameters.split_at(MATRIX_LEN);
    let element = |at: usize| {
        let (row, column) = (at / 6, at % 6);
        let name = format!("{MATRIX}, {}, {}", AXES[row], AXES[column]);
        (name, part.unit(row, column), Physical::Any)
    };
    let coordinate = |at: usize| (format!("{POINT}[{at}]"), "m", REACH);
    let named = (0..elements.len())
        .map(element)
        .chain((0..point.len()).map(coordinate));
    for ((parameter, unit, expected), &value) in named.zip(&entry.parameters) {
        let (effect, target) = (entry.effect, entry.target.clone());
        if !value.is_finite() {
            return Err(SetError::NotFinite {
                index,
                effect,
                target,
                parameter,
                value,
            });
        }
        if !expected.holds(value) {
            return Err(SetError::OutOfBounds {
                index,
                effect,
                target,
                parameter,
                value,
                unit,
                expected,
            });
        }
    }
    let matrix = Matrix6::from_row_slice(elements);
    part.check(&matrix).map_err(|fault| SetError::Matrix {
        index,
        effect: entry.effect,
        target: entry.target.clone(),
        fault,
    })
}
