//! Numbers of the learned models: engines against each other, allocations, a graphics card against the processor.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr
)]

mod allocation;
#[path = "../common/mod.rs"]
mod common;
mod cuda;
mod engine;
mod released;
