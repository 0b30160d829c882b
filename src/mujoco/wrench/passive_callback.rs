//! The same force in a MuJoCo without engine plugins (Debian 12's 2.2.2), as its `mjcb_passive`.
//!
//! The library comes in by `LD_PRELOAD` or `dlopen`. The attributes of `hydro.wrench` are custom texts
//! of the model, their names prefixed, beside the body that the water acts on:
//!
//! ```xml
//! <size nuserdata="400"/>
//! <custom>
//!   <text name="hydro.body" data="trunk"/>
//!   <text name="hydro.checkpoint" data="models/b1-task2"/>
//! </custom>
//! ```
//!
//! The memory that an engine plugin would keep in plugin state stands at the start of `userdata`; a
//! model with too little is refused with the number needed. There is no hook at a step's end, so the
//! memory follows the clock: it changes in the first evaluation after `time` did. Runge-Kutta evaluates
//! forces at times and states that are no part of the trajectory, so it is refused.

use std::{
    cell::RefCell,
    hash::{DefaultHasher, Hasher},
    sync::{
        Arc,
        atomic::{AtomicPtr, Ordering},
    },
};

use parking_lot::Mutex;

use hydro_frames::Wrench;

use super::told_once::tell_once;
use crate::{
    mujoco::{
        bodies::{base_body, hull, joint_space},
        ffi::{
            Api, DataView, ModelView,
            api::own_folder,
            bindings::{mjData, mjModel, mjOBJ_BODY},
            guard, scene_folder,
            views::view,
            warn,
        },
    },
    plugin::{
        Afloat, Instance, LearnedWrench, Registry, Settings, sea::Sea, search_path::SearchPath,
    },
};

/// Type of the callback.
type Passive = unsafe extern "C" fn(*const mjModel, *mut mjData);

/// Prefix of the custom texts.
const PREFIX: &str = "hydro.";

/// A callback that was installed before ours; it is called first.
static EARLIER: AtomicPtr<()> = AtomicPtr::new(std::ptr::null_mut());

/// Refusals that were told, and whether a step had passed, so that a model that is refused at every step says
/// so once. The first warning falls into the step that the compiler takes to test a model, and a program
/// may never show what was said there; hence a second one when the simulation moves.
static WARNED: Mutex<Vec<(String, bool)>> = Mutex::new(Vec::new());

/// Sets `mjcb_passive`.
pub(crate) fn install(api: &Api) {
    // SAFETY: `mjcb_passive` is a nullable function pointer of this type.
    let Some(slot) = (unsafe { api.variable::<Option<Passive>>(b"mjcb_passive\0") }) else {
        return;
    };
    // SAFETY: the variable's address; the loader runs this before the program's own threads do.
    unsafe {
        let ours: Passive = passive;
        match *slot {
            Some(other) if other as usize == ours as usize => return,
            Some(other) => EARLIER.store(other as *mut (), Ordering::Relaxed),
            None => {}
        }
        *slot = Some(ours);
    }
}

/// An instance and its body; `None` where the model asks for none; else why it was refused.
type Made = Result<Option<(Arc<Instance>, usize)>, String>;

/// The result of setting up a model, with a hash of the texts and sizes that it was made from.
struct Tied {
    fingerprint: u64,
    made: Made,
}

thread_local! {
    static TIED: RefCell<Option<Tied>> = const { RefCell::new(None) };
}

unsafe extern "C" fn passive(m: *const mjModel, d: *mut mjData) {
    let earlier = EARLIER.load(Ordering::Relaxed);
    if !earlier.is_null() {
        // SAFETY: stored from a function pointer of this type.
        unsafe { std::mem::transmute::<*mut (), Passive>(earlier)(m, d) };
    }
    guard("passive callback", (), || {
        // SAFETY: MuJoCo passes a model that lives through the call.
        let Some(model) = Api::get().and_then(|api| unsafe { ModelView::new(m, api) }) else {
            return;
        };
        // SAFETY: and a data of it that nothing else uses meanwhile.
        let Some(mut data) = (unsafe { DataView::new(d, model) }) else {
            return;
        };
        match tied(model) {
            Ok(Some((instance, body))) => {
                if let Some(learned) = instance.learned() {
                    act(&mut data, &instance, learned, body);
                }
            }
            Ok(None) => {}
            Err(refusal) => tell(model, refusal, data.time() > model.raw().opt.timestep),
        }
    });
}

fn tell(model: ModelView<'_>, refusal: String, moving: bool) {
    let text = format!("{refusal}. No force is applied");
    let news = {
        let mut warned = WARNED.lock();
        let said = (refusal, moving);
        let news = !warned.contains(&said);
        if news {
            warned.push(said);
        }
        news
    };
    if news {
        warn(model.api(), &text);
    }
}

fn act(data: &mut DataView<'_>, instance: &Instance, learned: &LearnedWrench, body: usize) {
    let (state, moment) = data.userdata_and_moment(learned.state_len());
    let starts = LearnedWrench::is_cold(state);
    let notice = learned.follow_clock(state, moment);
    let force = learned.force(state, moment);
    let force = force.scaled(hull::submerged_part(data, instance.hulls(), instance.sea()));
    if force.wrench != Wrench::default() {
        joint_space::add_to_passive(data, body, learned.features().base(), force.wrench);
    }
    joint_space::add_torques(data, &force.joints);
    // There is no hook at a load, and what is said while a model compiles may never be shown: what a
    // load would tell is told at each start.
    let model = data.model();
    if let Some(note) = learned.settings().engine.note().filter(|_| starts) {
        tell_once(model.api(), note);
    }
    let at_load = starts.then(|| learned.notices_at_load(model.has_fluid()));
    for notice in at_load.into_iter().flatten().chain(notice) {
        warn(
            model.api(),
            &notice.text(
                data.time(),
                model.raw().opt.timestep,
                learned.sample_period(),
            ),
        );
    }
}

/// The instance that this thread has set up for a model; made at the first evaluation and after a change of the model.
fn tied(model: ModelView<'_>) -> Made {
    let fingerprint = fingerprint(model);
    let known = TIED.with_borrow(|tied| {
        let tied = tied
            .as_ref()
            .filter(|tied| tied.fingerprint == fingerprint)?;
        Some(tied.made.clone())
    });
    if let Some(made) = known {
        return made;
    }
    let made = set_up(model);
    TIED.with_borrow_mut(|tied| {
        *tied = Some(Tied {
            fingerprint,
            made: made.clone(),
        });
    });
    made
}

/// A hash of all that the set-up reads, so that a model at the address of a deleted one is not
/// mistaken for it.
fn fingerprint(model: ModelView<'_>) -> u64 {
    let raw = model.raw();
    let mut hasher = DefaultHasher::new();
    // SAFETY: MuJoCo allocates that many characters.
    unsafe {
        hasher.write(view(raw.text_data.cast::<u8>(), raw.ntextdata));
        hasher.write(view(raw.names.cast::<u8>(), raw.nnames));
    }
    for number in [raw.nq, raw.nv, raw.nbody, raw.nuserdata, raw.opt.integrator] {
        hasher.write_i32(number);
    }
    hasher.finish()
}

fn set_up(model: ModelView<'_>) -> Made {
    let text = |name: &str| model.custom_text(&format!("{PREFIX}{name}"));
    if text("checkpoint").is_none() {
        return Ok(None);
    }
    let bodies = || {
        (1..model.bodies())
            .map(|body| model.name(mjOBJ_BODY as i32, body))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let name = text("body").ok_or_else(|| {
        format!(
            "custom text `hydro.body` is missing; name the body that the water acts on: {}",
            bodies()
        )
    })?;
    let body = model.id(mjOBJ_BODY as i32, &name).ok_or_else(|| {
        format!(
            "custom text `hydro.body` is `{name}`; the model's bodies are: {}",
            bodies()
        )
    })?;
    if model.runge_kutta() {
        return Err("integrator RK4 needs the engine plugin of a newer MuJoCo; set <option integrator=\"Euler\"/>".to_owned());
    }
    let search = SearchPath::from_environment(own_folder(), scene_folder::current());
    let settings = Settings::parse(text, &search)
        .map_err(|fault| format!("custom texts `hydro.*`: {fault}"))?;
    if settings.effects.is_some() {
        return Err(
            "custom text `hydro.effects`: named effects need the engine plugin of a newer MuJoCo"
                .to_owned(),
        );
    }
    let needs_plugin = [
        ("waves", settings.waves.is_some()),
        ("potential_flow", settings.potential_flow.is_some()),
        ("current", settings.current_field.is_some()),
    ];
    if let Some((name, _)) = needs_plugin.into_iter().find(|(_, given)| *given) {
        return Err(format!(
            "custom text `hydro.{name}`: water that changes needs the engine plugin of a newer MuJoCo; give `current` three numbers"
        ));
    }
    if let Some(folder) = &settings.checkpoint {
        let loaded = Registry::global().checkpoint(folder);
        let loaded = loaded.map_err(|fault| format!("custom texts `hydro.*`: {fault}"))?;
        if !loaded.checkpoint.card.added_mass.is_empty() {
            return Err("custom text `hydro.checkpoint`: its card leaves the added mass to the inertia, which needs the engine \
                        plugin of a newer MuJoCo"
                .to_owned());
        }
    }
    let described = base_body::body(model, body);
    let sea = Sea {
        waterline: settings.waterline,
        ..Sea::default()
    };
    let hulls = match sea.waterline {
        Some(_) => hull::hulls(model, body, settings.hull.as_deref()),
        None => Vec::new(),
    };
    let (_, instance) = Registry::global()
        .acquire(settings, &described, None, Afloat { sea, hulls })
        .map_err(|fault| format!("custom texts `hydro.*`: {fault}"))?;
    let learned = instance
        .learned()
        .ok_or("custom text `hydro.checkpoint` is missing")?;
    let needed = learned.state_len();
    let found = model.raw().nuserdata;
    if usize::try_from(found).unwrap_or(0) < needed {
        return Err(format!(
            "the memory of this checkpoint needs {needed} numbers of user data, the model has {found}; add \
             <size nuserdata=\"{needed}\"/>"
        ));
    }
    Ok(Some((instance, body)))
}
