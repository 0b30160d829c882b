//! The engine plugin `hydro.wrench`: MuJoCo's callbacks, each a thin shim over [`LearnedWrench`].
//!
//! Capabilities: passive force (the wrench is added to `qfrc_passive`) and sensor (six numbers, force
//! and torque in the base frame). Neither feeds the other: each evaluates the pure
//! [`LearnedWrench::wrench`] and the effects from the plugin state. The sensor belongs to the velocity stage,
//! since it needs positions, velocities and time only.

use std::ffi::{CStr, c_char, c_int, c_void};

use hydro_frames::Wrench;

use super::{
    applied::{applied, total_wrench, water_at},
    arrows,
    instance_effects::{self, held_with_effects, moves_water, with_sources},
    instances::{self, BROKEN, carrying_body, set_up, settings},
    memory_fit, origins, submerged,
    told_once::tell_once,
    warned_once::{self, Cause},
};
use crate::{
    mujoco::{
        bodies::joint_space,
        effects::forces,
        ffi::{
            Api, DataView, ModelView,
            bindings::{
                mjData, mjModel, mjPLUGIN_PASSIVE, mjPLUGIN_SENSOR, mjSTAGE_VEL, mjpPlugin, mjtNum,
            },
            guard, last_refusal,
            views::view_mut,
            warn,
        },
    },
    plugin::{
        InstanceKey, LearnedWrench, Notice, Registry, attribute_table::WRENCH, learned_wrench,
    },
};

/// Name in the `plugin=` attribute.
const NAME: &CStr = c"hydro.wrench";

/// Steps of a model that can be meant [s]; a sample stands on a grid of such steps.
const STEPS: std::ops::RangeInclusive<f64> = 1e-9..=1e3;

/// Characters of a refusal at most.
const LONGEST: usize = 900;

/// Numbers that the sensor reports: force x y z, torque x y z, base frame.
const SENSOR_LEN: c_int = 6;

/// Registers the plugin, unless one of this name is there already: MuJoCo ends the process where a
/// second build of the same plugin registers from another path. False where one was there.
pub(crate) fn register(api: &'static Api) -> bool {
    let mut slot: c_int = -1;
    // SAFETY: a static C string and a place for the slot.
    let known = unsafe { (api.functions.mjp_getPlugin)(NAME.as_ptr(), &mut slot) };
    if known.is_null() {
        let mut names: Vec<*const c_char> = WRENCH
            .iter()
            .map(|attribute| attribute.name.as_ptr())
            .collect();
        // SAFETY: all zero is a valid table (null pointers, no flags); MuJoCo fills its defaults.
        let mut table: mjpPlugin = unsafe { std::mem::zeroed() };
        // SAFETY: a table to write to.
        unsafe { (api.functions.mjp_defaultPlugin)(&mut table) };
        table.name = NAME.as_ptr();
        table.nattribute = names.len() as c_int;
        table.attributes = names.as_mut_ptr().cast();
        table.capabilityflags = (mjPLUGIN_PASSIVE | mjPLUGIN_SENSOR) as c_int;
        table.needstage = mjSTAGE_VEL as c_int;
        table.nstate = Some(nstate);
        table.nsensordata = Some(nsensordata);
        table.init = Some(init);
        table.destroy = Some(destroy);
        table.reset = Some(reset);
        table.compute = Some(compute);
        table.advance = Some(advance);
        table.visualize = Some(arrows::visualize);
        // SAFETY: MuJoCo copies the table and its strings before it returns.
        slot = unsafe { (api.functions.mjp_registerPlugin)(&table) };
    }
    instances::set_slot(slot);
    if known.is_null() {
        submerged::set_acting();
    }
    known.is_null()
}

unsafe extern "C" fn nstate(m: *const mjModel, id: c_int) -> c_int {
    guard("nstate", 0, || {
        // SAFETY: MuJoCo passes a model that lives through the call.
        let model = Api::get().and_then(|api| unsafe { ModelView::new(m, api) });
        let len = model.and_then(|model| {
            // A fault is reported by `init`, which MuJoCo calls next.
            let settings = settings(model, id as usize).ok()?;
            let step = model.raw().opt.timestep;
            let mut len = memory_fit::effects_len(&settings, step)?;
            if let Some(folder) = &settings.checkpoint {
                let checkpoint = Registry::global().checkpoint(folder).ok()?;
                let engine = Registry::global().engine(&checkpoint, &settings).ok()?;
                len += learned_wrench::state_len(&*engine);
            }
            Some(len)
        });
        len.map_or(0, |len| len as c_int)
    })
}

unsafe extern "C" fn nsensordata(_: *const mjModel, _: c_int, _: c_int) -> c_int {
    SENSOR_LEN
}

unsafe extern "C" fn init(m: *const mjModel, d: *mut mjData, id: c_int) -> c_int {
    guard("init", -1, || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
            return -1;
        };
        let id = id as usize;
        let model = data.model();
        let step = model.raw().opt.timestep;
        let set_up = match STEPS.contains(&step) {
            true => set_up(model, id),
            false => Err(format!(
                "plugin hydro.wrench: the timestep of <option> is {} s, expected from {:e} to {} s",
                hydro_files::number(step),
                STEPS.start(),
                STEPS.end()
            )),
        };
        match set_up {
            Ok((key, instance)) => {
                if let Some(fault) = memory_fit::fault(model, id, &instance) {
                    Registry::global().release(key);
                    last_refusal::remember(&fault);
                    warn(model.api(), &fault);
                    return -1;
                }
                origins::remember(model, id, key);
                data.plugin_data_mut()[id] = key.to_bits() as usize;
                warned_once::forget(&data.plugin_data_mut()[id]);
                for note in instance
                    .effects()
                    .into_iter()
                    .flat_map(|bound| &bound.notes)
                {
                    tell_once(model.api(), note);
                }
                if let Some(learned) = instance.learned() {
                    if let Some(note) = learned.settings().engine.note() {
                        tell_once(model.api(), note);
                    }
                    for notice in learned.notices_at_load(model.has_fluid()) {
                        tell(model, learned, notice, 0.0);
                    }
                }
                0
            }
            Err(refusal) => {
                // An attribute may be of any length, and MuJoCo's own buffer is of a thousand.
                let refusal = hydro_files::one_line(refusal, LONGEST);
                last_refusal::remember(&refusal);
                warn(model.api(), &refusal);
                -1
            }
        }
    })
}

/// Warns of a notice.
fn tell(model: ModelView<'_>, learned: &LearnedWrench, notice: Notice, time: f64) {
    let text = notice.text(time, model.raw().opt.timestep, learned.sample_period());
    warn(model.api(), &format!("plugin hydro.wrench: {text}"));
}

unsafe extern "C" fn destroy(d: *mut mjData, id: c_int) {
    guard("destroy", (), || {
        // SAFETY: MuJoCo passes a data whose plugin fields are still there.
        let Some(data) = (unsafe { d.as_mut() }) else {
            return;
        };
        // SAFETY: `nplugin` numbers, of which `id` is one.
        let all = unsafe { view_mut(data.plugin_data, data.nplugin) };
        warned_once::forget(&all[id as usize]);
        let bits = std::mem::take(&mut all[id as usize]);
        if bits != BROKEN
            && let Some(key) = InstanceKey::from_bits(bits as u64)
        {
            Registry::global().release(key);
        }
    });
}

unsafe extern "C" fn reset(m: *const mjModel, state: *mut mjtNum, _: *mut c_void, id: c_int) {
    guard("reset", (), || {
        // SAFETY: MuJoCo passes the model and the state of this instance.
        let Some(model) = Api::get().and_then(|api| unsafe { ModelView::new(m, api) }) else {
            return;
        };
        // SAFETY: as many numbers as the model says.
        LearnedWrench::reset(unsafe { view_mut(state, model.plugin_statenum()[id as usize]) });
    });
}

unsafe extern "C" fn compute(m: *const mjModel, d: *mut mjData, id: c_int, capability: c_int) {
    guard("compute", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
            return;
        };
        let Some(now) = applied(&mut data, id as usize) else {
            return;
        };
        if capability == mjPLUGIN_PASSIVE as c_int {
            if let Some(learned) = now.instance.learned() {
                let base = learned.features().base();
                joint_space::add_to_passive(&mut data, now.body, base, now.wrench);
                joint_space::add_torques(&mut data, &now.joints);
            }
            if now.instance.effects().is_some() {
                instance_effects::add_once(&mut data, &now.effects, Some(id as usize));
            }
        } else {
            let wrench = total_wrench(&data, &now);
            report(&mut data, id, wrench);
        }
    });
}

/// Writes the wrench to every sensor of the instance.
fn report(data: &mut DataView<'_>, id: c_int, wrench: Wrench) {
    let model = data.model();
    for (sensor, of) in model.sensor_plugin().iter().enumerate() {
        if *of == id {
            let at = model.sensor_adr()[sensor] as usize;
            data.sensordata_mut()[at..at + SENSOR_LEN as usize].copy_from_slice(&wrench.to_array());
        }
    }
}

unsafe extern "C" fn advance(m: *const mjModel, d: *mut mjData, id: c_int) {
    guard("advance", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { DataView::from_callback(m, d) }) else {
            return;
        };
        let id = id as usize;
        let Some((instance, effects)) = held_with_effects(&mut data, id) else {
            return;
        };
        let start = instance.learned_len();
        if data.instance_state(id).len() > start {
            let mut memory = data.instance_state(id)[start..].to_vec();
            if let Some(which) = effects.iter().position(|of| of.id == id) {
                with_sources(&data, &effects, |data, sources| {
                    forces::advance_memory(data, sources, which, &mut memory);
                });
            }
            let (state, _) = data.plugin_state_and_moment(id);
            state[start..].copy_from_slice(&memory);
        }
        let Some(learned) = instance.learned() else {
            return;
        };
        let mut water = [0.0; 3];
        if moves_water(&effects)
            && let Some(body) = carrying_body(data.model(), id)
        {
            water = water_at(&data, &effects, id, learned.features().base(), body);
        }
        let (state, mut moment) = data.plugin_state_and_moment(id);
        moment.water = water;
        let (notice, time) = (learned.advance(&mut state[..start], moment), moment.time);
        let again = matches!(notice, Some(Notice::OutOfRange(_)))
            && !warned_once::first_time(&data.plugin_data_mut()[id], Cause::OutOfRange);
        if let Some(notice) = notice.filter(|_| !again) {
            tell(data.model(), learned, notice, time);
        }
    });
}
