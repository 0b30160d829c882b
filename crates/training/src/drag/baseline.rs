//! The fitted drag on a data set: fitted on a training split, and its predictions along a test split.

use std::convert::Infallible;

use hydro_frames::{Twist, Wrench};
use hydro_model::features::{Feature, FeatureLayout};

use super::{fit::DragFit, law::Drag};
use crate::{comparison::Predict, dataset::Split};

/// The regression of a drag on a training split, buoyancy taken out exactly; `None` where the features
/// hold no twist.
pub fn fit_drag(layout: &FeatureLayout, train: &Split) -> Option<DragFit> {
    let mut fit = DragFit::default();
    for trajectory in 0..train.len() {
        let samples = train.x(trajectory).chunks_exact(train.inputs());
        let wrenches = train.wrench(trajectory).chunks_exact(6);
        let hydrostatics = train.hydrostatic(trajectory).chunks_exact(6);
        for ((sample, wrench), hydrostatic) in samples.zip(wrenches).zip(hydrostatics) {
            let (twist, density) = twist_and_density(layout, sample)?;
            fit.add(&twist, density, &without_buoyancy(wrench, hydrostatic));
        }
    }
    Some(fit)
}

/// The fitted drag as a method, with exact buoyancy and density.
pub fn drag_predictions<'a>(
    drag: &'a Drag,
    layout: &'a FeatureLayout,
) -> Box<Predict<'a, Infallible>> {
    Box::new(move |split, trajectory| {
        let samples = split.x(trajectory).chunks_exact(split.inputs());
        let hydrostatics = split.hydrostatic(trajectory).chunks_exact(6);
        let predicted = samples.zip(hydrostatics).flat_map(|(sample, hydrostatic)| {
            let wrench = twist_and_density(layout, sample)
                .map(|(twist, density)| drag.wrench(&twist, density))
                .unwrap_or_default()
                .to_array();
            let mut sum = [0.0; 6];
            for (sum, (drag, buoyancy)) in sum.iter_mut().zip(wrench.iter().zip(hydrostatic)) {
                *sum = drag + f64::from(*buoyancy);
            }
            sum
        });
        Ok(predicted.collect())
    })
}

/// Base twist and density of a floating base's sample; `None` where the layout does not hold them.
pub fn twist_and_density(layout: &FeatureLayout, sample: &[f32]) -> Option<(Twist, f64)> {
    let triple = |feature: fn(usize) -> Feature| -> Option<[f64; 3]> {
        let at = |axis| Some(f64::from(sample[layout.index_of(&feature(axis))?]));
        Some([at(0)?, at(1)?, at(2)?])
    };
    let twist = Twist {
        angular: triple(Feature::AngularVelocity)?,
        linear: triple(Feature::LinearVelocity)?,
    };
    Some((twist, f64::from(sample[layout.density()?])))
}

/// The wrench without buoyancy of each sample: measured (perturbed) minus exact hydrostatics.
fn without_buoyancy(wrench: &[f32], hydrostatic: &[f32]) -> Wrench {
    let mut values = [0.0; 6];
    for (value, (all, part)) in values.iter_mut().zip(wrench.iter().zip(hydrostatic)) {
        *value = f64::from(*all) - f64::from(*part);
    }
    Wrench::from_array(values)
}
