//! A trial laid out as the model's `sensordata`, and the channels that are compared.

use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion};

use crate::{
    output::records::Channel,
    plant::{PlantDescription, SensorKind, prescribed::PrescribedMotion},
    problem::prescribed,
    trial::{Series, Trial},
};

/// One trial, its readings in the order of `sensordata`.
#[derive(Debug, Default)]
pub(crate) struct MeasuredTrial {
    /// Name of the trial.
    pub(crate) name: String,
    /// Labels of the rows [s]: a row labelled t holds the state at t less a step.
    pub(crate) times: Vec<f64>,
    /// Readings by row; NaN where there is none.
    pub(crate) values: Vec<f64>,
    /// Length of a row.
    pub(crate) width: usize,
    /// Controls.
    pub(crate) control: Series,
    /// Full-physics state at the start, where the log has one.
    pub(crate) initial_state: Option<Vec<f64>>,
    /// Motion that is imposed.
    pub(crate) prescribed: Option<Arc<PrescribedMotion>>,
    /// True for steady states: rows have nothing to do with each other, and every degree of freedom is prescribed.
    pub(crate) steady: bool,
    /// Standard deviation of each value where the table gives it, else NaN; empty where it gives none.
    pub(crate) deviations: Vec<f64>,
}

impl MeasuredTrial {
    pub(crate) fn new(trial: Trial, model: &PlantDescription) -> Self {
        let width = model
            .sensors
            .iter()
            .map(|sensor| sensor.start + sensor.len)
            .max()
            .unwrap_or(0);
        let laid_out = |series: &Series| {
            let mut values = vec![f64::NAN; width * series.times.len()];
            for sensor in &model.sensors {
                for component in 0..sensor.len {
                    let Some(column) = series.component(&sensor.name, component, sensor.len) else {
                        continue;
                    };
                    for (row, value) in series.column_values(column).enumerate() {
                        values[row * width + sensor.start + component] = value;
                    }
                }
            }
            values
        };
        let values = laid_out(&trial.sensors);
        let prescribed = prescribed::motion(&trial, model).map(Arc::new);
        if let Some(table) = &trial.steady {
            return Self {
                name: trial.name,
                times: prescribed::row_times(&table.motion, model),
                values,
                width,
                control: prescribed::held(&trial.control, model),
                initial_state: None,
                prescribed,
                steady: true,
                deviations: laid_out(&table.deviations),
            };
        }
        let initial_state = trial
            .initial_state
            .filter(|state| state.len() == model.state_len);
        Self {
            name: trial.name,
            times: trial.sensors.times,
            values,
            width,
            control: trial.control,
            initial_state,
            prescribed,
            ..Self::default()
        }
    }

    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.values[row * self.width..(row + 1) * self.width]
    }

    /// True where a degree of freedom is prescribed.
    pub(crate) fn imposes(&self, dof: usize) -> bool {
        (self.prescribed.as_ref()).is_some_and(|motion| motion.imposes(dof))
    }

    /// Time from the first row to the last [s]; of steady states none.
    pub(crate) fn seconds(&self) -> f64 {
        if self.steady {
            return 0.0;
        }
        match (self.times.first(), self.times.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Median time between rows [s].
    pub(crate) fn period(&self) -> f64 {
        let mut gaps: Vec<f64> = self
            .times
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        if gaps.is_empty() {
            return f64::INFINITY;
        }
        let middle = gaps.len() / 2;
        *gaps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// Place of a sensor's numbers in `sensordata`, and the channels that they become.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    /// Row of `PlantDescription::sensors`.
    pub(crate) sensor: usize,
    /// First number in `sensordata`.
    pub(crate) start: usize,
    /// Numbers.
    pub(crate) len: usize,
    /// First channel.
    pub(crate) channel: usize,
    /// Channels: three for an attitude, else one a number.
    pub(crate) channels: usize,
    /// True for an attitude.
    pub(crate) attitude: bool,
}

/// All channels that are compared.
#[derive(Clone, Debug)]
pub(crate) struct Channels {
    pub(crate) list: Vec<Channel>,
    pub(crate) sources: Vec<Source>,
}

impl Channels {
    /// One number with declared noise, in metres.
    #[cfg(test)]
    pub(crate) fn single(noise: f64) -> Self {
        Self::alike(1, noise)
    }

    /// Sensors of one number each, in metres, with declared noise.
    #[cfg(test)]
    pub(crate) fn alike(count: usize, noise: f64) -> Self {
        let channel = |at: usize| Channel {
            sensor: format!("sensor_{at}"),
            component: 0,
            unit: "m".to_owned(),
            noise,
            declared_noise: Some(noise),
        };
        let source = |at: usize| Source {
            sensor: at,
            start: at,
            len: 1,
            channel: at,
            channels: 1,
            attitude: false,
        };
        Self {
            list: (0..count).map(channel).collect(),
            sources: (0..count).map(source).collect(),
        }
    }

    /// The channels of sensors with at least one reading in the trials; a component may be without any.
    pub(crate) fn with_readings(model: &PlantDescription, trials: &[MeasuredTrial]) -> Self {
        let mut list = Vec::new();
        let mut sources = Vec::new();
        for (at, sensor) in model.sensors.iter().enumerate() {
            let seen = trials.iter().any(|trial| {
                (0..trial.times.len()).any(|row| {
                    trial.row(row)[sensor.start..sensor.start + sensor.len]
                        .iter()
                        .any(|value| value.is_finite())
                })
            });
            if !seen {
                continue;
            }
            let attitude = sensor.kind == SensorKind::Quaternion;
            let channels = if attitude { 3 } else { sensor.len };
            sources.push(Source {
                sensor: at,
                start: sensor.start,
                len: sensor.len,
                channel: list.len(),
                channels,
                attitude,
            });
            for component in 0..channels {
                let declared = match sensor.noise > 0.0 {
                    true => Some(sensor.noise),
                    false if attitude => None,
                    false => typical_deviation(trials, sensor.start + component),
                };
                list.push(Channel {
                    sensor: sensor.name.clone(),
                    component,
                    unit: if attitude { "rad" } else { sensor.unit }.to_owned(),
                    noise: declared.unwrap_or(f64::NAN),
                    declared_noise: declared,
                });
            }
        }
        Self { list, sources }
    }

    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// Measured less predicted, by channel; NaN where there is no reading. An attitude gives the rotation
    /// vector from the predicted to the measured one, in the predicted frame.
    pub(crate) fn residual(&self, measured: &[f64], predicted: &[f64], residual: &mut [f64]) {
        for source in &self.sources {
            let range = source.start..source.start + source.len;
            let (measured, predicted) = (&measured[range.clone()], &predicted[range]);
            let out = &mut residual[source.channel..source.channel + source.channels];
            if source.attitude {
                out.copy_from_slice(&rotation_between(predicted, measured));
            } else {
                for ((value, measured), predicted) in out.iter_mut().zip(measured).zip(predicted) {
                    *value = measured - predicted;
                }
            }
        }
    }
}

/// Rotation vector from one attitude (w x y z) to another, in the frame of the first.
pub(crate) fn rotation_between(from: &[f64], to: &[f64]) -> [f64; 3] {
    let unit = |q: &[f64]| {
        UnitQuaternion::try_new(Quaternion::new(q[0], q[1], q[2], q[3]), f64::MIN_POSITIVE)
    };
    match (unit(from), unit(to)) {
        (Some(from), Some(to)) => (from.inverse() * to).scaled_axis().into(),
        _ => [f64::NAN; 3],
    }
}

/// Median standard deviation of a value of `sensordata`, where the trials are tables that give one for every reading.
fn typical_deviation(trials: &[MeasuredTrial], at: usize) -> Option<f64> {
    let mut all = Vec::new();
    for trial in trials {
        for row in 0..trial.times.len() {
            let place = row * trial.width + at;
            if trial.values[place].is_finite() {
                let deviation = trial.deviations.get(place).copied();
                all.push(deviation.filter(|value| value.is_finite())?);
            }
        }
    }
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// Mean of every channel over each trial. Steady states have one mean together: rows of a table are one population.
pub(crate) fn all_means(trials: &[MeasuredTrial], channels: &Channels) -> Vec<Vec<f64>> {
    let mut pooled = vec![(0.0, 0_usize); channels.len()];
    let zeros = vec![0.0; channels.len()];
    for trial in trials.iter().filter(|trial| trial.steady) {
        for row in 0..trial.times.len() {
            for (channel, (sum, count)) in pooled.iter_mut().enumerate() {
                let value = deviation(trial, channels, row, channel, &zeros);
                if value.is_finite() {
                    *sum += value;
                    *count += 1;
                }
            }
        }
    }
    let pooled: Vec<f64> = (pooled.iter())
        .map(|(sum, count)| sum / (*count).max(1) as f64)
        .collect();
    (trials.iter())
        .map(|trial| match trial.steady {
            true => pooled.clone(),
            false => means(trial, channels),
        })
        .collect()
}

/// Mean of every channel over a trial; of an attitude, the first reading stands for it.
fn means(trial: &MeasuredTrial, channels: &Channels) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_usize); channels.len()];
    let zeros = vec![0.0; channels.len()];
    for row in 0..trial.times.len() {
        for (channel, (sum, count)) in sums.iter_mut().enumerate() {
            let value = deviation(trial, channels, row, channel, &zeros);
            if value.is_finite() {
                *sum += value;
                *count += 1;
            }
        }
    }
    sums.iter()
        .map(|(sum, count)| sum / (*count).max(1) as f64)
        .collect()
}

/// A reading less the mean of its channel.
pub(crate) fn deviation(
    trial: &MeasuredTrial,
    channels: &Channels,
    row: usize,
    channel: usize,
    means: &[f64],
) -> f64 {
    let Some(source) = channels
        .sources
        .iter()
        .find(|of| (of.channel..of.channel + of.channels).contains(&channel))
    else {
        return f64::NAN;
    };
    let component = channel - source.channel;
    let reading = &trial.row(row)[source.start..source.start + source.len];
    let value = if source.attitude {
        let first = &trial.row(0)[source.start..source.start + source.len];
        rotation_between(first, reading)[component]
    } else {
        reading[component]
    };
    value - means[channel]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::{
        plant::Plant,
        tests::{fake::RigidBody, trial},
    };

    /// A vector sensor of which the log lacks a component keeps the others.
    #[test]
    fn components_are_compared_singly() {
        let body = RigidBody::new();
        let model = body.description();
        let mut logged = trial("one", &[], &[0.0, 0.0], 1, 1.0);
        let sensor = (model.sensors.iter())
            .find(|of| of.kind == SensorKind::LinearVelocity)
            .unwrap();
        let lost = logged.sensors.component(&sensor.name, 1, 3).unwrap();
        let width = logged.sensors.width();
        let mut column = 0..;
        logged
            .sensors
            .data
            .retain(|_| column.next().unwrap() % width != lost);
        logged.sensors.columns.remove(lost);
        let measured = MeasuredTrial::new(logged, model);
        let row = &measured.row(5)[sensor.start..sensor.start + 3];
        assert!(
            row[0].is_finite() && row[1].is_nan() && row[2].is_finite(),
            "{row:?}"
        );
        let channels = Channels::with_readings(model, &[measured]);
        let of_sensor = channels.list.iter().filter(|of| of.sensor == sensor.name);
        assert_eq!(of_sensor.count(), 3);
    }
}
