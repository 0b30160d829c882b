//! Scale error of a sensor: `measured = scale reading`.

use crate::{
    Card, Effect, Id, Parameter, Part, Physical, Placement, SensorPart, Target, TargetKind,
};

/// Parameter `scale` [1].
#[derive(Debug)]
pub struct SensorScaling;

static CARD: Card = Card {
    id: Id::SensorScale,
    phrase: "a sensor scale",
    target: TargetKind::Sensor,
    summary: "readings off by a factor",
    equation: "measured = scale reading",
    source: "IEEE Std 952-1997 and its successors (scale factor of inertial sensors); contract: measured(t) \
             = scale * sensor(t - delay) + bias",
    idealised: false,
    placement: Placement::Sensors,
};

impl Effect for SensorScaling {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn parameters(&self, target: &Target) -> Vec<Parameter> {
        let Target::Sensor(_) = target else {
            return Vec::new();
        };
        vec![
            Parameter::about("scale", "1", 1.0, 0.1)
                .within(0.7, 1.3)
                .physically(Physical::NotNegative),
        ]
    }

    /// A rotation has no scale.
    fn applies_to(&self, target: &Target) -> bool {
        matches!(target, Target::Sensor(sensor) if !sensor.attitude)
    }

    fn part(&self) -> Part<'_> {
        Part::Sensor(self)
    }
}

impl SensorPart for SensorScaling {
    fn scale(&self, p: &[f64]) -> f64 {
        p[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_scales_and_nothing_else() {
        assert_eq!(SensorScaling.scale(&[1.1]), 1.1);
        assert_eq!(
            (SensorScaling.delay(&[1.1]), SensorScaling.bias(&[1.1], 0)),
            (0.0, 0.0)
        );
    }
}
