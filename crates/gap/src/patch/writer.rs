//! Writes effects one after the other: each in plain MJCF where it has a form there, the others into the plugin.

use hydro_effects::{Entry, Id, Part, Placement, TargetKind, effect};

use super::{
    Request, actuator, body, error::PatchError, force_sensors, joint, mjcf::Mjcf,
    patched::Renumbered, wrench_plugin, xml_edit,
};

/// Order in which entries are written: gravity compensation before a payload adds a body; backlashes from the last joint
/// to the first, because each shifts every coordinate behind it.
pub(super) fn order(request: &Request<'_>) -> Vec<usize> {
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

fn target_kind(id: Id) -> TargetKind {
    effect(id).card().target
}

/// True where the plugin adds inertia for an effect.
fn body_adds_inertia(id: Id) -> bool {
    matches!(effect(id).part(), Part::Body(part) if part.has_inertia())
}

/// True for an effect on an actuator that plain MJCF cannot express.
fn is_only_in_plugin(id: Id) -> bool {
    let card = effect(id).card();
    card.target == TargetKind::Actuator && card.placement == Placement::Plugin
}

/// A model that is being patched, one effect after the other.
#[derive(Debug)]
pub(super) struct Writer<'a> {
    pub(super) request: &'a Request<'a>,
    pub(super) text: String,
    /// Form of each entry in words; `None` until it is written.
    pub(super) forms: Vec<Option<String>>,
    /// Values of the nominal model that were replaced.
    pub(super) renumbered: Vec<Renumbered>,
    /// Bodies whose mass was written, and the factor on it.
    pub(super) mass_factors: Vec<(String, f64)>,
    pub(super) remarks: Vec<String>,
}

impl<'a> Writer<'a> {
    /// A writer with nothing written yet into `text`.
    pub(super) fn new(request: &'a Request<'a>, text: String) -> Self {
        Self {
            request,
            text,
            forms: vec![None; request.entries.len()],
            renumbered: Vec::new(),
            mass_factors: Vec::new(),
            remarks: Vec::new(),
        }
    }

    /// The text as it stands, parsed.
    pub(super) fn model(&self) -> Result<Mjcf<'_>, PatchError> {
        Mjcf::parse(&self.text, self.request.nominal)
    }

    /// Every entry has a target in the text and as many finite values as parameters.
    pub(super) fn check(&self) -> Result<(), PatchError> {
        let model = self.model()?;
        let names = |nodes: Vec<roxmltree::Node<'_, '_>>| -> Vec<String> {
            nodes
                .iter()
                .filter_map(|node| node.attribute("name"))
                .map(str::to_owned)
                .collect()
        };
        for entry in self.request.entries {
            let (kind, existing) = match target_kind(entry.effect) {
                TargetKind::Body => ("body", names(model.bodies().collect())),
                TargetKind::Joint => ("joint", names(model.joints().collect())),
                TargetKind::Actuator => ("actuator", names(model.section("actuator").collect())),
                TargetKind::Sensor => continue,
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
    pub(super) fn native(&mut self, index: usize) -> Result<(), PatchError> {
        let entry = &self.request.entries[index];
        let model = self.model()?;
        let named =
            |node: &roxmltree::Node<'_, '_>| node.attribute("name") == Some(entry.target.as_str());
        let mut remark = None;
        let changed = match target_kind(entry.effect) {
            TargetKind::Sensor => None,
            TargetKind::Actuator => model
                .section("actuator")
                .find(named)
                .and_then(|node| self.actuator(&model, node, entry, &mut remark)),
            TargetKind::Joint => model
                .joints()
                .find(named)
                .and_then(|node| self.joint(&model, node, entry)),
            TargetKind::Body => model
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

    /// Factor on the mass of a body, as written.
    pub(super) fn mass_factor(&self, body: &str) -> f64 {
        self.mass_factors
            .iter()
            .find(|(name, _)| name == body)
            .map_or(1.0, |(_, factor)| *factor)
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
            .any(|other| other.target == entry.target && is_only_in_plugin(other.effect));
        match (entry.effect, entry.parameters.as_slice()) {
            (Id::ActuatorGain, [factor]) => Some((
                actuator::gain(model, node, *factor)?,
                "gain of the actuator",
            )),
            // The plugin starts from the given command, so effects on the command go into the plugin too.
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
                    xml_edit::number(*delay)
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
            (Id::JointArmature, [more]) => {
                (joint::armature(model, node, *more), "armature of the joint")
            }
            (Id::JointStiffness, [stiffness, reference]) => (
                joint::stiffness(model, node, *stiffness, *reference)?,
                "spring of the joint",
            ),
            (Id::JointFriction, [coulomb, excess, _]) => (
                joint::friction(model, node, *coulomb, *excess)?,
                "dry friction of the joint",
            ),
            (Id::JointBacklash, [width]) if *width <= 0.0 => {
                (model.text.to_owned(), "nothing: no play")
            }
            (Id::JointBacklash, [width]) => {
                let description = self.request.description;
                let joint = description
                    .joints
                    .iter()
                    .find(|joint| joint.name == entry.target)?;
                let place = joint::JointPlace {
                    qpos: joint.qpos,
                    dof: joint.dof,
                    inertia: joint.scale.inertia,
                    rotor: joint.scale.armature,
                    damping: joint.scale.damping,
                    step: description.timestep,
                };
                (
                    joint::backlash(model, node, *width, place)?,
                    "an extra joint",
                )
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
                if moment.iter().all(|component| *component == 0.0)
                    && !force_sensors::is_weighed(model, &entry.target) =>
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

    /// Writes the remaining entries into the plugin, and makes load cells of the force sensors above them.
    pub(super) fn plugin(&mut self) -> Result<(), PatchError> {
        let mut weighed = Vec::new();
        let mut currents = Vec::new();
        for (index, entry) in self.request.entries.iter().enumerate() {
            if self.forms[index].is_some() || target_kind(entry.effect) == TargetKind::Sensor {
                continue;
            }
            if entry.effect == Id::Current {
                // After all instances are there whose water it moves.
                currents.push(index);
                continue;
            }
            let body = self.instance_body(entry)?;
            self.list(index, &body)?;
            if target_kind(entry.effect) == TargetKind::Body {
                weighed.push(body);
            }
        }
        for index in currents {
            weighed.extend(self.current(index)?);
        }
        let cells = force_sensors::convert(&self.model()?, &weighed);
        self.remarks.extend(cells.remarks());
        self.text = cells.text;
        Ok(())
    }

    /// Lists an entry in the instance on a body.
    fn list(&mut self, index: usize, body: &str) -> Result<(), PatchError> {
        let entry = &self.request.entries[index];
        let names = (self.request.names)(self.request.description, entry.effect, &entry.target);
        let values = names.into_iter().zip(entry.parameters.iter().copied());
        let listed =
            wrench_plugin::ListedEffect::new(entry.effect, &entry.target, values.collect());
        let model = self.model()?;
        let density = body::has_native_fluid(&model)
            .then(|| model.setting_number("option", "density"))
            .filter(|density| *density > 0.0);
        let mut text = wrench_plugin::add(&model, body, &[listed], density)?;
        drop(model);
        if body_adds_inertia(entry.effect) {
            text = wrench_plugin::make_room(&Mjcf::parse(&text, self.request.nominal)?, body);
        }
        self.text = text;
        self.forms[index] = Some(format!("hydro.wrench on `{body}`"));
        Ok(())
    }

    /// Writes a current, which every force of the water depends on. MuJoCo's wind, where its own fluid acts, holds for the
    /// plugin's effects too. Returns the bodies on which the plugin's forces change.
    fn current(&mut self, index: usize) -> Result<Vec<String>, PatchError> {
        let entry = &self.request.entries[index];
        let model = self.model()?;
        let with_instance = wrench_plugin::bodies_with_instance(&model);
        let moved = match *entry.parameters.as_slice() {
            [x, y, z] if body::has_native_fluid(&model) => {
                Some((body::current(&model, [x, y, z]), "option wind"))
            }
            [x, y, z] if !with_instance.is_empty() => Some((
                wrench_plugin::add_current(&model, [x, y, z]),
                "current of hydro.wrench",
            )),
            _ => None,
        };
        drop(model);
        let Some((text, form)) = moved else {
            // Nothing depends on the water yet.
            let body = self.instance_body(entry)?;
            self.list(index, &body)?;
            return Ok(vec![body]);
        };
        self.text = text;
        self.forms[index] = Some(form.to_owned());
        Ok(with_instance)
    }

    /// The body whose plugin instance lists an entry: the target itself; for joints and actuators the first body of the
    /// tree with an instance, else the base.
    fn instance_body(&self, entry: &Entry) -> Result<String, PatchError> {
        let model = self.model()?;
        let named =
            |node: &roxmltree::Node<'_, '_>| node.attribute("name") == Some(entry.target.as_str());
        let inside = match target_kind(entry.effect) {
            TargetKind::Body | TargetKind::Sensor => return Ok(entry.target.clone()),
            TargetKind::Joint => model.joints().find(named),
            TargetKind::Actuator => model
                .section("actuator")
                .find(named)
                .and_then(|node| transmission(&model, node)),
        };
        let with_instance = wrench_plugin::bodies_with_instance(&model);
        let base = inside
            .and_then(Mjcf::base_above)
            .or_else(|| model.joints().find_map(Mjcf::base_above))
            .or_else(|| model.bodies().next());
        let in_tree = base.and_then(|base| {
            base.descendants()
                .filter(|node| node.has_tag_name("body"))
                .filter_map(|node| node.attribute("name"))
                .find(|name| with_instance.iter().any(|body| body == name))
        });
        let named_base = base.and_then(|base| {
            base.descendants()
                .filter(|node| node.has_tag_name("body"))
                .find_map(|node| node.attribute("name"))
        });
        in_tree
            .map(str::to_owned)
            .or_else(|| with_instance.first().cloned())
            .or_else(|| named_base.map(str::to_owned))
            .ok_or_else(|| PatchError::NoTarget {
                effect: entry.effect,
                kind: "body",
                target: entry.target.clone(),
                existing: Vec::new(),
            })
    }
}

/// An element on the body that an actuator acts on.
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
