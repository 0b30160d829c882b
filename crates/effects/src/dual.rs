//! Dual numbers and vectors of them: arithmetic that carries derivatives along.

use num_dual::DualNum;

/// A real number, or one that carries derivatives along.
pub(crate) trait Scalar: DualNum<Primitive = f64> + Copy {}
impl<D: DualNum<Primitive = f64> + Copy> Scalar for D {}

/// The value without its derivatives.
pub(crate) fn real<D: Scalar>(x: D) -> f64 {
    x.re()
}

/// `|x| x`, with the derivative 2 |x|.
pub(crate) fn signed_square<D: Scalar>(x: D) -> D {
    if real(x) < 0.0 { -(x * x) } else { x * x }
}

/// `a x b`.
pub(crate) fn cross<D: Scalar>(a: [D; 3], b: [D; 3]) -> [D; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `a . b`.
pub(crate) fn dot<D: Scalar>(a: [D; 3], b: [D; 3]) -> D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + b`.
pub(crate) fn sum<D: Scalar>(a: [D; 3], b: [D; 3]) -> [D; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Product component by component.
pub(crate) fn times<D: Scalar>(a: [D; 3], b: [D; 3]) -> [D; 3] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

/// `factor a`.
pub(crate) fn scaled<D: Scalar>(factor: D, a: [D; 3]) -> [D; 3] {
    a.map(|component| factor * component)
}

/// Numbers without derivatives.
pub(crate) fn constant<D: Scalar>(a: [f64; 3]) -> [D; 3] {
    a.map(D::from)
}
