//! From Candle's storage to the numbers of an operation, in single or double precision.

use candle_core::{CpuStorage, Layout, Result, WithDType};

/// The numbers of a contiguous argument.
pub(super) fn numbers<'a, T: WithDType>(
    storage: &'a CpuStorage,
    layout: &Layout,
) -> Result<&'a [T]> {
    match layout.contiguous_offsets() {
        Some((start, end)) => Ok(&T::cpu_storage_as_slice(storage)?[start..end]),
        None => candle_core::bail!("the operation takes contiguous tensors"),
    }
}

/// Storage of what `$run` gives, in the precision of `$storage`; the operation names itself where that is another.
macro_rules! in_either_precision {
    ($operation:expr, $storage:expr, $run:expr) => {
        match $storage {
            candle_core::CpuStorage::F32(_) => {
                <f32 as candle_core::WithDType>::to_cpu_storage_owned($run)
            }
            candle_core::CpuStorage::F64(_) => {
                <f64 as candle_core::WithDType>::to_cpu_storage_owned($run)
            }
            _ => candle_core::bail!("{} takes f32 or f64", $operation.name()),
        }
    };
}

pub(super) use in_either_precision;
