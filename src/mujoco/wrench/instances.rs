//! The instances of `hydro.wrench` in a model: set up from their attributes, and found again by a key.

use std::sync::{
    Arc,
    atomic::{AtomicI32, Ordering},
};

use hydro_effects::{EffectSet, Entry, Id};
use hydro_model::water::BodyAddedMass;
use nalgebra::Vector3;

use super::origins;
use crate::{
    mujoco::{
        bodies::{base_body, hull},
        effects::{
            bind,
            surroundings::{Carrier, Surroundings},
            wet_bodies::shared_hulls,
        },
        ffi::{
            DataView, ModelView,
            api::own_folder,
            bindings::{mjOBJ_BODY, mjOBJ_GEOM, mjOBJ_PLUGIN},
            scene_folder, warn,
        },
    },
    plugin::{
        Afloat, Bound, Handle, Instance, InstanceKey, Registry, Settings, SetupError,
        search_path::SearchPath,
    },
};

/// `plugin_data` of an instance that could not be made again: zero wrench from then on.
pub(crate) const BROKEN: usize = usize::MAX;

/// The slot that MuJoCo gave; -1: not registered.
static SLOT: AtomicI32 = AtomicI32::new(-1);

/// Keeps the slot that MuJoCo gave the plugin.
pub(crate) fn set_slot(slot: i32) {
    SLOT.store(slot, Ordering::Relaxed);
}

/// The instances of this plugin in a model.
pub(crate) fn instances(model: ModelView<'_>) -> impl Iterator<Item = usize> {
    let slot = SLOT.load(Ordering::Relaxed);
    model
        .plugin()
        .iter()
        .enumerate()
        .filter(move |(_, of)| **of == slot)
        .map(|(instance, _)| instance)
}

/// Names of the bodies that carry the instances, in their order.
pub(crate) fn bodies(model: ModelView<'_>) -> Vec<String> {
    instances(model)
        .map(|instance| {
            carrying_body(model, instance).map_or_else(String::new, |body| {
                model.label(mjOBJ_BODY as i32, "body", body)
            })
        })
        .collect()
}

/// The body that carries an instance, where it is a single one.
pub(crate) fn carrying_body(model: ModelView<'_>, instance: usize) -> Option<usize> {
    model
        .body_plugin()
        .iter()
        .position(|of| *of == instance as i32)
}

/// The instance behind `plugin_data`; made again from the attributes where this process lacks it, or where the data was made of
/// a model that says others.
pub(crate) fn held(data: &mut DataView<'_>, id: usize) -> Option<Handle> {
    let bits = data.plugin_data()[id];
    if bits == BROKEN {
        return None;
    }
    let before = InstanceKey::from_bits(bits as u64);
    let own = before.filter(|key| origins::is_of(data.model(), id, *key));
    if let Some(instance) = own.and_then(Handle::for_key) {
        return Some(instance);
    }
    match set_up(data.model(), id) {
        Ok((key, instance)) => {
            origins::remember(data.model(), id, key);
            // The data had one instance, and has one.
            if let Some(before) = before {
                Registry::global().release(before);
            }
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
pub(crate) fn set_up(
    model: ModelView<'_>,
    id: usize,
) -> Result<(InstanceKey, Arc<Instance>), String> {
    let name = match model.name(mjOBJ_PLUGIN as i32, id) {
        name if name.is_empty() => "plugin hydro.wrench".to_owned(),
        name => format!("plugin hydro.wrench, instance `{name}`"),
    };
    let refused = |reason: String| format!("{name}: {reason}");
    let bodies: Vec<usize> = (0..model.bodies())
        .filter(|body| model.body_plugin()[*body] == id as i32)
        .collect();
    let body = match bodies.as_slice() {
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
    let around = surroundings(model, &settings, body).map_err(refused)?;
    let entries = entries(model, &settings, &around).map_err(refused)?;
    let mut effects = bound(model, &around, &entries)
        .map_err(|fault| refused(format!("attribute `effects`: {fault}")))?;
    if let Some(effects) = &mut effects {
        effects.notes.extend(shared_hulls(model, effects));
    }
    let afloat = Afloat {
        hulls: match (&settings.checkpoint, around.sea.waterline) {
            (Some(_), Some(_)) => hull::hulls(model, body, around.hull.as_deref()),
            _ => Vec::new(),
        },
        sea: around.sea,
    };
    let fades = settings.checkpoint.is_some() && afloat.sea.waterline.is_some();
    if fades && settings.hull.is_some() && afloat.hulls.is_empty() {
        return Err(refused(
            "attribute `hull` names no geom of the carrying body or below it; its wrench fades with their submerged part"
                .to_owned(),
        ));
    }
    let body = base_body::body(model, body);
    Registry::global()
        .acquire(settings, &body, effects, afloat)
        .map_err(|fault| refused(fault.to_string()))
}

/// The effects that an instance's attributes name, then the added mass that its checkpoint's card leaves to the inertia.
pub(crate) fn entries(
    model: ModelView<'_>,
    settings: &Settings,
    around: &Surroundings,
) -> Result<Vec<Entry>, String> {
    let targets = bind::ModelTargets { model, around };
    let mut set = match &settings.effects {
        Some(text) => EffectSet::parse(text, &targets)
            .map_err(|fault| format!("attribute `effects`: {fault}"))?,
        None => EffectSet::default(),
    };
    let added = added_mass(settings)?;
    if !added.is_empty() {
        set.entries.extend(added);
        set.check(&targets)
            .map_err(|fault| format!("the added mass of the checkpoint's card: {fault}"))?;
    }
    Ok(set.entries)
}

/// The added mass of a checkpoint's card, in water of the instance's density.
fn added_mass(settings: &Settings) -> Result<Vec<Entry>, String> {
    let Some(folder) = &settings.checkpoint else {
        return Ok(Vec::new());
    };
    let loaded = Registry::global().checkpoint(folder);
    let loaded = loaded.map_err(|fault| fault.to_string())?;
    let bodies = loaded.checkpoint.card.added_mass.iter();
    let entry = |of: &BodyAddedMass| {
        let matrix = of.matrix.iter().map(|element| element * settings.density);
        Entry {
            effect: Id::AddedMass,
            target: of.body.clone(),
            // About the body's origin.
            parameters: matrix.chain([0.0; 3]).collect(),
        }
    };
    Ok(bodies.map(entry).collect())
}

/// The water around an instance that a body carries.
pub(crate) fn surroundings(
    model: ModelView<'_>,
    settings: &Settings,
    body: usize,
) -> Result<Surroundings, String> {
    let unknown = settings
        .hull
        .iter()
        .flatten()
        .find(|name| model.id(mjOBJ_GEOM as i32, name).is_none());
    if let Some(name) = unknown {
        let known: Vec<String> = (0..model.geom_type().len())
            .map(|geom| model.name(mjOBJ_GEOM as i32, geom))
            .filter(|name| !name.is_empty())
            .collect();
        return Err(format!(
            "attribute `hull` names geom `{name}`; the model has: {}",
            if known.is_empty() {
                "none with a name".to_owned()
            } else {
                known.join(", ")
            }
        ));
    }
    let gravity = Vector3::from(model.raw().opt.gravity).norm();
    let (sea, notes) = settings.sea(gravity).map_err(|fault| fault.to_string())?;
    let [x, y, z] = model.raw().opt.gravity;
    if settings.waves.is_some() && (x != 0.0 || y != 0.0 || z >= 0.0) {
        return Err(format!(
            "attribute `waves`: option gravity is {x} {y} {z}; expected 0 0 -g, for waves are about a level surface"
        ));
    }
    Ok(Surroundings {
        density: settings.density_is_given.then_some(settings.density),
        sea,
        potential_flow: settings
            .potential_flow()
            .map_err(|fault| fault.to_string())?
            .map(Arc::new),
        notes,
        current: settings.current,
        hull: settings.hull.clone(),
        carrier: Some(Carrier {
            body,
            volume: settings.volume,
            centre: settings.centre_of_buoyancy,
        }),
        is_hypothesis: false,
    })
}

/// Effects and sea of an instance, tied to its model.
pub(crate) fn bound(
    model: ModelView<'_>,
    around: &Surroundings,
    entries: &[Entry],
) -> Result<Option<Bound>, String> {
    if entries.is_empty() && !around.sea.moves() && around.potential_flow.is_none() {
        return Ok(None);
    }
    bind::bind(model, entries, around).map(Some)
}

pub(crate) fn settings(model: ModelView<'_>, id: usize) -> Result<Settings, SetupError> {
    let search = SearchPath::from_environment(own_folder(), scene_folder::current());
    Ok(Settings::parse(|name| model.attribute(id, name), &search)?)
}
