//! `hydro train`.

/// Flags of `hydro train`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

/// Runs the command.
pub(super) fn run(_args: &Args) -> anyhow::Result<()> {
    anyhow::bail!("not yet")
}
