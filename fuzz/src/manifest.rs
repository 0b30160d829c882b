//! `manifest.json` of a data set whose shards are sound.

use hydro_training::dataset::Dataset;

use super::{folder, refused};

/// The shard of every split.
pub(super) const SHARD: &[u8] = include_bytes!("../parts/data/shard.safetensors");

/// Reads a manifest and the splits that it names.
pub fn read(bytes: &[u8]) -> bool {
    folder::put("manifest/manifest.json", bytes);
    folder::put("manifest/shard.safetensors", SHARD);
    open("manifest")
}

/// Opens a data set of the scratch folder and reads its splits; true where all are accepted.
pub(super) fn open(name: &str) -> bool {
    let data = match Dataset::open(&folder::path().join(name)) {
        Ok(data) => data,
        Err(error) => return refused(&error),
    };
    let mut sound = true;
    for split in data.manifest().splits.keys() {
        sound &= match data.split(split, Some(3)) {
            Ok(split) => split.len() <= 3,
            Err(error) => refused(&error),
        };
    }
    sound
}
