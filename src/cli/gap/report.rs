//! `hydro gap report`: the page again, from the stages in a folder.

use std::path::PathBuf;

use anyhow::{Context as _, bail};

use super::{
    own_effects, pipeline,
    results_folder::{Folder, lock, provenance},
    terminal,
};
use crate::cli::{command_line, print_json};

/// Flags of `hydro gap report`.
#[derive(Debug, clap::Args)]
pub(super) struct Flags {
    /// Folder of results.
    #[arg(long)]
    out: PathBuf,
    /// Print the verdict as JSON and nothing else on standard output.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(flags: &Flags) -> anyhow::Result<()> {
    // The inputs are kept as they are.
    let Some(known) = provenance::<serde_json::Value>(&flags.out)? else {
        bail!(
            "--out {}: no run.json, so no results of hydro gap",
            flags.out.display()
        );
    };
    // The stages name effects of the user's own, which the inputs define.
    if let Some(own) = known.inputs.get("own_effects") {
        let own = serde_json::from_value(own.clone())
            .with_context(|| format!("--out {}: own_effects of run.json", flags.out.display()))?;
        own_effects::recall(&own)?;
    }
    let _lock = lock(&flags.out, &command_line())?;
    let mut folder = Folder::go_on(&flags.out, known)?;
    let record = pipeline::gather(&folder)?;
    pipeline::publish(&mut folder, &record)?;
    if flags.json {
        return print_json(&record.verdict);
    }
    say!("{}", terminal::ten_lines(&record, &flags.out));
    Ok(())
}
