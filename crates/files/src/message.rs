//! Texts of others in messages.

/// Characters of a text that a message shows.
const SHOWN: usize = 300;

/// A text on one line of at most 300 characters. What it leaves out is counted.
pub fn short(text: impl std::fmt::Display) -> String {
    one_line(text, SHOWN)
}

/// A text on one line, cut after `most` characters. What it leaves out is counted.
pub fn one_line(text: impl std::fmt::Display, most: usize) -> String {
    let text = text.to_string();
    let words: Vec<&str> = text.split_whitespace().collect();
    let line = words.join(" ");
    let shown = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let length = line.chars().count();
    if length <= most {
        return line.chars().map(shown).collect();
    }
    let start: String = line.chars().take(most).map(shown).collect();
    format!("{start}... ({} characters more)", length - most)
}

/// A number in a few digits, however large or small it is.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-6..1e15).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A number in three digits.
pub fn rounded(value: f64) -> String {
    number(format!("{value:.2e}").parse().unwrap_or(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_short() {
        let texts = [0.0, 0.01, -1.0, 1e300, 1e-300, f64::NAN].map(number);
        assert_eq!(texts, ["0", "0.01", "-1", "1e300", "1e-300", "NaN"]);
    }

    #[test]
    fn three_digits_are_kept() {
        let texts = [0.0041349, 12345.6, -0.0].map(rounded);
        assert_eq!(texts, ["0.00413", "12300", "-0"]);
    }

    #[test]
    fn a_text_is_one_line_of_a_stated_length() {
        assert_eq!(short("a\n  | b\u{0}"), "a | b\u{fffd}");
        let long = short("y".repeat(100_000));
        assert!(long.ends_with("yyy... (99700 characters more)"), "{long}");
    }
}
