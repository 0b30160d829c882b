//! Plots and HTML pages: rendering only, no computation.

pub mod experiment;
pub mod gap;
mod html;
pub mod page;
pub mod plot;
