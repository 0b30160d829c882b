//! Sampled signals against time, as recorded.

/// Rows of numbers against time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Time of each row [s], strictly increasing once a trial has been read, `[rows]`.
    pub times: Vec<f64>,
    /// Name of each column, `[columns]`; a component of a vector is `name[i]`.
    pub columns: Vec<String>,
    /// The values, row after row, `[rows, columns]`; NaN stands for a sample that is missing.
    pub data: Vec<f64>,
}

impl Series {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// True where there is no row.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.columns.len()
    }

    /// The value in a row and a column.
    ///
    /// # Panics
    /// Past the last row or column.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.row(row)[column]
    }

    /// A row, `[columns]`.
    ///
    /// # Panics
    /// Past the last row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.data[row * self.width()..(row + 1) * self.width()]
    }

    /// The values of a column in turn, `[rows]`.
    pub fn column_values(&self, column: usize) -> impl Iterator<Item = f64> + '_ {
        // `max(1)`: a step of zero is refused even where there is nothing to step over.
        let values = self.data.iter().skip(column).step_by(self.width().max(1));
        values.copied()
    }

    /// Index of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// Index of the column of one component of a signal with `dim` components; `None` where the log lacks it.
    pub fn component(&self, signal: &str, component: usize, dim: usize) -> Option<usize> {
        if dim == 1 {
            return self.column(signal);
        }
        self.column(&component_name(signal, component))
    }

    /// The typical time between rows [s]: the median; `None` with fewer than two rows.
    pub fn period(&self) -> Option<f64> {
        let steps = self.times.windows(2).map(|pair| pair[1] - pair[0]);
        median(steps.collect())
    }

    /// Fills `values`, `[columns]`, with the values at time `t` [s]: linear between rows, held before the first and after
    /// the last, as `mujoco.sysid` does with controls. Next to a missing sample the value is NaN, except at the time of a
    /// row that has it; NaN where there is no row.
    pub fn interpolate(&self, t: f64, values: &mut [f64]) {
        if self.is_empty() || t.is_nan() {
            values.fill(f64::NAN);
            return;
        }
        let after = self.times.partition_point(|time| *time <= t);
        if after == 0 || after == self.len() || self.times[after - 1] == t {
            // Before the first, after the last, or at a row.
            let row = self.row(after.saturating_sub(1));
            for (value, recorded) in values.iter_mut().zip(row) {
                *value = *recorded;
            }
            return;
        }
        let (start, end) = (self.times[after - 1], self.times[after]);
        let weight = (t - start) / (end - start);
        let rows = self.row(after - 1).iter().zip(self.row(after));
        for (value, (before, after)) in values.iter_mut().zip(rows) {
            // Weighted this way a constant stays that constant to the last bit.
            *value = before + weight * (after - before);
        }
    }

    /// The same signals at other times [s], by [`Series::interpolate`].
    pub fn resample(&self, times: &[f64]) -> Self {
        let width = self.width();
        let mut data = vec![0.0; times.len() * width];
        if width > 0 {
            for (row, time) in data.chunks_exact_mut(width).zip(times) {
                self.interpolate(*time, row);
            }
        }
        Self {
            times: times.to_vec(),
            columns: self.columns.clone(),
            data,
        }
    }
}

/// The name of a component of a vector signal.
pub(super) fn component_name(signal: &str, component: usize) -> String {
    format!("{signal}[{component}]")
}

/// The median of the finite values; `None` where there is none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    Some(0.5 * (values[values.len() / 2 - 1] + upper))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn ramp() -> Series {
        Series {
            times: vec![0.0, 1.0, 3.0],
            columns: vec!["a".into(), "v[0]".into(), "v[1]".into()],
            data: vec![0.0, 1.0, 5.0, 10.0, 1.0, f64::NAN, 20.0, 1.0, 7.0],
        }
    }

    fn values(series: &Series, t: f64) -> [f64; 3] {
        let mut values = [0.0; 3];
        series.interpolate(t, &mut values);
        values
    }

    #[test]
    fn between_rows_it_is_linear_and_beyond_them_held() {
        let series = ramp();
        assert_eq!(values(&series, 0.25)[..2], [2.5, 1.0]);
        assert_eq!(values(&series, 2.5)[..2], [17.5, 1.0]);
        assert_eq!(values(&series, -4.0), [0.0, 1.0, 5.0]);
        assert_eq!(values(&series, f64::NEG_INFINITY), [0.0, 1.0, 5.0]);
        assert_eq!(values(&series, 3.0), [20.0, 1.0, 7.0]);
        assert_eq!(values(&series, 9.0), [20.0, 1.0, 7.0]);
        assert!(values(&series, f64::NAN)[0].is_nan());
    }

    #[test]
    fn a_missing_sample_is_missing_around_it_and_nowhere_else() {
        let series = ramp();
        assert_eq!(values(&series, 0.0)[2], 5.0);
        for t in [0.5, 1.0, 2.0] {
            assert!(values(&series, t)[2].is_nan());
        }
        assert_eq!(values(&series, 3.0)[2], 7.0);
    }

    #[test]
    fn a_straight_line_is_resampled_exactly() {
        let line = |times: &[f64]| Series {
            times: times.to_vec(),
            columns: vec!["x".into()],
            data: times.iter().map(|t| 3.0 * t - 1.0).collect(),
        };
        let fine = line(&[0.0, 0.5, 2.0, 4.0]).resample(&[0.25, 1.0, 3.0]);
        assert_eq!(fine, line(&[0.25, 1.0, 3.0]));
    }

    #[test]
    fn columns_are_found_by_the_name_of_their_signal() {
        let series = ramp();
        assert_eq!(series.component("a", 0, 1), Some(0));
        assert_eq!(series.component("v", 1, 2), Some(2));
        assert_eq!(series.component("v", 2, 3), None);
        assert_eq!(series.column("v[1]"), Some(2));
        assert_eq!(series.at(1, 0), 10.0);
        assert_eq!(
            series.column_values(0).collect::<Vec<_>>(),
            [0.0, 10.0, 20.0]
        );
        assert_eq!(series.period(), Some(1.5));
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let mut values = [1.0];
        Series::default().interpolate(0.0, &mut values);
        assert!(values[0].is_nan());
        assert_eq!(Series::default().period(), None);
        let controls_of_a_passive_body = Series {
            times: vec![0.0, 1.0],
            ..Series::default()
        };
        assert_eq!(controls_of_a_passive_body.resample(&[0.5]).len(), 1);
        assert_eq!(controls_of_a_passive_body.column_values(0).count(), 0);
    }
}
