//! Which effects on which targets are tried on a model.

use std::collections::BTreeSet;

use hydro_effects as effects;
use hydro_effects::{
    Entry, Id, Medium, NearBoundary, Parameter, Part,
    card::{ActuatorScale, BodyScale, SensorScale, Target, TargetKind},
};

use crate::{
    options::CandidateOptions,
    plant::{PlantBody, PlantDescription, PlantJoint, SensorKind},
    problem::{
        channels::{Channels, MeasuredTrial, Source},
        typical::Typical,
    },
};

/// The frequency of an oscillation [rad/s].
pub(crate) const FREQUENCY: &str = "frequency";

/// One effect on one target, or on every target of a kind, with values that these share or with values of their own.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    /// Which effect.
    pub(crate) effect: Id,
    /// Its targets: one, or all of a kind.
    pub(crate) targets: Vec<String>,
    /// Parameters that are fitted: of all targets together, or of one target after the other.
    pub(crate) parameters: Vec<Parameter>,
    /// Values of those after them, which this form of the effect leaves at their nulls; likewise.
    pub(crate) left_out: Vec<f64>,
    /// True where every target has values of its own.
    pub(crate) is_apart: bool,
}

impl Candidate {
    /// The forms of an effect with values that its targets share: with what is optional, and without. The smaller comes
    /// first. Bounds are those of all targets, priors the narrowest.
    fn forms(effect: Id, targets: &[(String, Target)]) -> Vec<Self> {
        let effect_of = effects::effect(effect);
        let mut each = targets.iter().map(|(_, of)| effect_of.parameters(of));
        let Some(mut all) = each.next() else {
            return Vec::new();
        };
        for others in each {
            for (p, other) in all.iter_mut().zip(others) {
                p.lower = p.lower.max(other.lower);
                p.upper = p.upper.min(other.upper);
                p.prior_sd = p.prior_sd.min(other.prior_sd);
                p.start = p.start.min(other.start).clamp(p.lower, p.upper);
            }
        }
        let needed = all.iter().take_while(|p| !p.optional).count();
        let mut counts = vec![needed, all.len()];
        counts.dedup();
        counts
            .into_iter()
            .map(|count| Self {
                effect,
                targets: targets.iter().map(|(name, _)| name.clone()).collect(),
                parameters: all[..count].to_vec(),
                left_out: all[count..].iter().map(|p| p.null).collect(),
                is_apart: false,
            })
            .collect()
    }

    /// An effect with a value of each target's own, its first parameter: bounds and priors are those of the target. What else shapes
    /// it, a Stribeck friction say, is too much to be told of many at once.
    fn apart(effect: Id, targets: &[(String, Target)]) -> Self {
        let mut whole = Self {
            effect,
            targets: targets.iter().map(|(name, _)| name.clone()).collect(),
            parameters: Vec::new(),
            left_out: Vec::new(),
            is_apart: true,
        };
        for (_, of) in targets {
            let all = effects::effect(effect).parameters(of);
            let (first, others) = all.split_at(all.len().min(1));
            whole.parameters.extend_from_slice(first);
            whole.left_out.extend(others.iter().map(|p| p.null));
        }
        whole
    }

    /// A target's part, by its place among the targets, of a list that is laid out as the parameters are.
    pub(crate) fn of_target<'v, T>(&self, at: usize, all: &'v [T]) -> &'v [T] {
        match self.is_apart {
            true => {
                let count = all.len() / self.targets.len();
                &all[at * count..(at + 1) * count]
            }
            false => all,
        }
    }

    /// Effects and their targets, whatever the form: of one with values of each target's own, one on each.
    pub(crate) fn mechanisms(&self) -> impl Iterator<Item = (Id, &[String])> {
        let together = match self.is_apart {
            true => 1,
            false => self.targets.len(),
        };
        let each = self.targets.chunks(together.max(1));
        each.map(|targets| (self.effect, targets))
    }

    /// The target that a parameter belongs to, by its place among all; all of them where they share it.
    pub(crate) fn targets_of(&self, parameter: usize) -> &[String] {
        match self.is_apart {
            true => {
                let count = self.parameters.len() / self.targets.len();
                std::slice::from_ref(&self.targets[parameter / count])
            }
            false => &self.targets,
        }
    }

    /// Effect and targets, whatever the form.
    pub(crate) fn mechanism(&self) -> (Id, &[String]) {
        (self.effect, &self.targets)
    }

    /// True where both cannot be in one set: the same effect on targets that overlap, or on one body what the
    /// other includes.
    pub(crate) fn clashes(&self, other: &Self) -> bool {
        let includes = |a: &Self, b: &Self| {
            a.effect == b.effect
                || effects::effect(a.effect).includes(b.effect, a.left_out.is_empty())
        };
        let overlap = self
            .targets
            .iter()
            .any(|target| other.targets.contains(target));
        overlap && (includes(self, other) || includes(other, self))
    }

    /// Bounds a frequency so that its period is no longer than some seconds; false where it is not usual to be so short.
    fn oscillates_within(&mut self, seconds: f64) -> bool {
        let lowest = std::f64::consts::TAU / seconds;
        let mut parameters = self.parameters.iter_mut();
        parameters.all(|p| {
            if p.name != FREQUENCY {
                return true;
            }
            p.lower = p.lower.max(lowest);
            p.lower < p.upper
        })
    }

    /// Entries with values in the order of the parameters.
    pub(crate) fn entries(&self, values: &[f64]) -> Vec<Entry> {
        let targets = self.targets.iter().enumerate();
        targets
            .map(|(at, target)| Entry {
                effect: self.effect,
                target: target.clone(),
                parameters: [values, &self.left_out]
                    .map(|all| self.of_target(at, all))
                    .concat(),
            })
            .collect()
    }

    /// True for a parameter whose contribution nature's form may differ from: not for a shape, and not where the effect
    /// idealises nothing.
    pub(crate) fn has_form_error(&self, parameter: &Parameter) -> bool {
        effects::effect(self.effect).card().idealised && !parameter.shapes
    }

    /// Values that mean "no effect".
    pub(crate) fn null(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.null).collect()
    }
}

/// Prior probability of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prior {
    /// Its log share among single effects, by effect, target and form; of an expected one its form's alone.
    pub(crate) log_share: f64,
    /// True where the model itself says that the effect is missing: with and without it are alike likely.
    pub(crate) is_expected: bool,
    /// True where it needs a medium of which the model tells nothing.
    pub(crate) is_untold: bool,
}

/// Prior of each candidate in a medium. A model that `lacks_fluid` in a medium that has
/// one is expected to lack what every fluid does, on the body that it names.
pub(crate) fn priors(
    candidates: &[Candidate],
    (medium, lacks_fluid): (Medium, Option<&str>),
    options: &CandidateOptions,
) -> Vec<Prior> {
    let own = candidates.iter().map(|of| of.effect);
    let own: BTreeSet<Id> = own.filter(|id| matches!(id, Id::Own(_))).collect();
    let built_in = Id::ALL.iter().filter(|id| is_tried(**id));
    let effects = (built_in.count() + own.len()) as f64;
    let prior = |of: &Candidate| {
        let alike = || candidates.iter().filter(|c| c.effect == of.effect);
        let targets: BTreeSet<&[String]> = alike().map(|c| &c.targets[..]).collect();
        let forms = alike().filter(|c| c.targets == of.targets).count();
        let form = match (forms, of.left_out.is_empty()) {
            (1, _) => 1.0,
            (_, true) => options.elaborate_form,
            (_, false) => 1.0 - options.elaborate_form,
        };
        let effect = effects::effect(of.effect);
        let usual = match effect.is_refinement() {
            true => options.refinement,
            false => 1.0,
        };
        let is_there = medium > Medium::None && effect.medium() <= medium;
        let on_body = lacks_fluid.is_some_and(|body| of.targets == [body]);
        let is_expected = on_body && is_there && effect.is_of_every_fluid();
        Prior {
            log_share: match is_expected {
                true => form.ln(),
                false => (form * usual / (effects * targets.len() as f64)).ln(),
            },
            is_expected,
            // Air is everywhere.
            is_untold: effect.medium() > medium.max(Medium::Air),
        }
    };
    candidates.iter().map(prior).collect()
}

/// All effects on all their targets, the user's `own` too.
pub(crate) fn enumerate(
    model: &PlantDescription,
    channels: &Channels,
    trials: &[MeasuredTrial],
    typical: &Typical,
    (own, medium): (&[Id], Option<Medium>),
    options: &CandidateOptions,
) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    let moving = model.bodies.iter().filter(|body| body.moves).count();
    let ends = model.bodies.iter().filter(|body| body.end).count();
    let bases = bases(model, options.base_volume_ratio);
    let pace = Pace::typical(model, typical);
    // A joint whose motion is imposed shows no force of its own.
    let is_free = |dof: usize| trials.is_empty() || !trials.iter().all(|of| of.imposes(dof));
    let is_dry = !model.has_fluid && medium.is_none_or(|told| told < Medium::Water);
    // One thing has one name: in a model without fluid that of the joint.
    let is_of_joint = |id: Id, body: &PlantBody| {
        let twin = effects::effect(id).on_one_joint().is_some();
        twin && is_dry && body.only_dof.is_some_and(is_free)
    };
    for id in Id::ALL.iter().filter(|id| is_tried(**id)).chain(own) {
        let effect = effects::effect(*id);
        if medium.is_some_and(|medium| effect.medium() > medium) {
            continue;
        }
        let only = effect.only_on();
        let is_asked = !only.is_empty();
        let is_meant = |name: &str| !is_asked || only.iter().any(|of| of == name);
        // Each alone, and all: with values of their own where every joint has it in a measure of its own, else with shared ones.
        let mut add = |targets: &[(String, Target)]| {
            for one in targets.chunks(1) {
                candidates.extend(Candidate::forms(*id, one));
            }
            if targets.len() > 1 {
                match effect.is_of_every_joint() {
                    true => candidates.push(Candidate::apart(*id, targets)),
                    false => candidates.extend(Candidate::forms(*id, targets)),
                }
            }
        };
        match effect.card().target {
            TargetKind::Body => {
                let boundary = effect.boundary();
                let floats = effect.needs_waterline();
                if floats && !model.has_surface {
                    continue;
                }
                // At one depth, at one distance, these are drag and added mass by another name.
                let stays = |boundary| !travels(model, typical, boundary, options.least_travel);
                if !floats && boundary.is_some_and(stays) {
                    continue;
                }
                let mut bodies: Vec<&PlantBody> =
                    model.bodies.iter().filter(|body| body.moves).collect();
                bodies.retain(|body| is_meant(&body.name));
                bodies.retain(|body| !(floats && body.floats));
                // All bodies are in the same water.
                if matches!(effect.part(), Part::Water(_)) {
                    bodies.retain(|body| bases.contains(&body.name.as_str()));
                    bodies.truncate(1);
                }
                for body in bodies {
                    if boundary.is_some_and(|boundary| {
                        is_out_of_reach(boundary, model, typical, body, options.reach)
                    }) {
                        continue;
                    }
                    if is_of_joint(*id, body) {
                        continue;
                    }
                    let is_base = bases.contains(&body.name.as_str());
                    // What a robot carries hangs at the end of a chain.
                    let carries = effect.is_point_mass() && body.end && ends <= options.all_bodies;
                    let is_small = moving <= options.all_bodies;
                    if !(is_base || is_asked || carries || (is_small && body.wet)) {
                        continue;
                    }
                    let mut scale = body.scale.clone();
                    (scale.speed, scale.rate) = pace.of_body(&body.scale, options.least_speed);
                    if medium.unwrap_or(model.medium) < Medium::Water {
                        scale.buoyancy_left_out = 0.0;
                    }
                    add(&[(body.name.clone(), Target::Body(scale))]);
                }
            }
            TargetKind::Joint => {
                let is_mechanism = |of: &PlantJoint| is_asked || !of.is_coordinate;
                let free =
                    (model.joints.iter()).filter(|joint| is_free(joint.dof) && is_mechanism(joint));
                let targets = free.map(|joint| {
                    let mut scale = joint.scale.clone();
                    scale.speed = typical.speed[joint.dof].max(options.least_joint_speed);
                    scale.travel = typical.travel[joint.qpos].max(options.least_joint_travel);
                    scale.middle = typical.middle[joint.qpos];
                    // A motor may have no limits, and a cart no weight along its rail.
                    let pushes = joint.pushes.iter();
                    let pushes = pushes.map(|(command, force)| force * typical.command[*command]);
                    scale.torque = pushes.fold(scale.torque, f64::max);
                    (joint.name.clone(), Target::Joint(scale))
                });
                // A slide and a hinge have no value in common.
                let targets = targets.filter(|(name, of)| is_meant(name) && effect.applies_to(of));
                let (slides, hinges): (Vec<_>, Vec<_>) =
                    targets.partition(|(_, of)| matches!(of, Target::Joint(of) if of.slides));
                add(&hinges);
                add(&slides);
            }
            TargetKind::Actuator => {
                let targets = model
                    .actuators
                    .iter()
                    .enumerate()
                    .filter_map(|(at, actuator)| {
                        let target = Target::Actuator(ActuatorScale {
                            command: typical.command[at],
                            inflow: pace.speed.max(options.least_speed),
                            step: model.timestep,
                            thrusts: actuator.thrusts,
                        });
                        (typical.command[at] > 0.0 && effect.applies_to(&target))
                            .then(|| (actuator.name.clone(), target))
                    });
                let targets: Vec<_> = targets.collect();
                add(&targets);
            }
            TargetKind::Sensor => {
                for source in &channels.sources {
                    let sensor = &model.sensors[source.sensor];
                    let target = Target::Sensor(SensorScale {
                        dimension: source.channels,
                        noise: noise(channels, source, trials),
                        signal: rms(trials, source.start, source.len),
                        unit: if source.attitude { "rad" } else { sensor.unit },
                        period: (trials.iter().find(|trial| !trial.steady))
                            .map_or(model.timestep, MeasuredTrial::period),
                        attitude: sensor.kind == SensorKind::Quaternion,
                    });
                    if effect.applies_to(&target) {
                        add(&[(sensor.name.clone(), target)]);
                    }
                }
            }
        }
    }
    let longest = trials
        .iter()
        .map(MeasuredTrial::seconds)
        .fold(0.0, f64::max);
    candidates.retain_mut(|of| of.oscillates_within(longest / options.periods));
    candidates
}

/// False for an effect that is part of a design.
fn is_tried(id: Id) -> bool {
    effects::effect(id).is_hypothesis()
}

/// Typical speed and rate of the base.
struct Pace {
    /// Along its translations [m/s].
    speed: f64,
    /// About its rotations [rad/s].
    rate: f64,
    /// True where hinges alone move what there is, so that speeds come from rates.
    swings: bool,
}

impl Pace {
    fn typical(model: &PlantDescription, typical: &Typical) -> Self {
        let norm = |dofs: &mut dyn Iterator<Item = usize>| {
            dofs.map(|dof| typical.speed[dof].powi(2))
                .sum::<f64>()
                .sqrt()
        };
        if let Some(base) = &model.base {
            return Self {
                speed: norm(&mut (base.dof..base.dof + 3)),
                rate: norm(&mut (base.dof + 3..base.dof + 6)),
                swings: false,
            };
        }
        let of = |slides: bool| {
            let joints = model.joints.iter();
            joints
                .filter(move |joint| joint.scale.slides == slides)
                .map(|joint| joint.dof)
        };
        // Slides belong to the carriage of the hull, hinges below them to its limbs.
        let swings = of(true).next().is_none();
        Self {
            speed: norm(&mut of(true)),
            rate: if swings { norm(&mut of(false)) } else { 0.0 },
            swings,
        }
    }

    /// Speed [m/s] and rate [rad/s] of a body: one that swings goes as fast as its far end.
    fn of_body(&self, scale: &BodyScale, least: f64) -> (f64, f64) {
        let speed = if self.swings {
            self.rate * greatest_extent(scale)
        } else {
            self.speed
        };
        (speed.max(least), self.rate.max(least))
    }
}

/// The base of every tree.
pub(crate) fn bases(model: &PlantDescription, volume_ratio: f64) -> Vec<&str> {
    let mut bases: Vec<(&PlantBody, f64)> = Vec::new();
    for body in model.bodies.iter().filter(|body| body.moves) {
        // Of its own: a root's sizes are those of all that hangs on it. A body without weight or size is no hull,
        // however much water it stands for: buoyancy is often written as one.
        match bases.last_mut() {
            Some((base, least)) if !body.root => {
                if body.wet && body.bulk > *least {
                    (*base, *least) = (body, body.bulk);
                }
            }
            _ => bases.push((body, volume_ratio * body.bulk)),
        }
    }
    bases.iter().map(|(body, _)| body.name.as_str()).collect()
}

/// The greatest extent of a body [m], zero where it has none.
fn greatest_extent(scale: &BodyScale) -> f64 {
    scale.extent.into_iter().fold(0.0, f64::max)
}

/// True where a body stays so far below or above the surface, or so far from walls, in all trials that it does not feel them: its
/// drag and added mass there would be drag and added mass by another name.
fn is_out_of_reach(
    boundary: NearBoundary,
    model: &PlantDescription,
    typical: &Typical,
    body: &PlantBody,
    reach: f64,
) -> bool {
    let Some(base) = (model.base.as_ref()).filter(|base| base.body == body.name) else {
        return false;
    };
    let reach = reach * greatest_extent(&body.scale);
    match boundary {
        NearBoundary::FreeSurface => {
            let height = base.qpos + 2;
            let (lowest, highest) = (typical.lowest[height], typical.highest[height]);
            model.waterline - highest > reach || lowest - model.waterline > reach
        }
        NearBoundary::Wall => typical.clearance > reach,
    }
}

/// True where something that moves goes far enough to feel the distance from a boundary change: that from the surface along the
/// vertical alone.
fn travels(
    model: &PlantDescription,
    typical: &Typical,
    boundary: NearBoundary,
    least: f64,
) -> bool {
    let extents = model.bodies.iter().map(|body| greatest_extent(&body.scale));
    let size = extents.fold(0.0, f64::max);
    let is_depth = boundary == NearBoundary::FreeSurface;
    let turns = (model.joints.iter())
        .filter(|joint| !joint.scale.slides || (is_depth && joint.is_level))
        .map(|joint| joint.qpos..joint.qpos + 1);
    let along = (model.base.iter()).flat_map(|base| {
        let [place, attitude] = [base.qpos..base.qpos + 2, base.qpos + 3..base.qpos + 7];
        std::iter::once(attitude).chain(is_depth.then_some(place))
    });
    let kept: Vec<usize> = turns.chain(along).flatten().collect();
    (0..typical.travel.len())
        .filter(|at| !kept.contains(at))
        .any(|at| typical.travel[at] > least * size)
}

/// Noise of a sensor: that of its first component with a reading.
fn noise(channels: &Channels, source: &Source, trials: &[MeasuredTrial]) -> f64 {
    let is_read =
        |component: &usize| source.attitude || rms(trials, source.start + component, 1) > 0.0;
    let read = (0..source.channels).find(is_read).unwrap_or(0);
    channels.list[source.channel + read].noise
}

/// Root mean square of a sensor's readings.
fn rms(trials: &[MeasuredTrial], start: usize, len: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for trial in trials {
        for row in 0..trial.times.len() {
            for value in &trial.row(row)[start..start + len] {
                if value.is_finite() {
                    sum += value * value;
                    count += 1;
                }
            }
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests;
