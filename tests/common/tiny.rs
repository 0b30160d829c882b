//! A small data set on disk, of another robot than B1: nothing is wired to 35 features.

use std::{fs, path::Path};

use safetensors::{Dtype, tensor::TensorView};
use sha2::{Digest as _, Sha256};

/// Samples of a trajectory.
pub const T: usize = 40;
pub const FEATURES: [&str; 3] = ["position.thigh", "linear_velocity.x", "density"];

pub fn bytes(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// A force that relaxes towards a function of the features: `count` trajectories of one split.
fn shard(count: usize, salt: usize) -> Vec<u8> {
    let (mut x, mut wrench) = (Vec::new(), Vec::new());
    for trajectory in 0..count {
        let mut force = 0.0f32;
        for k in 0..T {
            let wave = ((k + 7 * trajectory + 31 * salt) as f32 * 0.2).sin();
            let sample = [wave, 0.5 * wave * wave, 1000.0 + trajectory as f32];
            force += 0.3 * (20.0 * sample[0] - 10.0 * sample[1] - force);
            x.extend(sample);
            wrench.extend([force, -2.0 * force]);
        }
    }
    let time: Vec<f32> = (0..T).map(|k| k as f32 * 0.01).collect();
    let condition: Vec<u8> = vec![0; count * T * 4];
    let (x, wrench, time) = (bytes(&x), bytes(&wrench), bytes(&time));
    let tensors = vec![
        (
            "x",
            TensorView::new(Dtype::F32, vec![count, T, 3], &x).unwrap(),
        ),
        (
            "wrench",
            TensorView::new(Dtype::F32, vec![count, T, 2], &wrench).unwrap(),
        ),
        (
            "wrench_clean",
            TensorView::new(Dtype::F32, vec![count, T, 2], &wrench).unwrap(),
        ),
        ("time", TensorView::new(Dtype::F32, vec![T], &time).unwrap()),
        (
            "condition",
            TensorView::new(Dtype::I32, vec![count, T], &condition).unwrap(),
        ),
    ];
    safetensors::serialize(tensors, None).unwrap()
}

pub fn sha256(data: &[u8]) -> String {
    let digest = Sha256::digest(data);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// 12 trajectories to train on, 4 to validate, 4 to test.
pub fn dataset(folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    let mut splits = serde_json::Map::new();
    for (salt, (split, count)) in [("train", 12), ("val", 4), ("test", 4)]
        .into_iter()
        .enumerate()
    {
        let file = format!("{split}-00000-of-00001.safetensors");
        let data = shard(count, salt);
        fs::write(folder.join(&file), &data).unwrap();
        let digest = sha256(&data);
        splits.insert(
            split.to_owned(),
            serde_json::json!({"trajectories": count, "shards": [{"file": file, "trajectories": count, "sha256": digest}]}),
        );
    }
    let manifest = serde_json::json!({
        "schema": "hydro-dataset/1", "name": "tiny", "features": FEATURES, "feature_units": ["rad", "m/s", "kg/m^3"],
        "outputs": ["force.x", "force.y"], "output_units": ["N", "N"], "frames": {"wrench": "base"},
        "sample_period": 0.01, "samples": T, "splits": splits,
    });
    fs::write(folder.join("manifest.json"), manifest.to_string()).unwrap();
}
