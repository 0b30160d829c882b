//! Actuators that do not do what they are told: the difference of force, in joint space.
//!
//! MuJoCo gives no hook between a command and its force. What an actuator gives follows from its
//! parameters, so the difference to what it should give is known in the passive stage and is added
//! there: f'(u') - f(u), through the actuator's own moment arms.

use nalgebra::Vector3;

use super::source::Source;
use crate::{
    mujoco::{
        bodies::{
            fluid_loads,
            joint_space::{rotation, vector},
        },
        ffi::{
            DataView, ModelView,
            bindings::{mjBIAS_AFFINE, mjDSBL_ACTUATION, mjDSBL_CLAMPCTRL, mjGAIN_AFFINE},
            views::{NBIAS, NGAIN},
        },
    },
    plugin::bound::ChangedActuator,
};

/// The command that arrives, from the one that was given; memory is brought over the step.
pub(crate) fn arriving(
    changed: &ChangedActuator,
    mut command: f64,
    step: f64,
    memory: &mut [f64],
) -> f64 {
    for acting in &changed.acting {
        if let Some(part) = acting.actuator() {
            let memory = &mut memory[acting.memory.clone()];
            command = part.command(&acting.parameters, command, step, memory);
        }
    }
    command
}

/// The force to add at the actuator's output.
pub(crate) fn correction(
    data: &DataView<'_>,
    source: &Source<'_>,
    changed: &ChangedActuator,
    water: impl Fn(Vector3<f64>) -> Vector3<f64>,
) -> f64 {
    let model = data.model();
    let option = &model.raw().opt;
    let group = model.actuator_group()[changed.actuator];
    let disabled = (0..31).contains(&group) && option.disableactuator & (1 << group) != 0;
    if disabled || option.disableflags & mjDSBL_ACTUATION as i32 != 0 {
        return 0.0;
    }
    let given = data.ctrl()[changed.control];
    let arrived = if source.commands_arrived {
        given
    } else {
        let mut memory = source.memory.to_vec();
        arriving(changed, given, option.timestep, &mut memory)
    };
    let nominal = force(data, changed, given);
    let parts = || {
        let acting = changed.acting.iter();
        acting.filter_map(|acting| Some((acting.actuator()?, &acting.parameters)))
    };
    let real = parts().fold(force(data, changed, arrived), |real, (part, parameters)| {
        part.force(parameters, real)
    });
    // Speed of advance along the thrust that is given.
    let inflow = changed.thrust.map_or(0.0, |(site, direction)| {
        let at = vector(data.site_xpos(), site);
        let body = model.site_bodyid()[site] as usize;
        let (linear, _) = fluid_loads::velocity(data, body, at);
        let along = rotation(data.site_xmat(), site) * Vector3::from(direction);
        let advance = along.dot(&(linear - water(at)));
        if real < 0.0 { -advance } else { advance }
    });
    let factor: f64 = parts()
        .map(|(part, parameters)| part.force_factor(parameters, inflow))
        .product();
    factor * real - nominal
}

/// Force of an actuator with this control [N or N m], after its limits.
fn force(data: &DataView<'_>, changed: &ChangedActuator, control: f64) -> f64 {
    let model = data.model();
    let raw = model.raw();
    let (id, output) = (changed.actuator, changed.output);
    let clamp = |value: f64, range: &[f64]| value.max(range[0]).min(range[1]);
    // SAFETY: one flag a control, and one an actuator.
    let (control_is_limited, force_is_limited) = unsafe {
        (
            ModelView::flag(raw.actuator_ctrllimited, changed.control),
            ModelView::flag(raw.actuator_forcelimited, id),
        )
    };
    let mut input = control;
    if control_is_limited && raw.opt.disableflags & mjDSBL_CLAMPCTRL as i32 == 0 {
        let at = 2 * changed.control;
        input = clamp(input, &model.actuator_ctrlrange()[at..at + 2]);
    }
    if let Ok(first) = usize::try_from(model.actuator_actadr()[id]) {
        input = data.act()[first + model.actuator_actnum()[id] as usize - 1];
    }
    let (length, velocity) = (
        data.actuator_length()[output],
        data.actuator_velocity()[output],
    );
    let affine = |prm: &[f64]| prm[0] + prm[1] * length + prm[2] * velocity;
    let gain = &model.actuator_gainprm()[NGAIN * id..][..3];
    let bias = &model.actuator_biasprm()[NBIAS * id..][..3];
    let mut force = input
        * if model.actuator_gaintype()[id] as u32 == mjGAIN_AFFINE {
            affine(gain)
        } else {
            gain[0]
        };
    if model.actuator_biastype()[id] as u32 == mjBIAS_AFFINE {
        force += affine(bias);
    }
    if force_is_limited {
        force = clamp(force, &model.actuator_forcerange()[2 * id..2 * id + 2]);
    }
    force
}

/// The generalised forces of a force at an output.
pub(crate) fn in_joint_space(
    data: &DataView<'_>,
    output: usize,
    force: f64,
    forces: &mut Vec<(usize, f64)>,
) {
    if force == 0.0 {
        return;
    }
    let start = data.moment_rowadr()[output] as usize;
    let row = start..start + data.moment_rownnz()[output] as usize;
    for (dof, arm) in data.moment_colind()[row.clone()]
        .iter()
        .zip(&data.actuator_moment()[row])
    {
        forces.push((*dof as usize, arm * force));
    }
}
