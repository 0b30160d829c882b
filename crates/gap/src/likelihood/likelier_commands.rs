//! Whether commands were logged with noise: judged by what the readings say of their fast part.

use hydro_files::rounded;

use crate::{
    error::GapError,
    likelihood::working_point::WorkingPoint,
    problem::{command_noise, problem::Problem},
    progress::Watch,
};

impl Problem<'_> {
    /// The problem with smoothed commands where the readings are likelier under them than under those that were logged, all noisy
    /// ones together. Commands may be white by design; then the readings follow them. Both are compared on the beginning of every trial,
    /// with the same noise in between, so that what a model lacks speaks for neither.
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
        let logged = log_likelihood(&self, &quiet)?;
        let mut others = smoothed.data;
        self.exchange_commands(&mut others);
        let smooth = log_likelihood(&self, &quiet)?;
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
            self.command_noise.clear();
        }
        Ok(self)
    }

    fn exchange_commands(&mut self, others: &mut [Vec<f64>]) {
        for (trial, other) in self.trials.iter_mut().zip(others) {
            std::mem::swap(&mut trial.control.data, other);
        }
    }
}

/// That of the nominal at the likeliest unmodelled forces; `None` where it diverges.
fn log_likelihood(problem: &Problem<'_>, watch: &Watch<'_>) -> Result<Option<f64>, GapError> {
    let mut working = WorkingPoint::new(problem, watch)?;
    working.keep_first(problem.settings.options.candidates.command_seconds);
    working.followed_likelihood()
}
