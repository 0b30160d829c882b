//! Numbers, units, intervals and probabilities as text.

use hydro_gap::verdict::FittedParameter;

/// A number with five digits, for numbers that differ little.
pub(super) fn fine(value: f64) -> String {
    if !(1e-3..1e5).contains(&value.abs()) {
        return number(value);
    }
    let digits = (4 - value.abs().log10().floor() as i32).clamp(0, 8) as usize;
    minus(trim(&format!("{value:.digits$}")))
}

/// Three significant digits without trailing zeros; a dash where there is no number.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "\u{2013}".to_owned();
    }
    let size = value.abs();
    if size < f64::MIN_POSITIVE {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&size) {
        let text = format!("{value:.2e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return minus(&format!("{}e{exponent}", trim(mantissa)));
    }
    let digits = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
    minus(trim(&format!("{value:.digits$}")))
}

/// A number with its unit; `1` is no unit.
pub fn with_unit(value: f64, unit: &str) -> String {
    match unit {
        "" | "1" => number(value),
        unit => format!("{} {unit}", number(value)),
    }
}

/// An interval in words.
pub fn interval([low, high]: [f64; 2]) -> String {
    format!("{} to {}", number(low), number(high))
}

/// The range of the trials' own values, where they differ; empty where all trials have one.
pub fn by_trial(parameter: &FittedParameter) -> String {
    let values = parameter.by_trial.values().copied();
    let Some((low, high)) = values.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((f64::min(low, value), f64::max(high, value))),
    }) else {
        return String::new();
    };
    format!("differs from trial to trial: {}", interval([low, high]))
}

/// A share as a percentage, without the sign.
pub(super) fn bare_percent(share: f64) -> String {
    if !share.is_finite() {
        return "\u{2013}".to_owned();
    }
    let value = 100.0 * share;
    // One decimal only where it says something.
    let text = match value.abs() {
        size if (0.05..9.95).contains(&size) => trim(&format!("{value:.1}")).to_owned(),
        _ => format!("{value:.0}"),
    };
    minus(if text == "-0" { "0" } else { &text })
}

/// A share as a percentage.
pub fn percent(share: f64) -> String {
    format!("{} %", bare_percent(share))
}

/// A share that is explained or left, as a percentage; never rounded to all or nothing.
pub fn part_of_excess(share: f64) -> String {
    match share {
        share if share > 0.99 => "more than 99 %".to_owned(),
        share if share < 0.01 => "less than 1 %".to_owned(),
        share => percent(share),
    }
}

/// A probability; never rounded to certainty.
pub fn probability(p: f64) -> String {
    match p {
        p if !p.is_finite() => "\u{2013}".to_owned(),
        p if p > 0.995 => "above 0.99".to_owned(),
        p if p < 0.005 => "below 0.01".to_owned(),
        p => format!("{p:.2}"),
    }
}

/// A probability for a table.
pub(super) fn short_probability(p: f64) -> String {
    probability(p).replace("above", ">").replace("below", "<")
}

/// A p-value; those below a thousandth are said to be so.
pub(super) fn p_value(p: f64) -> String {
    match p {
        p if !p.is_finite() => "\u{2013}".to_owned(),
        p if p < 1e-3 => "< 0.001".to_owned(),
        p => number(p),
    }
}

fn trim(text: &str) -> &str {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_certain() {
        assert_eq!(
            [0.0, 12.3456, -0.5, 1e-5, 123_456.0, 0.001234, f64::NAN].map(number),
            [
                "0",
                "12.3",
                "\u{2212}0.5",
                "1e\u{2212}5",
                "1.23e5",
                "0.00123",
                "\u{2013}"
            ]
        );
        assert_eq!(
            [0.9999, 0.42, 0.0].map(probability),
            ["above 0.99", "0.42", "below 0.01"]
        );
        assert_eq!(
            [1.0, 0.97, 0.021, 0.0].map(part_of_excess),
            ["more than 99 %", "97 %", "2.1 %", "less than 1 %"]
        );
        assert_eq!(
            [0.823, 0.0123, -0.0001, -0.2].map(percent),
            ["82 %", "1.2 %", "0 %", "\u{2212}20 %"]
        );
        assert_eq!(with_unit(2.0, "kg"), "2 kg");
        assert_eq!(with_unit(2.0, "1"), "2");
    }
}
