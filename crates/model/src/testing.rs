//! Helpers of the tests of models.

use candle_core::{DType, Device, Result, Tensor, Var};
use candle_nn::VarBuilder;

use crate::parameters::Parameters;

/// Numbers in (-1, 1) that repeat from run to run: sin((i + 1) step).
pub(crate) fn ramp(shape: &[usize], step: f64) -> Tensor {
    let count: usize = shape.iter().product();
    let values: Vec<f64> = (0..count).map(|i| ((i + 1) as f64 * step).sin()).collect();
    Tensor::from_vec(values, shape, &Device::Cpu).expect("shape fits")
}

/// All numbers of a tensor.
pub(crate) fn numbers(tensor: &Tensor) -> Vec<f64> {
    tensor
        .flatten_all()
        .and_then(|t| t.to_vec1::<f64>())
        .expect("numbers")
}

/// A sum of squares with a different weight for every number.
pub(crate) fn weighted(tensor: &Tensor) -> Tensor {
    (tensor.sqr().expect("squares") * ramp(tensor.dims(), 0.31))
        .and_then(|t| t.sum_all())
        .expect("a loss")
}

/// A model in f64 with generic weights; the weights by name.
pub(crate) fn in_f64<M>(build: impl Fn(VarBuilder) -> Result<M>) -> (M, Vec<(String, Var)>) {
    let (_, drawn) = Parameters::draw(3, &build).expect("drawn");
    let vars: Vec<(String, Var)> = drawn
        .iter()
        .enumerate()
        .map(|(i, (name, var))| {
            let values = (ramp(var.dims(), 0.37 + i as f64) * 0.5).expect("scaled");
            let var = Var::from_tensor(&values).expect("a variable");
            (name.to_owned(), var)
        })
        .collect();
    let tensors = vars
        .iter()
        .map(|(name, var)| (name.clone(), var.as_tensor().clone()))
        .collect();
    let vb = VarBuilder::from_tensors(tensors, DType::F64, &Device::Cpu);
    (build(vb).expect("built"), vars)
}

/// Holds the gradient of `loss`, one element a weight, to central differences.
pub(crate) fn check_gradient(vars: &[(String, Var)], loss: impl Fn() -> Tensor) {
    let gradients = loss().backward().expect("derives");
    for (name, var) in vars {
        let gradient = numbers(gradients.get(var).expect(name));
        let base = numbers(var);
        let index = base.len() / 2;
        let at = |shift: f64| {
            let mut values = base.clone();
            values[index] += shift;
            let moved = Tensor::from_vec(values, var.shape(), &Device::Cpu).expect("fits");
            var.set(&moved).expect("set");
            loss().to_scalar::<f64>().expect("a number")
        };
        // Steps of cube-root precision.
        let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
        at(0.0);
        let error = (slope - gradient[index]).abs();
        assert!(
            error < 1e-6 * slope.abs().max(1.0),
            "{name}: {slope} against {}",
            gradient[index]
        );
    }
}
