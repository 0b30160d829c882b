//! The command as it was typed.

/// The command as it was typed, for cards and reports.
pub(super) fn command_line() -> String {
    let quoted = |word: String| match word.contains(char::is_whitespace) {
        true => format!("'{word}'"),
        false => word,
    };
    // A name that is no text is shown as well as it can be.
    let words = std::env::args_os().skip(1);
    let words = words.map(|word| quoted(word.to_string_lossy().into_owned()));
    std::iter::once("hydro".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}
