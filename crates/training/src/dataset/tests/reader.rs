//! Tiny data sets in folders of their own.

mod odd;

use std::{fs, path::PathBuf};

use safetensors::{Dtype, tensor::TensorView};
use serde_json::{Value, json};

use super::*;

/// (M, T, n, f) of every shard.
const SIZE: (usize, usize, usize, usize) = (2, 3, 4, 2);

/// A tensor to be written: name, type, shape, four-byte words.
struct Raw(&'static str, Dtype, Vec<usize>, Vec<[u8; 4]>);

fn floats(name: &'static str, shape: &[usize], first: f32) -> Raw {
    let count = shape.iter().product();
    Raw(
        name,
        Dtype::F32,
        shape.to_vec(),
        (0..count)
            .map(|i: usize| (first + i as f32).to_le_bytes())
            .collect(),
    )
}

fn tensors() -> Vec<Raw> {
    let (.., f) = SIZE;
    tensors_of(f)
}

/// Tensors of a shard with so many outputs.
fn tensors_of(f: usize) -> Vec<Raw> {
    let (m, t, n, _) = SIZE;
    vec![
        floats("x", &[m, t, n], 0.0),
        floats("wrench", &[m, t, f], 100.0),
        floats("wrench_clean", &[m, t, f], 200.0),
        floats("hydrostatic", &[m, t, f], 300.0),
        floats("time", &[t], 0.0),
        Raw(
            "condition",
            Dtype::I32,
            vec![m, t],
            (0..6i32).map(i32::to_le_bytes).collect(),
        ),
    ]
}

/// Writes a shard, returns its manifest entry.
fn write_shard(folder: &Path, file: &str, tensors: &[Raw]) -> Value {
    let data: Vec<(&str, Dtype, &Vec<usize>, Vec<u8>)> = tensors
        .iter()
        .map(|Raw(name, dtype, shape, words)| (*name, *dtype, shape, words.concat()))
        .collect();
    let views = data.iter().map(|(name, dtype, shape, bytes)| {
        (
            *name,
            TensorView::new(*dtype, (*shape).clone(), bytes).expect("fits"),
        )
    });
    let bytes = safetensors::serialize(views, None).expect("serialises");
    fs::write(folder.join(file), &bytes).expect("written");
    json!({"file": file, "trajectories": SIZE.0, "sha256": hexadecimal(&Sha256::digest(&bytes))})
}

struct Fixture {
    root: tempfile::TempDir,
    manifest: Value,
}

impl Fixture {
    fn new() -> Self {
        let root = tempfile::tempdir().expect("a folder");
        let shards: Vec<Value> = [
            "train-00000-of-00002.safetensors",
            "train-00001-of-00002.safetensors",
        ]
        .iter()
        .map(|file| write_shard(root.path(), file, &tensors()))
        .collect();
        let manifest = json!({
            "schema": SCHEMA, "name": "tiny",
            "features": ["position.a", "velocity.a", "linear_velocity.x", "density"],
            "feature_units": ["rad", "rad/s", "m/s", "kg/m^3"],
            "outputs": ["force.x", "force.y"], "output_units": ["N", "N"],
            "frames": {"wrench": "base"}, "sample_period": 0.01, "samples": SIZE.1, "seed": 7,
            "splits": {"train": {"trajectories": 4, "shards": shards}, "val": {"trajectories": 0, "shards": []}},
        });
        Self { root, manifest }
    }

    /// With another first shard.
    fn with_shard(tensors: &[Raw]) -> Self {
        let mut fixture = Self::new();
        let entry = write_shard(
            fixture.root.path(),
            "train-00000-of-00002.safetensors",
            tensors,
        );
        fixture.manifest["splits"]["train"]["shards"][0] = entry;
        fixture
    }

    fn open(&self) -> Result<Dataset, DatasetError> {
        fs::write(self.path("manifest.json"), self.manifest.to_string()).expect("written");
        Dataset::open(self.root.path())
    }

    fn path(&self, file: &str) -> PathBuf {
        self.root.path().join(file)
    }

    fn refusal(&self) -> String {
        match self.open().and_then(|dataset| dataset.split("train", None)) {
            Ok(_) => panic!("must be refused"),
            Err(error) => error.to_string(),
        }
    }
}

#[test]
fn shards_are_joined_in_order_and_a_limit_cuts_inside_one() {
    let fixture = Fixture::new();
    let split = fixture
        .open()
        .and_then(|d| d.split("train", None))
        .expect("read");
    assert_eq!(
        (
            split.len(),
            split.samples(),
            split.inputs(),
            split.outputs()
        ),
        (4, 3, 4, 2)
    );
    assert_eq!(split.x(1)[0], 12.0);
    assert_eq!(split.wrench(3)[5], 111.0);
    assert_eq!((split.clean(0)[0], split.hydrostatic(0)[1]), (200.0, 301.0));
    assert_eq!(
        (split.condition(1), split.time()),
        (&[3, 4, 5][..], &[0.0, 1.0, 2.0][..])
    );
    let dataset = fixture.open().expect("valid");
    for (limit, kept) in [(3, 3), (4, 4), (usize::MAX / 3 + 1, 4), (usize::MAX, 4)] {
        let split = dataset.split("train", Some(limit)).expect("read");
        assert_eq!(split.len(), kept, "{limit}");
        assert_eq!(split.x(kept - 1).len(), 12);
    }
    assert!(dataset.split("val", None).expect("read").is_empty());
    assert_eq!(dataset.manifest().provenance["seed"], 7);
}

#[test]
fn hydrostatics_may_be_absent() {
    let fixture = Fixture::with_shard(
        &tensors()
            .into_iter()
            .filter(|t| t.0 != "hydrostatic")
            .collect::<Vec<_>>(),
    );
    let split = fixture
        .open()
        .and_then(|d| d.split("train", None))
        .expect("read");
    assert_eq!(split.hydrostatic(0), [0.0; 6]);
}

#[test]
fn a_folder_without_a_manifest_lists_what_it_holds() {
    let fixture = Fixture::new();
    let error = Dataset::open(fixture.root.path())
        .expect_err("no manifest")
        .to_string();
    assert!(
        error.contains("manifest.json is missing; there are: train-00000-of-00002.safetensors"),
        "{error}"
    );
}

#[test]
fn a_missing_shard_is_named() {
    let fixture = Fixture::new();
    fs::remove_file(fixture.path("train-00001-of-00002.safetensors")).expect("removed");
    assert!(
        fixture
            .refusal()
            .contains("1 of 2 shards missing: train-00001-of-00002.safetensors")
    );
}

#[test]
fn another_schema_is_named() {
    let mut fixture = Fixture::new();
    fixture.manifest["schema"] = "hydro-dataset/2".into();
    assert!(
        fixture
            .refusal()
            .contains("schema is \"hydro-dataset/2\", expected \"hydro-dataset/1\"")
    );
}

#[test]
fn a_flipped_or_cut_shard_is_damaged() {
    let fixture = Fixture::new();
    let path = fixture.path("train-00001-of-00002.safetensors");
    let mut bytes = fs::read(&path).expect("read");
    *bytes.last_mut().expect("not empty") ^= 1;
    fs::write(&path, &bytes).expect("written");
    assert!(
        fixture
            .refusal()
            .contains("train-00001-of-00002.safetensors is damaged")
    );
    fs::write(&path, &bytes[..20]).expect("written");
    assert!(fixture.refusal().contains("is damaged"));
}

#[test]
fn a_number_that_is_none_is_found_by_trajectory_row_and_feature() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut tensors = tensors();
        // Trajectory 1, row 2, feature 2.
        tensors[0].3[12 + 2 * 4 + 2] = bad.to_le_bytes();
        let message = Fixture::with_shard(&tensors).refusal();
        assert!(
            message.contains("`x` of trajectory 1, row 2, linear_velocity.x is"),
            "{message}"
        );
    }
    let mut tensors = tensors();
    tensors[2].3[3] = f32::NAN.to_le_bytes();
    let message = Fixture::with_shard(&tensors).refusal();
    assert!(
        message.contains("`wrench_clean` of trajectory 0, row 1, force.y is NaN"),
        "{message}"
    );
}

#[test]
fn missing_and_misshapen_tensors_are_named_with_both_shapes() {
    let mut wrong = tensors();
    wrong[1] = floats("wrench", &[2, 3, 3], 0.0);
    let message = Fixture::with_shard(&wrong).refusal();
    assert!(
        message.contains("tensor `wrench` is F32 [2, 3, 3], expected F32 [2, 3, 2]"),
        "{message}"
    );
    let message = Fixture::with_shard(&tensors()[1..]).refusal();
    assert!(
        message.contains("tensor `x` is missing (there are: condition, hydrostatic"),
        "{message}"
    );
}

#[test]
fn malformed_manifests_say_what_is_wrong() {
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 12] = [
        (
            |m| m["samples"] = 1_000_000_000_000_000_000_u64.into(),
            "more than any memory holds",
        ),
        (
            |m| m["samples"] = 1_000_000_000.into(),
            "expected F32 [2, 1000000000, ",
        ),
        (
            |m| {
                for shard in [0, 1] {
                    m["splits"]["train"]["shards"][shard]["trajectories"] = (1_u64 << 63).into();
                }
                m["splits"]["train"]["trajectories"] = 0.into();
            },
            "its shards hold more than any memory does",
        ),
        (
            |m| m["sample_period"] = 1e-300.into(),
            "sample_period is 1e-300 s",
        ),
        (
            |m| m["features"][0] = "speed".into(),
            "unknown feature `speed`",
        ),
        (
            |m| m["splits"]["train"]["trajectories"] = 5.into(),
            "says 5 trajectories, its shards hold 4",
        ),
        (
            |m| m["splits"]["train"]["shards"][0]["file"] = "../x".into(),
            "shard `../x` is not a plain file name",
        ),
        (
            |m| m["sample_period"] = (-1.0).into(),
            "sample_period is -1 s",
        ),
        (
            |m| m["feature_units"] = json!(["rad"]),
            "feature_units has 1 entries, expected 4",
        ),
        (
            |m| m["feature_units"][2] = "kn".into(),
            "feature_units gives `linear_velocity.x` in [kn], expected [m/s]",
        ),
        (
            |m| m["output_units"][0] = "kN".into(),
            "output_units gives `force.x` in [kN], expected [N]",
        ),
        (
            |m| m["frames"]["linear_velocity"] = "world".into(),
            "frames gives `linear_velocity` in \"world\"",
        ),
    ];
    for (change, expected) in cases {
        let mut fixture = Fixture::new();
        change(&mut fixture.manifest);
        let message = fixture.refusal();
        assert!(message.contains(expected), "{message} lacks {expected}");
    }
    let dataset = Fixture::new().open().expect("valid");
    let error = dataset
        .split("tset", None)
        .expect_err("no such split")
        .to_string();
    assert!(
        error.contains("no split `tset`") && error.ends_with("there are: train, val"),
        "{error}"
    );
}

/// One output of each component, and two joints; (M, T, f) as [`SIZE`] has M and T.
fn with_joints(generalised: bool, hydrostatic: bool) -> Fixture {
    let (m, t, ..) = SIZE;
    let mut tensors = tensors_of(6);
    if generalised {
        tensors.push(floats("generalised", &[m, t, 7], 1000.0));
    }
    if hydrostatic {
        tensors.push(floats("generalised_hydrostatic", &[m, t, 7], 2000.0));
    }
    let mut fixture = Fixture::new();
    let file = "train-00000-of-00002.safetensors";
    let entry = write_shard(fixture.root.path(), file, &tensors);
    let outputs = [
        "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z",
    ];
    fixture.manifest["outputs"] = json!(outputs);
    fixture.manifest["output_units"] = json!(["N", "N", "N", "N m", "N m", "N m"]);
    fixture.manifest["splits"]["train"] = json!({"trajectories": m, "shards": [entry]});
    if generalised {
        fixture.manifest["generalised"] = json!([&outputs[..], &["a"]].concat());
    }
    fixture
}

#[test]
fn torques_of_joints_follow_the_wrench() {
    let open = |fixture: &Fixture, outputs| {
        let dataset = fixture.open().and_then(|data| data.with_outputs(outputs));
        let dataset = dataset.expect("has them");
        let split = dataset.split("train", None).expect("read");
        (dataset, split)
    };
    let fixture = with_joints(true, true);
    let (dataset, split) = open(&fixture, Outputs::Generalised);
    assert_eq!(dataset.manifest().outputs[6], "joint_torque.a");
    assert_eq!(dataset.manifest().output_units[6], "N m");
    assert_eq!(split.outputs(), 7);
    // Row 1 of trajectory 1: row 4 of all.
    let row = |values: &[f32]| values[7..14].to_vec();
    let of = |base: f32, joint: f32| -> Vec<f32> {
        (0..6)
            .map(|at| base + 24.0 + at as f32)
            .chain([joint])
            .collect()
    };
    assert_eq!(row(split.wrench(1)), of(100.0, 1000.0 + 34.0));
    assert_eq!(row(split.clean(1)), of(200.0, 1000.0 + 34.0));
    assert_eq!(row(split.hydrostatic(1)), of(300.0, 2000.0 + 34.0));

    let (dataset, split) = open(&fixture, Outputs::Wrench);
    assert_eq!((dataset.manifest().outputs.len(), split.outputs()), (6, 6));
    let (_, split) = open(&with_joints(true, false), Outputs::Generalised);
    assert!(split.hydrostatic(0).iter().all(|value| *value == 0.0));
}

#[test]
fn torques_that_are_not_there_are_refused() {
    let refusal = |fixture: Fixture| {
        let opened = fixture
            .open()
            .and_then(|data| data.with_outputs(Outputs::Generalised));
        let read = opened.and_then(|data| data.split("train", None));
        read.expect_err("refused").to_string()
    };
    let message = refusal(with_joints(false, false));
    assert!(
        message.contains("no `generalised`") && message.contains("--water strip"),
        "{message}"
    );
    for (columns, expected) in [
        (
            json!(["force.x", "a"]),
            "generalised is force.x a, expected force.x",
        ),
        (
            json!([
                "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z", "b"
            ]),
            "generalised names the joint `b`, the features: a",
        ),
    ] {
        let mut fixture = with_joints(true, true);
        fixture.manifest["generalised"] = columns;
        let message = refusal(fixture);
        assert!(message.contains(expected), "{message}");
    }
    // The manifest names columns that the shard lacks.
    let mut fixture = with_joints(false, false);
    fixture.manifest["generalised"] = json!([
        "force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z", "a"
    ]);
    let message = refusal(fixture);
    assert!(message.contains("`generalised` is missing"), "{message}");
    let mut fixture = with_joints(true, true);
    fixture.manifest["added_mass"] = json!([{"body": "hull", "matrix": [1.0]}]);
    let message = refusal(fixture);
    assert!(
        message.contains("added_mass of `hull` has 1 numbers"),
        "{message}"
    );
}
