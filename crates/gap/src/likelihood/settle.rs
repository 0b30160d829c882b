//! A working point settles: sweeps, each followed by a step to the best values.
//!
//! A step after which the likelihood that the point has reached falls, and the one that first order promises too, went too far: only a
//! part of it is taken. First order's promise then does not hold, so the set counts by what its point has reached (`promised.rs`). So it
//! does where the sweeps end before the likelihood stays.

use crate::{
    error::GapError,
    likelihood::{
        choices::Choices,
        found::{Found, likeliest},
        level::{Level, Sizes},
        levels::{self, Grid},
        search::Search,
        starts::on_the_way,
        track::Track,
        working_point::{Keep, SETTLED, WorkingPoint},
    },
    problem::point::Point,
};

/// A point that has settled, or whose sweeps have ended.
pub(crate) struct Settled {
    /// Log posterior of its set in its last sweep; none where a step was too long or its values still moved.
    log_posterior: Option<f64>,
}

impl WorkingPoint<'_, '_> {
    /// Lets starts, numbers, the set's values and the sizes of the disturbances settle, no other effect in sight; not to the end
    /// where it will hardly be as likely as `least`. `None` where a track blows up.
    pub(crate) fn settle(&mut self, least: Option<f64>) -> Result<Option<Settled>, GapError> {
        let levels = self.levels.clone();
        let least_force = self.problem.settings.options.likelihood.forces[0];
        let chooses = levels.near.iter().any(|of| of.force > least_force);
        self.levels.all = levels.nearest(Grid::of(self.problem));
        let settled = self.settle_there(chooses, least);
        let found = std::mem::replace(&mut self.levels, levels);
        if chooses && settled.as_ref().is_ok_and(Option::is_some) {
            self.levels.settled(&found);
        }
        settled
    }

    fn settle_there(
        &mut self,
        chooses: bool,
        least: Option<f64>,
    ) -> Result<Option<Settled>, GapError> {
        let mut last: Option<(f64, f64)> = None;
        let options = &self.problem.settings.options.likelihood;
        let mut before: Option<(Vec<Track>, Point)> = None;
        let mut part = 1.0;
        // True once the values have settled, or are not worth it.
        let mut is_done = false;
        for _ in 0..options.settling {
            let Some(swept) = self.sweep(Some(&[]), Keep::Columns, None)? else {
                return Ok(None);
            };
            let found = self.own_sets(&swept.levels);
            let Some(best) = likeliest(&found) else {
                return Ok(None);
            };
            let level = &swept.levels[best.level];
            let reached = best.log_posterior - level.promised(self.problem, &self.point, best);
            let now = best.log_posterior;
            // Too far: a part of the step is taken, and of all later ones.
            if let Some((last, last_reached)) = last
                && now < last - options.too_far
                && reached < last_reached
                && let Some((tracks, point)) = &before
            {
                part *= options.shorter;
                self.tracks = on_the_way(self.problem, tracks, &self.tracks, options.shorter)?;
                self.point = point.on_the_way(&self.point, options.shorter);
                continue;
            }
            let from = (self.tracks.clone(), self.point.clone());
            let forms = self.likeliest_forms(&swept.levels, now);
            let (point, z) = level.moved(self.problem, &self.point, &[], best);
            self.smooth(&swept, &z, level.sizes)?;
            self.point = point;
            // The point's candidates may stand in another order than before.
            let mut reforms = false;
            for (candidate, form) in forms {
                let row = self.point.candidates.iter().position(|of| *of == candidate);
                if let Some(row) = row {
                    reforms |= self.point.forms[row] != form;
                    self.point.forms[row] = form;
                }
            }
            let logs = found
                .iter()
                .map(|of| (swept.levels[of.level].sizes, of.log_likelihood));
            let logs: Vec<(Sizes, f64)> = logs.collect();
            let sizes = levels::likeliest(Grid::of(self.problem), &logs);
            if let Some(sizes) = sizes.filter(|_| chooses) {
                self.levels.settle_about(Grid::of(self.problem), sizes);
                self.levels.all.clone_from(&self.levels.near);
            }
            let change = last.map(|(last, _)| (now - last).abs());
            let is_settled = !reforms && change.is_some_and(|change| change < SETTLED * part);
            let is_hopeless = (change.zip(least))
                .is_some_and(|(change, least)| now + options.hoped * change < least);
            last = Some((now, reached));
            if part < 1.0 {
                self.tracks = on_the_way(self.problem, &from.0, &self.tracks, part)?;
                self.point = from.1.on_the_way(&self.point, part);
            }
            before = Some(from);
            is_done = is_settled || is_hopeless;
            if is_done {
                break;
            }
        }
        // A step that was not looked at may have been too far again.
        self.counts_as_reached = part < 1.0 || !is_done;
        if let Some((tracks, point)) = before.filter(|_| part < 1.0) {
            (self.tracks, self.point) = (tracks, point);
        }
        Ok(last.map(|(log_posterior, _)| Settled {
            log_posterior: (!self.counts_as_reached).then_some(log_posterior),
        }))
    }

    /// The same, and the log posterior of the point's set there.
    pub(crate) fn settled_posterior(
        &mut self,
        least: Option<f64>,
    ) -> Result<Option<f64>, GapError> {
        match self.settle(least)? {
            Some(settled) if settled.log_posterior.is_some() => Ok(settled.log_posterior),
            Some(_) => self.posterior(),
            None => Ok(None),
        }
    }

    /// Sizes of the errors of form, by candidate, with which the point's set is likeliest beside any of the disturbances, one
    /// candidate after the other. `best`: its log posterior with those that it has.
    fn likeliest_forms(&self, levels: &[Level], mut best: f64) -> Vec<(usize, [f64; 2])> {
        let log = |levels: &[Level]| {
            let found = self.own_sets(levels);
            likeliest(&found).map_or(f64::NEG_INFINITY, |of| of.log_posterior)
        };
        let mut at_best: Option<Vec<Level>> = None;
        let sizes = self.problem.settings.options.likelihood.form_sizes;
        let mut forms = self.point.forms.clone();
        for (candidate, form) in self.point.candidates.iter().zip(&mut forms) {
            for (error, now) in form.iter_mut().enumerate() {
                for other in sizes {
                    if other == *now {
                        continue;
                    }
                    let from = at_best.as_deref().unwrap_or(levels).iter();
                    let tried = from.map(|of| of.with_form(*candidate, error, other / *now));
                    let tried: Vec<Level> = tried.collect();
                    let found = log(&tried);
                    if found > best {
                        (best, at_best, *now) = (found, Some(tried), other);
                    }
                }
            }
        }
        self.point.candidates.iter().copied().zip(forms).collect()
    }

    /// The point's set on the likelihood of a sweep without directions.
    pub(super) fn own_set(&self, level: &Level) -> Option<Found> {
        let choices = Choices::new(self.problem, &self.point, &[]);
        let choices = &match self.without_effects {
            Some(log_likelihood) => choices.against_none(log_likelihood),
            None => choices,
        };
        Search { level, choices }.whole(&self.point.candidates)
    }

    /// The same at every level.
    pub(crate) fn own_sets(&self, levels: &[Level]) -> Vec<Found> {
        let levels = levels.iter();
        levels.filter_map(|level| self.own_set(level)).collect()
    }

    /// The same, as likely as the point is where its fit did not end as first order has it.
    pub(crate) fn reached(&self, levels: &[Level]) -> Vec<Found> {
        let mut found = self.own_sets(levels);
        for of in found.iter_mut().filter(|_| self.counts_as_reached) {
            let promised = levels[of.level].promised(self.problem, &self.point, of);
            of.log_likelihood -= promised;
            of.log_posterior -= promised;
        }
        found
    }
}
