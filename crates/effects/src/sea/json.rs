//! Fields of a JSON object by name, with errors that name them.

use serde_json::{Map, Value};

use super::error::SeaError;
use crate::did_you_mean::hint;

/// A number for people: digits where they are few.
pub(crate) fn plain(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-4..1e9).contains(&size) || !size.is_finite() {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A JSON value in a few words.
pub(crate) fn in_words(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(value) => format!("the number {value}"),
        Value::String(value) => format!(
            "the string `{}`",
            value.chars().take(60).collect::<String>()
        ),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object".to_owned(),
    }
}

pub(crate) fn fault(field: &str, found: &Value, expected: &str) -> SeaError {
    SeaError::Value {
        field: field.to_owned(),
        found: in_words(found),
        expected: expected.to_owned(),
    }
}

/// Refuses a number that is not between two bounds, both allowed, or is not a number.
pub(crate) fn check(
    field: &str,
    value: f64,
    unit: &str,
    [lower, upper]: [f64; 2],
) -> Result<f64, SeaError> {
    if (lower..=upper).contains(&value) {
        return Ok(value);
    }
    let unit = if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    };
    Err(SeaError::Value {
        field: field.to_owned(),
        found: format!("{}{unit}", plain(value)),
        expected: format!("{} to {}{unit}", plain(lower), plain(upper)),
    })
}

/// Refuses infinity and what is not a number.
pub(crate) fn check_finite(field: &str, value: f64) -> Result<f64, SeaError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(SeaError::Value {
        field: field.to_owned(),
        found: value.to_string(),
        expected: "a finite number".to_owned(),
    })
}

/// The document of a text, checked to be an object of this schema.
pub(crate) fn document(text: &str, schema: &'static str) -> Result<Value, SeaError> {
    let document: Value = serde_json::from_str(text).map_err(|error| SeaError::Json {
        line: error.line(),
        column: error.column(),
        what: error.to_string(),
    })?;
    let found = match document.as_object().map(|fields| fields.get("schema")) {
        None => {
            return Err(fault(
                "the file",
                &document,
                &format!("an object with `schema`: `{schema}`"),
            ));
        }
        Some(None) => "none".to_owned(),
        Some(Some(Value::String(found))) if found == schema => return Ok(document),
        Some(Some(found)) => in_words(found),
    };
    Err(SeaError::Schema {
        found,
        expected: schema,
    })
}

/// The fields of an object.
#[derive(Debug)]
pub(crate) struct Fields<'a> {
    place: String,
    map: &'a Map<String, Value>,
}

impl<'a> Fields<'a> {
    /// The object at a place, whose keys must all be known. The document's own place is empty.
    pub(crate) fn new(
        place: &str,
        value: &'a Value,
        known: &[&'static str],
    ) -> Result<Self, SeaError> {
        let fields = Self {
            place: place.to_owned(),
            map: value
                .as_object()
                .ok_or_else(|| fault(place, value, "an object"))?,
        };
        match fields.map.keys().find(|key| !known.contains(&key.as_str())) {
            None => Ok(fields),
            Some(found) => Err(SeaError::UnknownKey {
                field: fields.place(),
                found: found.chars().take(60).collect(),
                hint: hint(found, known.iter().copied()),
                known: known.to_vec(),
            }),
        }
    }

    /// The place of the object in errors.
    pub(crate) fn place(&self) -> String {
        if self.place.is_empty() {
            "the file".to_owned()
        } else {
            self.place.clone()
        }
    }

    /// The place of a field in errors.
    pub(crate) fn field(&self, key: &str) -> String {
        if self.place.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.place)
        }
    }

    pub(crate) fn get(&self, key: &str) -> Option<&'a Value> {
        self.map.get(key)
    }

    pub(crate) fn required(
        &self,
        key: &'static str,
        expected: &str,
    ) -> Result<&'a Value, SeaError> {
        self.get(key).ok_or_else(|| SeaError::Missing {
            field: self.place(),
            missing: key,
            expected: expected.to_owned(),
        })
    }

    /// The one key that is there, of some that exclude each other.
    pub(crate) fn one_of<const N: usize>(
        &self,
        keys: [&'static str; N],
    ) -> Result<&'static str, SeaError> {
        let mut there = keys.into_iter().filter(|key| self.get(key).is_some());
        match (there.next(), there.next()) {
            (Some(only), None) => Ok(only),
            (Some(first), Some(second)) => Err(SeaError::Both {
                field: self.place(),
                first,
                second,
            }),
            (None, _) => Err(SeaError::Missing {
                field: self.place(),
                missing: keys[0],
                expected: keys.map(|key| format!("`{key}`")).join(" or "),
            }),
        }
    }

    /// A number, or none where the key is absent.
    pub(crate) fn optional(&self, key: &str, unit: &str) -> Result<Option<f64>, SeaError> {
        self.get(key)
            .map(|value| number(&self.field(key), value, unit))
            .transpose()
    }

    /// A number that must be there.
    pub(crate) fn number(&self, key: &'static str, unit: &str) -> Result<f64, SeaError> {
        let value = self.required(key, &in_unit(unit))?;
        number(&self.field(key), value, unit)
    }

    /// A whole number of at least zero, or none where the key is absent.
    pub(crate) fn whole(&self, key: &str) -> Result<Option<u64>, SeaError> {
        let expected = "a whole number of at least 0 and below 2^64";
        self.get(key)
            .map(|value| {
                value
                    .as_u64()
                    .ok_or_else(|| fault(&self.field(key), value, expected))
            })
            .transpose()
    }

    /// True or false, or none where the key is absent.
    pub(crate) fn truth(&self, key: &str) -> Result<Option<bool>, SeaError> {
        self.get(key)
            .map(|value| {
                value
                    .as_bool()
                    .ok_or_else(|| fault(&self.field(key), value, "true or false"))
            })
            .transpose()
    }

    /// Three numbers within bounds.
    pub(crate) fn vector(
        &self,
        key: &'static str,
        unit: &str,
        bounds: [f64; 2],
    ) -> Result<[f64; 3], SeaError> {
        let value = self.required(key, &three_numbers(unit))?;
        vector(&self.field(key), value, unit, bounds)
    }

    /// A list that must be there, of one element at least and no more than `most`.
    pub(crate) fn list(
        &self,
        key: &'static str,
        what: &str,
        most: usize,
    ) -> Result<&'a [Value], SeaError> {
        let expected = format!("a list of 1 to {most} {what}");
        let value = self.required(key, &expected)?;
        value
            .as_array()
            .filter(|list| (1..=most).contains(&list.len()))
            .map(Vec::as_slice)
            .ok_or_else(|| fault(&self.field(key), value, &expected))
    }
}

/// Numbers that ascend, of one at least and no more than `most`.
pub(crate) fn ascending(
    fields: &Fields<'_>,
    key: &'static str,
    unit: &str,
    bounds: [f64; 2],
    most: usize,
) -> Result<Vec<f64>, SeaError> {
    let list = fields.list(key, "numbers", most)?;
    let mut values: Vec<f64> = Vec::with_capacity(list.len());
    for (at, value) in list.iter().enumerate() {
        let field = format!("{}[{at}]", fields.field(key));
        let value = check(&field, number(&field, value, unit)?, unit, bounds)?;
        if let Some(last) = values.last().filter(|last| **last >= value) {
            return Err(SeaError::Value {
                field,
                found: format!("{value} {unit} after {last} {unit}"),
                expected: "numbers that ascend".to_owned(),
            });
        }
        values.push(value);
    }
    Ok(values)
}

fn three_numbers(unit: &str) -> String {
    format!("three numbers [{unit}], x y z")
}

/// Three numbers within bounds, at a place.
pub(crate) fn vector(
    field: &str,
    value: &Value,
    unit: &str,
    bounds: [f64; 2],
) -> Result<[f64; 3], SeaError> {
    let list = value.as_array().filter(|list| list.len() == 3);
    let list = list.ok_or_else(|| fault(field, value, &three_numbers(unit)))?;
    let mut vector = [0.0; 3];
    for (axis, (slot, value)) in vector.iter_mut().zip(list).enumerate() {
        let field = format!("{field}[{axis}]");
        *slot = check(&field, number(&field, value, unit)?, unit, bounds)?;
    }
    Ok(vector)
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() {
        "a number".to_owned()
    } else {
        format!("a number [{unit}]")
    }
}

/// A number at a place.
pub(crate) fn number(field: &str, value: &Value, unit: &str) -> Result<f64, SeaError> {
    value
        .as_f64()
        .ok_or_else(|| fault(field, value, &in_unit(unit)))
}
