pub mod records;
pub mod verdict;
