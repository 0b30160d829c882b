//! A step of known length.

use candle_nn::{Init, VarBuilder};

use super::*;

/// One step from w = [2] (a vector: no decay) with gradient g moves by the learning rate, whatever g's size:
/// mean/first = g, square/second = g^2 on the first step.
#[test]
fn the_first_step_has_the_length_of_the_learning_rate() {
    let build = |vb: VarBuilder| vb.get_with_hints(1, "w", Init::Const(2.0));
    let (_, parameters) = Parameters::draw(0, build).expect("drawn");
    let (_, var) = parameters.iter().next().expect("one weight");
    let loss = (var.as_tensor() * 1000.0)
        .and_then(|t| t.sum_all())
        .expect("a loss");
    let gradients = loss.backward().expect("derives");
    let step = StepSettings {
        learning_rate: 0.1,
        weight_decay: 0.5,
        clip_norm: 1.0,
    };
    let norm = AdamW::default()
        .step(&parameters, &gradients, step)
        .expect("steps");
    assert!((norm - 1000.0).abs() < 1e-6);
    let moved = var.to_vec1::<f32>().expect("a number")[0];
    assert!((moved - 1.9).abs() < 1e-6, "{moved}");
}
