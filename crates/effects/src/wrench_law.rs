//! Wrenches over dual numbers: an effect on a body writes its wrench once, and its value, its damping and its
//! derivatives by the parameters come from the same lines.

use nalgebra::Matrix6;
use num_dual::DualSVec64;

use crate::{
    BodyPart, Motion,
    card::LARGEST,
    dual::{Scalar, cross, sum},
    flow::Flow,
};

/// Most parameters that an effect on a body has.
const MOST_PARAMETERS: usize = 8;

/// Parameters, padded with zeros.
pub(crate) type Parameters<D> = [D; MOST_PARAMETERS];

/// A number with six derivatives: by the six velocities, or by six parameters.
type Dual6 = DualSVec64<6>;

/// An effect on a body over dual numbers; every such effect is a [`BodyPart`].
pub(crate) trait WrenchLaw {
    /// Length of the memory.
    const MEMORY_LEN: usize = 0;
    /// True where it adds inertia.
    const HAS_INERTIA: bool = false;
    /// False where the wrench does not depend on the present velocity.
    const DEPENDS_ON_VELOCITY: bool = true;

    /// [`BodyPart::wrench`] over dual numbers.
    fn dual_wrench<D: Scalar>(&self, p: &Parameters<D>, flow: &Flow<D>, memory: &[f64]) -> [D; 6];

    /// [`BodyPart::inertia`].
    fn added_inertia(&self, _p: &Parameters<f64>, _flow: &Flow<f64>) -> Option<Matrix6<f64>> {
        None
    }

    /// [`BodyPart::advance`].
    fn advance_memory(
        &self,
        _p: &Parameters<f64>,
        _flow: &Flow<f64>,
        _step: f64,
        _memory: &mut [f64],
    ) {
    }
}

/// A parameter, held so that no product of finite numbers overflows.
pub(crate) fn bounded(value: f64) -> f64 {
    value.clamp(-LARGEST, LARGEST)
}

fn padded<D: Scalar>(p: &[f64]) -> Parameters<D> {
    let mut padded = [D::from(0.0); MOST_PARAMETERS];
    for (place, &value) in padded.iter_mut().zip(p) {
        *place = D::from(bounded(value));
    }
    padded
}

impl<L: WrenchLaw> BodyPart for L {
    fn memory_len(&self) -> usize {
        L::MEMORY_LEN
    }

    fn has_inertia(&self) -> bool {
        L::HAS_INERTIA
    }

    fn wrench(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> [f64; 6] {
        WrenchLaw::dual_wrench(self, &padded(p), &Flow::bounded(motion), memory)
    }

    fn inertia(&self, p: &[f64], motion: &Motion) -> Option<Matrix6<f64>> {
        if !L::HAS_INERTIA {
            return None;
        }
        WrenchLaw::added_inertia(self, &padded(p), &Flow::bounded(motion))
    }

    fn damping(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Option<Matrix6<f64>> {
        if !L::DEPENDS_ON_VELOCITY {
            return None;
        }
        let mut flow = Flow::<Dual6>::bounded(motion);
        for axis in 0..3 {
            flow.linear[axis] = flow.linear[axis].derivative(axis);
            flow.angular[axis] = flow.angular[axis].derivative(axis + 3);
        }
        let wrench = WrenchLaw::dual_wrench(self, &padded(p), &flow, memory);
        let mut damping = Matrix6::zeros();
        for (row, component) in wrench.iter().enumerate() {
            if let Some(gradient) = &component.eps.0 {
                damping.set_row(row, &-gradient.transpose());
            }
        }
        Some(damping)
    }

    fn by_parameters(&self, p: &[f64], motion: &Motion, memory: &[f64]) -> Vec<[f64; 6]> {
        let count = p.len().min(MOST_PARAMETERS);
        let flow = Flow::<Dual6>::bounded(motion);
        let mut columns = vec![[0.0; 6]; p.len()];
        for first in (0..count).step_by(6) {
            let here = first..count.min(first + 6);
            let mut p = padded::<Dual6>(p);
            for index in here.clone() {
                p[index] = p[index].derivative(index - first);
            }
            let wrench = WrenchLaw::dual_wrench(self, &p, &flow, memory);
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
        if L::MEMORY_LEN > 0 {
            WrenchLaw::advance_memory(self, &padded(p), &Flow::bounded(motion), step, memory);
        }
    }

    fn remembers_motion_alone(&self) -> bool {
        true
    }
}

/// A force and a torque as six numbers.
pub(crate) fn force_and_torque<D: Scalar>(force: [D; 3], torque: [D; 3]) -> [D; 6] {
    let [fx, fy, fz] = force;
    let [tx, ty, tz] = torque;
    [fx, fy, fz, tx, ty, tz]
}

/// Force and torque about a point [m], as a wrench about the body's origin.
pub(crate) fn about_origin<D: Scalar>(force: [D; 3], torque: [D; 3], point: [D; 3]) -> [D; 6] {
    force_and_torque(force, sum(torque, cross(point, force)))
}
