//! What a person looks at: plots and a page. Renders, computes nothing.

pub mod experiment;
pub mod gap;
mod html;
pub mod page;
pub mod plot;
