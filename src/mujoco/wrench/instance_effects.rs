//! The named effects of all instances of a model, and the one place where they are added to MuJoCo's forces.

use smallvec::SmallVec;

use super::{
    instances::instances,
    memory_fit::held,
    warned_once::{self, Cause},
};
use crate::{
    mujoco::{
        effects::{active_effects, forces::Additions, source::Source},
        ffi::{DataView, warn},
    },
    plugin::{Bound, Handle},
};

/// An instance that has effects.
pub(crate) struct InstanceEffects {
    /// Number of the instance in the model.
    pub(crate) id: usize,
    pub(crate) instance: Handle,
}

/// Number of instances that are kept without an allocation.
const FEW: usize = 4;

/// Instances that have effects, in MuJoCo's order.
pub(crate) type Effects = SmallVec<[InstanceEffects; FEW]>;

/// The instances that have effects, in MuJoCo's order.
pub(crate) fn with_effects(data: &mut DataView<'_>) -> Effects {
    with_effects_beside(data, None)
}

/// An instance, and [`with_effects`]: every instance is looked up once. `None` where the instance is put aside.
pub(crate) fn held_with_effects(data: &mut DataView<'_>, id: usize) -> Option<(Handle, Effects)> {
    let own = held(data, id)?;
    let effects = with_effects_beside(data, Some((id, &own)));
    Some((own, effects))
}

/// [`with_effects`], where one instance is at hand.
fn with_effects_beside(data: &mut DataView<'_>, own: Option<(usize, &Handle)>) -> Effects {
    let ids: SmallVec<[usize; FEW]> = instances(data.model()).collect();
    ids.into_iter()
        .filter_map(|id| {
            let instance = match own {
                Some((of, own)) if of == id => own.clone(),
                _ => held(data, id)?,
            };
            let acts = instance.effects().is_some();
            acts.then_some(InstanceEffects { id, instance })
        })
        .collect()
}

/// True where an effect or a sea moves the water.
pub(crate) fn moves_water(effects: &Effects) -> bool {
    let moves = |bound: &Bound| !bound.water.is_empty() || bound.sea.moves();
    active_effects::current().is_some_and(|active| moves(&active.bound))
        || effects
            .iter()
            .any(|of| of.instance.effects().is_some_and(moves))
}

/// Calls with the effects of all instances, then those that are active on this thread.
pub(crate) fn with_sources<T>(
    data: &DataView<'_>,
    instances: &[InstanceEffects],
    call: impl FnOnce(&DataView<'_>, &[Source<'_>]) -> T,
) -> T {
    let active = active_effects::current();
    let mut sources: SmallVec<[Source<'_>; FEW]> = SmallVec::new();
    for InstanceEffects { id, instance } in instances {
        let turned = active.and_then(|active| active.nominal.iter().find(|(of, _)| of == id));
        let Some(bound) = turned.map(|(_, bound)| bound).or(instance.effects()) else {
            continue;
        };
        sources.push(Source {
            bound,
            memory: &data.instance_state(*id)[instance.learned_len()..],
            commands_arrived: false,
        });
    }
    if let Some(active) = active {
        sources.push(Source {
            bound: &active.bound,
            memory: &active.memory,
            commands_arrived: true,
        });
    }
    call(data, &sources)
}

/// Adds all effects of a simulation to `qfrc_passive` and to the inertia matrix: in the callback of the
/// last that has any, so that the matrix is made once. `instance` is the plugin instance that asks; the
/// passive callback, which comes before all instances, is none.
pub(crate) fn add_once(data: &mut DataView<'_>, effects: &Effects, instance: Option<usize>) {
    if effects.last().map(|last| last.id) != instance {
        return;
    }
    let mut additions = with_sources(data, effects, |data, sources| {
        Additions::collect(data, sources)
    });
    if additions.fault.is_some() && active_effects::current().is_some() {
        // A hypothesis of `hydro gap` that has no force has no likelihood.
        additions.spoil();
    } else if let (Some(effect), Some(id)) = (additions.fault, instance)
        && warned_once::first_time(&data.plugin_data_mut()[id], Cause::NotFinite)
    {
        let text = format!(
            "plugin hydro.wrench: the force of effect `{effect}` is not a finite number at t = {} s; it counts as zero until \
             it is one again, for example after a reset",
            data.time()
        );
        warn(data.model().api(), &text);
    }
    additions.apply(data);
}
