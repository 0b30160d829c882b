//! Data sets and rollouts that the jobs share, opened and named by what they hold.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use hydro_plugin::{
    dataset::{Dataset, Split},
    kinematics::Kinematics,
    rollouts::Rollouts,
};
use sha2::{Digest as _, Sha256};

use super::Args;

/// Opened, not yet read.
pub(super) struct Inputs {
    /// By name.
    pub(super) data: BTreeMap<String, Dataset>,
    /// Outside the training range: name and data set.
    beyond: Vec<(String, Dataset)>,
    /// For the closed loop.
    pub(super) rollouts: Option<Rollouts>,
    /// One long run.
    pub(super) long: Option<Rollouts>,
}

impl Inputs {
    pub(super) fn open(args: &Args) -> anyhow::Result<Self> {
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
            if theirs.features != ours.features || theirs.outputs != ours.outputs {
                bail!("--beyond {given}: its features or outputs are not those of --data");
            }
            beyond.push((name.to_owned(), set));
        }
        let rollouts = |folder: Option<&Path>| folder.map(Rollouts::load).transpose();
        Ok(Self {
            data,
            beyond,
            rollouts: rollouts(args.rollouts.as_deref())?,
            long: rollouts(args.long.as_deref())?,
        })
    }

    /// How many force components all data sets have.
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

    /// Names and digests of what a model is examined on beside its test split.
    pub(super) fn examined_on(&self) -> BTreeMap<String, String> {
        let runs = |name: &str, rollouts: &Rollouts| {
            let mut digest = Sha256::new();
            for entry in &rollouts.index.rollouts {
                digest.update(entry.sha256.as_bytes());
            }
            let text = digest
                .finalize()
                .into_iter()
                .map(|byte| format!("{byte:02x}"));
            (name.to_owned(), text.collect::<String>())
        };
        self.beyond
            .iter()
            .map(|(name, set)| (format!("beyond.{name}"), set.sha256().to_owned()))
            .chain(self.rollouts.iter().map(|of| runs("rollouts", of)))
            .chain(self.long.iter().map(|of| runs("long", of)))
            .collect()
    }

    /// The test splits outside the training range: name, sha256, trajectories.
    pub(super) fn read_beyond(&self) -> anyhow::Result<Vec<(String, String, Split)>> {
        self.beyond
            .iter()
            .map(|(name, set)| {
                let split = set
                    .split("test", None)
                    .with_context(|| format!("--beyond {name}"))?;
                Ok((name.clone(), set.sha256().to_owned(), split))
            })
            .collect()
    }
}
