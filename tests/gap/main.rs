//! Foundations of `hydro gap`: trials on disk, effects in MuJoCo, patched models.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stderr)]

mod numbers;
mod patch_python;
mod plant;
mod prescribed;
#[path = "../common/skip_python.rs"]
mod skip_python;
mod trial;
