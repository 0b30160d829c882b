//! Writes effects into an MJCF: the least special form that MuJoCo has for each, else an entry of the
//! plugin `hydro.wrench`.
//!
//! | effect | form |
//! |---|---|
//! | `actuator_gain` | gain and bias; a `motor` becomes `general` |
//! | `actuator_lag` | `dyntype="filterexact" actearly="true"` |
//! | `actuator_delay` | `delay`, `nsample`, `interp="linear"` |
//! | `joint_damping` | `damping` |
//! | `joint_stiffness` | `stiffness`, `springref` |
//! | `joint_friction` | `frictionloss`, where there is hardly an excess at low speed |
//! | `joint_backlash` | an extra limited joint |
//! | `payload` | a body |
//! | `net_buoyancy` | `gravcomp`, where it acts at the centre of mass of a body on which none hangs and which no force sensor weighs |
//! | `current` | `option wind` where MuJoCo's own fluid acts, else `current` of every `hydro.wrench` |
//! | all else | `effects` of `hydro.wrench` on the target's body; force sensors above become load cells |
//!
//! The text is changed in place, byte by byte, so that the difference to the nominal model is what was
//! added and comments stay. Included files are taken in and relative paths made absolute: the result
//! loads from any folder. Sensors' effects have no place in an MJCF and are passed over.
//!
//! Uncertain numbers of the nominal model that were fitted beside the effects are written too: see
//! `nominal.rs`.

mod actuator;
mod body;
mod checkpoint;
mod diff;
mod document;
mod edit;
mod error;
mod flatten;
mod fluid;
mod inertia;
mod instance;
mod joint;
mod keyframe;
mod load_cell;
mod nominal;
mod save;
mod wrench;

use std::path::{Path, PathBuf};

pub use checkpoint::{LearnedWrench, add_learned_wrench};
pub use diff::{DiffKind, DiffLine, diff, unified};
use document::Mjcf;
pub use error::PatchError;
use hydro_effects::{Entry, Id};
pub use nominal::Renumbered;
pub use save::save;

use crate::plant::{Nuisance, PlantDescription};

/// Names of the parameters of an effect on a target of a model: a body's shape may choose them.
pub type Names = fn(&PlantDescription, Id, &str) -> Vec<String>;

/// What is to be written, and what must be known for it.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The nominal MJCF.
    pub nominal: &'a Path,
    /// Effects with values, in the order of the catalogue's parameters. `payload`: mass, x, y, z;
    /// `net_buoyancy`: force, its moment; `current`: x, y, z.
    pub entries: &'a [Entry],
    /// Numbers of the nominal and how far they are turned, as `Plant::simulation` understands it: relative,
    /// or metres for a centre of mass. One at zero leaves the text as it is.
    pub numbers: &'a [(Nuisance, f64)],
    /// The nominal model as compiled: masses, inertias, addresses, step.
    pub description: &'a PlantDescription,
    /// Names of an effect's parameters on a target, in their order.
    pub names: Names,
    /// Folders where the plugin looks for relative paths, before that of the model.
    pub search: &'a [PathBuf],
}

/// Where an effect went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// Which effect.
    pub effect: Id,
    /// What it acts on.
    pub target: String,
    /// The form that it took, for a person.
    pub form: String,
}

/// A patched model.
#[derive(Clone, Debug, PartialEq)]
pub struct Patched {
    /// The text.
    pub xml: String,
    /// Where each effect went, in the order in which they were given.
    pub written: Vec<Written>,
    /// Numbers of the nominal that were written anew. Those that could not be are among the remarks.
    pub numbers: Vec<Renumbered>,
    /// What a person should know.
    pub remarks: Vec<String>,
}

/// Writes effects and numbers into a model. Nothing is written to disk.
///
/// # Errors
/// A file that cannot be read, an effect on something that the model does not name, a wrong number of
/// values.
pub fn patch(request: &Request<'_>) -> Result<Patched, PatchError> {
    let flat = flatten::flatten(request.nominal)?;
    let path = request.nominal;
    let text = flatten::absolute_paths(&flat, path)?;
    let text = wrench::absolute_paths(&Mjcf::parse(&text, path)?, request.search, &flat.folder);
    let mut writer = Writer {
        request,
        text,
        forms: vec![None; request.entries.len()],
        renumbered: Vec::new(),
        mass_factors: Vec::new(),
        remarks: Vec::new(),
    };
    writer.check()?;
    writer.numbers()?;
    for index in order(request) {
        writer.native(index)?;
    }
    writer.plugin()?;
    // What was made must be what was meant to be made: XML.
    Mjcf::parse(&writer.text, path)?;
    let written = request
        .entries
        .iter()
        .zip(writer.forms)
        .filter_map(|(entry, form)| {
            Some(Written {
                effect: entry.effect,
                target: entry.target.clone(),
                form: form?,
            })
        })
        .collect();
    Ok(Patched {
        xml: writer.text,
        written,
        numbers: writer.renumbered,
        remarks: writer.remarks,
    })
}

/// In which order entries are written: a play shifts every coordinate behind it, so the last goes first;
/// gravity compensation looks at bodies before a payload adds one.
fn order(request: &Request<'_>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..request.entries.len()).collect();
    let rank = |index: &usize| {
        let entry = &request.entries[*index];
        match entry.effect {
            Id::NetBuoyancy => (0, 0),
            Id::JointBacklash => {
                let joint = request
                    .description
                    .joints
                    .iter()
                    .find(|joint| joint.name == entry.target);
                (2, usize::MAX - joint.map_or(0, |joint| joint.qpos))
            }
            _ => (1, 0),
        }
    };
    order.sort_by_key(rank);
    order
}

/// Where an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Body,
    Joint,
    Actuator,
    Sensor,
}

fn place(effect: Id) -> Place {
    match effect {
        Id::ActuatorGain
        | Id::ActuatorDeadband
        | Id::ActuatorLag
        | Id::ActuatorDelay
        | Id::InflowThrustLoss => Place::Actuator,
        Id::JointFriction | Id::JointDamping | Id::JointStiffness | Id::JointBacklash => {
            Place::Joint
        }
        Id::SensorBias | Id::SensorDelay | Id::SensorScale => Place::Sensor,
        _ => Place::Body,
    }
}

/// Effects that add inertia in the plugin.
const INERT: [Id; 4] = [
    Id::AddedMass,
    Id::Payload,
    Id::FreeSurface,
    Id::WallProximity,
];

/// Effects on actuators that only the plugin has.
const PLUGIN_ONLY: [Id; 2] = [Id::ActuatorDeadband, Id::InflowThrustLoss];

/// A model that is being patched, one effect after the other.
#[derive(Debug)]
struct Writer<'a> {
    request: &'a Request<'a>,
    text: String,
    /// What became of each entry; none as long as nothing has.
    forms: Vec<Option<String>>,
    /// Numbers that were written.
    renumbered: Vec<Renumbered>,
    /// Bodies whose mass was written, and the factor on it.
    mass_factors: Vec<(String, f64)>,
    remarks: Vec<String>,
}

impl Writer<'_> {
    fn model(&self) -> Result<Mjcf<'_>, PatchError> {
        Mjcf::parse(&self.text, self.request.nominal)
    }

    /// Every entry has a target in the text and as many finite values as parameters.
    fn check(&self) -> Result<(), PatchError> {
        let model = self.model()?;
        let names = |nodes: Vec<roxmltree::Node<'_, '_>>| -> Vec<String> {
            nodes
                .iter()
                .filter_map(|node| node.attribute("name"))
                .map(str::to_owned)
                .collect()
        };
        for entry in self.request.entries {
            let (kind, existing) = match place(entry.effect) {
                Place::Body => ("body", names(model.bodies().collect())),
                Place::Joint => ("joint", names(model.joints().collect())),
                Place::Actuator => ("actuator", names(model.section("actuator").collect())),
                Place::Sensor => continue,
            };
            if !existing.contains(&entry.target) {
                return Err(PatchError::NoTarget {
                    effect: entry.effect,
                    kind,
                    target: entry.target.clone(),
                    existing,
                });
            }
            let same =
                |other: &&Entry| other.effect == entry.effect && other.target == entry.target;
            if self.request.entries.iter().filter(same).count() > 1 {
                return Err(PatchError::Twice {
                    effect: entry.effect,
                    target: entry.target.clone(),
                });
            }
            let expected =
                (self.request.names)(self.request.description, entry.effect, &entry.target);
            if entry.parameters.len() != expected.len() {
                return Err(PatchError::Values {
                    effect: entry.effect,
                    target: entry.target.clone(),
                    got: entry.parameters.len(),
                    expected,
                });
            }
            for (name, value) in expected.into_iter().zip(&entry.parameters) {
                if !value.is_finite() {
                    return Err(PatchError::NotFinite {
                        effect: entry.effect,
                        target: entry.target.clone(),
                        name,
                        value: *value,
                    });
                }
            }
        }
        Ok(())
    }

    /// Writes an entry in plain MJCF, if that can say it.
    fn native(&mut self, index: usize) -> Result<(), PatchError> {
        let entry = &self.request.entries[index];
        let model = self.model()?;
        let named =
            |node: &roxmltree::Node<'_, '_>| node.attribute("name") == Some(entry.target.as_str());
        let mut remark = None;
        let changed = match place(entry.effect) {
            Place::Sensor => None,
            Place::Actuator => model
                .section("actuator")
                .find(named)
                .and_then(|node| self.actuator(&model, node, entry, &mut remark)),
            Place::Joint => model
                .joints()
                .find(named)
                .and_then(|node| self.joint(&model, node, entry)),
            Place::Body => model
                .bodies()
                .find(named)
                .and_then(|node| self.body(&model, node, entry)),
        };
        drop(model);
        if let Some((text, form)) = changed {
            self.text = text;
            self.forms[index] = Some(form.to_owned());
        }
        self.remarks.extend(remark);
        Ok(())
    }

    fn actuator(
        &self,
        model: &Mjcf<'_>,
        node: roxmltree::Node<'_, '_>,
        entry: &Entry,
        remark: &mut Option<String>,
    ) -> Option<(String, &'static str)> {
        let step = self.request.description.timestep;
        let has_plugin_only = self
            .request
            .entries
            .iter()
            .any(|other| other.target == entry.target && PLUGIN_ONLY.contains(&other.effect));
        match (entry.effect, entry.parameters.as_slice()) {
            (Id::ActuatorGain, [factor]) => Some((
                actuator::gain(model, node, *factor)?,
                "gain of the actuator",
            )),
            // The plugin works from the command as it was given: what comes before it is the plugin's too.
            (Id::ActuatorLag | Id::ActuatorDelay, _) if has_plugin_only => None,
            (Id::ActuatorLag, [time]) => {
                Some((actuator::lag(model, node, *time)?, "filter of the actuator"))
            }
            (Id::ActuatorDelay, [delay]) => {
                let form = "delay of the actuator";
                if let Some(text) = actuator::delay(model, node, *delay, step) {
                    return Some((text, form));
                }
                *remark = Some(format!(
                    "the delay of `{}`, {} s, is below half a step of {step} s: MuJoCo has none so short, \
                     and none was written",
                    entry.target,
                    edit::number(*delay)
                ));
                Some((model.text.to_owned(), "nothing: below half a step"))
            }
            _ => None,
        }
    }

    fn joint(
        &self,
        model: &Mjcf<'_>,
        node: roxmltree::Node<'_, '_>,
        entry: &Entry,
    ) -> Option<(String, &'static str)> {
        Some(match (entry.effect, entry.parameters.as_slice()) {
            (Id::JointDamping, [damping]) => (
                joint::damping(model, node, *damping)?,
                "damping of the joint",
            ),
            (Id::JointStiffness, [stiffness, reference]) => (
                joint::stiffness(model, node, *stiffness, *reference)?,
                "spring of the joint",
            ),
            (Id::JointFriction, [coulomb, excess, _]) => (
                joint::friction(model, node, *coulomb, *excess)?,
                "dry friction of the joint",
            ),
            (Id::JointBacklash, [play]) => {
                let description = self.request.description;
                let joint = description
                    .joints
                    .iter()
                    .find(|joint| joint.name == entry.target)?;
                let place = joint::Place {
                    qpos: joint.qpos,
                    dof: joint.dof,
                    inertia: joint.scale.inertia,
                    step: description.timestep,
                };
                (joint::play(model, node, *play, place)?, "an extra joint")
            }
            _ => return None,
        })
    }

    fn body(
        &self,
        model: &Mjcf<'_>,
        node: roxmltree::Node<'_, '_>,
        entry: &Entry,
    ) -> Option<(String, &'static str)> {
        Some(match (entry.effect, entry.parameters.as_slice()) {
            (Id::Payload, [mass, x, y, z]) => {
                (body::payload(model, node, *mass, [*x, *y, *z])?, "a body")
            }
            // Gravity compensation acts at the centre of mass.
            (Id::NetBuoyancy, [force, moment @ ..])
                if moment.iter().all(|of| *of == 0.0)
                    && !load_cell::is_weighed(model, &entry.target) =>
            {
                let bodies = &self.request.description.bodies;
                let scale = &bodies.iter().find(|body| body.name == entry.target)?.scale;
                let mass = scale.mass * self.mass_factor(&entry.target);
                (
                    body::buoyancy(model, node, *force, mass * scale.gravity)?,
                    "gravity compensation of the body",
                )
            }
            _ => return None,
        })
    }

    /// Writes what is left into the plugin, and makes its forces felt by force sensors.
    fn plugin(&mut self) -> Result<(), PatchError> {
        let mut weighed = Vec::new();
        let mut currents = Vec::new();
        for (index, entry) in self.request.entries.iter().enumerate() {
            if self.forms[index].is_some() || place(entry.effect) == Place::Sensor {
                continue;
            }
            if entry.effect == Id::Current {
                // Once all instances are there that it moves the water of.
                currents.push(index);
                continue;
            }
            let carrier = self.carrier(entry)?;
            self.list(index, &carrier)?;
            if place(entry.effect) == Place::Body {
                weighed.push(carrier);
            }
        }
        for index in currents {
            weighed.extend(self.current(index)?);
        }
        let cells = load_cell::convert(&self.model()?, &weighed);
        self.remarks.extend(cells.remarks());
        self.text = cells.text;
        Ok(())
    }

    /// Lists an entry in the instance on a body.
    fn list(&mut self, index: usize, carrier: &str) -> Result<(), PatchError> {
        let entry = &self.request.entries[index];
        let names = (self.request.names)(self.request.description, entry.effect, &entry.target);
        let listed = wrench::Listed {
            effect: entry.effect,
            target: entry.target.clone(),
            parameters: names
                .into_iter()
                .zip(entry.parameters.iter().copied())
                .collect(),
        };
        let model = self.model()?;
        let density = body::has_native_fluid(&model)
            .then(|| model.setting_number("option", "density"))
            .filter(|density| *density > 0.0);
        let mut text = wrench::add(&model, carrier, &[listed], density)?;
        drop(model);
        if INERT.contains(&entry.effect) {
            text = wrench::make_room(&Mjcf::parse(&text, self.request.nominal)?, carrier);
        }
        self.text = text;
        self.forms[index] = Some(format!("hydro.wrench on `{carrier}`"));
        Ok(())
    }

    /// A current moves the water of whatever acts through water. MuJoCo's wind, where its own fluid acts,
    /// moves that of the plugin's effects too. Returns the bodies on which the plugin's forces change.
    fn current(&mut self, index: usize) -> Result<Vec<String>, PatchError> {
        let entry = &self.request.entries[index];
        let model = self.model()?;
        let carriers = wrench::carriers(&model);
        let moved = match *entry.parameters.as_slice() {
            [x, y, z] if body::has_native_fluid(&model) => {
                Some((body::current(&model, [x, y, z]), "option wind"))
            }
            [x, y, z] if !carriers.is_empty() => Some((
                wrench::add_current(&model, [x, y, z]),
                "current of hydro.wrench",
            )),
            _ => None,
        };
        drop(model);
        let Some((text, form)) = moved else {
            // No water yet to move.
            let carrier = self.carrier(entry)?;
            self.list(index, &carrier)?;
            return Ok(vec![carrier]);
        };
        self.text = text;
        self.forms[index] = Some(form.to_owned());
        Ok(carriers)
    }

    /// The body whose instance of the plugin an entry is listed in: its own; for joints and actuators the
    /// first of its tree that has one, else the base.
    fn carrier(&self, entry: &Entry) -> Result<String, PatchError> {
        let model = self.model()?;
        let named =
            |node: &roxmltree::Node<'_, '_>| node.attribute("name") == Some(entry.target.as_str());
        let inside = match place(entry.effect) {
            Place::Body | Place::Sensor => return Ok(entry.target.clone()),
            Place::Joint => model.joints().find(named),
            Place::Actuator => model
                .section("actuator")
                .find(named)
                .and_then(|node| transmission(&model, node)),
        };
        let carriers = wrench::carriers(&model);
        let base = inside
            .and_then(Mjcf::base_of)
            .or_else(|| model.joints().find_map(Mjcf::base_of))
            .or_else(|| model.bodies().next());
        let in_tree = base.and_then(|base| {
            base.descendants()
                .filter(|node| node.has_tag_name("body"))
                .filter_map(|node| node.attribute("name"))
                .find(|name| carriers.iter().any(|carrier| carrier == name))
        });
        let named_base = base.and_then(|base| {
            base.descendants()
                .filter(|node| node.has_tag_name("body"))
                .find_map(|node| node.attribute("name"))
        });
        in_tree
            .map(str::to_owned)
            .or_else(|| carriers.first().cloned())
            .or_else(|| named_base.map(str::to_owned))
            .ok_or_else(|| PatchError::NoTarget {
                effect: entry.effect,
                kind: "body",
                target: entry.target.clone(),
                existing: Vec::new(),
            })
    }
}

/// Something on the body that an actuator acts on.
fn transmission<'d, 'a>(
    model: &'d Mjcf<'a>,
    actuator: roxmltree::Node<'d, 'a>,
) -> Option<roxmltree::Node<'d, 'a>> {
    let find = |key: &str, nodes: Vec<roxmltree::Node<'d, 'a>>| {
        let name = actuator.attribute(key)?;
        nodes
            .into_iter()
            .find(|node| node.attribute("name") == Some(name))
    };
    find("joint", model.joints().collect())
        .or_else(|| find("jointinparent", model.joints().collect()))
        .or_else(|| find("site", model.sites().collect()))
        .or_else(|| find("cranksite", model.sites().collect()))
        .or_else(|| find("body", model.bodies().collect()))
}

#[cfg(test)]
mod tests;
