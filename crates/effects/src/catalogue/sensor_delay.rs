//! Delay of a sensor: `measured(t) = reading(t - delay)`.

use crate::{
    Card, Effect, Id, Parameter, Part, Physical, Placement, SensorPart, Target, TargetKind,
};

/// Parameter `delay` [s].
#[derive(Debug)]
pub struct SensorDelay;

static CARD: Card = Card {
    id: Id::SensorDelay,
    phrase: "a sensor delay",
    target: TargetKind::Sensor,
    summary: "readings that come late",
    equation: "measured(t) = reading(t - delay)",
    source: "P. Furgale, J. Rehder, R. Siegwart, Unified temporal and spatial calibration for multi-sensor \
             systems, IROS, 2013; contract: measured(t) = scale * sensor(t - delay) + bias",
    idealised: false,
    placement: Placement::Sensors,
};

impl Effect for SensorDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Sensor(sensor) = target else {
            return Vec::new();
        };
        let period = if sensor.period > 0.0 {
            sensor.period
        } else {
            0.01
        };
        vec![
            Parameter::about("delay", "s", 0.0, 0.05_f64.max(2.0 * period))
                .within(0.0, 1.0)
                .physically(Physical::NotNegative)
                // Between two readings, where an interpolated signal has a derivative.
                .starting(0.5 * period),
        ]
    }

    fn part(&self) -> Part<'_> {
        Part::Sensor(self)
    }
}

impl SensorPart for SensorDelay {
    fn has_delay(&self) -> bool {
        true
    }

    fn delay(&self, p: &[f64]) -> f64 {
        p[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_delays_and_nothing_else() {
        assert_eq!(SensorDelay.delay(&[0.04]), 0.04);
        assert_eq!(
            (SensorDelay.scale(&[0.04]), SensorDelay.bias(&[0.04], 0)),
            (1.0, 0.0)
        );
    }
}
