//! The engine plugin `hydro.wrench`: MuJoCo's callbacks, each a thin shim over [`Instance`].
//!
//! Capabilities: passive force (the wrench is added to `qfrc_passive`) and sensor (six numbers, force
//! and torque in the base frame). Neither feeds the other: each evaluates the pure
//! [`Instance::wrench`] and the effects from the plugin state. The sensor belongs to the velocity stage,
//! since it needs positions, velocities and time only.

use std::{
    ffi::{CStr, c_char, c_int, c_void},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicI32, Ordering},
    },
};

use hydro_effects::{EffectSet, Entry};
use hydro_frames::Wrench;

use super::{
    api::{Api, own_folder},
    apply, arrows, bind,
    bindings::{
        mjData, mjModel, mjOBJ_BODY, mjOBJ_PLUGIN, mjPLUGIN_PASSIVE, mjPLUGIN_SENSOR, mjSTAGE_VEL,
        mjpPlugin, mjtNum,
    },
    boundary::guard,
    describe, effect_forces,
    effect_forces::Source,
    run, scale,
    views::{DataView, ModelView, view_mut},
    warn::warn,
};
use crate::plugin::{
    Base, Bound, Carrier, Handle, Instance, InstanceKey, Notice, Registry, Settings, SetupError,
    attributes, instance, search::SearchPath,
};

/// Name in the `plugin=` attribute.
pub(super) const NAME: &CStr = c"hydro.wrench";

/// Numbers that the sensor reports: force x y z, torque x y z, base frame.
const SENSOR_LEN: c_int = 6;

/// `plugin_data` of an instance that could not be made again: zero wrench from then on.
const BROKEN: usize = usize::MAX;

/// The slot that MuJoCo gave; -1: not registered.
static SLOT: AtomicI32 = AtomicI32::new(-1);

/// Why the latest instance was refused, for the error of a load that this process asked for.
static LAST_REFUSAL: Mutex<Option<String>> = Mutex::new(None);

/// Keeps the reason of a refusal.
pub(super) fn remember_refusal(reason: &str) {
    LAST_REFUSAL
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .replace(reason.to_owned());
}

/// Takes the reason of the latest refusal.
pub(super) fn take_refusal() -> Option<String> {
    LAST_REFUSAL
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .take()
}

/// Registers the plugin, unless one of this name is there already: MuJoCo ends the process where a
/// second build of the same plugin registers from another path.
pub(super) fn register(api: &'static Api) {
    let mut slot: c_int = -1;
    // SAFETY: a static C string and a place for the slot.
    let known = unsafe { (api.functions.mjp_getPlugin)(NAME.as_ptr(), &mut slot) };
    if known.is_null() {
        let mut names: Vec<*const c_char> = ATTRIBUTES.iter().map(|name| name.as_ptr()).collect();
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
    SLOT.store(slot, Ordering::Relaxed);
}

/// [`attributes::NAMES`] as C strings; a test holds the two together.
const ATTRIBUTES: [&CStr; attributes::NAMES.len()] = [
    c"checkpoint",
    c"effects",
    c"density",
    c"waterline",
    c"current",
    c"joints",
    c"solver",
    c"engine",
    c"initial_force",
    c"wrench_scale",
];

/// The instances of this plugin in a model.
pub(super) fn instances(model: ModelView<'_>) -> impl Iterator<Item = usize> {
    let slot = SLOT.load(Ordering::Relaxed);
    model
        .plugin()
        .iter()
        .enumerate()
        .filter(move |(_, of)| **of == slot)
        .map(|(instance, _)| instance)
}

/// Names of the bodies that carry the instances, in their order.
pub(super) fn carrying_bodies(model: ModelView<'_>) -> Vec<String> {
    instances(model)
        .map(|instance| {
            body_of(model, instance).map_or_else(String::new, |body| {
                model.label(mjOBJ_BODY as i32, "body", body)
            })
        })
        .collect()
}

/// What the checkpoint of an instance puts on its body now.
pub(super) struct Applied {
    pub(super) body: usize,
    pub(super) wrench: Wrench,
    carrier: Handle,
}

/// The wrench of an instance's checkpoint at the state of `data`: pure but for a note on a cold start.
/// Zero where there are effects alone.
pub(super) fn applied(data: &mut DataView<'_>, id: usize) -> Option<Applied> {
    let carrier = held(data, id)?;
    let body = body_of(data.model(), id)?;
    let mut wrench = Wrench::default();
    if let Some(learned) = carrier.learned() {
        let mut moment_water = [0.0; 3];
        if water_moves(data) {
            moment_water = water_at(data, learned.features().base(), body);
        }
        let mut moment = data.moment();
        moment.water = moment_water;
        let state = &data.instance_state(id)[..carrier.learned_len()];
        wrench = learned.wrench(state, moment);
        wrench = apply::below_surface(data, body, carrier.settings().waterline, wrench);
        if let Some(scale) = run::current().and_then(|run| run.wrench_scale) {
            let mut scaled = wrench.to_array();
            for (value, factor) in scaled.iter_mut().zip(scale) {
                *value *= factor;
            }
            wrench = Wrench::from_array(scaled);
        }
    }
    Some(Applied {
        body,
        wrench,
        carrier,
    })
}

/// An instance that has effects.
pub(super) struct Carrying {
    pub(super) id: usize,
    carrier: Handle,
}

/// The instances that have effects, in MuJoCo's order.
pub(super) fn with_effects(data: &mut DataView<'_>) -> Vec<Carrying> {
    if data.model().plugin().is_empty() {
        return Vec::new();
    }
    let ids: Vec<usize> = instances(data.model()).collect();
    ids.into_iter()
        .filter_map(|id| {
            let carrier = held(data, id)?;
            carrier
                .effects()
                .is_some()
                .then_some(Carrying { id, carrier })
        })
        .collect()
}

/// Calls with the effects of all instances and of this thread's run, in that order.
pub(super) fn with_sources<T>(
    data: &DataView<'_>,
    carriers: &[Carrying],
    call: impl FnOnce(&DataView<'_>, &[Source<'_>]) -> T,
) -> T {
    let run = run::current();
    let mut sources: Vec<Source<'_>> = Vec::with_capacity(carriers.len() + 1);
    for Carrying { id, carrier } in carriers {
        let turned = run.and_then(|run| run.nominal.iter().find(|(of, _)| of == id));
        let Some(bound) = turned.map(|(_, bound)| bound).or(carrier.effects()) else {
            continue;
        };
        sources.push(Source {
            bound,
            memory: &data.instance_state(*id)[carrier.learned_len()..],
            commands_arrived: false,
        });
    }
    if let Some(run) = run {
        sources.push(Source {
            bound: &run.bound,
            memory: &run.memory,
            commands_arrived: true,
        });
    }
    call(data, &sources)
}

/// True where an effect moves the water.
fn water_moves(data: &mut DataView<'_>) -> bool {
    let moves = |bound: &Bound| !bound.water.is_empty();
    run::current().is_some_and(|run| moves(&run.bound))
        || with_effects(data)
            .iter()
            .any(|of| of.carrier.effects().is_some_and(moves))
}

/// What effects add to the velocity of the water at the base, at the time of `data` [m/s].
fn water_at(data: &mut DataView<'_>, base: &Base, body: usize) -> [f64; 3] {
    let carriers = with_effects(data);
    // At a step's end `xpos` is still that of its start.
    let at = match base {
        Base::Free { qpos, .. } => {
            let position = &data.qpos()[*qpos..*qpos + 3];
            [position[0], position[1], position[2]]
        }
        _ => ModelView::triple(data.xpos(), body),
    };
    with_sources(data, &carriers, |data, sources| {
        effect_forces::added_water(data, sources, at, data.time())
    })
}

/// The body that carries an instance, where it is a single one.
fn body_of(model: ModelView<'_>, instance: usize) -> Option<usize> {
    model
        .body_plugin()
        .iter()
        .position(|of| *of == instance as i32)
}

/// The instance behind `plugin_data`; made again from the attributes where this process lacks it.
fn held(data: &mut DataView<'_>, id: usize) -> Option<Handle> {
    let bits = data.plugin_data()[id];
    if bits == BROKEN {
        return None;
    }
    if let Some(instance) = InstanceKey::from_bits(bits as u64).and_then(Handle::of) {
        return Some(instance);
    }
    match set_up(data.model(), id) {
        Ok((key, instance)) => {
            data.plugin_data_mut()[id] = key.to_bits() as usize;
            Some(Handle::new(instance))
        }
        Err(refusal) => {
            data.plugin_data_mut()[id] = BROKEN;
            let api = data.model().api();
            warn(
                api,
                &format!("{refusal}. The wrench of this instance is zero from now on"),
            );
            None
        }
    }
}

/// Checks everything about an instance and makes it.
fn set_up(model: ModelView<'_>, id: usize) -> Result<(InstanceKey, Arc<Carrier>), String> {
    let name = match model.name(mjOBJ_PLUGIN as i32, id) {
        name if name.is_empty() => "plugin hydro.wrench".to_owned(),
        name => format!("plugin hydro.wrench, instance `{name}`"),
    };
    let refused = |reason: String| format!("{name}: {reason}");
    let carriers: Vec<usize> = (0..model.bodies())
        .filter(|body| model.body_plugin()[*body] == id as i32)
        .collect();
    let body = match carriers.as_slice() {
        [] => {
            return Err(refused(
                "no body carries it (a second plugin on a body takes the first one's place); put one \
                 <plugin plugin=\"hydro.wrench\" .../> inside the <body> that the water acts on"
                    .to_owned(),
            ));
        }
        [0] => {
            return Err(refused(
                "the world carries it; put it inside the <body> that the water acts on".to_owned(),
            ));
        }
        [body] => *body,
        several => {
            let names: Vec<String> = several
                .iter()
                .map(|body| model.name(mjOBJ_BODY as i32, *body))
                .collect();
            return Err(refused(format!(
                "bodies {} share it; an instance has one memory, so declare an <instance> for each",
                names.join(", ")
            )));
        }
    };
    let settings = settings(model, id).map_err(|fault| refused(fault.to_string()))?;
    let effects = entries(model, &settings)
        .and_then(|entries| bound(model, &settings, &entries))
        .map_err(|fault| refused(format!("attribute `effects`: {fault}")))?;
    let body = describe::body(model, body);
    Registry::global()
        .acquire(settings, &body, effects)
        .map_err(|fault| refused(fault.to_string()))
}

/// The effects that an instance's attributes name.
pub(super) fn entries(model: ModelView<'_>, settings: &Settings) -> Result<Vec<Entry>, String> {
    let Some(text) = &settings.effects else {
        return Ok(Vec::new());
    };
    let targets = bind::ModelTargets {
        model,
        density: scale::density(model, Some(settings.density)),
    };
    let set = EffectSet::parse(text, &targets).map_err(|fault| fault.to_string())?;
    Ok(set.entries)
}

/// Effects of an instance, tied to its model.
pub(super) fn bound(
    model: ModelView<'_>,
    settings: &Settings,
    entries: &[Entry],
) -> Result<Option<Bound>, String> {
    if entries.is_empty() {
        return Ok(None);
    }
    let around = bind::Surroundings {
        density: Some(settings.density),
        waterline: settings.waterline,
        current: settings.current,
        commands_before_step: false,
    };
    bind::bind(model, entries, around).map(Some)
}

pub(super) fn settings(model: ModelView<'_>, id: usize) -> Result<Settings, SetupError> {
    let search = SearchPath::from_environment(own_folder());
    Ok(Settings::parse(|name| model.attribute(id, name), &search)?)
}

unsafe extern "C" fn nstate(m: *const mjModel, id: c_int) -> c_int {
    guard("nstate", 0, || {
        // SAFETY: MuJoCo passes a model that lives through the call.
        let model = Api::get().and_then(|api| unsafe { ModelView::new(m, api) });
        let len = model.and_then(|model| {
            // A fault is reported by `init`, which MuJoCo calls next.
            let settings = settings(model, id as usize).ok()?;
            let step = model.raw().opt.timestep;
            let mut len = match &settings.effects {
                Some(text) => bind::memory_len(text, step)?,
                None => 0,
            };
            if let Some(folder) = &settings.checkpoint {
                let checkpoint = Registry::global().checkpoint(folder).ok()?;
                let engine = Registry::global().engine(&checkpoint, &settings).ok()?;
                len += instance::state_len(&*engine);
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
        let Some(mut data) = (unsafe { both(m, d) }) else {
            return -1;
        };
        let id = id as usize;
        let model = data.model();
        match set_up(model, id) {
            Ok((key, carrier)) => {
                data.plugin_data_mut()[id] = key.to_bits() as usize;
                if let Some(learned) = carrier.learned() {
                    for notice in learned.notices_at_load(model.has_fluid()) {
                        tell(model, learned, notice, 0.0);
                    }
                }
                0
            }
            Err(refusal) => {
                remember_refusal(&refusal);
                warn(model.api(), &refusal);
                -1
            }
        }
    })
}

/// Warns of a notice.
fn tell(model: ModelView<'_>, instance: &Instance, notice: Notice, time: f64) {
    let text = notice.text(time, model.raw().opt.timestep, instance.sample_period());
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
        Instance::reset(unsafe { view_mut(state, model.plugin_statenum()[id as usize]) });
    });
}

unsafe extern "C" fn compute(m: *const mjModel, d: *mut mjData, id: c_int, capability: c_int) {
    guard("compute", (), || {
        // SAFETY: MuJoCo passes a model and a data of it that live through the call.
        let Some(mut data) = (unsafe { both(m, d) }) else {
            return;
        };
        let Some(now) = applied(&mut data, id as usize) else {
            return;
        };
        if capability == mjPLUGIN_PASSIVE as c_int {
            if let Some(learned) = now.carrier.learned() {
                let base = learned.features().base();
                apply::add_to_passive(&mut data, now.body, base, now.wrench);
            }
            if now.carrier.effects().is_some() {
                effect_forces::add_once(&mut data, Some(id as usize));
            }
        } else {
            let wrench = with_effects_of(&mut data, &now);
            report(&mut data, id, wrench);
        }
    });
}

/// All that acts on the body: the checkpoint's wrench, and effects but for what is proportional to
/// acceleration.
pub(super) fn with_effects_of(data: &mut DataView<'_>, now: &Applied) -> Wrench {
    let carriers = with_effects(data);
    let mut sum = now.wrench.to_array();
    with_sources(data, &carriers, |data, sources| {
        let effects = effect_forces::on_body(data, sources, now.body);
        for (sum, more) in sum.iter_mut().zip(effects) {
            *sum += more;
        }
    });
    Wrench::from_array(sum)
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
        let Some(mut data) = (unsafe { both(m, d) }) else {
            return;
        };
        let id = id as usize;
        let Some(carrier) = held(&mut data, id) else {
            return;
        };
        let start = carrier.learned_len();
        if data.instance_state(id).len() > start {
            let carriers = with_effects(&mut data);
            let mut memory = data.instance_state(id)[start..].to_vec();
            if let Some(which) = carriers.iter().position(|of| of.id == id) {
                with_sources(&data, &carriers, |data, sources| {
                    effect_forces::advanced(data, sources, which, &mut memory);
                });
            }
            let (state, _) = data.plugin_state_and_moment(id);
            state[start..].copy_from_slice(&memory);
        }
        let Some(learned) = carrier.learned() else {
            return;
        };
        let mut water = [0.0; 3];
        if water_moves(&mut data)
            && let Some(body) = body_of(data.model(), id)
        {
            water = water_at(&mut data, learned.features().base(), body);
        }
        let (state, mut moment) = data.plugin_state_and_moment(id);
        moment.water = water;
        let (notice, time) = (learned.advance(&mut state[..start], moment), moment.time);
        if let Some(notice) = notice {
            tell(data.model(), learned, notice, time);
        }
    });
}

/// Views of what a callback got.
///
/// # Safety
/// The model and the data are null, or live and used by nothing else during `'a`; the data is of that
/// model.
pub(super) unsafe fn both<'a>(m: *const mjModel, d: *mut mjData) -> Option<DataView<'a>> {
    // SAFETY: the caller's promise.
    let model = unsafe { ModelView::new(m, Api::get()?) }?;
    // SAFETY: the caller's promise.
    unsafe { DataView::new(d, model) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_lists_every_attribute_that_is_read() {
        let names: Vec<&str> = ATTRIBUTES
            .iter()
            .filter_map(|name| name.to_str().ok())
            .collect();
        assert_eq!(names, attributes::NAMES);
    }
}
