//! The program `hydro` as a user meets it: every command and every refusal through the real binary.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stderr)]

mod attention;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod corpus;
mod hostile;
mod program;
mod run;
mod simulate;
mod strip_water;
