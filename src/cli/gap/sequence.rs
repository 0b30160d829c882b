//! The stages one after the other: what the folder holds is not computed again, every stage is kept as
//! soon as it is done, and a stop is heeded between and inside stages.

use std::{collections::BTreeMap, path::Path, sync::atomic::Ordering, time::Instant};

use anyhow::{Context as _, bail};
use hydro_gap::{
    Watch, conclude,
    records::{Added, Found, Named, Record, Verified},
};
use hydro_plugin::report::gap::page;
use serde::{Deserialize, Serialize};

use super::folder::{
    CANDIDATE, Folder, PATCHED, Product, REPORT, RESIDUAL_FILES, TIMING, VERDICT, read,
};

/// How far to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stage {
    /// Where.
    Find,
    /// What.
    Name,
    /// A candidate.
    Add,
    /// The verdict.
    Verify,
}

/// What `add` hands on: its record, and the text of the candidate model with the files of a learned
/// residual that it names. Without a text the record says why there is none.
pub(super) struct Candidate {
    pub(super) added: Added,
    pub(super) xml: Option<String>,
    /// By name in the folder of results.
    pub(super) residual: Vec<(&'static str, Vec<u8>)>,
}

/// What `verify` gets.
pub(super) struct Exam<'a> {
    pub(super) found: &'a Found,
    pub(super) added: Option<&'a Added>,
    /// The candidate on disk: the file must show the gain, not the fit.
    pub(super) candidate: Option<&'a Path>,
}

/// Finds.
type Find<'a> = Box<dyn Fn(&Watch<'_>) -> anyhow::Result<Found> + 'a>;
/// Names.
type Name<'a> = Box<dyn Fn(&Found, &Watch<'_>) -> anyhow::Result<Named> + 'a>;
/// Adds; none where there is nothing to add.
type Add<'a> = Box<dyn Fn(&Found, &Named, &Watch<'_>) -> anyhow::Result<Option<Candidate>> + 'a>;
/// Verifies; none where nothing is held out.
type Verify<'a> = Box<dyn Fn(&Exam<'_>, &Watch<'_>) -> anyhow::Result<Option<Verified>> + 'a>;

/// The work itself, so that going on can be tested without a simulator.
pub(super) struct Stages<'a> {
    pub(super) find: Find<'a>,
    pub(super) name: Name<'a>,
    pub(super) add: Add<'a>,
    pub(super) verify: Verify<'a>,
}

/// Seconds by stage and the greatest memory, for `timing.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Timing {
    /// Seconds by stage, when it was computed.
    pub(super) seconds: BTreeMap<String, f64>,
    /// Greatest resident memory of the last process [byte]; none where the system does not say.
    peak_memory: Option<u64>,
}

/// How far it came.
#[derive(Debug)]
pub(super) enum Reached {
    /// Where.
    Found(Box<Found>),
    /// What.
    Named(Box<Named>),
    /// A candidate, or that there is none.
    Added(Box<Option<Added>>),
    /// All.
    Verdict(Box<Record>),
}

/// Runs the stages up to one, in a folder. `before_verify` notes which held-out files are opened.
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
        // The record is of no use without the model.
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
        let exam = Exam {
            found: &found,
            added: added.as_ref(),
            candidate: added
                .as_ref()
                .is_some_and(Added::is_written)
                .then_some(candidate.as_path()),
        };
        (stages.verify)(&exam, watch)
    })?;
    let seconds = runner.timing.seconds;
    let record = record(folder, seconds, found, named, added, verified);
    publish(folder, &record)?;
    Ok(Reached::Verdict(Box::new(record)))
}

/// Puts together what a folder holds, for `hydro gap report`.
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

/// Writes what other programs and people read: the patched model where it was accepted, verdict and page.
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
    /// True once a stage was computed: what followed the old one is stale.
    fresh: bool,
}

impl Runner<'_> {
    /// What the folder holds of a stage, or what computing it gives.
    fn stage<P: Product, I: Serialize>(
        &mut self,
        folder: &mut Folder<I>,
        compute: impl FnOnce(&mut Folder<I>) -> anyhow::Result<P>,
    ) -> anyhow::Result<P> {
        if !self.fresh
            && let Some(product) = folder.product::<P>()?
        {
            return Ok(product);
        }
        folder.forget::<P>()?;
        self.fresh = true;
        self.heed(P::STAGE)?;
        let clock = Instant::now();
        let product = match compute(folder) {
            Ok(product) => product,
            // Whatever a stage says that was stopped, it is not its fault.
            Err(error) => return self.heed(P::STAGE).and(Err(error)),
        };
        folder.keep(&product)?;
        let seconds = clock.elapsed().as_secs_f64();
        self.timing.seconds.insert(P::STAGE.to_owned(), seconds);
        self.timing.peak_memory = peak_memory();
        folder.note(TIMING, &self.timing)?;
        Ok(product)
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

/// Times of stages that ran before; a damaged file costs only the times.
fn timing(path: &Path) -> Timing {
    let known = std::fs::read(path).ok();
    known
        .and_then(|text| serde_json::from_slice(&text).ok())
        .unwrap_or_default()
}

/// Greatest resident memory of this process [byte], from Linux's /proc.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
