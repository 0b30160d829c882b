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

mod block;
mod engine;
mod error;
mod files;
mod lesson;
mod memory;
mod ours;
mod plain;
mod read;
mod reference;
mod task;
mod trajectories;
mod unrolled;

use std::io::{BufRead as _, Write as _};

use serde::Deserialize;
use serde_json::{Value, json};

use self::{
    block::{Block, Contender},
    error::Result,
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
struct Worker(Option<Box<dyn Contender>>);

impl Worker {
    fn answer(&mut self, line: &str) -> Result<Value> {
        match serde_json::from_str(line)? {
            Request::Prepare { task } => {
                let mut contender = task.prepare()?;
                let values = contender.check()?;
                self.0 = Some(contender);
                Ok(json!({ "values": values }))
            }
            Request::Block { count } => {
                let contender = self.0.as_mut().ok_or("a block before any task")?;
                let Block { seconds, values } = contender.block(count)?;
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
