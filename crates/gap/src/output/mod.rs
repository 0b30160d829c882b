//! Results of the stages and the verdict, as written to files.

pub mod records;
pub mod verdict;
