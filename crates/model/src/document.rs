//! Files that name their schema: reading them, digests in hexadecimal, lists of names and differences for messages.

use std::{
    fmt::{self, Display},
    fs,
    path::Path,
};

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

/// Starts of two sha256 in hexadecimal, for a message; `None` where they are the same.
pub fn digest_difference(found: &str, expected: &str) -> Option<String> {
    let start = |digest: &str| digest.chars().take(8).collect::<String>();
    (found != expected).then(|| {
        let (found, expected) = (start(found), start(expected));
        format!("the sha256 {found}..., expected {expected}...")
    })
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

/// First place where two ordered lists of a kind of name differ, for an error message.
#[derive(Debug, PartialEq, Eq)]
pub struct Difference {
    kind: &'static str,
    index: usize,
    found: Option<String>,
    expected: Option<String>,
}

impl Difference {
    /// The first of `found` that is not the one of `expected`; `None` where the lists are the same. `kind` is the word for an
    /// entry.
    pub fn find<T: PartialEq + Display>(
        kind: &'static str,
        found: &[T],
        expected: &[T],
    ) -> Option<Self> {
        let most = found.len().max(expected.len());
        let index = (0..most).find(|index| found.get(*index) != expected.get(*index))?;
        let name = |list: &[T]| list.get(index).map(hydro_files::short);
        Some(Self {
            kind,
            index,
            found: name(found),
            expected: name(expected),
        })
    }
}

impl Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |name: &Option<String>| match name {
            Some(name) => format!("`{name}`"),
            None => "missing".to_owned(),
        };
        let (found, expected) = (name(&self.found), name(&self.expected));
        let Self { kind, index, .. } = self;
        match self.expected {
            Some(_) => write!(f, "{kind} {index} (from 0) is {found}, expected {expected}"),
            None => write!(
                f,
                "{kind} {index} (from 0) is {found}, expected {index} {kind}s in all"
            ),
        }
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
    fn digests_are_told_apart_by_their_first_digits() {
        assert_eq!(digest_difference("abc", "abc"), None);
        assert_eq!(
            digest_difference(&"0123456789".repeat(6), "short").as_deref(),
            Some("the sha256 01234567..., expected short...")
        );
    }

    #[test]
    fn lists_are_told_apart_by_the_first_name_that_differs() {
        let said = |found: &[&str], expected: &[&str]| {
            Difference::find("feature", found, expected).map(|of| of.to_string())
        };
        assert_eq!(said(&["a", "b"], &["a", "b"]), None);
        for (found, expected, words) in [
            (
                &["a", "b"][..],
                &["a", "c"][..],
                "feature 1 (from 0) is `b`, expected `c`",
            ),
            (
                &["a"],
                &["a", "c"],
                "feature 1 (from 0) is missing, expected `c`",
            ),
            (
                &["a", "b"],
                &["a"],
                "feature 1 (from 0) is `b`, expected 1 features in all",
            ),
        ] {
            assert_eq!(said(found, expected).as_deref(), Some(words));
        }
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
