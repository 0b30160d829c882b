//! The inputs of the stages: a folder of results is continued only with the same inputs.
//!
//! A held-out trial's file is not opened before `verify`; until then only its name counts.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::ErrorKind,
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use anyhow::Context as _;
use hydro_effects::{Id, Medium};
use hydro_gap::trial::{self, Listed, Split};
use serde::{Deserialize, Serialize};

use super::{flags::Flags, own_effects};
use crate::cli::sha256;

/// Size and time of a file, to notice a change without reading it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Mark {
    bytes: u64,
    /// Time of the last change [ns since 1970].
    changed: u64,
}

impl Mark {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let metadata = || -> std::io::Result<Self> {
            let found = fs::metadata(path)?;
            let changed = found.modified()?.duration_since(UNIX_EPOCH);
            Ok(Self {
                bytes: found.len(),
                changed: changed.map_or(0, |time| time.as_nanos() as u64),
            })
        };
        metadata().with_context(|| format!("looking at {}", path.display()))
    }
}

/// The inputs of the stages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Inputs {
    /// Version of this program.
    program: String,
    model: PathBuf,
    /// Digest of the MJCF and its included files.
    model_sha256: String,
    uncertainty_sha256: Option<String>,
    /// The medium that the user says.
    #[serde(default)]
    medium: Option<Medium>,
    /// Definitions of the user's own effects, by name.
    #[serde(default)]
    own_effects: BTreeMap<String, String>,
    holdout: f64,
    seed: u64,
    #[serde(default)]
    no_residual: bool,
    fit: BTreeMap<String, Mark>,
    /// `None` until `verify` has read the file.
    held_out: BTreeMap<String, Option<Mark>>,
}

impl Inputs {
    /// The inputs as they are now. A held-out trial of `known`, the inputs of the folder of results, counts even where its
    /// file is gone.
    pub(super) fn look(flags: &Flags, known: Option<&Self>) -> anyhow::Result<Self> {
        let listed = trial::list(&flags.trials)?;
        let mut names: BTreeSet<String> = listed.iter().map(|one| one.name.clone()).collect();
        names.extend(
            known
                .iter()
                .flat_map(|known| known.held_out.keys().cloned()),
        );
        let names: Vec<String> = names.into_iter().collect();
        let Split { fit, held_out } = trial::split(&names, flags.holdout, flags.seed);
        let file = |name: &String| listed.iter().find(|one| one.name == *name);
        let mut marks = BTreeMap::new();
        for one in fit.iter().filter_map(file) {
            marks.insert(one.name.clone(), Mark::read(&one.path)?);
        }
        Ok(Self {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            model: fs::canonicalize(&flags.model)
                .with_context(|| format!("--model {}", flags.model.display()))?,
            model_sha256: model_sha256(&flags.model)?,
            uncertainty_sha256: flags
                .uncertainty
                .as_deref()
                .map(|path| {
                    let text = hydro_files::read(path, hydro_files::TEXT)
                        .with_context(|| format!("--uncertainty {}", path.display()))?;
                    Ok::<_, anyhow::Error>(sha256(&text))
                })
                .transpose()?,
            medium: flags.medium.map(Medium::from),
            own_effects: own_effects::definitions(&own_effects(flags)?),
            holdout: flags.holdout,
            seed: flags.seed,
            no_residual: flags.no_residual,
            fit: marks,
            held_out: held_out.into_iter().map(|name| (name, None)).collect(),
        })
    }

    /// Trials used before `verify`.
    pub(super) fn fit_trials(&self) -> Vec<String> {
        self.fit.keys().cloned().collect()
    }

    /// Trials that only `verify` opens.
    pub(super) fn held_out_trials(&self) -> Vec<String> {
        self.held_out.keys().cloned().collect()
    }

    /// Records the held-out files that `verify` reads.
    pub(super) fn note_held_out(&mut self, listed: &[Listed]) -> anyhow::Result<()> {
        for (name, mark) in &mut self.held_out {
            if let Some(one) = listed.iter().find(|one| one.name == *name) {
                *mark = Some(Mark::read(&one.path)?);
            }
        }
        Ok(())
    }

    /// Differences to the inputs of a folder, in words; `listed` are the present files.
    pub(super) fn differences(&self, old: &Self, listed: &[Listed]) -> Vec<String> {
        let mut found = Vec::new();
        if self.program != old.program {
            found.push(format!(
                "the program is version {}, it was {}",
                self.program, old.program
            ));
        }
        if self.model != old.model {
            found.push(format!(
                "--model is {}, it was {}",
                self.model.display(),
                old.model.display()
            ));
        } else if self.model_sha256 != old.model_sha256 {
            found.push(format!("the text of {} has changed", self.model.display()));
        }
        if self.medium != old.medium {
            found.push("--medium differs".to_owned());
        }
        if self.uncertainty_sha256 != old.uncertainty_sha256 {
            found.push("--uncertainty differs".to_owned());
        }
        let names = |inputs: &Self| inputs.own_effects.keys().cloned().collect::<Vec<_>>();
        if names(self) != names(old) {
            let listed = |inputs: &Self| match names(inputs).as_slice() {
                [] => "none".to_owned(),
                names => names.join(", "),
            };
            found.push(format!(
                "effects of your own are {}, they were {}",
                listed(self),
                listed(old)
            ));
        } else {
            for (name, text) in &self.own_effects {
                if old.own_effects.get(name) != Some(text) {
                    found.push(format!("the definition of {name} has changed"));
                }
            }
        }
        if self.holdout.to_bits() != old.holdout.to_bits() {
            found.push(format!(
                "--holdout is {}, it was {}",
                self.holdout, old.holdout
            ));
        }
        if self.seed != old.seed {
            found.push(format!("--seed is {}, it was {}", self.seed, old.seed));
        }
        if self.no_residual != old.no_residual {
            let said = |given: bool| if given { "given" } else { "not given" };
            found.push(format!(
                "--no-residual is {}, it was {}",
                said(self.no_residual),
                said(old.no_residual)
            ));
        }
        let names = |inputs: &Self| -> BTreeSet<String> {
            inputs
                .fit
                .keys()
                .chain(inputs.held_out.keys())
                .cloned()
                .collect()
        };
        let (now, before) = (names(self), names(old));
        for name in now.difference(&before) {
            found.push(format!("trial `{name}` is new"));
        }
        for name in before.difference(&now) {
            found.push(format!("trial `{name}` is gone"));
        }
        for (name, mark) in &self.fit {
            if old.fit.get(name).is_some_and(|old| old != mark) {
                found.push(format!("the file of trial `{name}` has changed"));
            }
        }
        for (name, mark) in &old.held_out {
            let file = listed.iter().find(|one| one.name == *name);
            let now = file.and_then(|one| Mark::read(&one.path).ok());
            if let (Some(mark), Some(now)) = (mark, now)
                && *mark != now
            {
                found.push(format!("the file of held-out trial `{name}` has changed"));
            }
        }
        found
    }

    /// Takes over the record of held-out files that were read.
    pub(super) fn keep_held_out(&mut self, old: &Self) {
        self.held_out.clone_from(&old.held_out);
    }
}

/// The user's own effects, read and checked.
pub(super) fn own_effects(flags: &Flags) -> anyhow::Result<Vec<Id>> {
    own_effects::folder(flags.effects.as_deref(), &flags.model)
        .map_or_else(|| Ok(Vec::new()), |folder| own_effects::load(&folder))
}

/// Digest of a model and all files that it includes, however deep; a missing one is left to the loader to report.
fn model_sha256(model: &Path) -> anyhow::Result<String> {
    let folder = model.parent().unwrap_or(Path::new("."));
    let mut waiting = vec![model.to_owned()];
    let mut seen = BTreeSet::new();
    let mut all = Vec::new();
    while let Some(path) = waiting.pop() {
        if !seen.insert(path.clone()) {
            continue;
        }
        let place = || match path == model {
            true => format!("--model {}", model.display()),
            false => format!("--model {}: includes {}", model.display(), path.display()),
        };
        let text = match hydro_files::read_text(&path, hydro_files::TEXT) {
            Ok(text) => text,
            Err(error) if error.kind() == ErrorKind::NotFound && path != model => continue,
            Err(error) => return Err(error).with_context(place),
        };
        all.extend_from_slice(text.as_bytes());
        // The stage `add` edits the text: what cannot be edited is refused before hours of fits.
        let text = text.trim_start_matches('\u{feff}');
        let tree = roxmltree::Document::parse(text).map_err(|error| {
            let hint = match error {
                roxmltree::Error::DtdDetected => {
                    "; remove the <!DOCTYPE ...>, MuJoCo does not use it"
                }
                _ => "",
            };
            anyhow::Error::msg(format!("{}{hint}", hydro_files::short(error)))
        });
        let tree = tree.with_context(place)?;
        let includes = tree
            .descendants()
            .filter(|node| node.has_tag_name("include"))
            .filter_map(|node| node.attribute("file"));
        waiting.extend(includes.map(|file| folder.join(file)));
    }
    Ok(sha256(&all))
}
