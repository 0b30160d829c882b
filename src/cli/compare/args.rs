//! Flags of `hydro compare`.

use std::path::PathBuf;

use hydro_training::experiment::{Experiment, JobId};

/// Flags of `hydro compare`.
#[derive(Clone, Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// task1 (towing) or task2 (swimming).
    pub(super) experiment: Experiment,
    /// Data set of Task 2 (scripts/gen_task2.py), or the folder of Tasks 1.1, 1.2 and 1.3 (scripts/gen_task1.py).
    #[arg(long)]
    pub(super) data: PathBuf,
    /// Folder of the jobs, the tables and the pictures.
    #[arg(long)]
    pub(super) out: PathBuf,
    /// Rollouts for the closed loop (scripts/record_rollouts.py), of Task 2.
    #[arg(long)]
    pub(super) rollouts: Option<PathBuf>,
    /// A folder with one long rollout: are speeds, rates and wrench bounded?
    #[arg(long, requires = "rollouts")]
    pub(super) long: Option<PathBuf>,
    /// A data set outside the training range, of Task 2; may be given more than once.
    #[arg(long, value_name = "NAME=FOLDER")]
    pub(super) beyond: Vec<String>,
    /// Seeds of the trainings; 0,1,2 if left out, with --quick 0,1.
    #[arg(long, value_delimiter = ',')]
    pub(super) seeds: Option<Vec<u64>>,
    /// Rows of the table, such as lstm,relaxation-ode; all if left out.
    #[arg(long, value_delimiter = ',')]
    pub(super) entries: Option<Vec<String>>,
    /// A small part of the data, few passes, two seeds, a shorter examination: about a quarter of an hour on two cores.
    #[arg(long)]
    pub(super) quick: bool,
    /// Passes over the training split instead of the usual number, the same for all.
    #[arg(long)]
    pub(super) epochs: Option<usize>,
    /// Train on the first so many trajectories.
    #[arg(long)]
    pub(super) trajectories: Option<usize>,
    /// Largest learning rate instead of each row's own, the same for all.
    #[arg(long)]
    pub(super) learning_rate: Option<f64>,
    /// Jobs at a time, which share the cores; a job a core if left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) parallel: Option<u16>,
    /// Do this job alone, such as 2/lstm/seed-0, and write no tables.
    #[arg(long, value_name = "JOB", conflicts_with_all = ["list", "tables"])]
    pub(super) only: Option<JobId>,
    /// Number of the process that does the jobs; this one ends with it.
    #[arg(long, hide = true, requires = "only")]
    pub(super) parent: Option<i32>,
    /// List the jobs, done and not done, and do none.
    #[arg(long, conflicts_with = "tables")]
    pub(super) list: bool,
    /// Write the tables of the jobs that are done, and do none.
    #[arg(long)]
    pub(super) tables: bool,
    /// Take the times again even if --out has them.
    #[arg(long)]
    pub(super) retime: bool,
    /// Folder of the scene b1_swim.xml.
    #[arg(long, default_value = "mjcf")]
    pub(super) scenes: PathBuf,
    /// Print one JSON value at the end and nothing else on standard output.
    #[arg(long)]
    pub(super) json: bool,
}

impl Args {
    /// Seeds of the trainings, those of the flag or the usual ones.
    pub(super) fn seeds(&self) -> Vec<u64> {
        let usual = if self.quick {
            vec![0, 1]
        } else {
            vec![0, 1, 2]
        };
        self.seeds.clone().unwrap_or(usual)
    }
}
