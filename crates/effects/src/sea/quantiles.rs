//! Quantiles of a density that is known on a grid.

/// Distribution of a density, linear in each cell of an even grid.
#[derive(Debug)]
pub(crate) struct Quantiles {
    lower: f64,
    cell: f64,
    /// Share below each point of the grid: 0 at the first, 1 at the last, rising.
    below: Vec<f64>,
}

impl Quantiles {
    /// The distribution of a density (of any scale, nowhere negative, somewhere positive) between two bounds, on a grid of
    /// `cells` cells, by the trapezoidal rule.
    pub(crate) fn new(lower: f64, upper: f64, cells: usize, density: impl Fn(f64) -> f64) -> Self {
        let cell = (upper - lower) / cells as f64;
        let mut below = Vec::with_capacity(cells + 1);
        let (mut sum, mut last) = (0.0, density(lower));
        below.push(0.0);
        for index in 1..=cells {
            let next = density(lower + index as f64 * cell);
            sum += 0.5 * (last + next);
            below.push(sum);
            last = next;
        }
        for share in &mut below {
            *share /= sum;
        }
        Self { lower, cell, below }
    }

    /// The point below which a share, 0 to 1, of the density lies.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        let last = self.below.len() - 2;
        let above = self.below.partition_point(|&below| below <= share);
        let index = above.saturating_sub(1).min(last);
        let (left, right) = (self.below[index], self.below[index + 1]);
        let within = if right > left {
            ((share - left) / (right - left)).clamp(0.0, 1.0)
        } else {
            0.0
        };
        self.lower + (index as f64 + within) * self.cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_a_parabola() {
        let cubic = Quantiles::new(0.0, 2.0, 4000, |x| 3.0 * x * x);
        for share in [0.0, 0.001, 0.2, 0.5, 0.9, 1.0] {
            let expected = 2.0 * f64::cbrt(share);
            assert!((cubic.quantile(share) - expected).abs() < 2e-4, "{share}");
        }
    }

    #[test]
    fn gaps_of_the_density_and_shares_outside_are_no_trouble() {
        let two = Quantiles::new(-1.0, 1.0, 200, |x| if x.abs() > 0.5 { 1.0 } else { 0.0 });
        assert!((two.quantile(0.25) + 0.75).abs() < 0.01);
        assert!((two.quantile(0.75) - 0.75).abs() < 0.01);
        assert_eq!(two.quantile(-1.0), -1.0);
        assert_eq!(two.quantile(2.0), 1.0);
    }
}
