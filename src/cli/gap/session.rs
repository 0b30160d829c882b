//! One run of `hydro gap`: the stages with MuJoCo as the plant.
//!
//! The stages share the simulated trials and their sensitivities, which are computed when the first stage that the folder
//! of results does not hold needs them.

use std::{
    cell::{OnceCell, RefCell},
    collections::BTreeMap,
    path::Path,
};

use anyhow::{Context as _, bail};
use hydro_effects::Medium;
use hydro_gap as gap;
use hydro_gap::{
    Explanation, Followed, Naming, Problem, Settings, Uncertainty, Watch, patch,
    plant::{Plant, PlantDescription, SensorKind},
    records::Verified,
    trial::{self, Listed, SensorQuantity, SensorSignature, Signature, Trial},
    verdict::Outcome,
};
use hydro_plugin::mujoco::plant::MujocoPlant;

use super::{
    bars::Bars,
    candidate::{Candidate, parameter_names, patched_candidate, record_refitted},
    flags::Flags,
    inputs::{Inputs, own_effects},
    left_out::LeftOut,
    own_effects::fit,
    pipeline::{self, HeldOutInput, Reached, Stage, Stages},
    residual_candidate,
    results_folder::{CANDIDATE, Folder, lock, provenance},
    terminal,
};
use crate::cli::{
    cancel::{GOES_ON, cancel_on_signal},
    command_line, print_json, write_line,
};

/// Runs the stages up to `until`.
pub(super) fn run(flags: &Flags, until: Stage) -> anyhow::Result<()> {
    if let Some(threads) = flags.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.into())
            .build_global()
            .context("--threads")?;
    }
    names_are_text(flags)?;
    let _lock = lock(&flags.out, &command_line())?;
    let mut folder = open(flags)?;
    let plant = MujocoPlant::load(&flags.model)
        .with_context(|| format!("--model {}", flags.model.display()))?;
    check_timestep(&flags.model, plant.description().timestep)?;
    let own_effects = own_effects(flags)?;
    fit(&own_effects, plant.description())?;
    let settings = Settings {
        medium: medium(flags, plant.description())?,
        own_effects,
        uncertainty: uncertainty(flags, plant.description())?,
        seed: flags.seed,
        options: gap::Options::default(),
    };
    let stop = cancel_on_signal(GOES_ON)?;
    let bars = Bars::default();
    let tell = |what: &str, done: usize, total: usize| bars.tell(what, done, total);
    let watch = Watch {
        stop: &stop,
        tell: &tell,
    };
    let session = Session {
        flags,
        plant: &plant,
        settings: &settings,
        inputs: folder.provenance.inputs.clone(),
        signature: signature(plant.description()),
        remarks: RefCell::default(),
        left_out: RefCell::default(),
    };
    // In this order, because each borrows from the one before.
    let (problem, followed) = (OnceCell::new(), OnceCell::new());
    let (explanation, naming) = (OnceCell::new(), OnceCell::new());
    let prepared = |watch: &Watch<'_>| filled(&problem, || session.problem(watch));
    let follow = |watch: &Watch<'_>| -> anyhow::Result<&Followed<'_>> {
        let problem = prepared(watch)?;
        filled(&followed, || Ok(Followed::new(problem, watch)?))
    };
    let explained = |watch: &Watch<'_>| -> anyhow::Result<&Explanation<'_>> {
        let followed = follow(watch)?;
        filled(&explanation, || Ok(gap::explain(followed, watch)?))
    };
    let named = |watch: &Watch<'_>| -> anyhow::Result<&Naming> {
        let explanation = explained(watch)?;
        filled(&naming, || Ok(gap::name(explanation, watch)?))
    };
    let stages = Stages {
        find: Box::new(|watch| {
            let held_out = session.inputs.held_out_trials();
            let mut found = gap::locate(follow(watch)?, &held_out, watch)?;
            let noticed = session.remarks.take();
            found.remarks.splice(0..0, noticed);
            Ok(found)
        }),
        name: Box::new(|_, watch| Ok(named(watch)?.named.clone())),
        add: Box::new(|_, _, watch| {
            let naming = named(watch)?;
            let explanation = explained(watch)?;
            match gap::add(explanation, naming) {
                Some(addition) => session.candidate(addition).map(Some),
                None if naming.named.outcome == Outcome::Unknown && !flags.no_residual => {
                    let nuisances = gap::refitted(explanation);
                    session
                        .residual(prepared(watch)?, nuisances, watch)
                        .map(Some)
                }
                None => Ok(None),
            }
        }),
        verify: Box::new(|input, watch| session.verify(input, watch)),
    };
    let note = |inputs: &mut Inputs| inputs.note_held_out(&trial::list(&flags.trials)?);
    let reached = pipeline::run(&mut folder, &stages, until, &watch, note);
    bars.finish();
    print_result(&reached?, flags)
}

/// Refuses names that are no text: run.json holds them, and MuJoCo takes no others.
fn names_are_text(flags: &Flags) -> anyhow::Result<()> {
    for (flag, path) in [
        ("--model", &flags.model),
        ("--trials", &flags.trials),
        ("--out", &flags.out),
    ] {
        if path.to_str().is_none() {
            bail!(
                "{flag} {}: the name is no UTF-8 text; rename the folder or file",
                path.display()
            );
        }
    }
    Ok(())
}

/// Steps of a model that can be meant [s].
const STEPS: std::ops::RangeInclusive<f64> = 1e-6..=10.0;

/// Refuses a model whose step no trial can be followed with.
fn check_timestep(model: &Path, timestep: f64) -> anyhow::Result<()> {
    if STEPS.contains(&timestep) {
        return Ok(());
    }
    bail!(
        "--model {}: the timestep of its <option> is {} s, expected from {:e} to {}; seconds are meant",
        model.display(),
        hydro_files::number(timestep),
        STEPS.start(),
        STEPS.end()
    )
}

/// The folder of results, continued where the inputs are the same.
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
    // Held-out trials of the old run whose files are gone no longer count.
    let inputs = Inputs::look(flags, None)?;
    let mut folder = Folder::go_on(&flags.out, known)?;
    folder.clear(inputs)?;
    Ok(folder)
}

/// The medium of the flag. One that the model contradicts is refused.
fn medium(flags: &Flags, model: &PlantDescription) -> anyhow::Result<Option<Medium>> {
    let stated = flags.medium.map(Medium::from);
    if let Some(stated) = stated
        && model.has_fluid
        && stated != model.medium
    {
        bail!(
            "--medium is {stated}, but the fluid of {} is {}: its density, a checkpoint or an effect of `hydro.wrench` says so",
            flags.model.display(),
            model.medium
        );
    }
    Ok(stated)
}

fn uncertainty(flags: &Flags, model: &PlantDescription) -> anyhow::Result<Uncertainty> {
    let Some(path) = &flags.uncertainty else {
        return Ok(Uncertainty::default());
    };
    let place = || format!("--uncertainty {}", path.display());
    let text = hydro_files::read_text(path, hydro_files::TEXT).with_context(place)?;
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

/// Shared inputs of the stages.
struct Session<'a> {
    flags: &'a Flags,
    plant: &'a MujocoPlant,
    settings: &'a Settings,
    inputs: Inputs,
    signature: Signature,
    /// Remarks on the trials read last.
    remarks: RefCell<Vec<String>>,
    /// Signals that are not compared.
    left_out: RefCell<LeftOut>,
}

impl<'a> Session<'a> {
    fn problem(&self, watch: &Watch<'_>) -> anyhow::Result<Problem<'a>> {
        let trials = self.read(&self.inputs.fit_trials())?;
        for line in self.left_out.borrow().lines() {
            eprintln!("{line}");
        }
        let problem = Problem::prepare(self.plant, trials, self.settings.clone(), watch)?;
        Ok(problem.with_likelier_commands(watch)?)
    }

    /// Reads trials by name and keeps the remarks for the report.
    fn read(&self, names: &[String]) -> anyhow::Result<Vec<Trial>> {
        let listed = trial::list(&self.flags.trials)?;
        let mut noticed: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut trials = Vec::with_capacity(names.len());
        for name in names {
            let Some(file) = listed.iter().find(|one| one.name == *name) else {
                bail!(
                    "--trials {}: the trial `{name}` is not there; there are {}",
                    self.flags.trials.display(),
                    trial_names(&listed)
                );
            };
            let (trial, remarks) = trial::read_listed(file, &self.signature)?;
            for remark in remarks {
                self.left_out.borrow_mut().note(&remark.kind);
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

    /// The candidate model with effects, and its difference to the nominal model.
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
        record_refitted(
            &mut added,
            &patched,
            &addition.numbers,
            &addition.deviations,
            "together with the effects",
        );
        patched_candidate(&self.flags.model, added, patched)
    }

    /// A candidate with a learned residual, or a remark why there is none.
    fn residual(
        &self,
        problem: &Problem<'_>,
        nuisances: Vec<(f64, f64)>,
        watch: &Watch<'_>,
    ) -> anyhow::Result<Candidate> {
        let task = residual_candidate::Task {
            nominal: &self.flags.model,
            model: self.plant.description(),
            out: &self.flags.out,
            seed: self.settings.seed,
            nuisances,
        };
        residual_candidate::candidate(&task, problem, watch)
    }

    fn verify(
        &self,
        input: &HeldOutInput<'_>,
        watch: &Watch<'_>,
    ) -> anyhow::Result<Option<Verified>> {
        let held_out = self.inputs.held_out_trials();
        if held_out.is_empty() {
            return Ok(None);
        }
        // Without an addition the nominal model is compared with itself, for its error.
        let path = input.candidate.unwrap_or(&self.flags.model);
        let after = MujocoPlant::load(path)
            .with_context(|| format!("the patched model {}", path.display()))?;
        let none = BTreeMap::new();
        let examined = gap::VerifyInput {
            before: self.plant,
            after: &after,
            sensors: input.added.map_or(&none, |added| &added.sensors),
            cross_fit: input.added.map_or(&[], |added| &added.cross_fit),
            own: input.added.and_then(|added| added.own.as_ref()),
            recalibrated: input.added.map_or(&[], |added| &added.recalibrated),
            commands_before: input.added.map_or(0.0, |added| added.commands_before),
        };
        let trials = self.read(&held_out)?;
        let noticed = self.remarks.take();
        let fitted = self.inputs.fit_trials();
        let few = gap::is_cross_fitted(held_out.len() + fitted.len(), &self.settings.options);
        let fitted = if few && !examined.cross_fit.is_empty() {
            self.read(&fitted)?
        } else {
            Vec::new()
        };
        self.remarks.replace(noticed);
        let channels = &input.found.channels;
        let mut verified = gap::verify(&examined, trials, fitted, channels, self.settings, watch)?;
        verified.remarks.extend(self.remarks.take());
        Ok(Some(verified))
    }
}

fn trial_names(listed: &[Listed]) -> String {
    let names: Vec<&str> = listed.iter().map(|one| one.name.as_str()).collect();
    names.join(", ")
}

/// The signature that trials are checked against.
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
        joints: model
            .joints
            .iter()
            .map(|joint| joint.name.clone())
            .collect(),
        state_len: model.state_len,
        timestep: model.timestep,
    }
}

/// Prints the result of the last stage.
fn print_result(reached: &Reached, flags: &Flags) -> anyhow::Result<()> {
    match (reached, flags.json) {
        (Reached::Found(found), true) => print_json(found),
        (Reached::Named(named), true) => print_json(named),
        (Reached::Added(added), true) => print_json(added),
        (Reached::Verdict(record), true) => print_json(&record.verdict),
        (Reached::Found(found), false) => write_line(&terminal::found(found)),
        (Reached::Named(named), false) => write_line(&terminal::named(named)),
        (Reached::Added(added), false) => {
            let candidate = flags.out.join(CANDIDATE);
            write_line(&terminal::added((**added).as_ref(), &candidate))
        }
        (Reached::Verdict(record), false) => write_line(&terminal::ten_lines(record, &flags.out)),
    }
}
