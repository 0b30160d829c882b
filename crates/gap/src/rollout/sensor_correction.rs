//! Bias, scale and delay of sensors, and the output errors of a rollout under them.

use hydro_effects::{self as effects, Entry, Part};

use crate::{
    plant::PlantDescription,
    problem::{
        channels::{Channels, MeasuredTrial},
        segments::Segment,
    },
    rollout::shooting::Trace,
};

/// Correction of one sensor of the measurement: scale, delay [s], bias by channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Correction {
    pub(crate) scale: f64,
    pub(crate) delay: f64,
    pub(crate) bias: [f64; 3],
}

impl Correction {
    pub(crate) const NONE: Self = Self {
        scale: 1.0,
        delay: 0.0,
        bias: [0.0; 3],
    };
}

/// Corrections by sensor of the model.
pub(crate) fn corrections(model: &PlantDescription, entries: &[Entry]) -> Vec<Correction> {
    let mut all = vec![Correction::NONE; model.sensors.len()];
    for entry in entries {
        let Part::Sensor(part) = effects::effect(entry.effect).part() else {
            continue;
        };
        let Some(at) = model
            .sensors
            .iter()
            .position(|sensor| sensor.name == entry.target)
        else {
            continue;
        };
        let correction = &mut all[at];
        correction.scale *= part.scale(&entry.parameters);
        correction.delay += part.delay(&entry.parameters);
        for (component, bias) in correction.bias.iter_mut().enumerate() {
            *bias += part.bias(&entry.parameters, component);
        }
    }
    all
}

/// Residuals of a segment, row by row, channel by channel, in the units of the channels; NaN where there
/// is no reading.
pub(crate) fn residuals(
    trace: &Trace,
    trial: &MeasuredTrial,
    segment: &Segment,
    channels: &Channels,
    corrections: &[Correction],
    step: f64,
    residuals: &mut Vec<f64>,
) {
    residuals.clear();
    let mut reading = vec![0.0; trial.width];
    let mut late = vec![0.0; trial.width];
    let mut row_residual = vec![0.0; channels.len()];
    for row in segment.rows.clone() {
        let time = trial.times[row] - step;
        trace.at(time, &mut reading);
        for source in &channels.sources {
            let correction = &corrections[source.sensor];
            if *correction == Correction::NONE {
                continue;
            }
            let range = source.start..source.start + source.len;
            if correction.delay != 0.0 {
                trace.at(time - correction.delay, &mut late);
                reading[range.clone()].copy_from_slice(&late[range.clone()]);
            }
            if !source.attitude {
                for (component, value) in reading[range].iter_mut().enumerate() {
                    *value = *value * correction.scale + correction.bias[component.min(2)];
                }
            }
        }
        channels.residual(trial.row(row), &reading, &mut row_residual);
        for source in channels.sources.iter().filter(|source| source.attitude) {
            let bias = corrections[source.sensor].bias;
            for (value, bias) in row_residual[source.channel..].iter_mut().zip(bias) {
                *value -= bias;
            }
        }
        residuals.extend_from_slice(&row_residual);
    }
}
