//! Parts of drawings: scales, ticks, shortened names. Colours are classes of the page's style, so that drawings follow the
//! light and the dark theme.

use std::fmt::Write as _;

use super::numbers::number;
use crate::report::html::escape;

/// Maps a range of values to a range of pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Scale {
    /// A range of no width, or one that is not finite, becomes one about its middle.
    pub(super) fn new((low, high): (f64, f64), (from, to): (f64, f64)) -> Self {
        let (low, high) = match (low.is_finite() && high.is_finite(), high - low) {
            (false, _) => (0.0, 1.0),
            // Halves: the width itself could overflow.
            (true, width) if !width.is_finite() => (low / 2.0, high / 2.0),
            (true, width) if width > 1e-12 * low.abs().max(high.abs()) => (low, high),
            _ => {
                let pad = (low.abs() * 0.1).max(1e-9);
                (low - pad, high + pad)
            }
        };
        Self {
            low,
            high,
            from,
            to,
        }
    }

    /// Pixel of a value, outside of the range by at most its width; NaN is at the start.
    pub(super) fn at(&self, value: f64) -> f64 {
        if value.is_nan() {
            return self.from;
        }
        let part = (value - self.low) / (self.high - self.low);
        self.from + part.clamp(-1.0, 2.0) * (self.to - self.from)
    }

    /// About `count` round values inside.
    pub(super) fn ticks(&self, about: usize) -> Vec<f64> {
        let rough = (self.high - self.low) / about.max(1) as f64;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .into_iter()
            .map(|factor| factor * decade)
            // A few ticks too many are better than one alone.
            .find(|step| *step >= 0.8 * rough)
            .unwrap_or(rough);
        let first = (self.low / step).ceil();
        (0..=4 * about)
            .map(|index| (first + index as f64) * step)
            .take_while(|tick| *tick <= self.high + 1e-9 * step)
            // A rounding error beside zero is zero.
            .map(|tick| if tick.abs() < 1e-9 * step { 0.0 } else { tick })
            .collect()
    }
}

/// Least and greatest of the finite values.
pub(super) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
}

/// A coordinate in as few characters as a tenth of a pixel needs.
pub(super) fn coordinate(value: f64) -> String {
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" {
        "0".to_owned()
    } else {
        text.to_owned()
    }
}

/// Opens a drawing of a size [px]; `about` is its text for screen readers.
pub(super) fn open(svg: &mut String, width: f64, height: f64, about: &str) {
    let _ = write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
        coordinate(width),
        coordinate(height),
        escape(about)
    );
}

/// Alignment of a text at its point.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    /// The text starts at the point.
    Start,
    /// Its middle is at the point.
    Middle,
    /// It ends at the point.
    End,
}

/// Writes words of a class at a point [px].
pub(super) fn text(svg: &mut String, at: (f64, f64), anchor: Anchor, class: &str, words: &str) {
    let anchor = match anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let _ = write!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"{anchor}\" class=\"{class}\">{}</text>",
        coordinate(at.0),
        coordinate(at.1),
        escape(words)
    );
}

/// Writes a name shortened to a number of characters, with the whole name as tooltip.
pub(super) fn name(svg: &mut String, at: (f64, f64), anchor: Anchor, most: usize, name: &str) {
    let short = shorten(name, most);
    if short == name {
        text(svg, at, anchor, "name", name);
        return;
    }
    let _ = write!(svg, "<g><title>{}</title>", escape(name));
    text(svg, at, anchor, "name", &short);
    svg.push_str("</g>");
}

/// Head and tail of a long name; the end often tells it from its neighbours.
pub(super) fn shorten(name: &str, most: usize) -> String {
    let letters: Vec<char> = name.chars().collect();
    if letters.len() <= most {
        return name.to_owned();
    }
    let tail = (most - 1) / 2;
    let head = most - 1 - tail;
    let start: String = letters[..head].iter().collect();
    let end: String = letters[letters.len() - tail..].iter().collect();
    format!("{start}\u{2026}{end}")
}

/// A line of a class between two points [px].
pub(super) fn line(svg: &mut String, class: &str, from: (f64, f64), to: (f64, f64)) {
    let _ = write!(
        svg,
        "<path class=\"{class}\" d=\"M{} {}L{} {}\"/>",
        coordinate(from.0),
        coordinate(from.1),
        coordinate(to.0),
        coordinate(to.1)
    );
}

/// A rectangle of a class at a corner, with a size [px].
pub(super) fn rectangle(svg: &mut String, class: &str, corner: (f64, f64), size: (f64, f64)) {
    let _ = write!(
        svg,
        "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
        coordinate(corner.0),
        coordinate(corner.1),
        coordinate(size.0.max(0.0)),
        coordinate(size.1.max(0.0))
    );
}

/// The time axis below a plot: ticks with numbers, the unit after the last.
pub(super) fn time_axis(svg: &mut String, scale: &Scale, left: f64, right: f64, y: f64) {
    line(svg, "axis", (left, y), (right, y));
    let ticks = scale.ticks(5);
    for (index, tick) in ticks.iter().enumerate() {
        let x = scale.at(*tick);
        line(svg, "axis", (x, y), (x, y + 3.0));
        let unit = if index + 1 == ticks.len() { " s" } else { "" };
        text(
            svg,
            (x, y + 14.0),
            Anchor::Middle,
            "",
            &format!("{}{unit}", number(*tick)),
        );
    }
}

/// A horizontal bar from 0 to 1 that fills its cell, on a track.
pub(super) fn share_bar(html: &mut String, class: &str, share: f64) {
    let share = if share.is_finite() {
        share.clamp(0.0, 1.0)
    } else {
        0.0
    };
    let _ = write!(
        html,
        "<svg viewBox=\"0 0 100 10\" preserveAspectRatio=\"none\" aria-hidden=\"true\">\
         <rect class=\"track\" width=\"100\" height=\"10\"/><rect class=\"{class}\" width=\"{}\" height=\"10\"/></svg>",
        coordinate(100.0 * share)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let ticks = |low, high| Scale::new((low, high), (0.0, 100.0)).ticks(5);
        assert_eq!(ticks(0.0, 20.0), [0.0, 5.0, 10.0, 15.0, 20.0]);
        assert_eq!(ticks(-3.5, 3.1), [-2.0, 0.0, 2.0]);
        for bad in [
            (f64::NAN, 1.0),
            (3.0, 3.0),
            (f64::MIN, f64::MAX),
            (0.0, 0.0),
        ] {
            assert!(!ticks(bad.0, bad.1).is_empty(), "{bad:?}");
        }
    }

    #[test]
    fn long_names_keep_head_and_tail() {
        assert_eq!(shorten("a_very_long_sensor_left", 11), "a_ver\u{2026}_left");
        assert_eq!(shorten("short", 11), "short");
    }
}
