//! Words of messages: counts, lists of names, the nearest known name.

/// Names that a message lists before it counts the rest.
const LISTED: usize = 40;

/// Characters of a name in a list.
const LONGEST_NAME: usize = 80;

/// "1 row", "2 rows".
pub(super) fn counted(count: impl Into<u64>, thing: &str) -> String {
    let count = count.into();
    let ending = if count == 1 { "" } else { "s" };
    format!("{count} {thing}{ending}")
}

/// Names for a message: `a`, `b`, ... or "none".
pub(crate) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    if names.is_empty() {
        return "none".to_owned();
    }
    let shown: Vec<String> = names
        .iter()
        .take(LISTED)
        .map(|name| format!("`{}`", hydro_files::one_line(name.as_ref(), LONGEST_NAME)))
        .collect();
    let rest = names.len() - shown.len();
    let more = if rest > 0 {
        format!(" and {rest} more")
    } else {
        String::new()
    };
    shown.join(", ") + &more
}

/// Levenshtein distance without regard to case: letters to insert, delete or replace (V. I. Levenshtein, Soviet Physics
/// Doklady 10, 1966).
pub(super) fn distance(one: &str, other: &str) -> usize {
    // A name of thousands of letters resembles nothing, and need not be compared in full.
    let lower = |text: &str| -> Vec<char> { text.to_lowercase().chars().take(128).collect() };
    let (one, other) = (lower(one), lower(other));
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in one.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in other.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[other.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_textbook() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("Gyro", "gyro"), 0);
    }

    #[test]
    fn long_lists_are_counted() {
        assert_eq!(listed::<&str>(&[]), "none");
        assert_eq!(listed(&["a", "b"]), "`a`, `b`");
        assert!(listed(&vec!["x"; 50]).ends_with("and 10 more"));
    }
}
