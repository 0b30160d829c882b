//! The tables and figures of the paper's experiments: one Markdown page, and pictures beside it.

mod figures;
mod page;
mod tables;

pub use self::{
    figures::figures,
    page::{pictures, tables},
};
