//! A point refitted: how likely it is once it has settled, values of a trial's own, and what is left of the readings.

use nalgebra::DVector;

use crate::{
    error::GapError,
    likelihood::{
        by_trial::Deviation,
        directions::Direction,
        form_error,
        found::{Found, likeliest},
        innovations::{self, Innovation},
        level::{Level, Sizes},
        levels::Grid,
        working_point::{Keep, Swept, WorkingPoint},
    },
};

impl WorkingPoint<'_, '_> {
    /// Log marginal likelihood of the point's set beside the least unmodelled forces, once it has settled. `None` where a trial
    /// blows up.
    pub(crate) fn settled_evidence(&mut self) -> Result<Option<f64>, GapError> {
        self.keep_least();
        if !(self.follow()? && self.settle(None)?.is_some()) {
            return Ok(None);
        }
        let swept = self.sweep(Some(&[]), Keep::Likelihood, None)?;
        let least = swept.as_ref().and_then(|swept| self.least_forces(swept));
        Ok(least.map(|(_, found)| found.log_likelihood))
    }

    /// The same beside the likeliest disturbances.
    pub(crate) fn settled_likelihood(&mut self) -> Result<Option<f64>, GapError> {
        if !(self.follow()? && self.settle(None)?.is_some()) {
            return Ok(None);
        }
        Ok(self.likeliest()?.map(|of| of.log_likelihood))
    }

    /// Log posterior of the point's set beside the likeliest disturbances.
    pub(crate) fn posterior(&mut self) -> Result<Option<f64>, GapError> {
        Ok(self.likeliest()?.map(|of| of.log_posterior))
    }

    fn likeliest(&mut self) -> Result<Option<Found>, GapError> {
        let nearest = self.levels.nearest(Grid::of(self.problem));
        let all = std::mem::replace(&mut self.levels.all, nearest);
        let swept = self.sweep(Some(&[]), Keep::Likelihood, None);
        self.levels.all = all;
        let Some(swept) = swept? else {
            return Ok(None);
        };
        let found = self.reached(&swept.levels);
        Ok(likeliest(&found).cloned())
    }

    /// Likelihoods of predictions over a segment's length, from the readings alone, along some directions: beside the least
    /// unmodelled forces, and beside those of some sizes. None where a track blows up.
    pub(crate) fn predictions(
        &mut self,
        directions: &[Direction],
        sizes: Sizes,
    ) -> Result<Vec<Level>, GapError> {
        self.levels.only(Grid::of(self.problem), sizes);
        let seconds = self.problem.settings.options.segments.length;
        let swept = self.sweep(Some(directions), Keep::Likelihood, Some(seconds))?;
        Ok(swept.map_or_else(Vec::new, |of| of.levels))
    }

    /// Leaves the rows of every trial out from one on.
    pub(crate) fn keep_rows(&mut self, rows: usize) {
        for track in &mut self.tracks {
            track.links.retain(|link| link.segment.rows.end <= rows);
        }
    }

    /// Keeps the beginning of every trial, all of them together `seconds` long [s].
    pub(crate) fn keep_first(&mut self, seconds: f64) {
        let each = seconds / self.tracks.len().max(1) as f64;
        for track in &mut self.tracks {
            let first = track.links.first().map_or(0.0, |of| of.segment.start);
            (track.links).retain(|of| of.segment.start < first + each);
        }
    }

    /// Uncertain numbers and the point's own parameters of the only trial, the point's values known but for deviations along
    /// some directions of these. `None` where the trial blows up.
    pub(crate) fn own_values(
        &mut self,
        directions: &[Deviation],
    ) -> Result<Option<DVector<f64>>, GapError> {
        if !self.follow()? {
            return Ok(None);
        }
        let Some(swept) = self.sweep(Some(&[]), Keep::Likelihood, None)? else {
            return Ok(None);
        };
        let found = self.own_sets(&swept.levels);
        let level = likeliest(&found).map(|found| &swept.levels[found.level]);
        let forms = form_error::beside(self.problem, &self.point);
        let numbers = forms.numbers;
        // Errors of form are none, here as where the fit was made.
        let kept: Vec<usize> = (0..numbers)
            .chain(forms.len()..forms.len() + self.point.values.iter().map(Vec::len).sum::<usize>())
            .collect();
        let known = self.problem.normalised(&self.point);
        Ok(level.and_then(|level| level.deviating(&kept, directions, &known)))
    }

    /// The point's set beside the least unmodelled forces, where the drifts make it likeliest.
    fn least_forces<'s>(&self, swept: &'s Swept) -> Option<(&'s Level, Found)> {
        let least = swept.levels.first()?.sizes.force;
        let levels = swept.levels.iter().filter(|of| of.sizes.force == least);
        let found: Vec<Found> = levels.filter_map(|level| self.own_set(level)).collect();
        let best = likeliest(&found)?.clone();
        Some((&swept.levels[best.level], best))
    }

    /// Innovations of every track, once it follows the readings: the difference of each segment from what those before predict
    /// without unmodelled forces, the uncertain numbers where all readings have them. `None` where a track blows up.
    pub(crate) fn innovations(&mut self) -> Result<Option<Vec<Vec<Innovation>>>, GapError> {
        self.keep_least();
        let seconds = self.problem.settings.options.segments.length;
        let Some(swept) = self.sweep(Some(&[]), Keep::Readings, Some(seconds))? else {
            return Ok(None);
        };
        let Some((level, found)) = self.least_forces(&swept) else {
            return Ok(None);
        };
        let (_, z) = level.moved(self.problem, &self.point, &[], &found);
        let by_track = (self
            .tracks
            .iter()
            .zip(&swept.links)
            .zip(&self.arrival)
            .zip(&z))
        .map(|(((track, links), arrival), z)| {
            innovations::innovations(
                self.problem,
                track,
                links,
                swept.noise(level.sizes),
                z,
                (arrival, self.disturbances(track, level.sizes)),
            )
        });
        Ok(by_track.collect())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tests::{fake::RigidBody, on_prepared, trial};

    /// Two trials of 10 s: the first two seconds of each, or all where more is asked for.
    #[test]
    fn the_beginning_of_every_trial_is_kept() {
        let trials = ["one", "two"].map(|name| trial(name, &[], &[0.0, 0.0], 3, 1.0));
        on_prepared(&RigidBody::new(), trials.to_vec(), |problem, watch| {
            let seconds = |working: &WorkingPoint<'_, '_>| -> Vec<f64> {
                let tracks = working.tracks.iter().map(|of| &of.links);
                tracks
                    .map(|of| of[of.len() - 1].segment.start - of[0].segment.start)
                    .collect()
            };
            let mut working = WorkingPoint::new(problem, watch).unwrap();
            let whole = seconds(&working);
            working.keep_first(100.0);
            assert_eq!(seconds(&working), whole);
            working.keep_first(4.0);
            let kept = seconds(&working);
            assert!(
                kept.len() == 2 && kept.iter().all(|of| (1.5..2.0).contains(of)),
                "{kept:?}"
            );
        });
    }
}
