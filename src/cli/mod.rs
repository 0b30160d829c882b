//! The command line: one file a command, each turning options into a checked configuration and one library call. Nothing
//! else prints.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::exit,
    reason = "only the command line prints"
)]

mod other_water;
#[macro_use]
mod output;

mod attributes;
mod cancel;
mod command_line;
mod compare;
mod doctor;
mod effects;
mod evaluate;
mod exit;
mod files;
mod gap;
mod inspect;
mod machine;
mod model_flags;
mod progress;
#[cfg(mujoco_plugins)]
mod references;
mod sample_period;
#[cfg(mujoco_plugins)]
mod simulate;
#[cfg(mujoco_plugins)]
mod swim;
mod table;
mod train;
mod yardsticks;

use clap::{Parser, Subcommand};

use self::output::print_json;
#[cfg(mujoco_plugins)]
use self::{command_line::command_line, files::sha256, output::write_line};
pub(crate) use self::{exit::exit_status, output::print_error};

/// Learned hydrodynamics for MuJoCo.
#[derive(Debug, Parser)]
#[command(name = "hydro", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train a force model on a data set and write a checkpoint.
    Train(train::Args),
    /// Errors of a checkpoint on a data set, in open loop.
    Evaluate(evaluate::Args),
    /// The paper's experiments: train every model with every solver over seeds, and write the tables.
    Compare(compare::Args),
    /// Drive a robot under a learned wrench and compare it with the truth and with baselines.
    #[cfg(mujoco_plugins)]
    Simulate(simulate::Args),
    /// Find what a simulation lacks, name it, add it, verify.
    Gap(gap::Args),
    /// Make files of effects for the plugin's attribute `effects`.
    Effects(effects::Args),
    /// List the attributes of the plugins `hydro.wrench` and `hydro.load_cell` in an MJCF.
    Attributes(attributes::Args),
    /// Describe a checkpoint, a data set or a folder of rollouts.
    Inspect(inspect::Args),
    /// Say which MuJoCo was found and whether the plugin works in it.
    Doctor(doctor::Args),
}

/// Parses the command line and runs the command; MuJoCo's warnings are counted and told in one line at the end.
pub(crate) fn run() -> anyhow::Result<()> {
    let command = Cli::parse().command;
    #[cfg(feature = "mujoco")]
    hydro_plugin::mujoco::warnings::count(|text| eprintln!("WARNING: {text}"));
    let result = run_command(command);
    #[cfg(feature = "mujoco")]
    if let Some(line) = warning_line(&hydro_plugin::mujoco::warnings::take_counts()) {
        eprintln!("{line}");
    }
    result
}

/// One line on MuJoCo's warnings by kind; `None` where there was none.
#[cfg(feature = "mujoco")]
fn warning_line(counts: &[(String, u64)]) -> Option<String> {
    let total: u64 = counts.iter().map(|(_, count)| count).sum();
    let kinds: Vec<String> = counts
        .iter()
        .map(|(kind, count)| format!("{kind} ({count})"))
        .collect();
    let often = match total {
        1 => "once".to_owned(),
        _ => format!("{total} times"),
    };
    (total > 0).then(|| format!("MuJoCo warned {often}: {}", kinds.join("; ")))
}

fn run_command(command: Command) -> anyhow::Result<()> {
    match command {
        Command::Train(args) => train::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Compare(args) => compare::run(&args),
        #[cfg(mujoco_plugins)]
        Command::Simulate(args) => simulate::run(&args),
        Command::Gap(args) => gap::run(&args),
        Command::Effects(args) => effects::run(&args),
        Command::Attributes(args) => attributes::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    }
}

#[cfg(all(test, feature = "mujoco"))]
mod tests {
    use super::warning_line;

    #[test]
    fn warnings_are_one_line_by_kind() {
        assert_eq!(warning_line(&[]), None);
        let counts = [
            ("huge value in QACC".to_owned(), 40),
            ("contacts".to_owned(), 2),
        ];
        assert_eq!(
            warning_line(&counts).as_deref(),
            Some("MuJoCo warned 42 times: huge value in QACC (40); contacts (2)")
        );
        assert_eq!(
            warning_line(&counts[1..]).as_deref(),
            Some("MuJoCo warned 2 times: contacts (2)")
        );
    }
}
