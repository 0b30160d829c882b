//! Tables in Markdown.

use hydro_training::experiment::{MeanSd, Row};

/// One figure of a table.
pub(super) struct Column<'a> {
    /// Above it.
    pub(super) head: &'a str,
    /// Name in [`Row::values`].
    pub(super) key: &'a str,
    /// Whether the least is the best.
    pub(super) ranked: bool,
}

impl<'a> Column<'a> {
    pub(super) fn new(head: &'a str, key: &'a str) -> Self {
        Self {
            head,
            key,
            ranked: true,
        }
    }

    /// A figure of which neither little nor much is good.
    pub(super) fn unranked(head: &'a str, key: &'a str) -> Self {
        Self {
            ranked: false,
            ..Self::new(head, key)
        }
    }
}

/// Rows under a head, the first column on the left.
pub(super) fn markdown(head: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = line(head);
    text += "|---|";
    text += &"---:|".repeat(head.len().saturating_sub(1));
    text.push('\n');
    rows.iter().for_each(|row| text += &line(row));
    text
}

/// A table of rows: the model, then its figures; the least mean of a ranked column is in bold.
pub(super) fn figures_of<'a>(
    rows: impl Iterator<Item = &'a Row> + Clone,
    columns: &[Column<'_>],
) -> String {
    let head: Vec<String> = std::iter::once("")
        .chain(columns.iter().map(|column| column.head))
        .map(str::to_owned)
        .collect();
    let least = |key: &str| {
        rows.clone()
            .filter_map(|row| ranked(row, key))
            .fold(f64::INFINITY, f64::min)
    };
    let cells: Vec<Vec<String>> = rows
        .clone()
        .map(|row| {
            let figures = columns
                .iter()
                .map(|column| match row.values.get(column.key) {
                    None => "\u{2013}".to_owned(),
                    Some(value) => {
                        let mut text = spread(value);
                        if value.count < row.seeds.len() {
                            text += &format!(" ({} of {} seeds)", value.count, row.seeds.len());
                        }
                        let rank = ranked(row, column.key).filter(|_| column.ranked);
                        if rank.is_some_and(|mean| mean <= least(column.key)) {
                            format!("**{text}**")
                        } else {
                            text
                        }
                    }
                });
            std::iter::once(row.label.clone()).chain(figures).collect()
        })
        .collect();
    markdown(&head, &cells)
}

/// The mean, of a row that has one for every seed and is one of the competitors.
fn ranked(row: &Row, key: &str) -> Option<f64> {
    let value = row.values.get(key)?;
    (value.count == row.seeds.len() && row.competes).then_some(value.mean)
}

/// Mean and standard deviation over seeds, to three digits of the mean.
pub(super) fn spread(value: &MeanSd) -> String {
    let (mean, sd) = (value.mean, value.sd);
    let digits = digits(mean);
    if value.count > 1 {
        format!("{mean:.digits$} \u{b1} {sd:.digits$}")
    } else {
        format!("{mean:.digits$}")
    }
}

/// Decimals that show three digits.
pub(super) fn digits(value: f64) -> usize {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    (2.0 - value.abs().log10().floor()).clamp(0.0, 6.0) as usize
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn three_digits_are_shown_and_the_best_is_bold() {
        let row = |label: &str, mean: f64, count: usize| Row {
            data: "2".to_owned(),
            entry: label.to_owned(),
            label: label.to_owned(),
            competes: true,
            seeds: (0..3).collect(),
            values: BTreeMap::from([(
                "nrmse".to_owned(),
                MeanSd {
                    mean,
                    sd: 0.01,
                    count,
                },
            )]),
            ..Row::default()
        };
        let rows = [row("a", 0.123_44, 3), row("b", 12.3, 1)];
        let columns = [
            Column::new("nRMSE", "nrmse"),
            Column::unranked("again", "nrmse"),
            Column::new("none", "x"),
        ];
        assert_eq!(
            figures_of(rows.iter(), &columns),
            "|  | nRMSE | again | none |\n|---|---:|---:|---:|\n\
             | a | **0.123 \u{b1} 0.010** | 0.123 \u{b1} 0.010 | \u{2013} |\n| b | 12.3 (1 of 3 seeds) | 12.3 (1 of 3 seeds) | \u{2013} |\n"
        );
    }
}
