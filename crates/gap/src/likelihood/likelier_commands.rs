//! Whether commands were logged with noise: judged by what the readings say of their fast part.

use hydro_files::rounded;

use crate::{
    error::GapError,
    likelihood::{
        force_scale::Unmodelled, levels::Levels, track::Track, working_point::WorkingPoint,
    },
    problem::{command_noise, problem::Problem},
    progress::Watch,
};

impl Problem<'_> {
    /// The problem with smoothed commands where the readings are likelier under them than under those that were logged, all noisy
    /// ones together. Commands may be white by design; then the readings follow them. Both are compared on the beginning of every trial,
    /// with the same noise in between, so that what a model lacks speaks for neither, and with the readings weighed alike.
    ///
    /// # Errors
    /// The plant refuses, or a stop was asked for.
    pub fn with_likelier_commands(mut self, watch: &Watch<'_>) -> Result<Self, GapError> {
        let options = &self.settings.options.candidates;
        let Some(smoothed) = command_noise::smoothed(&self.trials, options) else {
            return Ok(self);
        };
        let quiet = Watch::silent(watch.stop);
        self.command_noise = smoothed.noise;
        // Weighed under the commands as logged.
        let Some(start) = start(&self, &quiet)? else {
            return Ok(self.with_logged_commands());
        };
        let logged = log_likelihood(&self, &quiet, start.clone())?;
        let mut others = smoothed.data;
        self.exchange_commands(&mut others);
        let smooth = log_likelihood(&self, &quiet, start)?;
        if logged
            .zip(smooth)
            .is_some_and(|(logged, smooth)| smooth > logged)
        {
            let names = self.noisy_commands().filter_map(|(at, sd)| {
                let actuator = self.model.actuators.get(at)?;
                Some(format!("`{}` ({})", actuator.name, rounded(sd)))
            });
            let names: Vec<String> = names.collect();
            self.remarks.push(format!(
                "white noise was logged with the commands of {}, standard deviations in brackets: the readings do not follow \
                 it; they are smoothed, and the noise that is left is allowed for",
                names.join(", ")
            ));
        } else {
            self.exchange_commands(&mut others);
            self = self.with_logged_commands();
        }
        Ok(self)
    }

    fn with_logged_commands(mut self) -> Self {
        self.command_noise.clear();
        self
    }

    fn exchange_commands(&mut self, others: &mut [Vec<f64>]) {
        for (trial, other) in self.trials.iter_mut().zip(others) {
            std::mem::swap(&mut trial.control.data, other);
        }
    }
}

/// The beginning of every trial as the nominal follows it, its readings weighed, and the disturbances beside it.
type Start = (Vec<Track>, (Unmodelled, Levels));

fn start(problem: &Problem<'_>, watch: &Watch<'_>) -> Result<Option<Start>, GapError> {
    let mut working = WorkingPoint::new(problem, watch)?;
    working.keep_first(problem.settings.options.candidates.command_seconds);
    let follows = working.follow()?;
    Ok(follows.then_some((working.tracks, (working.unmodelled, working.levels))))
}

/// Log likelihood of the nominal beside the likeliest disturbances, on from a start; `None` where it diverges.
fn log_likelihood(
    problem: &Problem<'_>,
    watch: &Watch<'_>,
    (tracks, disturbances): Start,
) -> Result<Option<f64>, GapError> {
    WorkingPoint::along(problem, watch, tracks, disturbances).followed_likelihood()
}
