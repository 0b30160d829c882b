//! Bias of a sensor: `measured = reading + bias`; of an attitude, `reading exp(bias)`.

use crate::{Card, Effect, Id, Parameter, Part, Placement, SensorPart, Target, TargetKind};

/// Parameters in the sensor's unit: `bias` for one number, `x`, `y`, `z` for three, else `bias_0`, `bias_1`...
#[derive(Debug)]
pub struct SensorBias;

static CARD: Card = Card {
    id: Id::SensorBias,
    phrase: "a sensor bias",
    target: TargetKind::Sensor,
    summary: "a reading off by a constant; an attitude by a rotation vector in the body's frame",
    equation: "measured = reading + bias; attitude: measured = reading exp(bias)",
    source: "IEEE Std 952-1997 and its successors (bias of inertial sensors); contract: measured(t) = scale \
             * sensor(t - delay) + bias",
    idealised: false,
    placement: Placement::Sensors,
};

impl Effect for SensorBias {
    fn card(&self) -> &'static Card {
        &CARD
    }

    /// `bias` where there is one number, `x`, `y`, `z` where there are three, else `bias_0`, `bias_1`...
    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Sensor(sensor) = target else {
            return Vec::new();
        };
        // Ten standard deviations of the noise, or a tenth of the signal.
        let typical = (10.0 * sensor.noise).max(0.1 * sensor.signal);
        let typical = if typical > 0.0 { typical } else { 1.0 };
        let name = |component: usize| match (sensor.dimension, component) {
            (1, _) => "bias".to_owned(),
            (3, 0) => "x".to_owned(),
            (3, 1) => "y".to_owned(),
            (3, _) => "z".to_owned(),
            (_, component) => format!("bias_{component}"),
        };
        (0..sensor.dimension)
            .map(|component| Parameter::about(name(component), sensor.unit, 0.0, typical))
            .collect()
    }

    fn differs_by_trial(&self) -> bool {
        true
    }

    fn part(&self) -> Part<'_> {
        Part::Sensor(self)
    }
}

impl SensorPart for SensorBias {
    fn bias(&self, p: &[f64], component: usize) -> f64 {
        p.get(component).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::card::SensorScale;

    fn names(dimension: usize) -> Vec<String> {
        let sensor = SensorScale {
            dimension,
            noise: 0.01,
            signal: 2.0,
            unit: "m/s",
            period: 0.02,
            attitude: false,
        };
        SensorBias
            .parameters(&Target::Sensor(sensor))
            .into_iter()
            .map(|parameter| parameter.name)
            .collect()
    }

    #[test]
    fn it_is_named_by_how_many_numbers_there_are() {
        assert_eq!(names(1), ["bias"]);
        assert_eq!(names(3), ["x", "y", "z"]);
        assert_eq!(names(2), ["bias_0", "bias_1"]);
    }

    #[test]
    fn each_component_has_its_own() {
        assert_eq!(SensorBias.bias(&[0.1, -0.2, 0.3], 1), -0.2);
        assert_eq!(SensorBias.bias(&[0.1], 3), 0.0);
        assert_eq!(
            (SensorBias.scale(&[0.1]), SensorBias.delay(&[0.1])),
            (1.0, 0.0)
        );
    }
}
