//! Trials made ready for every stage: channels, sensor noise, estimated motions, candidate effects.

use std::sync::atomic::AtomicUsize;

use hydro_effects::Medium;
use rayon::prelude::*;

use crate::{
    error::GapError,
    plant::{Plant, PlantDescription, Quantity, SensorKind},
    problem::{
        candidates,
        channels::{Channels, MeasuredTrial},
        outliers,
        problem::{Problem, Settings},
        segments::EstimatedMotion,
        sensor_noise,
        typical::Typical,
    },
    progress::Watch,
    rollout::{sensor_correction::Correction, state_estimation, system::System},
    trial::Trial,
};

/// Most numbers a row: every one brings candidate effects of its own, and memory grows with their square (4 trials of a
/// second: 0.2, 0.5, 3.1 GB with 25, 50, 100 numbers).
const MOST_CHANNELS: usize = 128;

impl<'a> Problem<'a> {
    /// Estimates noise where none is declared, and the motion of every trial.
    ///
    /// # Errors
    /// Nothing to compare, a nominal that blows up, or a stop that was asked for.
    pub fn prepare(
        plant: &'a dyn Plant,
        trials: Vec<Trial>,
        settings: Settings,
        watch: &Watch<'_>,
    ) -> Result<Self, GapError> {
        let model = plant.description();
        let mut trials: Vec<MeasuredTrial> = trials
            .into_iter()
            .map(|trial| MeasuredTrial::new(trial, model))
            .collect();
        let mut channels = Channels::with_readings(model, &trials);
        if channels.len() == 0 {
            return Err(GapError::NothingMeasured {
                trials: trials.iter().map(|trial| trial.name.clone()).collect(),
                sensors: model.sensors.iter().map(|s| s.name.clone()).collect(),
            });
        }
        check_count(&channels)?;
        check_forces(model, &channels, &trials)?;
        let settings = Settings {
            options: settings.options.for_rows(finest_period(&trials)),
            ..settings
        };
        let mut remarks = Vec::new();
        let estimated =
            sensor_noise::estimate(&mut channels, &trials, &settings.options.candidates);
        if !estimated.is_empty() {
            let source = match trials.iter().all(|trial| trial.steady) {
                true => "a table says nothing of it but by its scatter",
                false => "it was estimated from the readings' third differences",
            };
            remarks.push(format!(
                "the MJCF gives no noise for {}; {source}",
                estimated.join(", ")
            ));
        }
        let alone = outliers::remove(&channels, &mut trials, &settings.options.outliers);
        for (sensor, count) in alone {
            remarks.push(format!(
                "{count} readings of `{sensor}` stand alone, more than {} standard deviations of its estimated noise from \
                 those beside them, and are left out",
                settings.options.outliers.deviation
            ));
        }
        let done = AtomicUsize::new(0);
        let none = vec![Correction::NONE; model.sensors.len()];
        let motions = trials
            .par_iter()
            .map(|trial| {
                watch.check()?;
                let motion = state_estimation::estimate_motion(
                    &System::plain(plant),
                    trial,
                    &channels,
                    &none,
                    &settings.options,
                );
                watch.count("following the trials", &done, trials.len());
                motion
            })
            // Of several faults that of the first trial is told, whichever thread was faster.
            .collect::<Vec<Result<EstimatedMotion, GapError>>>()
            .into_iter()
            .collect::<Result<Vec<EstimatedMotion>, GapError>>()?;
        let typical = Typical::from_trials(model, &trials, &motions);
        if !model.actuators.is_empty() && !trials.iter().any(is_excited) {
            remarks.push(
                "the controls are constant in every trial: the data excite nothing but free motion"
                    .to_owned(),
            );
        }
        let candidates = candidates::enumerate(
            model,
            &channels,
            &trials,
            &typical,
            (&settings.own_effects, settings.medium),
            &settings.options.candidates,
        );
        let uncertainty = &settings.uncertainty;
        let nuisances = (model.nuisances.iter().enumerate())
            .map(|(at, nuisance)| {
                let options = &settings.options.candidates;
                (at, uncertainty.standard_deviation(nuisance, options))
            })
            .filter(|(_, sd)| *sd > 0.0)
            .filter(|(at, _)| {
                model.nuisances[*at].quantity != Quantity::CommandsBefore
                    || trials.iter().any(begins_under_commands)
            })
            .collect();
        let medium = settings.medium.unwrap_or(model.medium);
        let hulls = candidates::bases(model, settings.options.candidates.base_volume_ratio);
        let free = model.base.as_ref().map(|base| base.body.as_str());
        // A hull on rails or a hinge counts where the user says that it is in water.
        let led = hulls
            .first()
            .copied()
            .filter(|_| settings.medium == Some(Medium::Water));
        let lacks_fluid = free.or(led).filter(|_| !model.has_fluid);
        let priors = candidates::priors(
            &candidates,
            (medium, lacks_fluid),
            &settings.options.candidates,
        );
        Ok(Self {
            hulls: hulls.into_iter().map(str::to_owned).collect(),
            plant,
            model,
            priors,
            nuisances,
            drifting: sensor_noise::drifting(&channels, &trials),
            trials,
            motions,
            channels,
            candidates,
            command_noise: Vec::new(),
            commands: typical.command,
            settings,
            remarks,
        })
    }
}

/// Refuses trials that take more memory than there is.
fn check_count(channels: &Channels) -> Result<(), GapError> {
    if channels.len() <= MOST_CHANNELS {
        return Ok(());
    }
    let mut sensors: Vec<String> = (channels.list.iter())
        .map(|channel| channel.sensor.clone())
        .collect();
    sensors.dedup();
    Err(GapError::TooMuchMeasured {
        found: channels.len(),
        most: MOST_CHANNELS,
        sensors,
    })
}

/// Refuses trials in which nothing could show that the model is wrong.
fn check_forces(
    model: &PlantDescription,
    channels: &Channels,
    trials: &[MeasuredTrial],
) -> Result<(), GapError> {
    let is_driven = |trial: &MeasuredTrial| (0..model.nv).all(|dof| trial.imposes(dof));
    let tells = |kind: SensorKind| {
        matches!(
            kind,
            SensorKind::Force | SensorKind::Torque | SensorKind::Other
        )
    };
    let compared = || (channels.sources.iter()).map(|source| &model.sensors[source.sensor]);
    if compared().any(|sensor| tells(sensor.kind)) || !trials.iter().all(is_driven) {
        return Ok(());
    }
    Err(GapError::NoForces {
        trials: trials.iter().map(|trial| trial.name.clone()).collect(),
        compared: compared().map(|sensor| sensor.name.clone()).collect(),
        sensors: model.sensors.iter().map(|of| of.name.clone()).collect(),
    })
}

/// Shortest typical time between rows of the logs in time [s]; none where all states are steady.
pub(crate) fn finest_period(trials: &[MeasuredTrial]) -> Option<f64> {
    let logs = trials.iter().filter(|trial| !trial.steady);
    logs.map(MeasuredTrial::period).reduce(f64::min)
}

/// True where commands are there from the first row on.
fn begins_under_commands(trial: &MeasuredTrial) -> bool {
    let first = trial.control.data.iter().take(trial.control.width());
    !trial.steady && first.into_iter().any(|of| of.is_finite() && *of != 0.0)
}

/// True where a command changes.
fn is_excited(trial: &MeasuredTrial) -> bool {
    let width = trial.control.width().max(1);
    let mut rows = trial.control.data.chunks_exact(width);
    let first = rows.next().unwrap_or(&[]);
    rows.any(|row| row.iter().zip(first).any(|(a, b)| a.is_finite() && a != b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_thousand_sensors_are_too_many() {
        assert!(check_count(&Channels::alike(MOST_CHANNELS, 0.1)).is_ok());
        let said = check_count(&Channels::alike(10_000, 0.1));
        let said = said.map_err(|fault| fault.to_string());
        assert!(said.is_err_and(|said| said.contains("10000 numbers a row")
            && said.contains("`sensor_0`")
            && said.contains("and 9960 more")
            && said.contains("at most 128")));
    }
}
