//! `hydro gap report`: the page again, from the stages in a folder.

use std::path::PathBuf;

use anyhow::bail;

use super::{
    folder::{Folder, provenance},
    lines, sequence,
};
use crate::cli::print_json;

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
    // What the stages were made from is carried along as it is.
    let Some(known) = provenance::<serde_json::Value>(&flags.out)? else {
        bail!(
            "--out {}: no run.json, so no results of hydro gap",
            flags.out.display()
        );
    };
    let mut folder = Folder::go_on(&flags.out, known)?;
    let record = sequence::gather(&folder)?;
    sequence::publish(&mut folder, &record)?;
    if flags.json {
        return print_json(&record.verdict);
    }
    say!("{}", lines::ten_lines(&record, &flags.out));
    Ok(())
}
