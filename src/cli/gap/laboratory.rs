//! The stages with MuJoCo behind them.
//!
//! What they share, the trials followed and their sensitivities, is made when the first stage that is not
//! in the folder asks for it.

use std::{
    cell::{OnceCell, RefCell},
    collections::BTreeMap,
    fs,
    path::Path,
};

use anyhow::{Context as _, bail};
use hydro_effects::{
    Id,
    card::{Target, TargetKind},
    effect,
};
use hydro_gap as gap;
use hydro_gap::{
    LinearizedProblem, Naming, Problem, Settings, Uncertainty, Watch, patch,
    plant::{Nuisance, Plant, PlantDescription, Quantity, SensorKind},
    records::{Added, Refitted, Verified},
    trial::{self, Listed, SensorQuantity, SensorSignature, Signature, Trial},
    verdict::Outcome,
};
use hydro_plugin::mujoco::plant::MujocoPlant;

use super::{
    bars::Bars,
    effects::example,
    folder::{CANDIDATE, Folder, PATCHED, provenance},
    inputs::Inputs,
    lines, residual,
    sequence::{self, Candidate, Exam, Reached, Stage, Stages},
    settings::Flags,
};
use crate::cli::{cancel::cancel_on_signal, command_line, print_json, write_line};

/// Runs the stages up to one.
pub(super) fn run(flags: &Flags, until: Stage) -> anyhow::Result<()> {
    if let Some(threads) = flags.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()
            .context("--threads")?;
    }
    let mut folder = open(flags)?;
    let plant = MujocoPlant::load(&flags.model)
        .with_context(|| format!("--model {}", flags.model.display()))?;
    let settings = Settings {
        uncertainty: uncertainty(flags, plant.description())?,
        seed: flags.seed,
        options: gap::Options::default(),
    };
    let stop = cancel_on_signal()?;
    let bars = Bars::default();
    let tell = |what: &str, done: usize, total: usize| bars.tell(what, done, total);
    let watch = Watch {
        stop: &stop,
        tell: &tell,
    };
    let laboratory = Laboratory {
        flags,
        plant: &plant,
        settings: &settings,
        inputs: folder.provenance.inputs.clone(),
        signature: signature(plant.description()),
        remarks: RefCell::default(),
    };
    // Declared in this order: each borrows from the one before.
    let (study, bench, naming) = (OnceCell::new(), OnceCell::new(), OnceCell::new());
    let prepared = |watch: &Watch<'_>| -> anyhow::Result<(&Problem<'_>, &LinearizedProblem<'_>)> {
        let study = filled(&study, || laboratory.study(watch))?;
        let bench = filled(&bench, || Ok(study.linearize(watch)?))?;
        Ok((study, bench))
    };
    let named = |watch: &Watch<'_>| -> anyhow::Result<&Naming> {
        let (study, bench) = prepared(watch)?;
        filled(&naming, || Ok(gap::name(study, bench, watch)?))
    };
    let stages = Stages {
        find: Box::new(|watch| {
            let (study, bench) = prepared(watch)?;
            let held_out = laboratory.inputs.held_out_trials();
            let mut found = gap::locate(study, bench, &held_out, watch)?;
            let noticed = laboratory.remarks.take();
            found.remarks.splice(0..0, noticed);
            Ok(found)
        }),
        name: Box::new(|_, watch| Ok(named(watch)?.named.clone())),
        add: Box::new(|_, _, watch| {
            let (study, bench) = prepared(watch)?;
            let naming = named(watch)?;
            match gap::add(study, bench, naming) {
                Some(addition) => laboratory.candidate(addition).map(Some),
                None if naming.named.outcome == Outcome::Unknown && !flags.no_residual => {
                    let nuisances = gap::refitted(bench, naming);
                    laboratory.residual(study, nuisances, watch).map(Some)
                }
                None => Ok(None),
            }
        }),
        verify: Box::new(|exam, watch| laboratory.verify(exam, watch)),
    };
    let note = |inputs: &mut Inputs| inputs.note_held_out(&trial::list(&flags.trials)?);
    let reached = sequence::run(&mut folder, &stages, until, &watch, note);
    bars.finish();
    tell_of(&reached?, flags)
}

/// The folder of results: gone on with where the inputs are the same.
pub(super) fn open(flags: &Flags) -> anyhow::Result<Folder<Inputs>> {
    let known = provenance::<Inputs>(&flags.out)?;
    let mut inputs = Inputs::look(flags, known.as_ref().map(|known| &known.inputs))?;
    let Some(mut known) = known else {
        let model = flags.model.display().to_string();
        return Folder::start(&flags.out, model, command_line(), inputs);
    };
    let differences = inputs.differences(&known.inputs, &trial::list(&flags.trials)?);
    if differences.is_empty() {
        inputs.keep_held_out(&known.inputs);
        known.command = command_line();
        let mut folder = Folder::go_on(&flags.out, known)?;
        if flags.overwrite {
            folder.clear(inputs)?;
        }
        return Ok(folder);
    }
    if !flags.overwrite {
        bail!(
            "--out {} holds results of other inputs: {}; --overwrite starts anew, or choose another --out",
            flags.out.display(),
            differences.join("; ")
        );
    }
    (known.command, known.model) = (command_line(), flags.model.display().to_string());
    // What an old run knew of a held-out trial that is away now is of no use.
    let inputs = Inputs::look(flags, None)?;
    let mut folder = Folder::go_on(&flags.out, known)?;
    folder.clear(inputs)?;
    Ok(folder)
}

fn uncertainty(flags: &Flags, model: &PlantDescription) -> anyhow::Result<Uncertainty> {
    let Some(path) = &flags.uncertainty else {
        return Ok(Uncertainty::default());
    };
    let place = || format!("--uncertainty {}", path.display());
    let text = fs::read_to_string(path).with_context(place)?;
    Uncertainty::parse(&text, &model.nuisances).with_context(place)
}

/// The value of a cell, made on the first call.
fn filled<T>(cell: &OnceCell<T>, make: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<&T> {
    if let Some(value) = cell.get() {
        return Ok(value);
    }
    let value = make()?;
    Ok(cell.get_or_init(|| value))
}

/// What every stage starts from.
struct Laboratory<'a> {
    flags: &'a Flags,
    plant: &'a MujocoPlant,
    settings: &'a Settings,
    inputs: Inputs,
    signature: Signature,
    /// What was noticed in the trials that were read last.
    remarks: RefCell<Vec<String>>,
}

impl<'a> Laboratory<'a> {
    fn study(&self, watch: &Watch<'_>) -> anyhow::Result<Problem<'a>> {
        let trials = self.read(&self.inputs.fit_trials())?;
        Ok(Problem::prepare(
            self.plant,
            trials,
            self.settings.clone(),
            watch,
        )?)
    }

    /// Reads trials by name; what is noticed is kept for the report.
    fn read(&self, names: &[String]) -> anyhow::Result<Vec<Trial>> {
        let listed = trial::list(&self.flags.trials)?;
        let mut noticed: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut trials = Vec::with_capacity(names.len());
        for name in names {
            let Some(file) = listed.iter().find(|one| one.name == *name) else {
                bail!(
                    "--trials {}: the trial `{name}` is not there; there are {}",
                    self.flags.trials.display(),
                    names_of(&listed)
                );
            };
            let (trial, remarks) = trial::read(&file.path, &self.signature)?;
            for remark in remarks {
                noticed.entry(remark.text).or_default().push(name.clone());
            }
            trials.push(trial);
        }
        *self.remarks.borrow_mut() = noticed
            .into_iter()
            .map(|(text, trials)| format!("{text} (trials {})", trials.join(", ")))
            .collect();
        Ok(trials)
    }

    /// The text of the candidate, and how it differs from the nominal model.
    fn candidate(&self, addition: gap::Addition) -> anyhow::Result<Candidate> {
        let patched = patch::patch(&patch::Request {
            nominal: &self.flags.model,
            entries: &addition.entries,
            numbers: &addition.numbers,
            description: self.plant.description(),
            names: parameter_names,
            search: &[],
        })?;
        let mut added = addition.added;
        refit(
            &mut added,
            &patched,
            &addition.numbers,
            &addition.deviations,
            "together with the effects",
        );
        written(&self.flags.model, added, patched)
    }

    /// A candidate with a learned residual, or the remark why there is none.
    fn residual(
        &self,
        study: &Problem<'_>,
        nuisances: Vec<(f64, f64)>,
        watch: &Watch<'_>,
    ) -> anyhow::Result<Candidate> {
        let task = residual::Task {
            nominal: &self.flags.model,
            model: self.plant.description(),
            out: &self.flags.out,
            seed: self.settings.seed,
            nuisances,
        };
        residual::candidate(&task, study, watch)
    }

    fn verify(&self, exam: &Exam<'_>, watch: &Watch<'_>) -> anyhow::Result<Option<Verified>> {
        let held_out = self.inputs.held_out_trials();
        if held_out.is_empty() {
            return Ok(None);
        }
        // Without an addition the nominal model is compared with itself: its error is worth knowing.
        let path = exam.candidate.unwrap_or(&self.flags.model);
        let after = MujocoPlant::load(path)
            .with_context(|| format!("the patched model {}", path.display()))?;
        let none = BTreeMap::new();
        let examined = gap::VerifyInput {
            before: self.plant,
            after: &after,
            sensors: exam.added.map_or(&none, |added| &added.sensors),
            cross_fit: exam.added.map_or(&[], |added| &added.cross_fit),
            recalibrated: exam.added.map_or(&[], |added| &added.recalibrated),
        };
        let trials = self.read(&held_out)?;
        let noticed = self.remarks.take();
        let fitted = self.inputs.fit_trials();
        let few = held_out.len() + fitted.len() <= self.settings.options.verify.cross_fit_trials;
        let fitted = if few && !examined.cross_fit.is_empty() {
            self.read(&fitted)?
        } else {
            Vec::new()
        };
        self.remarks.replace(noticed);
        let channels = &exam.found.channels;
        let mut verified = gap::verify(&examined, trials, fitted, channels, self.settings, watch)?;
        verified.remarks.extend(self.remarks.take());
        Ok(Some(verified))
    }
}

/// Notes which numbers of the nominal were written, of those that were asked for; `beside` says what they
/// were fitted with.
pub(super) fn refit(
    added: &mut Added,
    patched: &patch::Patched,
    numbers: &[(Nuisance, f64)],
    deviations: &[f64],
    beside: &str,
) {
    let refitted = patched.numbers.iter().map(|written| {
        let of = &numbers[written.number].0.quantity;
        let unit = match of {
            Quantity::CentreOfMass(_) => 1.0,
            _ => written.from.abs(),
        };
        Refitted {
            what: written.name.clone(),
            from: written.from,
            to: written.to,
            unit: written.unit.to_owned(),
            deviation: deviations[written.number] * unit,
        }
    });
    added.numbers = refitted.collect();
    if !added.numbers.is_empty() {
        added.remarks.push(format!(
            "{PATCHED} holds {} numbers of the nominal model as they were fitted {beside}, each within \
             its declared uncertainty",
            added.numbers.len()
        ));
    }
}

/// What `add` hands on of a patched model.
pub(super) fn written(
    nominal: &Path,
    mut added: Added,
    patched: patch::Patched,
) -> anyhow::Result<Candidate> {
    let text =
        fs::read_to_string(nominal).with_context(|| format!("--model {}", nominal.display()))?;
    let name = nominal.file_name().unwrap_or_default();
    let names = (&*name.to_string_lossy(), PATCHED);
    added.diff = patch::unified(&text, &patched.xml, names);
    added.model = Some(PATCHED.to_owned());
    added.remarks.extend(patched.remarks);
    Ok(Candidate {
        added,
        xml: Some(patched.xml),
        residual: Vec::new(),
    })
}

fn names_of(listed: &[Listed]) -> String {
    let names: Vec<&str> = listed.iter().map(|one| one.name.as_str()).collect();
    names.join(", ")
}

/// Names of the parameters of an effect on a target of a model. A body's shape chooses them (across which axes flow
/// is felt), sizes of what else there is do not.
pub(super) fn parameter_names(model: &PlantDescription, id: Id, target: &str) -> Vec<String> {
    let effect = effect(id);
    let kind = effect.card().target;
    let body = model.bodies.iter().find(|body| body.name == target);
    let sizes = match body {
        Some(body) if kind == TargetKind::Body => Target::Body(body.scale.clone()),
        _ => example(kind),
    };
    effect
        .parameters(&sizes)
        .into_iter()
        .map(|parameter| parameter.name)
        .collect()
}

/// What a trial has to fit.
fn signature(model: &PlantDescription) -> Signature {
    let sensors = model.sensors.iter().map(|sensor| SensorSignature {
        name: sensor.name.clone(),
        dim: sensor.len,
        kind: match sensor.kind {
            SensorKind::Quaternion => SensorQuantity::Quaternion,
            SensorKind::JointPosition if sensor.unit == "rad" => SensorQuantity::Angle,
            _ => SensorQuantity::Other,
        },
    });
    Signature {
        actuators: model.actuators.iter().map(|a| a.name.clone()).collect(),
        sensors: sensors.collect(),
        state_len: model.state_len,
        timestep: model.timestep,
    }
}

/// The last word.
fn tell_of(reached: &Reached, flags: &Flags) -> anyhow::Result<()> {
    match (reached, flags.json) {
        (Reached::Found(found), true) => print_json(found),
        (Reached::Named(named), true) => print_json(named),
        (Reached::Added(added), true) => print_json(added),
        (Reached::Verdict(record), true) => print_json(&record.verdict),
        (Reached::Found(found), false) => write_line(&lines::found(found)),
        (Reached::Named(named), false) => write_line(&lines::named(named)),
        (Reached::Added(added), false) => {
            let candidate = flags.out.join(CANDIDATE);
            write_line(&lines::added((**added).as_ref(), &candidate))
        }
        (Reached::Verdict(record), false) => write_line(&lines::ten_lines(record, &flags.out)),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// What is written must be what the plugin reads: a link is long along z, a hull along x.
    #[test]
    fn names_are_those_of_the_body() {
        let text = r#"<mujoco><option density="1000"/><worldbody>
            <body name="hull"><freejoint/><geom type="ellipsoid" size="0.4 0.2 0.1" mass="30"/>
            <body name="link"><joint name="hinge"/>
            <geom type="ellipsoid" size="0.03 0.02 0.2" mass="1"/></body></body></worldbody></mujoco>"#;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nominal.xml");
        std::fs::write(&path, text).unwrap();
        let plant = MujocoPlant::load(&path).unwrap();
        let names = |id, target: &str| parameter_names(plant.description(), id, target);
        assert_eq!(names(Id::CrossFlowDrag, "hull"), ["sway", "heave"]);
        assert_eq!(names(Id::CrossFlowDrag, "link"), ["surge", "sway"]);
        assert_eq!(names(Id::JointDamping, "hinge"), ["damping"]);
        // An actuator's name may be a body's.
        assert_eq!(names(Id::ActuatorDelay, "link"), ["delay"]);
    }
}
