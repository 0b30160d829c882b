//! Which levels of disturbances are looked at: a coarse grid, and a fine one about the likeliest.
//!
//! A trial of a minute has a thousand pieces of unmodelled force and ten thousand readings. A size that is off by a factor of
//! 1.7 costs hundreds of nats of likelihood then, and any number that scales what forces do to the readings (a mass, a gain, a
//! sensor's scale) would be moved to win them. So the sizes are fitted before sets are compared.

use crate::{likelihood::level::Sizes, options::LikelihoodOptions, problem::problem::Problem};

/// The sizes that are tried.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid<'o> {
    options: &'o LikelihoodOptions,
    /// False where every sensor declares its noise.
    drifts: bool,
}

impl<'o> Grid<'o> {
    pub(crate) fn of(problem: &'o Problem<'_>) -> Self {
        Self {
            options: &problem.settings.options.likelihood,
            drifts: !problem.drifting.is_empty(),
        }
    }

    fn least_force(self) -> f64 {
        self.options.forces[0]
    }
}

/// Levels to look at, those of the least forces first.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    /// All of them; without effects the likeliest may be any.
    pub(crate) all: Vec<Sizes>,
    /// Those of them at which sets are searched.
    pub(crate) near: Vec<Sizes>,
    /// About the likeliest without effects.
    about_nothing: Vec<Sizes>,
    /// The likeliest of the working point's set, where there was one.
    centre: Option<Sizes>,
}

impl Levels {
    /// The whole coarse grid.
    pub(crate) fn coarse(grid: Grid<'_>) -> Self {
        let options = grid.options;
        let mut all = Vec::new();
        for force in options.forces {
            for drift in options.drifts {
                all.extend(options.slow_drifts.map(|slow_drift| Sizes {
                    force,
                    drift,
                    slow_drift,
                }));
            }
        }
        if !grid.drifts {
            all.retain(|of| of.drift == 0.0 && of.slow_drift == 0.0);
        }
        // Beside a slow drift the short one hardly matters.
        all.retain(|of| of.slow_drift == 0.0 || of.drift <= options.drifts[2]);
        sort(&mut all);
        Self {
            near: all.clone(),
            all,
            about_nothing: Vec::new(),
            centre: None,
        }
    }

    /// From log likelihoods without effects at some sizes: the coarse grid up to those that may be the likeliest, for effects
    /// leave less to disturbances; and what is about the likeliest.
    pub(crate) fn up_to(grid: Grid<'_>, logs: &[(Sizes, f64)]) -> Option<Self> {
        let options = grid.options;
        let top = logs.iter().map(|of| of.1).fold(f64::NEG_INFINITY, f64::max);
        let likely = || logs.iter().filter(|of| of.1 >= top - options.level_within);
        let next = |all: &[f64], size: fn(&Sizes) -> f64| {
            let largest = likely().map(|of| size(&of.0)).fold(0.0, f64::max);
            let larger = all.iter().copied().find(|of| *of >= largest);
            larger.unwrap_or(largest)
        };
        let force = next(&options.forces, |of| of.force);
        let drift = next(&options.drifts, |of| of.drift);
        let slow_drift = next(&options.slow_drifts, |of| of.slow_drift);
        let mut levels = Self::coarse(grid);
        levels
            .all
            .retain(|of| of.force <= force && of.drift <= drift && of.slow_drift <= slow_drift);
        levels.near.clone_from(&levels.all);
        levels.about_nothing = about(grid, likeliest(grid, logs)?);
        levels.join();
        Some(levels)
    }

    /// Searches sets from now on about some sizes and about those of no effects, at the least unmodelled forces, and at those of
    /// `logs`, the likeliest posteriors of sets at some sizes, that may be the likeliest.
    pub(crate) fn search_about(&mut self, grid: Grid<'_>, sizes: Sizes, logs: &[(Sizes, f64)]) {
        self.settle_about(grid, sizes);
        let within = grid.options.level_within;
        let top = logs.iter().map(|of| of.1).fold(f64::NEG_INFINITY, f64::max);
        let likely = logs.iter().filter(|of| of.1 >= top - within);
        self.near.extend(likely.map(|of| of.0));
        self.near.extend(&self.about_nothing);
        self.join();
    }

    /// Looks from now on about some sizes, and at the least unmodelled forces.
    pub(crate) fn settle_about(&mut self, grid: Grid<'_>, sizes: Sizes) {
        self.centre = Some(sizes);
        self.near = self.nearest(grid);
        self.join();
    }

    /// Those about the working point's likeliest, and at the least unmodelled forces; those that are near where it has none.
    pub(crate) fn nearest(&self, grid: Grid<'_>) -> Vec<Sizes> {
        let Some(centre) = self.centre else {
            return self.near.clone();
        };
        let force = grid.least_force();
        let mut nearest = about(grid, centre);
        nearest.push(Sizes { force, ..centre });
        sort(&mut nearest);
        nearest
    }

    /// Those of a point that has settled at others, beside what was near.
    pub(crate) fn settled(&mut self, there: &Self) {
        self.centre = there.centre;
        self.near.extend(&there.near);
        self.join();
    }

    /// Looks at some sizes alone, and at the least unmodelled forces.
    pub(crate) fn only(&mut self, grid: Grid<'_>, sizes: Sizes) {
        let force = grid.least_force();
        self.centre = None;
        self.near = vec![Sizes { force, ..sizes }, sizes];
        sort(&mut self.near);
        self.all.clone_from(&self.near);
    }

    /// Looks at the least unmodelled forces alone.
    pub(crate) fn keep_least(&mut self, grid: Grid<'_>) {
        let least = grid.least_force();
        self.centre = None;
        self.all.retain(|of| of.force == least);
        self.near.clone_from(&self.all);
    }

    /// All hold those that are near.
    pub(crate) fn join(&mut self) {
        sort(&mut self.near);
        self.all.extend(&self.near);
        self.all.extend(&self.about_nothing);
        sort(&mut self.all);
    }
}

/// Some sizes, and those a factor smaller and larger along each axis.
fn about(grid: Grid<'_>, centre: Sizes) -> Vec<Sizes> {
    let mut all = vec![centre];
    for axis in AXES {
        let [below, above] = beside(grid, centre, axis);
        all.extend(below);
        all.extend(above);
    }
    sort(&mut all);
    all
}

/// The sizes' axes: unmodelled forces, drifts, slow drifts.
const AXES: [usize; 3] = [0, 1, 2];

fn along(sizes: &mut Sizes, axis: usize) -> &mut f64 {
    match axis {
        0 => &mut sizes.force,
        1 => &mut sizes.drift,
        _ => &mut sizes.slow_drift,
    }
}

/// A factor smaller and larger along an axis; none below the least force. The only neighbour of no drift is the least one.
fn beside(grid: Grid<'_>, centre: Sizes, axis: usize) -> [Option<Sizes>; 2] {
    let options = grid.options;
    if axis > 0 && !grid.drifts {
        return [None; 2];
    }
    let at = |size: f64| {
        let mut sizes = centre;
        *along(&mut sizes, axis) = size;
        Some(sizes)
    };
    let mut here = centre;
    let size = *along(&mut here, axis);
    match axis {
        0 if size <= options.forces[0] => [None, at(size * options.level_ratio)],
        0 => [
            at((size / options.level_ratio).max(options.forces[0])),
            at(size * options.level_ratio),
        ],
        1 if size == 0.0 => [None, at(options.drifts[1])],
        2 if size == 0.0 => [None, at(options.slow_drifts[1])],
        _ => [
            at(size / options.level_ratio),
            at(size * options.level_ratio),
        ],
    }
}

/// The likeliest sizes, from log likelihoods at some: by parabolas through the best and its neighbours, on logarithmic scales.
pub(crate) fn likeliest(grid: Grid<'_>, logs: &[(Sizes, f64)]) -> Option<Sizes> {
    let options = grid.options;
    let (best, top) = *logs.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let log = |at: Sizes| logs.iter().find(|of| of.0 == at).map(|of| of.1);
    let mut refined = best;
    for axis in AXES {
        if let [Some(below), Some(above)] = beside(grid, best, axis).map(|of| of.and_then(log)) {
            *along(&mut refined, axis) *= options.level_ratio.powf(vertex(below, top, above));
        }
    }
    refined.force = refined.force.max(options.forces[0]);
    Some(refined)
}

/// Place of the top of a parabola through values at -1, 0 and 1, the middle one the largest.
fn vertex(below: f64, middle: f64, above: f64) -> f64 {
    let curvature = below - 2.0 * middle + above;
    if curvature < 0.0 {
        (0.5 * (below - above) / curvature).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}

fn sort(sizes: &mut Vec<Sizes>) {
    sizes.sort_by(|a, b| {
        let by_force = a.force.total_cmp(&b.force);
        let by_drift = a.drift.total_cmp(&b.drift);
        by_force
            .then(by_drift)
            .then(a.slow_drift.total_cmp(&b.slow_drift))
    });
    sizes.dedup();
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Log likelihood that is quadratic in the logarithms of the sizes, 3e-3 and 2e-3 the likeliest.
    fn log(of: &Sizes) -> f64 {
        let apart = |size: f64, best: f64| (size / best).ln().powi(2);
        -100.0 * apart(of.force, 3e-3) - 40.0 * apart(of.drift.max(1e-4), 2e-3) - of.slow_drift
    }

    #[test]
    fn the_likeliest_sizes_are_found_between_those_that_are_tried() {
        let options = LikelihoodOptions::default();
        let grid = Grid {
            options: &options,
            drifts: true,
        };
        let mut levels = Levels::coarse(grid);
        let mut found = levels.all[0];
        for _ in 0..4 {
            let logs: Vec<(Sizes, f64)> = levels.all.iter().map(|of| (*of, log(of))).collect();
            found = likeliest(grid, &logs).unwrap();
            levels = Levels::up_to(grid, &logs).unwrap();
        }
        assert!((found.force / 3e-3 - 1.0).abs() < 1e-3, "{found:?}");
        assert!((found.drift / 2e-3 - 1.0).abs() < 1e-3, "{found:?}");
        assert_eq!(found.slow_drift, 0.0);
        // Forces larger than what may be the likeliest are not looked at.
        let largest = levels.all.iter().map(|of| of.force).fold(0.0, f64::max);
        assert!(largest < 0.03, "{largest}");
    }

    #[test]
    fn sets_are_searched_about_the_best_at_the_least_forces_and_about_none() {
        let options = LikelihoodOptions::default();
        let grid = Grid {
            options: &options,
            drifts: false,
        };
        let sizes = |force: f64| Sizes {
            force,
            drift: 0.0,
            slow_drift: 0.0,
        };
        let logs = [(sizes(0.3), 0.0), (sizes(1.0), -100.0)];
        let mut levels = Levels::up_to(grid, &logs).unwrap();
        assert!(levels.all.iter().all(|of| of.drift == 0.0));
        levels.search_about(
            grid,
            sizes(1e-2),
            &[(sizes(0.02), -1.0), (sizes(3.0), -60.0)],
        );
        let near: Vec<f64> = levels.near.iter().map(|of| of.force).collect();
        for force in [1e-4, 1e-2 / 1.5, 1e-2, 1.5e-2, 0.02, 0.2, 0.3, 0.45] {
            let is_there = near.iter().any(|of| (of / force - 1.0).abs() < 1e-9);
            assert!(is_there, "{force} {near:?}");
        }
        assert_eq!(near.len(), 8, "{near:?}");
        assert!(levels.near.iter().all(|of| levels.all.contains(of)));
        levels.keep_least(grid);
        assert_eq!(levels.near, [sizes(1e-4)]);
    }

    #[test]
    fn a_parabola_has_its_top_where_it_is() {
        let parabola = |x: f64| 3.0 - 2.0 * (x - 0.3).powi(2);
        let found = vertex(parabola(-1.0), parabola(0.0), parabola(1.0));
        assert!((found - 0.3).abs() < 1e-12);
        // A straight line has none.
        assert_eq!(vertex(1.0, 2.0, 3.0), 0.0);
        assert_eq!(vertex(2.0, 2.0, 2.0), 0.0);
    }
}
