//! The memory of an instance held against the memory that its model was compiled for.
//!
//! A model says how many numbers of state an instance has. What the attributes name may be replaced afterwards, by a checkpoint
//! with a longer memory, say: data made before go on with the old weights, and data made later are refused here.

use super::instances::{self, BROKEN};
use crate::{
    mujoco::{
        effects::bind,
        ffi::{DataView, ModelView, warn},
    },
    plugin::{Handle, Instance, Settings},
};

/// Numbers of memory of effects, of a potential flow and of a current that is random or set by a program; `None` where their texts are at fault.
pub(super) fn effects_len(settings: &Settings, step: f64) -> Option<usize> {
    let effects = match &settings.effects {
        Some(text) => bind::memory_len(text, step)?,
        None => 0,
    };
    let flow = settings.potential_flow().ok()?;
    let current = settings.current_field().ok()?;
    Some(
        effects
            + flow.map_or(0, |flow| flow.state_len())
            + current.map_or(0, |current| current.state_len()),
    )
}

/// Reason why an instance does not fit its model's memory.
pub(super) fn fault(model: ModelView<'_>, id: usize, instance: &Instance) -> Option<String> {
    let step = model.raw().opt.timestep;
    let effects = effects_len(instance.settings(), step)?;
    let needed = instance.learned_len() + effects;
    let compiled = usize::try_from(model.plugin_statenum()[id]).unwrap_or(0);
    // A step that was made longer after compiling leaves an effect's memory too long, which does no harm.
    if needed == compiled || (effects > 0 && needed < compiled) {
        return None;
    }
    Some(format!(
        "plugin hydro.wrench: its memory takes {needed} numbers, the model was compiled for {compiled}: the checkpoint, the \
         effects or the timestep was replaced since; compile the model again"
    ))
}

/// The instance behind `plugin_data`. One that was made again and does not fit is put aside, with one warning.
pub(super) fn held(data: &mut DataView<'_>, id: usize) -> Option<Handle> {
    let before = data.plugin_data()[id];
    let instance = instances::held(data, id)?;
    if data.plugin_data()[id] == before {
        return Some(instance);
    }
    let model = data.model();
    let Some(fault) = fault(model, id, &instance) else {
        return Some(instance);
    };
    data.plugin_data_mut()[id] = BROKEN;
    warn(
        model.api(),
        &format!("{fault}. The wrench of this instance is zero from now on"),
    );
    None
}
