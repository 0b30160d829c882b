//! A table of numbers.

/// A table of numbers, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub(super) values: Vec<f64>,
    pub(super) columns: usize,
}

impl Table {
    /// A table of values row after row; `None` if they do not fill whole rows.
    pub fn new(values: Vec<f64>, columns: usize) -> Option<Self> {
        (columns > 0 && values.len().is_multiple_of(columns)).then_some(Self { values, columns })
    }

    /// Row `index`.
    ///
    /// # Panics
    /// Past the last row.
    pub fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.columns..(index + 1) * self.columns]
    }

    /// Every row in turn.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.columns)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.values.len() / self.columns
    }

    /// True where there is no row.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Keeps the first `rows` rows.
    pub fn truncate(&mut self, rows: usize) {
        self.values.truncate(rows * self.columns);
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }
}
