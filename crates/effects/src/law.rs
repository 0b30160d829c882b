//! A wrench written once, over dual numbers: its value, its damping and its sensitivities to parameters
//! come from the same lines.

use nalgebra::Matrix6;
use num_dual::{DualNum, DualSVec64};

use super::{BodyPart, flow::Flow, motion::Motion};

/// A real number, or one that carries derivatives along.
pub(super) trait Scalar: DualNum<Primitive = f64> + Copy {}
impl<D: DualNum<Primitive = f64> + Copy> Scalar for D {}

/// Room for parameters; no effect on a body has more.
pub(super) const ROOM: usize = 8;

/// Parameters, the ones that an effect does not have being zero.
pub(super) type Parameters<D> = [D; ROOM];

/// Greatest magnitude of a parameter, so that no product of finite numbers overflows.
const LARGEST_PARAMETER: f64 = 1e9;

/// Six derivatives at once: with respect to the six velocities, or to six parameters.
type Dual6 = DualSVec64<6>;

/// What [`BodyPart`] asks for, with the derivatives left to dual numbers.
pub(super) trait Law {
    /// Numbers of memory.
    const MEMORY: usize = 0;
    /// True where it has inertia.
    const INERT: bool = false;
    /// False where the wrench does not depend on velocity.
    const DAMPS: bool = true;

    /// As [`BodyPart::wrench`].
    fn law<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, memory: &[f64]) -> [D; 6];

    /// As [`BodyPart::inertia`].
    fn added_inertia(&self, _p: &Parameters<f64>, _flow: &Flow<f64>) -> Option<Matrix6<f64>> {
        None
    }

    /// As [`BodyPart::advance`].
    fn remember(&self, _p: &Parameters<f64>, _flow: &Flow<f64>, _step: f64, _memory: &mut [f64]) {}
}

fn bounded(value: f64) -> f64 {
    value.clamp(-LARGEST_PARAMETER, LARGEST_PARAMETER)
}

fn padded<D: Scalar>(p: &[f64]) -> Parameters<D> {
    let mut padded = [D::from(0.0); ROOM];
    for (place, &value) in padded.iter_mut().zip(p) {
        *place = D::from(bounded(value));
    }
    padded
}

impl<L: Law> BodyPart for L {
    fn memory_len(&self) -> usize {
        L::MEMORY
    }

    fn wrench(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> [f64; 6] {
        Law::law(self, &padded(p), &Flow::of(motion), memory)
    }

    fn inertia(&self, p: &[f64], motion: &Motion) -> Option<Matrix6<f64>> {
        if !L::INERT {
            return None;
        }
        Law::added_inertia(self, &padded(p), &Flow::of(motion))
    }

    fn damping(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Option<Matrix6<f64>> {
        if !L::DAMPS {
            return None;
        }
        let mut flow = Flow::<Dual6>::of(motion);
        for axis in 0..3 {
            flow.linear[axis] = flow.linear[axis].derivative(axis);
            flow.angular[axis] = flow.angular[axis].derivative(axis + 3);
        }
        let wrench = Law::law(self, &padded(p), &flow, memory);
        let mut damping = Matrix6::zeros();
        for (row, component) in wrench.iter().enumerate() {
            if let Some(gradient) = &component.eps.0 {
                damping.set_row(row, &-gradient.transpose());
            }
        }
        Some(damping)
    }

    fn by_parameters(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Vec<[f64; 6]> {
        let count = p.len().min(ROOM);
        let flow = Flow::<Dual6>::of(motion);
        let mut columns = vec![[0.0; 6]; p.len()];
        for first in (0..count).step_by(6) {
            let here = first..count.min(first + 6);
            let mut p = padded::<Dual6>(p);
            for index in here.clone() {
                p[index] = p[index].derivative(index - first);
            }
            let wrench = Law::law(self, &p, &flow, memory);
            for (row, component) in wrench.iter().enumerate() {
                if let Some(gradient) = &component.eps.0 {
                    for index in here.clone() {
                        columns[index][row] = gradient[index - first];
                    }
                }
            }
        }
        columns
    }

    fn advance(&self, p: &[f64], motion: &Motion, step: f64, memory: &mut [f64]) {
        if L::MEMORY > 0 {
            Law::remember(self, &padded(p), &Flow::of(motion), step, memory);
        }
    }
}

/// The value alone.
pub(super) fn real<D: Scalar>(x: D) -> f64 {
    x.re()
}

/// `|x| x`, with the derivative 2 |x|.
pub(super) fn signed_square<D: Scalar>(x: D) -> D {
    if real(x) < 0.0 { -(x * x) } else { x * x }
}

/// `a x b`.
pub(super) fn cross<D: Scalar>(a: [D; 3], b: [D; 3]) -> [D; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// `a . b`.
pub(super) fn dot<D: Scalar>(a: [D; 3], b: [D; 3]) -> D {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + b`.
pub(super) fn sum<D: Scalar>(a: [D; 3], b: [D; 3]) -> [D; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Component by component.
pub(super) fn times<D: Scalar>(a: [D; 3], b: [D; 3]) -> [D; 3] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

/// `factor a`.
pub(super) fn scaled<D: Scalar>(factor: D, a: [D; 3]) -> [D; 3] {
    a.map(|component| factor * component)
}

/// Plain numbers as scalars.
pub(super) fn constant<D: Scalar>(a: [f64; 3]) -> [D; 3] {
    a.map(D::from)
}

/// Force and torque side by side.
pub(super) fn wrench_of<D: Scalar>(force: [D; 3], torque: [D; 3]) -> [D; 6] {
    let [fx, fy, fz] = force;
    let [tx, ty, tz] = torque;
    [fx, fy, fz, tx, ty, tz]
}

/// Force and torque about a point [m], as a wrench about the body's origin.
pub(super) fn about_origin<D: Scalar>(force: [D; 3], torque: [D; 3], point: [D; 3]) -> [D; 6] {
    wrench_of(force, sum(torque, cross(point, force)))
}
