//! Shapes of JSON values, and the errors of those that do not have them.

use serde_json::Value;

use crate::set_error::SetError;

/// A JSON value in a few words.
pub(crate) fn in_words(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Number(value) => format!("the number {value}"),
        Value::String(value) => format!("the string `{value}`"),
        Value::Array(_) => "a list".to_owned(),
        Value::Object(_) => "an object".to_owned(),
    }
}

/// The error of a value of another shape than expected.
pub(crate) fn shape(place: String, found: &Value, expected: &str) -> SetError {
    SetError::Shape {
        place,
        found: in_words(found),
        expected: expected.to_owned(),
    }
}

/// An object with exactly these keys, but for one more that may be there, and their values in this order.
pub(crate) fn object<'a, const N: usize>(
    place: &str,
    value: &'a Value,
    keys: [&str; N],
    optional: Option<&str>,
) -> Result<[&'a Value; N], SetError> {
    let expected = keys.map(|key| format!("`{key}`")).join(", ");
    let fields = value.as_object().ok_or_else(|| {
        shape(
            place.to_owned(),
            value,
            &format!("an object with {expected}"),
        )
    })?;
    let is_known = |key: &str| keys.contains(&key) || optional == Some(key);
    if let Some(key) = fields.keys().find(|key| !is_known(key)) {
        return Err(SetError::Shape {
            place: place.to_owned(),
            found: format!("the key `{key}`"),
            expected: format!("only {expected}"),
        });
    }
    let mut values = [const { &Value::Null }; N];
    for (slot, key) in values.iter_mut().zip(keys) {
        *slot = fields.get(key).ok_or_else(|| SetError::Shape {
            place: place.to_owned(),
            found: format!("no `{key}`"),
            expected: expected.clone(),
        })?;
    }
    Ok(values)
}

/// Numbers of a list of that length.
pub(crate) fn numbers<const N: usize>(
    place: &str,
    value: &Value,
    what: &str,
) -> Result<[f64; N], SetError> {
    let list = value
        .as_array()
        .ok_or_else(|| shape(place.to_owned(), value, what))?;
    if list.len() != N {
        return Err(SetError::Shape {
            place: place.to_owned(),
            found: format!("a list of {}", list.len()),
            expected: what.to_owned(),
        });
    }
    let mut numbers = [0.0; N];
    for (at, (slot, value)) in numbers.iter_mut().zip(list).enumerate() {
        *slot = value
            .as_f64()
            .ok_or_else(|| shape(format!("{place}[{at}]"), value, "a number"))?;
    }
    Ok(numbers)
}
