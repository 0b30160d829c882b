//! Dense products and activations, shared by training and by the single-step engine.
//!
//! C [m,n] += A [m,k] B [k,n], with B packed once in panels of [`PANEL`] columns. Each element of C is
//! one chain of fused multiply-adds over k, in order, whatever the vector width, the number of rows
//! or the blocking: the same numbers on every machine with FMA, for one row and for many.
//!
//! Blocking after K. Goto and R. van de Geijn, "Anatomy of High-Performance Matrix Multiplication",
//! ACM TOMS 34(3), 2008.

mod activation;
mod half;
mod int16;
mod panels;
mod real;
mod row;
mod rows;
#[cfg(test)]
mod tests;

#[cfg(test)]
pub(crate) use self::half::rounded;
#[cfg(test)]
pub(crate) use self::tests::instruction_sets;
pub(crate) use self::{
    activation::{sigmoid, silu, softmax},
    half::{BeyondHalf, HalfPanels, multiply_row_half},
    int16::{Int16Panels, has_int16, multiply_int16},
    panels::{Panels, pack_rows},
    real::{Real, dot, sum_in_order},
    row::multiply_row,
    rows::multiply_rows,
};
