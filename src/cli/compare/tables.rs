//! Tables and pictures from the results of the jobs.

use std::collections::BTreeMap;

use anyhow::Context as _;
use hydro_model::{Engine, EngineKind, Solver, checkpoint::Checkpoint};
use hydro_plugin::report::experiment::{figures, pictures, tables};
use hydro_training::{
    Trainer,
    dataset::Dataset,
    experiment::{
        Cost, Entry, ExperimentResults, JobResult, ROUNDS, Reference, Row, Truth, summarise,
        time_engines, yardsticks,
    },
};
use serde::{Deserialize, Serialize};

use super::{args::Args, folder::Folder, inputs::Inputs, plan::Plan};
use crate::cli::{
    command_line::command_line, files::write_whole, machine::processor, output::print_json,
    progress::Progress,
};

/// Times by data set.
type Costs = BTreeMap<String, Vec<Cost>>;

pub(super) fn write(
    args: &Args,
    inputs: &Inputs,
    plan: &Plan,
    folder: &Folder,
) -> anyhow::Result<()> {
    let mut results = Vec::new();
    for job in &plan.jobs {
        results.extend(folder.done(job, plan, inputs)?);
    }
    let costs = costs(args, inputs, plan, folder, &results)?;
    let references = references(args, inputs, folder)?;
    let (rows, orderings) = summarise(
        args.experiment,
        &plan.entries,
        &results,
        &costs,
        &references,
    );
    let experiment = ExperimentResults {
        experiment: args.experiment,
        command: command(),
        data: inputs
            .data
            .iter()
            .map(|(name, set)| (name.clone(), set.sha256().to_owned()))
            .collect(),
        outputs: outputs(inputs),
        budgets: plan.budgets.clone(),
        rows,
        yardsticks: beside(inputs)?,
        references,
        orderings,
        truth: truths(inputs, &results)?,
    };
    write_whole(
        &folder.file("compare.json"),
        serde_json::to_string(&experiment)?.as_bytes(),
    )?;
    let mut drawn = figures(&experiment);
    drawn.retain(|(_, svg)| !svg.is_empty());
    for (name, svg) in &drawn {
        write_whole(&folder.figures().join(name), svg.as_bytes())?;
    }
    let text = tables(&experiment);
    let page = text.clone() + &pictures(drawn.iter().map(|(name, _)| name.as_str()));
    write_whole(&folder.file("README.md"), page.as_bytes())?;
    if args.json {
        return print_json(&experiment);
    }
    say!("{text}");
    say!(
        "{} of {} jobs done; {}",
        results.len(),
        plan.jobs.len(),
        folder.file("README.md").display()
    );
    Ok(())
}

/// The command that does everything, whatever part of it was asked for now.
fn command() -> String {
    let words = command_line();
    words
        .replace(" --tables", "")
        .replace(" --retime", "")
        .replace(" --json", "")
}

fn outputs(inputs: &Inputs) -> Vec<String> {
    let first = inputs.data.values().next();
    first.map_or_else(Vec::new, |set| set.manifest().outputs.clone())
}

/// `references.json`: the reference methods in closed loop, and digests of the data behind them.
#[derive(Serialize, Deserialize)]
struct References {
    on: BTreeMap<String, String>,
    found: Vec<Reference>,
}

/// The references in `--out`; driven now if there are none or they are of other data.
fn references(args: &Args, inputs: &Inputs, folder: &Folder) -> anyhow::Result<Vec<Reference>> {
    let path = folder.file("references.json");
    let mut on = inputs.examined_on();
    // Drag laws are fitted on the data.
    let data = inputs.data.iter();
    on.extend(data.map(|(name, set)| (format!("data.{name}"), set.sha256().to_owned())));
    if let Ok(bytes) = hydro_files::read(&path, hydro_files::TEXT) {
        let known: References = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: not references; take it away", path.display()))?;
        if known.on == on {
            return Ok(known.found);
        }
    }
    let found = measured(args, inputs)?;
    if !found.is_empty() {
        let known = References {
            on,
            found: found.clone(),
        };
        write_whole(&path, serde_json::to_string_pretty(&known)?.as_bytes())?;
    }
    Ok(found)
}

#[cfg(mujoco_plugins)]
fn measured(args: &Args, inputs: &Inputs) -> anyhow::Result<Vec<Reference>> {
    super::swimming::swim_references(args, inputs)
}

/// Empty without MuJoCo.
#[cfg(not(mujoco_plugins))]
fn measured(_: &Args, _: &Inputs) -> anyhow::Result<Vec<Reference>> {
    Ok(Vec::new())
}

/// Yardsticks without learning on every data set, and the numbers that the paper prints for it.
fn beside(inputs: &Inputs) -> anyhow::Result<Vec<Row>> {
    let mut found = Vec::new();
    for (name, set) in &inputs.data {
        found.extend(yardsticks(name, &set.split("test", None)?));
    }
    Ok(found)
}

/// The true force along the first test trajectory of every data set that a job was done on.
fn truths(inputs: &Inputs, results: &[JobResult]) -> anyhow::Result<BTreeMap<String, Truth>> {
    let mut found = BTreeMap::new();
    for (name, set) in &inputs.data {
        if !results.iter().any(|result| result.job.data == *name) {
            continue;
        }
        let test = set.split("test", None)?;
        let rows = test
            .clean(0)
            .chunks_exact(test.outputs())
            .map(<[f32]>::to_vec);
        let truth = Truth {
            time: test.time().to_vec(),
            force: rows.collect(),
        };
        found.insert(name.clone(), truth);
    }
    Ok(found)
}

/// Times of `--out`. Missing times of a data set are measured once all its models are trained: running jobs would disturb them.
fn costs(
    args: &Args,
    inputs: &Inputs,
    plan: &Plan,
    folder: &Folder,
    results: &[JobResult],
) -> anyhow::Result<Costs> {
    let path = folder.file("cost.json");
    let mut costs: Costs = match hydro_files::read(&path, hydro_files::TEXT) {
        Ok(bytes) if !args.retime => serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: not times; try --retime", path.display()))?,
        _ => Costs::new(),
    };
    for (name, set) in &inputs.data {
        let wanted = engines(plan, folder, (name, set), results)?;
        let known = costs.get(name).map_or(&[][..], Vec::as_slice);
        let all_known = wanted
            .iter()
            .all(|(id, _)| known.iter().any(|cost| cost.entry == *id));
        // All in one go, or their ratios mean nothing.
        if wanted.len() < plan.entries.len() {
            if args.retime {
                let lacks = |entry: &&Entry| wanted.iter().all(|(id, _)| id != entry.id);
                let lacking: Vec<_> = plan
                    .entries
                    .iter()
                    .filter(lacks)
                    .map(|entry| entry.id)
                    .collect();
                eprintln!(
                    "{name}: no times are taken, for {} has no weights of {}; --entries leaves rows out",
                    folder.file("jobs").display(),
                    lacking.join(", ")
                );
            }
        } else if !all_known {
            costs.insert(name.clone(), timed(set, &wanted)?);
            write_whole(&path, serde_json::to_string_pretty(&costs)?.as_bytes())?;
        }
    }
    Ok(costs)
}

fn timed(set: &Dataset, engines: &[(String, Box<dyn Engine>)]) -> anyhow::Result<Vec<Cost>> {
    let test = set.split("test", Some(64))?;
    let progress = Progress::new("rounds", ROUNDS as u64 + 1);
    let found = time_engines(engines, &test, &processor(), &|round| {
        progress.at(round as u64 + 1, "times, every engine in turn");
    })?;
    progress.finish();
    Ok(found)
}

/// One engine an entry, of the first seed that has weights. A result may have come without them: fixed steps take as long with
/// the weights that a training begins with, an adaptive solver's do not.
fn engines(
    plan: &Plan,
    folder: &Folder,
    (data, set): (&str, &Dataset),
    results: &[JobResult],
) -> anyhow::Result<Vec<(String, Box<dyn Engine>)>> {
    let mut found = Vec::new();
    for entry in &plan.entries {
        let jobs: Vec<_> = results
            .iter()
            .map(|result| &result.job)
            .filter(|job| job.data == data && job.entry == entry.id)
            .collect();
        let trained = jobs
            .iter()
            .map(|job| folder.checkpoint(job))
            .find(|path| path.join("card.json").is_file());
        let checkpoint = match (trained, jobs.first()) {
            (Some(path), _) => Checkpoint::load(&path)?,
            (None, Some(job)) if entry.solver != Solver::DormandPrince => {
                Trainer::new(plan.training(job)?, set)?.checkpoint(entry.id, &command())?
            }
            _ => continue,
        };
        let engine = (checkpoint.engine(EngineKind::Fused, None))
            .with_context(|| format!("the model {} on {data}", entry.id))?;
        found.push((entry.id.to_owned(), engine));
    }
    Ok(found)
}
