//! The Rust programs that scripts/bench.sh times: a live process that answers one JSON line with another.
//!
//! ```text
//! {"do": "prepare", "task": {"kind": "engine", ..}}   {"values": [..]}         what it computes, for the check
//! {"do": "block", "count": 100}                       {"seconds": s, "values": [..]}
//! {"do": "peak"}                                      {"bytes": b}             largest memory so far
//! ```
//!
//! An error is answered as `{"error": ".."}`; the end of the input ends the process.
#![allow(missing_docs, clippy::print_stdout)]

mod bandwidth;
mod engine;
mod error;
mod files;
mod implementation;
mod memory;
mod operation;
mod plain_field;
mod plain_model;
mod task;
mod training_case;
mod trajectories;
mod unrolled;

use std::io::{BufRead as _, Write as _};

use serde::Deserialize;
use serde_json::{Value, json};

use self::{
    error::Result,
    implementation::{Block, Implementation},
    task::Task,
};

#[derive(Deserialize)]
#[serde(tag = "do", rename_all = "lowercase")]
enum Request {
    Prepare { task: Task },
    Block { count: usize },
    Peak,
}

#[derive(Default)]
struct Worker(Option<Box<dyn Implementation>>);

impl Worker {
    fn answer(&mut self, line: &str) -> Result<Value> {
        match serde_json::from_str(line)? {
            Request::Prepare { task } => {
                let mut implementation = task.prepare()?;
                let values = implementation.check()?;
                self.0 = Some(implementation);
                Ok(json!({ "values": values }))
            }
            Request::Block { count } => {
                let implementation = self.0.as_mut().ok_or("a block before any task")?;
                let Block { seconds, values } = implementation.block(count)?;
                Ok(json!({ "seconds": seconds, "values": values }))
            }
            Request::Peak => Ok(json!({ "bytes": memory::peak_bytes()? })),
        }
    }
}

fn main() -> Result<()> {
    if std::env::args().any(|argument| argument == "--bench") {
        return Ok(()); // `cargo bench`: nobody asks.
    }
    let mut worker = Worker::default();
    for line in std::io::stdin().lock().lines() {
        let answer = worker
            .answer(&line?)
            .unwrap_or_else(|error| json!({ "error": error.to_string() }));
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}
