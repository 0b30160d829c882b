//! Difference of the nominal and the patched text, line by line.

use similar::{ChangeTag, TextDiff};

/// Lines shown around a change.
const CONTEXT: usize = 2;

/// Kind of a line in a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiffKind {
    /// The same in both.
    Kept,
    /// Only in the nominal model.
    Removed,
    /// Only in the patched model.
    Added,
    /// Lines that are the same in both and are left out.
    Skipped,
}

/// A line of a difference.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct DiffLine {
    pub kind: DiffKind,
    /// Its number in the nominal model, from one.
    pub nominal_line: Option<usize>,
    /// Its number in the patched model, from one.
    pub patched_line: Option<usize>,
    /// The line, without its end; empty where lines are left out.
    pub text: String,
}

/// The lines that differ, with two on either side.
pub fn diff(nominal: &str, patched: &str) -> Vec<DiffLine> {
    let diff = TextDiff::from_lines(nominal, patched);
    let mut lines = Vec::new();
    for group in diff.grouped_ops(CONTEXT) {
        if !lines.is_empty() {
            lines.push(DiffLine {
                kind: DiffKind::Skipped,
                nominal_line: None,
                patched_line: None,
                text: String::new(),
            });
        }
        for change in group.iter().flat_map(|op| diff.iter_changes(op)) {
            lines.push(DiffLine {
                kind: match change.tag() {
                    ChangeTag::Equal => DiffKind::Kept,
                    ChangeTag::Delete => DiffKind::Removed,
                    ChangeTag::Insert => DiffKind::Added,
                },
                nominal_line: change.old_index().map(|line| line + 1),
                patched_line: change.new_index().map(|line| line + 1),
                text: change.value().trim_end_matches(['\n', '\r']).to_owned(),
            });
        }
    }
    lines
}

/// The same as a unified diff.
pub fn unified(nominal: &str, patched: &str, names: (&str, &str)) -> String {
    TextDiff::from_lines(nominal, patched)
        .unified_diff()
        .context_radius(CONTEXT)
        .header(names.0, names.1)
        .to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_differs_is_shown() {
        let nominal: String = (1..=20).map(|line| format!("{line}\n")).collect();
        let patched = nominal
            .replace("\n4\n", "\nfour\n")
            .replace("\n18\n", "\n18\nx\n");
        let lines = diff(&nominal, &patched);
        let shown: Vec<(DiffKind, &str)> = lines
            .iter()
            .map(|line| (line.kind, line.text.as_str()))
            .collect();
        use DiffKind::{Added, Kept, Removed, Skipped};
        assert_eq!(
            shown,
            [
                (Kept, "2"),
                (Kept, "3"),
                (Removed, "4"),
                (Added, "four"),
                (Kept, "5"),
                (Kept, "6"),
                (Skipped, ""),
                (Kept, "17"),
                (Kept, "18"),
                (Added, "x"),
                (Kept, "19"),
                (Kept, "20"),
            ]
        );
        assert_eq!(lines[3].patched_line, Some(4));
        assert_eq!(lines[9].nominal_line, None);
        let text = unified(&nominal, &patched, ("nominal.xml", "patched.xml"));
        assert!(text.starts_with("--- nominal.xml\n+++ patched.xml\n@@"));
        assert!(diff(&nominal, &nominal).is_empty());
    }
}
