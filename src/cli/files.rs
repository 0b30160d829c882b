//! Files written whole, and their digests.

use std::path::Path;

use anyhow::Context as _;
use sha2::{Digest as _, Sha256};

/// Writes a file of another name beside it and renames that, so that a reader sees the old file or the new one.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)
        .and_then(|()| hydro_files::write_whole(path, bytes))
        .with_context(|| format!("writing {}", path.display()))
}

/// SHA-256 in hexadecimal digits.
pub(super) fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
