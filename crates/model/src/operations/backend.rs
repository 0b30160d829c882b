//! Implementation of an operation: kernels of this crate on the CPU, tensor operations elsewhere.

use candle_core::Device;

/// Both give the same numbers up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Backend {
    /// Custom operations of this crate, for the CPU.
    Kernels,
    /// Candle's own operations, for any device.
    Tensors,
}

impl Backend {
    /// The implementation for a device.
    pub(crate) fn for_device(device: &Device) -> Self {
        if device.is_cpu() {
            Self::Kernels
        } else {
            Self::Tensors
        }
    }
}
