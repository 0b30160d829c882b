//! Files that name their schema: reading them, digests in hexadecimal, lists of names for messages.

use std::{fs, path::Path};

use serde::de::DeserializeOwned;

/// Reason for refusing a document.
#[derive(Debug)]
pub enum Fault {
    /// Not JSON, or JSON without the required fields.
    Malformed(serde_json::Error),
    /// Another schema than the expected one, as the document writes it.
    Schema(String),
}

/// Reads a JSON document of the schema `expected`. The field `schema` is checked before all others, for a document of
/// another version may lack any of them.
pub fn parse<T: DeserializeOwned>(bytes: &[u8], expected: &str) -> Result<T, Fault> {
    let value: serde_json::Value = serde_json::from_slice(bytes).map_err(Fault::Malformed)?;
    let schema = value.get("schema");
    if schema.and_then(|schema| schema.as_str()) != Some(expected) {
        return Err(Fault::Schema(
            schema.map_or_else(|| "missing".to_owned(), hydro_files::short),
        ));
    }
    serde_json::from_value(value).map_err(Fault::Malformed)
}

/// `bytes` in lower-case hexadecimal.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Names of the entries of a folder, sorted; empty if it cannot be read.
pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// Characters of a list of names in a message.
const LISTED: usize = 1000;

/// `names` separated by commas, or `nothing`, for an error message.
pub fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "nothing".to_owned()
    } else {
        hydro_files::one_line(names.join(", "), LISTED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Note {
        text: String,
    }

    #[test]
    fn another_schema_is_said_before_anything_else() {
        let read = |text: &str| parse::<Note>(text.as_bytes(), "note/1");
        let found = read(r#"{"schema": "note/1", "text": "wet"}"#);
        assert!(matches!(found, Ok(Note { text }) if text == "wet"));
        assert!(
            matches!(read(r#"{"schema": "note/2"}"#), Err(Fault::Schema(found)) if found == "\"note/2\"")
        );
        assert!(matches!(read("{}"), Err(Fault::Schema(found)) if found == "missing"));
        for broken in ["{", r#"{"schema": "note/1"}"#] {
            assert!(matches!(read(broken), Err(Fault::Malformed(_))), "{broken}");
        }
    }
}
