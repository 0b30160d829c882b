//! Checkpoints on disk.

mod odd;

use std::{
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
};

use candle_core::Device;

use super::{
    replacement::{exchange, step_aside},
    *,
};
use crate::{
    AttentionOdeConfig, CnodeConfig, LstmConfig, MlpConfig, MlpOdeConfig, ModelConfig, Network,
    Normaliser, Parameters, RelaxationOdeConfig, Scratch, features::FeatureLayout,
};

fn checkpoint(model: ModelConfig) -> Checkpoint {
    let features = FeatureLayout::floating_base(&["a".into()]).expect("valid");
    let inputs = Encoder::new(model.encoding(), &features).len();
    let outputs = ["force.x", "force.y"].map(str::to_owned).to_vec();
    let (_, weights) =
        Parameters::draw(1, |vb| Network::new(&model, inputs, 2, vb)).expect("drawn");
    let card = Card {
        schema: SCHEMA.to_owned(),
        name: "test".to_owned(),
        feature_units: features
            .features()
            .iter()
            .map(|f| f.unit().to_owned())
            .collect(),
        joints: features.joints(),
        features,
        output_units: vec!["N".to_owned(); 2],
        outputs,
        frames: BTreeMap::from([("wrench".to_owned(), "base".to_owned())]),
        sample_period: 0.01,
        residual: false,
        water: None,
        added_mass: Vec::new(),
        envelope: None,
        solver: Solver::Euler,
        normaliser: Normaliser::identity(inputs, 2),
        dataset: None,
        metrics: serde_json::json!({"pooled": 0.1}),
        command: "hydro train".to_owned(),
        hydro: "0.1.0".to_owned(),
        weights_sha256: String::new(),
        card_sha256: String::new(),
        model,
    };
    Checkpoint::new(card, weights.snapshot().expect("copied")).expect("valid")
}

fn small() -> ModelConfig {
    ModelConfig::AttentionOde(AttentionOdeConfig {
        window: 2,
        heads: 2,
        embedding: 4,
        latent: 3,
        hidden: vec![5],
        ..AttentionOdeConfig::default()
    })
}

/// A saved checkpoint in a folder of its own.
fn saved() -> (tempfile::TempDir, PathBuf) {
    let root = tempfile::tempdir().expect("a folder");
    let folder = root.path().join("model");
    checkpoint(small()).save(&folder).expect("saved");
    (root, folder)
}

fn refusal(folder: &Path) -> String {
    Checkpoint::load(folder)
        .expect_err("must be refused")
        .to_string()
}

/// Rewrites the card of a saved checkpoint.
fn edit(folder: &Path, change: impl FnOnce(&mut serde_json::Value)) {
    let path = folder.join(CARD);
    let mut card = serde_json::from_slice(&fs::read(&path).expect("read")).expect("json");
    change(&mut card);
    card.as_object_mut()
        .expect("an object")
        .remove("card_sha256");
    fs::write(&path, card.to_string()).expect("written");
}

/// Replaces the weights, with a card that vouches for them.
fn replace_weights(folder: &Path, change: impl FnOnce(&mut BTreeMap<String, Tensor>)) {
    let mut checkpoint = Checkpoint::load(folder).expect("whole before");
    change(&mut checkpoint.weights);
    checkpoint.save(folder).expect("saved");
}

#[test]
fn what_was_saved_is_loaded_bit_by_bit() {
    for model in [
        small(),
        ModelConfig::MlpOde(MlpOdeConfig {
            hidden: vec![6],
            ..MlpOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![6],
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::RelaxationOde(RelaxationOdeConfig {
            hidden: vec![6],
            memory: 3,
            ..RelaxationOdeConfig::default()
        }),
        ModelConfig::Cnode(CnodeConfig {
            hidden: vec![6],
            ..CnodeConfig::default()
        }),
        ModelConfig::Lstm(LstmConfig {
            hidden: vec![6],
            ..LstmConfig::default()
        }),
        ModelConfig::Mlp(MlpConfig {
            hidden: vec![6],
            ..MlpConfig::default()
        }),
    ] {
        let root = tempfile::tempdir().expect("a folder");
        let folder = root.path().join("deep/model");
        let before = checkpoint(model);
        before.save(&folder).expect("saved");
        // Twice: the second replaces the first.
        before.save(&folder).expect("saved again");
        let after = Checkpoint::load(&folder).expect("loaded");
        assert_eq!(before.digest(), after.digest());
        assert_eq!(before.card.model, after.card.model);
        let force = |checkpoint: &Checkpoint| {
            let engine = checkpoint
                .engine(EngineKind::Fused, None)
                .expect("an engine");
            let mut force = vec![0.0; 2];
            engine.estimate(
                &vec![0.3; engine.inputs()],
                &mut force,
                &mut Scratch::default(),
            );
            force
        };
        assert_eq!(force(&before), force(&after));
        assert_eq!(
            names_in(&root.path().join("deep")),
            ["model"],
            "nothing else is left behind"
        );
    }
}

#[test]
fn the_digest_tells_weights_and_cards_apart() {
    let one = checkpoint(small());
    let mut other = one.clone();
    other.card.sample_period = 0.02;
    assert_ne!(one.digest(), other.digest());
}

#[test]
fn a_save_that_fails_leaves_the_old_one_whole() {
    let (root, folder) = saved();
    let file = root.path().join("file");
    fs::write(&file, "in the way").expect("written");
    let error = checkpoint(small())
        .save(&file.join("model"))
        .expect_err("its parent is a file");
    assert!(error.to_string().contains("file"), "{error}");
    Checkpoint::load(&folder).expect("still whole");
    assert_eq!(names_in(root.path()), ["file", "model"]);
}

#[test]
fn a_checkpoint_is_in_its_place_at_every_moment_of_its_replacement() {
    let (root, folder) = saved();
    let other = root.path().join("other");
    checkpoint(small()).save(&other).expect("saved");
    if exchange(&other, &folder).is_err() {
        // The file system does not know how; the test of the two renames is all there is.
        return;
    }
    let card = folder.join(CARD);
    let done = AtomicBool::new(false);
    let absent = std::thread::scope(|scope| {
        let watcher = scope.spawn(|| {
            let mut absent = 0;
            while !done.load(Ordering::Relaxed) {
                absent += usize::from(!card.exists());
            }
            absent
        });
        for _ in 0..20_000 {
            replace(&other, &folder, &root.path().join("old")).expect("replaced");
            let old = root.path().join("old");
            if old.exists() {
                fs::rename(old, &other).expect("back");
            }
        }
        done.store(true, Ordering::Relaxed);
        watcher.join().expect("no panic")
    });
    assert_eq!(absent, 0, "times that no card was found");
}

#[test]
fn where_folders_cannot_change_places_the_old_one_steps_aside() {
    let (root, folder) = saved();
    let (new, old) = (root.path().join("new"), root.path().join("old"));
    step_aside(&new, &folder, &old).expect_err("there is no new one");
    Checkpoint::load(&folder).expect("back in its place");
    let mut other = checkpoint(small());
    other.card.name = "other".to_owned();
    other.save(&new).expect("saved");
    step_aside(&new, &folder, &old).expect("replaced");
    assert_eq!(Checkpoint::load(&folder).expect("whole").card.name, "other");
    assert_eq!(Checkpoint::load(&old).expect("whole").card.name, "test");
}

#[test]
fn what_dead_runs_left_is_removed_and_nothing_else() {
    let (root, folder) = saved();
    let beside = [
        ".model.1.partial",
        ".model.2.partial",
        ".model.2.3.partial",
        ".model.x.partial",
    ];
    for name in beside {
        fs::create_dir_all(root.path().join(name).join("new")).expect("made");
    }
    fs::remove_dir_all(root.path().join(beside[1])).expect("removed");
    let mut running = Partial::new(root.path(), "model").expect("locked");
    // Under the number of another process.
    fs::rename(&running.folder, root.path().join(beside[1])).expect("renamed");
    running.folder = root.path().join(beside[1]);
    checkpoint(small()).save(&folder).expect("saved");
    assert_eq!(
        names_in(root.path()),
        [beside[2], beside[1], beside[3], "model"],
        "that of a running save and those of other names stay"
    );
    drop(running);
    assert_eq!(names_in(root.path()), [beside[2], beside[3], "model"]);
}

#[test]
fn a_save_writes_through_no_link() {
    let (root, folder) = saved();
    let victim = root.path().join("victim");
    fs::create_dir(&victim).expect("made");
    let link = root
        .path()
        .join(format!(".model.{}.partial", std::process::id()));
    std::os::unix::fs::symlink(&victim, &link).expect("linked");
    checkpoint(small()).save(&folder).expect("saved");
    Checkpoint::load(&folder).expect("whole");
    assert!(names_in(&victim).is_empty());
}

#[test]
fn sizes_of_a_card_are_held_against_the_tensors_that_are_there() {
    for (field, value) in [
        ("latent", 1u64 << 62),
        ("embedding", 1_000_000_000_000_000_000),
        ("window", u64::MAX),
        ("window", 3000),
        ("heads", 1 << 40),
        ("latent", 60_000),
    ] {
        let (_root, folder) = saved();
        edit(&folder, |card| card["config"][field] = value.into());
        let message = refusal(&folder);
        assert!(message.len() < 500 && !message.contains('\n'), "{message}");
    }
    let (_root, folder) = saved();
    edit(&folder, |card| {
        card["config"]["hidden"] = serde_json::json!([1_u64 << 63]);
    });
    let message = refusal(&folder);
    assert!(
        message.contains("hidden is 9223372036854775808, expected 65536 at most"),
        "{message}"
    );
}

#[test]
fn a_flipped_bit_in_a_card_is_found() {
    let (_root, folder) = saved();
    let path = folder.join(CARD);
    let whole = fs::read(&path).expect("read");
    let text = String::from_utf8(whole.clone()).expect("text");
    let at = text.find("0.01").expect("the period") + 3;
    let mut flipped = whole.clone();
    flipped[at] ^= 2;
    fs::write(&path, &flipped).expect("written");
    let message = refusal(&folder);
    assert!(message.contains("damaged, or changed since"), "{message}");
    assert!(message.contains("remove `card_sha256`"), "{message}");
    // Another layout of the same values is the same card.
    let values: serde_json::Value = serde_json::from_slice(&whole).expect("json");
    fs::write(&path, values.to_string()).expect("written");
    Checkpoint::load(&folder).expect("the same");
}

#[test]
fn what_is_no_file_is_refused_by_its_kind() {
    let (_root, folder) = saved();
    fs::remove_file(folder.join(WEIGHTS)).expect("removed");
    std::os::unix::fs::symlink("/dev/zero", folder.join(WEIGHTS)).expect("linked");
    assert!(refusal(&folder).contains("is a device; expected a file"));
}

#[test]
fn a_missing_folder_or_file_lists_what_exists() {
    let (root, folder) = saved();
    let message = refusal(&root.path().join("modle"));
    assert!(
        message.contains("the folder is missing; there are: model"),
        "{message}"
    );
    fs::remove_file(folder.join(WEIGHTS)).expect("removed");
    let message = refusal(&folder);
    assert!(
        message.contains("weights.safetensors is missing; there are: card.json"),
        "{message}"
    );
}

#[test]
fn truncated_and_flipped_weights_are_damaged() {
    let (_root, folder) = saved();
    let path = folder.join(WEIGHTS);
    let whole = fs::read(&path).expect("read");
    fs::write(&path, &whole[..whole.len() - 4]).expect("written");
    assert!(refusal(&folder).contains("is damaged"));
    let mut flipped = whole;
    *flipped.last_mut().expect("not empty") ^= 1;
    fs::write(&path, flipped).expect("written");
    assert!(refusal(&folder).contains("is damaged"));
}

#[test]
fn weights_that_are_no_safetensors_are_refused_even_if_vouched_for() {
    let (_root, folder) = saved();
    fs::write(folder.join(WEIGHTS), b"nonsense").expect("written");
    edit(&folder, |card| {
        card["weights_sha256"] = hexadecimal(&Sha256::digest(b"nonsense")).into()
    });
    assert!(refusal(&folder).contains("not a safetensors file"));
}

#[test]
fn missing_unknown_and_misshapen_tensors_are_named() {
    let (_root, folder) = saved();
    replace_weights(&folder, |weights| {
        weights.remove("field.0.bias");
    });
    let message = refusal(&folder);
    assert!(
        message.contains("tensor `field.0.bias` [5] is missing; there are: attention.lag_bias"),
        "{message}"
    );

    let (_root, folder) = saved();
    replace_weights(&folder, |weights| {
        let extra = weights["field.0.bias"].clone();
        weights.insert("field.9.bias".to_owned(), extra);
    });
    assert!(refusal(&folder).contains("tensor `field.9.bias` belongs to no part of the model"));

    let (_root, folder) = saved();
    replace_weights(&folder, |weights| {
        let swapped = weights["field.1.weight"]
            .t()
            .and_then(|t| t.contiguous())
            .expect("a matrix");
        weights.insert("field.1.weight".to_owned(), swapped);
    });
    let message = refusal(&folder);
    assert!(
        message.contains("tensor `field.1.weight` is F32 [5, 2], expected F32 [2, 5]"),
        "{message}"
    );
}

#[test]
fn a_weight_that_is_not_a_number_is_found() {
    for value in [f32::NAN, f32::INFINITY] {
        let (_root, folder) = saved();
        replace_weights(&folder, |weights| {
            let bad = Tensor::new(&[0.0, 0.0, 0.0, value, 0.0], &Device::Cpu).expect("a vector");
            weights.insert("field.0.bias".to_owned(), bad);
        });
        let message = refusal(&folder);
        assert!(
            message.contains("tensor `field.0.bias` holds") && message.contains("position 3"),
            "{message}"
        );
    }
}

#[test]
fn malformed_cards_say_what_is_wrong() {
    type Change = fn(&mut serde_json::Value);
    let cases: [(Change, &str); 13] = [
        (
            |card| card["schema"] = "hydro-checkpoint/9".into(),
            "schema is \"hydro-checkpoint/9\", expected",
        ),
        (
            |card| card["kind"] = "transformer".into(),
            "unknown variant `transformer`",
        ),
        (
            |card| card["config"]["windw"] = 3.into(),
            "unknown field `windw`",
        ),
        (
            |card| card["config"]["heads"] = 3.into(),
            "embedding 4 is not divisible by 3 heads",
        ),
        (
            |card| card["sample_period"] = 0.0.into(),
            "sample_period is 0 s",
        ),
        (
            |card| card["joints"] = serde_json::json!(["b"]),
            "joints are [\"b\"], but the features name [\"a\"]",
        ),
        (
            |card| card["normaliser"]["output_std"][1] = 0.0.into(),
            "normaliser.output_std[1] is 0",
        ),
        (
            |card| {
                card["envelope"] = serde_json::json!(
                    {"least": [0.0], "most": [1.0], "least_force": [0.0], "most_force": [1.0]}
                );
            },
            "envelope.least has 1 numbers, not 13",
        ),
        (
            |card| card["features"][0] = "speed".into(),
            "unknown feature `speed`",
        ),
        (
            |card| card["feature_units"] = serde_json::json!([]),
            "feature_units has 0 entries, expected 13",
        ),
        (
            |card| card["feature_units"][0] = "deg".into(),
            "feature_units gives `position.a` in [deg], expected [rad]",
        ),
        (
            |card| card["output_units"][1] = "lbf".into(),
            "output_units gives `force.y` in [lbf], expected [N]",
        ),
        (
            |card| card["frames"]["wrench"] = "world".into(),
            "frames gives `wrench` in \"world\", expected the frame \"base\"",
        ),
    ];
    for (change, expected) in cases {
        let (_root, folder) = saved();
        edit(&folder, change);
        let message = refusal(&folder);
        assert!(message.contains(expected), "{message} lacks {expected}");
    }
    let (_root, folder) = saved();
    fs::write(folder.join(CARD), "{ not json").expect("written");
    assert!(refusal(&folder).contains("card.json"));
}
