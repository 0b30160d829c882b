//! Prescribed motion in a simulation: states are set, and the generalised force that gives the imposed acceleration is found.

use std::sync::Arc;

use hydro_gap::plant::prescribed::PrescribedMotion;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::mujoco::{
    bodies::joint_space::last_dof,
    ffi::ModelView,
    simulator::{Data, Model},
};

/// A motion that is imposed on a model.
#[derive(Debug)]
pub(crate) struct Imposed {
    motion: Arc<PrescribedMotion>,
    /// The heaviest body that each degree of freedom carries, or that moves with it.
    carried: Vec<usize>,
}

impl Imposed {
    pub(crate) fn new(model: &Model, motion: Arc<PrescribedMotion>) -> Self {
        let view = model.view();
        let carried = (0..model.nv()).map(|dof| heaviest(view, dof)).collect();
        Self { motion, carried }
    }

    /// Sets the imposed positions and velocities of the present time. `held`: positions of what stands still.
    pub(crate) fn set(&self, data: &mut Data, held: Option<&[f64]>) {
        let time = data.time();
        let mut qpos = data.qpos().to_vec();
        let mut qvel = data.qvel().to_vec();
        if let Some(held) = held.filter(|_| self.motion.holds_the_rest) {
            qpos.copy_from_slice(held);
        }
        self.motion.impose(time, &mut qpos, &mut qvel);
        data.qpos_mut().copy_from_slice(&qpos);
        data.qvel_mut().copy_from_slice(&qvel);
    }

    /// Applies the force along the imposed degrees of freedom that gives them their acceleration, whatever else acts. `force`:
    /// unmodelled generalised forces [nv], empty for none; those along imposed degrees of freedom act on the bodies that these
    /// carry. `forward` brings accelerations up to date.
    ///
    /// Accelerations are linear in the force but for contacts and dry friction that it makes or breaks.
    pub(crate) fn drive(&self, data: &mut Data, force: &[f64], forward: &dyn Fn(&mut Data)) {
        let time = data.time();
        let wanted = self.motion.accelerations(time, data.qvel().len());
        data.xfrc_applied_mut().fill(0.0);
        for (dof, _) in &wanted {
            data.qfrc_applied_mut()[*dof] = 0.0;
        }
        forward(data);
        if self.load_bodies(data, &wanted, force) {
            forward(data);
        }
        let n = wanted.len();
        let accelerations = |data: &Data| {
            DVector::from_iterator(n, wanted.iter().map(|(dof, _)| data.qacc()[*dof]))
        };
        let free = accelerations(data);
        let lacking = DVector::from_iterator(n, wanted.iter().map(|(_, wanted)| *wanted)) - &free;
        let mut mobility = DMatrix::zeros(n, n);
        for (at, (dof, _)) in wanted.iter().enumerate() {
            data.qfrc_applied_mut()[*dof] = 1.0;
            forward(data);
            mobility.set_column(at, &(accelerations(data) - &free));
            data.qfrc_applied_mut()[*dof] = 0.0;
        }
        // Without one, a degree of freedom has no inertia: the simulation is about to blow up by itself.
        if let Some(found) = mobility.lu().solve(&lacking) {
            for ((dof, _), value) in wanted.iter().zip(found.iter()) {
                data.qfrc_applied_mut()[*dof] = *value;
            }
        }
    }

    /// Puts unmodelled forces along imposed degrees of freedom on bodies: a force along a slide, a torque about a hinge. False
    /// where there are none.
    fn load_bodies(&self, data: &mut Data, wanted: &[(usize, f64)], force: &[f64]) -> bool {
        let mut any = false;
        for (dof, _) in wanted {
            let size = force.get(*dof).copied().unwrap_or(0.0);
            if size == 0.0 {
                continue;
            }
            any = true;
            // Axis of rotation, then velocity of the tree's centre of mass, in the world.
            let axis = &data.cdof()[6 * dof..6 * dof + 6];
            let turn = Vector3::new(axis[0], axis[1], axis[2]);
            let (way, first) = match turn.norm() > 0.5 {
                true => (turn, 3),
                false => (Vector3::new(axis[3], axis[4], axis[5]), 0),
            };
            let at = 6 * self.carried[*dof] + first;
            for (sum, value) in data.xfrc_applied_mut()[at..at + 3]
                .iter_mut()
                .zip(way.iter())
            {
                *sum += size * value;
            }
        }
        any
    }
}

/// The heaviest of the bodies that a degree of freedom moves; of equals the first.
fn heaviest(model: ModelView<'_>, dof: usize) -> usize {
    let moves = |body: usize| {
        let mut last = last_dof(model, body);
        while last > dof as i32 {
            last = model.dof_parentid()[last as usize];
        }
        last == dof as i32
    };
    let bodies = (1..model.bodies()).filter(|body| moves(*body));
    let heavier = |best: Option<usize>, body: usize| match best {
        Some(best) if model.body_mass()[best] >= model.body_mass()[body] => Some(best),
        _ => Some(body),
    };
    bodies.fold(None, heavier).unwrap_or(0)
}
