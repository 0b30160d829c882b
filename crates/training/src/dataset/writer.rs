//! Writing a data set: one shard a split.

use std::{collections::BTreeMap, fs, path::Path};

use hydro_model::document::hexadecimal;
use safetensors::{Dtype, tensor::TensorView};
use sha2::{Digest as _, Sha256};

use super::{
    error::DatasetError,
    manifest::{Manifest, ShardEntry, SplitEntry},
    reader::Dataset,
};

/// One trajectory as it is recorded, of [`Manifest::samples`] samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Features, SI [T, n].
    pub x: Vec<f32>,
    /// Wrench [T, f]; without perturbation, so the clean one too.
    pub wrench: Vec<f32>,
}

/// Writes a data set into a folder and opens it. `about` says all but the splits.
///
/// # Errors
/// A folder that cannot be written to; numbers that are missing or not finite, by name.
pub fn write(
    folder: &Path,
    about: &Manifest,
    splits: &[(&str, Vec<Trajectory>)],
) -> Result<Dataset, DatasetError> {
    let io = |path: &Path| {
        let path = path.to_owned();
        move |source| DatasetError::Io { path, source }
    };
    fs::create_dir_all(folder).map_err(io(folder))?;
    let mut manifest = about.clone();
    manifest.splits = BTreeMap::new();
    for (name, trajectories) in splits {
        let file = format!("{name}-00000-of-00001.safetensors");
        let path = folder.join(&file);
        let bytes = shard(&path, about, trajectories)?;
        hydro_files::write_whole(&path, &bytes).map_err(io(&path))?;
        let trajectories = trajectories.len();
        let shard = ShardEntry {
            file,
            trajectories,
            sha256: hexadecimal(&Sha256::digest(&bytes)),
        };
        let split = SplitEntry {
            trajectories,
            shards: vec![shard],
        };
        manifest.splits.insert((*name).to_owned(), split);
    }
    let path = folder.join("manifest.json");
    let text = serde_json::to_vec_pretty(&manifest).map_err(|error| DatasetError::Manifest {
        path: path.clone(),
        reason: error.to_string(),
    })?;
    hydro_files::write_whole(&path, &text).map_err(io(&path))?;
    Dataset::open(folder)
}

/// The bytes of one shard.
fn shard(
    path: &Path,
    about: &Manifest,
    trajectories: &[Trajectory],
) -> Result<Vec<u8>, DatasetError> {
    let (m, t) = (trajectories.len(), about.samples);
    let bytes = |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
        values.flat_map(f32::to_le_bytes).collect()
    };
    let x = bytes(&mut trajectories.iter().flat_map(|of| of.x.iter().copied()));
    let wrench = bytes(&mut trajectories.iter().flat_map(|of| of.wrench.iter().copied()));
    let time = bytes(&mut (0..t).map(|k| (k as f64 * about.sample_period) as f32));
    let condition = vec![0_u8; 4 * m * t];
    let (n, f) = (about.features.len(), about.outputs.len());
    let tensors = [
        ("x", Dtype::F32, vec![m, t, n], &x),
        ("wrench", Dtype::F32, vec![m, t, f], &wrench),
        ("wrench_clean", Dtype::F32, vec![m, t, f], &wrench),
        ("time", Dtype::F32, vec![t], &time),
        ("condition", Dtype::I32, vec![m, t], &condition),
    ];
    // A trajectory of another length is found here.
    let format = |error: safetensors::SafeTensorError| DatasetError::Format {
        path: path.to_owned(),
        reason: error.to_string(),
    };
    let views = tensors
        .into_iter()
        .map(|(name, dtype, shape, bytes)| Ok((name, TensorView::new(dtype, shape, bytes)?)))
        .collect::<Result<Vec<_>, _>>()
        .map_err(format)?;
    safetensors::serialize(views, None).map_err(format)
}

#[cfg(test)]
#[path = "tests/writer.rs"]
mod tests;
