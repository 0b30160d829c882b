//! The trials as the nominal follows them: what every stage starts from.

use crate::{
    error::GapError,
    likelihood::{
        force_scale::Unmodelled, levels::Levels, track::Track, working_point::WorkingPoint,
    },
    problem::problem::Problem,
    progress::Watch,
};

/// Trials cut into segments, their readings weighed by what rows resolve, and the starts and unmodelled forces with which the
/// nominal follows them.
pub struct Followed<'p> {
    pub(crate) problem: &'p Problem<'p>,
    tracks: Vec<Track>,
    unmodelled: Unmodelled,
    levels: Levels,
}

impl<'p> Followed<'p> {
    /// Lets the nominal follow the trials.
    ///
    /// # Errors
    /// The nominal diverges on some trial, the plant refuses, or a stop was asked for.
    pub fn new(problem: &'p Problem<'p>, watch: &Watch<'_>) -> Result<Self, GapError> {
        let mut working = WorkingPoint::new(problem, watch)?;
        if !working.follow()? {
            return Err(diverges(problem));
        }
        Ok(Self {
            problem,
            tracks: working.tracks,
            unmodelled: working.unmodelled,
            levels: working.levels,
        })
    }

    /// The empty set at the nominal, starts and forces as the nominal follows the trials with them.
    pub(crate) fn working_point<'w>(&'w self, watch: &'w Watch<'w>) -> WorkingPoint<'w, 'w> {
        let sizes = (self.unmodelled.clone(), self.levels.clone());
        WorkingPoint::along(self.problem, watch, self.tracks.clone(), sizes)
    }
}

impl std::fmt::Debug for Followed<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Followed")
            .field("trials", &self.tracks.len())
            .finish_non_exhaustive()
    }
}

pub(crate) fn diverges(problem: &Problem<'_>) -> GapError {
    let trial = &problem.trials[0];
    let from = trial.times[0];
    GapError::NominalDiverges {
        trial: trial.name.clone(),
        start: from,
        after: 0.0,
        expected: trial.times[trial.times.len() - 1] - from,
        timestep: problem.model.timestep,
    }
}
