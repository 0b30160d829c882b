//! The command as it was typed.

/// The command as it was typed, for cards and reports.
pub(super) fn command_line() -> String {
    let quoted = |word: String| match word.contains(char::is_whitespace) {
        true => format!("'{word}'"),
        false => word,
    };
    let words = std::env::args().skip(1).map(quoted);
    std::iter::once("hydro".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}
