//! Which levels of disturbances are looked at: a coarse grid, and a fine one about the likeliest.
//!
//! A trial of a minute has a thousand pieces of unmodelled force and ten thousand readings. A size that is off by a factor of
//! 1.7 costs hundreds of nats of likelihood then, and any number that scales what forces do to the readings (a mass, a gain, a
//! sensor's scale) would be moved to win them. So the sizes are fitted before sets are compared.

use crate::{likelihood::level::Sizes, problem::problem::Problem};

/// Levels to look at, those of the least forces first.
#[derive(Clone, Debug)]
pub(crate) struct Levels {
    /// All of them; without effects the likeliest may be any.
    pub(crate) all: Vec<Sizes>,
    /// Those of them at which sets are searched.
    pub(crate) near: Vec<Sizes>,
    /// About the likeliest without effects.
    about_nothing: Vec<Sizes>,
}

impl Levels {
    /// The whole coarse grid.
    pub(crate) fn coarse(problem: &Problem<'_>) -> Self {
        let options = &problem.settings.options.likelihood;
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
        if problem.drifting.is_empty() {
            all.retain(|of| of.drift == 0.0 && of.slow_drift == 0.0);
        }
        // Beside a slow drift the short one hardly matters.
        all.retain(|of| of.slow_drift == 0.0 || of.drift <= options.drifts[2]);
        sort(&mut all);
        Self {
            near: all.clone(),
            all,
            about_nothing: Vec::new(),
        }
    }

    /// From log likelihoods without effects at some sizes: the coarse grid up to those that may be the likeliest, for effects
    /// leave less to disturbances; and what is about the likeliest.
    pub(crate) fn up_to(problem: &Problem<'_>, logs: &[(Sizes, f64)]) -> Option<Self> {
        let options = &problem.settings.options.likelihood;
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
        let mut levels = Self::coarse(problem);
        levels
            .all
            .retain(|of| of.force <= force && of.drift <= drift && of.slow_drift <= slow_drift);
        levels.near.clone_from(&levels.all);
        levels.about_nothing = about(problem, likeliest(problem, logs)?);
        levels.join();
        Some(levels)
    }

    /// Searches sets from now on about some sizes and about those of no effects, at the least unmodelled forces, and at those of
    /// `logs`, the likeliest posteriors of sets at some sizes, that may be the likeliest.
    pub(crate) fn search_about(
        &mut self,
        problem: &Problem<'_>,
        sizes: Sizes,
        logs: &[(Sizes, f64)],
    ) {
        self.settle_about(problem, sizes);
        let within = problem.settings.options.likelihood.level_within;
        let top = logs.iter().map(|of| of.1).fold(f64::NEG_INFINITY, f64::max);
        let likely = logs.iter().filter(|of| of.1 >= top - within);
        self.near.extend(likely.map(|of| of.0));
        self.near.extend(&self.about_nothing);
        self.join();
    }

    /// Looks from now on about some sizes, and at the least unmodelled forces.
    pub(crate) fn settle_about(&mut self, problem: &Problem<'_>, sizes: Sizes) {
        let force = problem.settings.options.likelihood.forces[0];
        self.near = about(problem, sizes);
        self.near.push(Sizes { force, ..sizes });
        self.join();
    }

    /// Looks at some sizes alone, and at the least unmodelled forces.
    pub(crate) fn only(&mut self, problem: &Problem<'_>, sizes: Sizes) {
        let force = problem.settings.options.likelihood.forces[0];
        self.near = vec![Sizes { force, ..sizes }, sizes];
        sort(&mut self.near);
        self.all.clone_from(&self.near);
    }

    /// Looks at the least unmodelled forces alone.
    pub(crate) fn keep_least(&mut self, problem: &Problem<'_>) {
        let least = problem.settings.options.likelihood.forces[0];
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
fn about(problem: &Problem<'_>, centre: Sizes) -> Vec<Sizes> {
    let mut all = vec![centre];
    for axis in AXES {
        let [below, above] = beside(problem, centre, axis);
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
fn beside(problem: &Problem<'_>, centre: Sizes, axis: usize) -> [Option<Sizes>; 2] {
    let options = &problem.settings.options.likelihood;
    if axis > 0 && problem.drifting.is_empty() {
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
pub(crate) fn likeliest(problem: &Problem<'_>, logs: &[(Sizes, f64)]) -> Option<Sizes> {
    let options = &problem.settings.options.likelihood;
    let (best, top) = *logs.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let log = |at: Sizes| logs.iter().find(|of| of.0 == at).map(|of| of.1);
    let mut refined = best;
    for axis in AXES {
        if let [Some(below), Some(above)] = beside(problem, best, axis).map(|of| of.and_then(log)) {
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
mod tests {
    use super::vertex;

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
