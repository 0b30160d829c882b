//! Data sets and rollouts that the jobs share, and their digests.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_model::{document::Difference, kinematics::Kinematics};
use hydro_training::{
    dataset::{Dataset, Split},
    experiment::Experiment,
    rollouts::Rollouts,
};

use super::args::Args;
use crate::cli::{files::sha256, other_water::other_water, sample_period::check_sample_period};

/// Opened inputs; splits are not yet read.
pub(super) struct Inputs {
    /// Data sets by name.
    pub(super) data: BTreeMap<String, Dataset>,
    /// Data sets outside the training range, with their names.
    beyond: Vec<(String, Dataset)>,
    /// Runs of the closed loop.
    pub(super) rollouts: Option<Rollouts>,
    /// One long run.
    pub(super) long: Option<Rollouts>,
    /// Digest of the scene in which models swim.
    scene_sha256: Option<String>,
    quick: bool,
}

/// Limits of `--quick`: test trajectories of each set, runs of the closed loop, samples of the long run.
const QUICK: (usize, usize, usize) = (16, 4, 6000);

impl Inputs {
    pub(super) fn open(args: &Args) -> anyhow::Result<Self> {
        if args.experiment != Experiment::Task2 {
            // --long asks for --rollouts itself.
            for (flag, given) in [
                ("--rollouts", args.rollouts.is_some()),
                ("--beyond", !args.beyond.is_empty()),
            ] {
                if given {
                    bail!("{flag}: for task2 alone; a towed robot does not swim");
                }
            }
        }
        let names = args.experiment.data();
        let mut data = BTreeMap::new();
        for name in names {
            let folder = if names.len() == 1 {
                args.data.clone()
            } else {
                args.data.join(name)
            };
            data.insert((*name).to_owned(), Dataset::open(&folder)?);
        }
        let mut beyond = Vec::new();
        for given in &args.beyond {
            let Some((name, folder)) = given.split_once('=') else {
                bail!("--beyond {given}: expected NAME=FOLDER");
            };
            let set = Dataset::open(&PathBuf::from(folder))?;
            let (theirs, ours) = (set.manifest(), data[names[0]].manifest());
            let (features, expected) = (theirs.features.features(), ours.features.features());
            let features = Difference::find("feature", features, expected);
            let outputs = || Difference::find("output", &theirs.outputs, &ours.outputs);
            if let Some(difference) = features.or_else(outputs) {
                bail!("--beyond {given}: {difference} as in --data");
            }
            check_sample_period(
                (data[names[0]].folder(), ours.sample_period),
                (set.folder(), theirs.sample_period),
            )
            .with_context(|| format!("--beyond {given}"))?;
            beyond.push((name.to_owned(), set));
        }
        let first = &data[names[0]];
        let features = &first.manifest().features;
        let water = first.manifest().water.as_ref();
        let rollouts = |flag: &str, folder: Option<&Path>| -> anyhow::Result<Option<Rollouts>> {
            let Some(folder) = folder else {
                return Ok(None);
            };
            if cfg!(not(mujoco_plugins)) {
                bail!("{flag}: this build has no MuJoCo to swim in");
            }
            let found = Rollouts::load(folder)?;
            let theirs = found.index.features.features();
            if let Some(difference) = Difference::find("feature", theirs, features.features()) {
                bail!("{flag} {}: {difference} as in --data", folder.display());
            }
            let trained = (first.folder(), water);
            if let Some(warning) = other_water(trained, (folder, found.index.water.as_ref())) {
                eprintln!("{warning}");
            }
            Ok(Some(found))
        };
        let mut runs = rollouts("--rollouts", args.rollouts.as_deref())?;
        let mut long = rollouts("--long", args.long.as_deref())?;
        if args.quick {
            if let Some(runs) = &mut runs {
                runs.runs.truncate(QUICK.1);
            }
            for run in long.iter_mut().flat_map(|long| &mut long.runs) {
                run.truncate(QUICK.2);
            }
        }
        let scene = match &runs {
            Some(_) => {
                let path = args.scenes.join("b1_swim.xml");
                let bytes = hydro_files::read(&path, hydro_files::TEXT)
                    .with_context(|| format!("reading {}", path.display()))?;
                Some(sha256(&bytes))
            }
            None => None,
        };
        Ok(Self {
            data,
            beyond,
            rollouts: runs,
            long,
            scene_sha256: scene,
            quick: args.quick,
        })
    }

    /// Force components, the same of all data sets.
    pub(super) fn outputs(&self) -> anyhow::Result<usize> {
        let mut counts: Vec<usize> = self
            .data
            .values()
            .map(|set| set.manifest().outputs.len())
            .collect();
        counts.dedup();
        match counts[..] {
            [count] => Ok(count),
            _ => bail!(
                "the data sets have forces of {counts:?} components, expected the same of all"
            ),
        }
    }

    /// The robot's links, where its data set knows them.
    pub(super) fn kinematics(&self) -> Option<&Kinematics> {
        self.data
            .values()
            .find_map(|set| set.manifest().kinematics.as_ref())
    }

    /// Most trajectories of a test split that a model is examined on; `None` for all.
    pub(super) fn most_tested(&self) -> Option<usize> {
        self.quick.then_some(QUICK.0)
    }

    /// Names and digests of all data beside the test split that a model is examined on.
    pub(super) fn examined_on(&self) -> BTreeMap<String, String> {
        let runs = |name: &str, rollouts: &Rollouts| {
            let runs = rollouts.index.rollouts.iter();
            let all: String = runs.map(|entry| entry.sha256.as_str()).collect();
            (name.to_owned(), sha256(all.as_bytes()))
        };
        self.beyond
            .iter()
            .map(|(name, set)| (format!("beyond.{name}"), set.sha256().to_owned()))
            .chain(self.rollouts.iter().map(|all| runs("rollouts", all)))
            .chain(self.long.iter().map(|all| runs("long", all)))
            .chain(
                self.scene_sha256
                    .iter()
                    .map(|sha| ("scene".to_owned(), sha.clone())),
            )
            .chain(
                self.quick
                    .then(|| ("quick".to_owned(), format!("{QUICK:?}"))),
            )
            .collect()
    }

    /// The test splits outside the training range: name, sha256, trajectories.
    pub(super) fn read_beyond(&self) -> anyhow::Result<Vec<(String, String, Split)>> {
        self.beyond
            .iter()
            .map(|(name, set)| {
                let split = set
                    .split("test", self.most_tested())
                    .with_context(|| format!("--beyond {name}"))?;
                Ok((name.clone(), set.sha256().to_owned(), split))
            })
            .collect()
    }
}
