//! Standard output and standard error.

use anyhow::Context as _;

/// `println!` that fails like any other write: a full disk is an error, a closed pipe the end.
macro_rules! say {
    ($($word:tt)*) => {
        $crate::cli::output::write_line(&format!($($word)*))?
    };
}

/// Lines of a message at most; one of more is put on one line.
const LINES: usize = 3;
/// Characters of a message at most.
const LONGEST: usize = 2000;

/// Prints an error and its causes.
pub(crate) fn print_error(error: &anyhow::Error) {
    eprintln!("hydro: {}", message(error));
}

/// Prints what a user should know of the engine on this processor, if there is anything.
pub(super) fn print_note_of(engine: hydro_model::EngineKind) {
    if let Some(note) = engine.note() {
        eprintln!("hydro: {note}");
    }
}

/// An error and its causes: as they are, or on one line and cut where they are long.
fn message(error: &anyhow::Error) -> String {
    let text = with_causes(error);
    let text = text.trim();
    let lines = text.lines().count();
    let plain = !text.chars().any(|c| c.is_control() && c != '\n');
    if lines <= LINES && text.len() <= LONGEST && plain {
        return text.to_owned();
    }
    hydro_files::one_line(text, LONGEST)
}

/// An error and its causes on one line, but for causes that it tells itself.
fn with_causes(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Prints one machine-readable result.
pub(super) fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    write_line(&serde_json::to_string_pretty(value)?)
}

/// Writes a line to standard output; a reader that has gone away ends the program quietly.
pub(super) fn write_line(line: &str) -> anyhow::Result<()> {
    use std::io::Write as _;
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{line}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        result => result.context("writing to standard output"),
    }
}

#[cfg(test)]
mod tests {
    use hydro_model::checkpoint::CheckpointError;

    use super::*;

    #[test]
    fn a_message_has_three_lines_at_most() {
        let text = |text: &str| message(&anyhow::Error::msg(text.to_owned()));
        assert_eq!(text("a\nb\nc\n"), "a\nb\nc");
        assert_eq!(text("at\n  |\n1 | x\n  | ^"), "at | 1 | x | ^");
        assert!(text(&"y".repeat(100_000)).len() < LONGEST + 50);
        assert_eq!(text("a\u{1b}[2J"), "a\u{fffd}[2J");
    }

    #[test]
    fn a_cause_is_told_once() {
        let error = CheckpointError::Io {
            path: "model/card.json".into(),
            source: std::io::Error::other("is a pipe; expected a file"),
        };
        let text = message(&anyhow::Error::from(error).context("--checkpoint"));
        assert_eq!(
            text,
            "--checkpoint: model/card.json: is a pipe; expected a file"
        );
    }
}
