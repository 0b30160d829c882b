//! The pipeline of stages: a stage that the folder holds is not computed again, a finished stage is saved at once, and a
//! stop takes effect between and inside stages.

use std::{collections::BTreeMap, path::Path, sync::atomic::Ordering, time::Instant};

use anyhow::{Context as _, bail};
use hydro_gap::{
    Watch, conclude,
    records::{Added, Found, Named, Record, Verified},
};
use hydro_plugin::report::gap::page;
use serde::{Deserialize, Serialize};

use super::{
    candidate::Candidate,
    results_folder::{
        CANDIDATE, Folder, PATCHED, Product, REPORT, RESIDUAL_FILES, TIMING, VERDICT, read,
    },
};
use crate::cli::machine::peak_memory;

/// The last stage to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stage {
    Find,
    Name,
    Add,
    Verify,
}

/// Input of `verify`.
pub(super) struct HeldOutInput<'a> {
    pub(super) found: &'a Found,
    pub(super) added: Option<&'a Added>,
    /// The candidate's file: the model as written is judged, not the fit.
    pub(super) candidate: Option<&'a Path>,
}

type Find<'a> = Box<dyn Fn(&Watch<'_>) -> anyhow::Result<Found> + 'a>;
type Name<'a> = Box<dyn Fn(&Found, &Watch<'_>) -> anyhow::Result<Named> + 'a>;
/// `None` where there is nothing to add.
type Add<'a> = Box<dyn Fn(&Found, &Named, &Watch<'_>) -> anyhow::Result<Option<Candidate>> + 'a>;
/// `None` where no trial is held out.
type Verify<'a> =
    Box<dyn Fn(&HeldOutInput<'_>, &Watch<'_>) -> anyhow::Result<Option<Verified>> + 'a>;

/// The stages, replaceable so that the pipeline can be tested without a simulator.
pub(super) struct Stages<'a> {
    pub(super) find: Find<'a>,
    pub(super) name: Name<'a>,
    pub(super) add: Add<'a>,
    pub(super) verify: Verify<'a>,
}

/// `timing.json`: seconds by stage, and the greatest memory.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Timing {
    /// Seconds by stage, when it was computed.
    pub(super) seconds: BTreeMap<String, f64>,
    /// Greatest resident memory of the last process [byte]; `None` where the system does not say.
    peak_memory: Option<u64>,
}

/// Result of the last stage that ran.
#[derive(Debug)]
pub(super) enum Reached {
    Found(Box<Found>),
    Named(Box<Named>),
    Added(Box<Option<Added>>),
    Verdict(Box<Record>),
}

/// Runs the stages up to `until` in a folder. `before_verify` records the held-out files that are about to be opened.
pub(super) fn run<I: Serialize>(
    folder: &mut Folder<I>,
    stages: &Stages<'_>,
    until: Stage,
    watch: &Watch<'_>,
    before_verify: impl Fn(&mut I) -> anyhow::Result<()>,
) -> anyhow::Result<Reached> {
    let mut runner = Runner {
        watch,
        timing: timing(&folder.file(TIMING)),
        fresh: false,
        stood: None,
    };
    let found: Found = runner.stage(folder, |_| (stages.find)(watch))?;
    if until == Stage::Find {
        return Ok(Reached::Found(Box::new(found)));
    }
    let named: Named = runner.stage(folder, |_| (stages.name)(&found, watch))?;
    if until == Stage::Name {
        return Ok(Reached::Named(Box::new(named)));
    }
    let candidate = folder.file(CANDIDATE);
    let known = folder.product::<Option<Added>>()?.flatten();
    let lost = RESIDUAL_FILES.iter().any(|name| folder.lost(name));
    if known.is_some_and(|added| added.is_written()) && (lost || !candidate.exists()) {
        // Without the model the record is useless.
        folder.forget::<Option<Added>>()?;
    }
    let added: Option<Added> = runner.stage(folder, |folder| {
        let Some(made) = (stages.add)(&found, &named, watch)? else {
            folder.remove(CANDIDATE)?;
            folder.remove_residual()?;
            return Ok(None);
        };
        if made.residual.is_empty() {
            folder.remove_residual()?;
        }
        for (name, bytes) in &made.residual {
            folder.write(name, bytes)?;
        }
        match &made.xml {
            Some(xml) => folder.write(CANDIDATE, xml.as_bytes())?,
            None => folder.remove(CANDIDATE)?,
        }
        Ok(Some(made.added))
    })?;
    if until == Stage::Add {
        return Ok(Reached::Added(Box::new(added)));
    }
    let verified: Option<Verified> = runner.stage(folder, |folder| {
        before_verify(&mut folder.provenance.inputs)?;
        folder.save_provenance()?;
        let input = HeldOutInput {
            found: &found,
            added: added.as_ref(),
            candidate: added
                .as_ref()
                .is_some_and(Added::is_written)
                .then_some(candidate.as_path()),
        };
        (stages.verify)(&input, watch)
    })?;
    runner.say_stood();
    let seconds = runner.timing.seconds;
    let record = record(folder, seconds, found, named, added, verified);
    publish(folder, &record)?;
    Ok(Reached::Verdict(Box::new(record)))
}

/// The record of all stages in a folder, for `hydro gap report`.
pub(super) fn gather<I: Serialize>(folder: &Folder<I>) -> anyhow::Result<Record> {
    fn needed<P: Product>(folder: &Folder<impl Serialize>) -> anyhow::Result<P> {
        folder.product()?.with_context(|| {
            format!(
                "{} is not there: `hydro gap {}` has not run in this folder",
                folder.file(P::FILE).display(),
                P::STAGE
            )
        })
    }
    Ok(record(
        folder,
        timing(&folder.file(TIMING)).seconds,
        needed(folder)?,
        needed(folder)?,
        needed(folder)?,
        needed(folder)?,
    ))
}

fn record<I: Serialize>(
    folder: &Folder<I>,
    seconds: BTreeMap<String, f64>,
    found: Found,
    named: Named,
    added: Option<Added>,
    verified: Option<Verified>,
) -> Record {
    Record {
        model: folder.provenance.model.clone(),
        command: folder.provenance.command.clone(),
        verdict: conclude(&found, &named, added.as_ref(), verified.as_ref()),
        found,
        named,
        added,
        verified,
        seconds,
    }
}

/// Writes the patched model, where it was accepted, the verdict and the page.
pub(super) fn publish<I: Serialize>(folder: &mut Folder<I>, record: &Record) -> anyhow::Result<()> {
    match &record.verdict.patch {
        Some(_) => {
            let candidate = folder.file(CANDIDATE);
            let xml = read(&candidate)?.with_context(|| {
                format!("{} is gone; `hydro gap add` makes it", candidate.display())
            })?;
            folder.write(PATCHED, &xml)?;
        }
        None => folder.remove(PATCHED)?,
    }
    folder.write(VERDICT, &serde_json::to_vec_pretty(&record.verdict)?)?;
    folder.write(REPORT, page(record).as_bytes())
}

struct Runner<'a> {
    watch: &'a Watch<'a>,
    timing: Timing,
    /// True once a stage was computed: the later ones in the folder are stale.
    fresh: bool,
    /// The last stage that the folder held.
    stood: Option<&'static str>,
}

impl Runner<'_> {
    /// The result of a stage: from the folder, or computed.
    fn stage<P: Product, I: Serialize>(
        &mut self,
        folder: &mut Folder<I>,
        compute: impl FnOnce(&mut Folder<I>) -> anyhow::Result<P>,
    ) -> anyhow::Result<P> {
        if !self.fresh
            && let Some(product) = folder.product::<P>()?
        {
            self.stood = Some(P::STAGE);
            return Ok(product);
        }
        folder.forget::<P>()?;
        self.say_stood();
        self.fresh = true;
        self.heed(P::STAGE)?;
        let clock = Instant::now();
        let product = match compute(folder) {
            Ok(product) => product,
            // A stage that was stopped may fail in any way; the stop is the cause to report.
            Err(error) => return self.heed(P::STAGE).and(Err(error)),
        };
        folder.keep(&product)?;
        let seconds = clock.elapsed().as_secs_f64();
        self.timing.seconds.insert(P::STAGE.to_owned(), seconds);
        self.timing.peak_memory = peak_memory();
        folder.note(TIMING, &self.timing)?;
        Ok(product)
    }

    /// Says once that an earlier run is gone on with.
    fn say_stood(&mut self) {
        if let Some(stage) = self.stood.take() {
            eprintln!("going on after `{stage}` of an earlier run");
        }
    }

    /// An error where a stop was asked for.
    fn heed(&self, stage: &str) -> anyhow::Result<()> {
        if self.watch.stop.load(Ordering::Relaxed) {
            bail!(
                "interrupted in `{stage}`; what was finished is kept, and the same command goes on from there"
            );
        }
        Ok(())
    }
}

/// Times of earlier runs; none where the file is missing or damaged.
fn timing(path: &Path) -> Timing {
    let known = hydro_files::read(path, hydro_files::TEXT).ok();
    known
        .and_then(|text| serde_json::from_slice(&text).ok())
        .unwrap_or_default()
}
