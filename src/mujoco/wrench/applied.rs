//! The force of an instance at a state.

use hydro_frames::Wrench;

use super::{
    instance_effects::{Effects, held_with_effects, moves_water, with_sources},
    instances::carrying_body,
};
use crate::{
    mujoco::{
        bodies::hull,
        effects::{active_effects, forces},
        ffi::{DataView, ModelView},
    },
    plugin::{Base, Handle, LearnedForce},
};

/// The force of an instance's checkpoint, with its body and what else acts.
pub(crate) struct Applied {
    pub(crate) body: usize,
    pub(crate) wrench: Wrench,
    /// Degree of freedom and torque on it [N m; N of a slide].
    pub(crate) joints: Vec<(usize, f64)>,
    pub(crate) instance: Handle,
    /// The instances of the model that have effects.
    pub(crate) effects: Effects,
}

/// The force of an instance's checkpoint at the state of `data`: pure but for a note on a cold start.
/// Zero where there are effects alone.
pub(crate) fn applied(data: &mut DataView<'_>, id: usize) -> Option<Applied> {
    let (instance, effects) = held_with_effects(data, id)?;
    let body = carrying_body(data.model(), id)?;
    let mut force = LearnedForce::default();
    if let Some(learned) = instance.learned() {
        let mut moment_water = [0.0; 3];
        if moves_water(&effects) {
            moment_water = water_at(data, &effects, id, learned.features().base(), body);
        }
        let mut moment = data.moment();
        moment.water = moment_water;
        let state = &data.instance_state(id)[..instance.learned_len()];
        let wet = hull::submerged_part(data, instance.hulls(), instance.sea());
        force = learned.force(state, moment).scaled(wet);
        if let Some(scale) = active_effects::current().and_then(|active| active.wrench_scale) {
            let mut scaled = force.wrench.to_array();
            for (value, factor) in scaled.iter_mut().zip(scale) {
                *value *= factor;
            }
            force.wrench = Wrench::from_array(scaled);
        }
    }
    Some(Applied {
        body,
        wrench: force.wrench,
        joints: force.joints,
        instance,
        effects,
    })
}

/// Velocity that effects and the instance's own sea add to the water at the base, at the time of `data`, world [m/s].
pub(crate) fn water_at(
    data: &DataView<'_>,
    effects: &Effects,
    id: usize,
    base: &Base,
    body: usize,
) -> [f64; 3] {
    // At a step's end `xpos` is still that of its start.
    let at = match base {
        Base::Free { qpos, .. } => {
            let position = &data.qpos()[*qpos..*qpos + 3];
            [position[0], position[1], position[2]]
        }
        _ => ModelView::triple(data.xpos(), body),
    };
    let which = effects.iter().position(|of| of.id == id);
    with_sources(data, effects, |data, sources| {
        forces::added_water(data, sources, which, at, data.time())
    })
}

/// All that acts on the body: the checkpoint's wrench, and effects but for what is proportional to
/// acceleration.
pub(crate) fn total_wrench(data: &DataView<'_>, now: &Applied) -> Wrench {
    let mut sum = now.wrench.to_array();
    with_sources(data, &now.effects, |data, sources| {
        let effects = forces::on_body(data, sources, now.body);
        for (sum, more) in sum.iter_mut().zip(effects) {
            *sum += more;
        }
    });
    Wrench::from_array(sum)
}
