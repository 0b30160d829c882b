//! Tables for people.

use comfy_table::{Cell, CellAlignment, Table, presets::NOTHING};

/// A table with a head; the first column is text, the others are numbers.
pub(super) fn table(head: &[&str], rows: &[Vec<String>]) -> Table {
    let mut table = Table::new();
    table.load_style(NOTHING);
    table.set_header(head.iter().enumerate().map(|(i, text)| cell(i, text)));
    for row in rows {
        table.add_row(row.iter().enumerate().map(|(i, text)| cell(i, text)));
    }
    table
}

fn cell(column: usize, text: &str) -> Cell {
    Cell::new(text).set_alignment(if column == 0 {
        CellAlignment::Left
    } else {
        CellAlignment::Right
    })
}

/// Prints a line a fact: its name, then its value.
pub(super) fn facts(rows: &[(&str, String)]) -> anyhow::Result<()> {
    for (name, value) in rows {
        say!("{name:>18}  {value}");
    }
    Ok(())
}
