//! By what a network runs: kernels of our own where there are any, else tensor operations.

use candle_core::Device;

/// The two give the same numbers but for rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Backend {
    /// The custom operations of this room, for the CPU.
    Kernels,
    /// Candle's own operations, for any device.
    Tensors,
}

impl Backend {
    /// What a device takes.
    pub(crate) fn for_device(device: &Device) -> Self {
        if device.is_cpu() {
            Self::Kernels
        } else {
            Self::Tensors
        }
    }
}
