//! The page of `hydro gap`, one HTML file without scripts or outside references, and the sentences that it shares with the
//! terminal.

mod diff;
mod errors;
mod facts;
mod heat_map;
mod numbers;
mod overlay;
mod page;
mod parameters;
mod ranking;
mod sentence;
mod svg;
#[cfg(test)]
mod tests;

pub use numbers::{by_trial, interval, number, part_of_excess, percent, probability, with_unit};
pub use page::page;
pub use sentence::{VerdictKind, effect_name, effect_on, headline, place, regime};
