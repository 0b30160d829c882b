//! The user's own effects: the files `NAME.toml` of a folder.

#[cfg(mujoco_plugins)]
use std::{collections::BTreeMap, path::PathBuf};
use std::{fs, path::Path};

use anyhow::{Context as _, bail};
use hydro_effects::{Id, own};
#[cfg(mujoco_plugins)]
use hydro_effects::{Target, TargetKind, did_you_mean::hint, effect};
#[cfg(mujoco_plugins)]
use hydro_gap::plant::PlantDescription;
use hydro_model::document::{listed, names_in};

/// Most files of a folder.
const MOST: usize = 32;

/// Folder beside the model that counts where none is given.
#[cfg(mujoco_plugins)]
const BESIDE: &str = "effects.d";

/// The folder that is given, else the one beside the model where there is one.
#[cfg(mujoco_plugins)]
pub(super) fn folder(given: Option<&Path>, model: &Path) -> Option<PathBuf> {
    given.map(Path::to_owned).or_else(|| {
        let beside = model.parent().unwrap_or(Path::new("")).join(BESIDE);
        beside.is_dir().then_some(beside)
    })
}

/// Reads and checks all files of a folder, in the order of their names.
pub(super) fn load(folder: &Path) -> anyhow::Result<Vec<Id>> {
    let place = || format!("--effects {}", folder.display());
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).with_context(place)? {
        let path = entry.with_context(place)?.path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            files.push(path);
        }
        if files.len() > MOST {
            bail!("{}: more than {MOST} files NAME.toml", place());
        }
    }
    if files.is_empty() {
        bail!(
            "{}: no file NAME.toml, expected one at least; there are: {}",
            place(),
            listed(&names_in(folder))
        );
    }
    files.sort();
    files.iter().map(|path| read(path)).collect()
}

fn read(path: &Path) -> anyhow::Result<Id> {
    let place = || path.display().to_string();
    let text = hydro_files::read_text(path, own::LARGEST_FILE).with_context(place)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    own::register_toml(&name, &text).with_context(place)
}

/// Definitions by name, which tell whether they have changed.
#[cfg(mujoco_plugins)]
pub(super) fn definitions(ids: &[Id]) -> BTreeMap<String, String> {
    let text = |id: &Id| effect(*id).definition().unwrap_or_default().to_owned();
    ids.iter()
        .map(|id| (id.as_str().to_owned(), text(id)))
        .collect()
}

/// Takes up definitions that an earlier run has kept.
#[cfg(mujoco_plugins)]
pub(super) fn recall(definitions: &BTreeMap<String, String>) -> anyhow::Result<()> {
    for (id, text) in definitions {
        let value = serde_json::from_str(text).with_context(|| id.clone())?;
        own::register_json(id, &value).with_context(|| id.clone())?;
    }
    Ok(())
}

/// Holds effects to a model: the targets and actuators that they name are there, and each has a target.
#[cfg(mujoco_plugins)]
pub(super) fn fit(ids: &[Id], model: &PlantDescription) -> anyhow::Result<()> {
    for id in ids {
        let own = effect(*id);
        let mut targets: Vec<String> = Vec::new();
        match own.card().target {
            TargetKind::Body => {
                let moving = model.bodies.iter().filter(|body| body.moves);
                targets.extend(moving.map(|body| body.name.clone()));
            }
            _ => {
                let joints = model.joints.iter();
                let fitting = joints.filter(|of| own.applies_to(&Target::Joint(of.scale.clone())));
                targets.extend(fitting.map(|joint| joint.name.clone()));
            }
        }
        if targets.is_empty() {
            let bodies = model.bodies.iter().map(|body| {
                let kind = if body.moves { "moving" } else { "fixed" };
                format!("{kind} body {}", body.name)
            });
            let joints = model.joints.iter().map(|joint| {
                let kind = if joint.scale.slides { "slide" } else { "hinge" };
                format!("{kind} {}", joint.name)
            });
            let there: Vec<String> = bodies.chain(joints).collect();
            bail!(
                "{id}: the model has nothing that it could act on; it has: {}",
                listed(&there)
            );
        }
        let actuators: Vec<String> = model.actuators.iter().map(|of| of.name.clone()).collect();
        for (word, wanted, known) in [
            ("targets", own.only_on(), &targets),
            ("[commands]", own.commands(), &actuators),
        ] {
            if let Some(found) = wanted.iter().find(|name| !known.contains(name)) {
                bail!(
                    "{id}: {word}: the model has no `{found}` that fits{}; it has: {}",
                    hint(found, known.iter().map(String::as_str)),
                    listed(known)
                );
            }
        }
    }
    Ok(())
}

#[cfg(all(test, mujoco_plugins))]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const SPRING: &str = "summary = \"s\"\ntarget = \"body\"\nworld_force = {x = \"-k * x\"}\n[parameters.k]\n\
                          unit = \"N/m\"\nlower = 0\nupper = 9\nprior_sd = 1";

    fn refusal(folder: &Path) -> String {
        format!("{:#}", load(folder).unwrap_err())
    }

    #[test]
    fn a_folder_is_read_in_order_and_faults_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        fs::write(path.join("drag.tml"), SPRING).unwrap();
        assert!(
            refusal(path).contains("no file NAME.toml, expected one at least; there are: drag.tml")
        );
        assert!(refusal(&path.join("none")).contains("--effects"));
        fs::write(path.join("b.toml"), SPRING).unwrap();
        fs::write(path.join("a.toml"), SPRING).unwrap();
        fs::write(path.join("notes.txt"), "anything").unwrap();
        let ids = load(path).unwrap();
        let names: Vec<_> = ids.iter().map(|id| id.as_str()).collect();
        assert_eq!(names, ["user.a", "user.b"]);
        let kept = definitions(&ids);
        recall(&kept).unwrap();
        assert_eq!(Id::from_name("user.a"), Some(ids[0]));
        fs::write(path.join("c.toml"), SPRING.replace("-k * x", "-k * xx")).unwrap();
        let text = refusal(path);
        assert!(
            text.contains("c.toml") && text.contains("there is no `xx`;"),
            "{text}"
        );
        // A size is not believed before it is looked at.
        let big = fs::File::create(path.join("c.toml")).unwrap();
        big.set_len(own::LARGEST_FILE + 1).unwrap();
        assert!(refusal(path).contains("is 65537 bytes; expected 65536 at most"));
        for at in 0..40 {
            fs::write(path.join(format!("n{at}.toml")), SPRING).unwrap();
        }
        assert!(refusal(path).contains("more than 32 files"));
    }

    #[test]
    fn the_folder_beside_the_model_counts_where_there_is_one() {
        let place = tempfile::tempdir().unwrap();
        let model = place.path().join("nominal.xml");
        assert_eq!(folder(None, &model), None);
        fs::create_dir(place.path().join(BESIDE)).unwrap();
        assert_eq!(folder(None, &model), Some(place.path().join(BESIDE)));
        let given = Path::new("elsewhere");
        assert_eq!(folder(Some(given), &model), Some(given.to_owned()));
    }

    #[test]
    fn names_in_a_definition_are_those_of_the_model() {
        use hydro_gap::plant::Plant as _;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nominal.xml");
        let text = r#"<mujoco><worldbody><body name="hull"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;
        fs::write(&path, text).unwrap();
        let plant = hydro_plugin::mujoco::plant::MujocoPlant::load(&path).unwrap();
        let said = |text: &str| {
            let id = own::register_toml("named", text).unwrap();
            fit(&[id], plant.description()).map_err(|fault| fault.to_string())
        };
        assert_eq!(said(SPRING), Ok(()));
        let only = SPRING.replace("target =", "targets = [\"hul\"]\ntarget =");
        assert!(
            said(&only)
                .unwrap_err()
                .contains("targets: the model has no `hul` that fits; did you mean `hull`?")
        );
        let reads = format!("{SPRING}\n[commands]\nport = \"bow\"");
        assert!(
            said(&reads)
                .unwrap_err()
                .contains("[commands]: the model has no `bow`")
        );
        let hinge = SPRING
            .replace("\"body\"", "\"hinge\"")
            .replace("world_force = {x = \"-k * x\"}", "force = \"-k * q\"")
            .replace("N/m", "N m/rad");
        assert!(
            said(&hinge)
                .unwrap_err()
                .contains("nothing that it could act on; it has: moving body hull")
        );
    }
}
