//! The device that computes the tensors of a run.

use std::{fmt, str::FromStr};

use candle_core::{Device, utils::cuda_is_available};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The processor, or a graphics card where the feature `cuda` is built in. Both draw the same first weights and
/// see the same windows in the same order; sums are taken in another order, so the results agree within rounding
/// and not to the bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub enum TrainDevice {
    /// The processor: `cpu`.
    #[default]
    Cpu,
    /// A graphics card by its number: `cuda:1`; `cuda` is `cuda:0`.
    Cuda(usize),
}

/// Reasons to refuse a device.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A graphics card asked of a build that has no CUDA.
    #[error(
        "{device}: this build has no CUDA; `cargo build --release --features cuda --target-dir target/cuda` makes one that does"
    )]
    WithoutCuda {
        /// The device asked for.
        device: TrainDevice,
    },
    /// A graphics card that cannot be used.
    #[error("{device} cannot be used: {reason}; `--device cpu` needs no graphics card")]
    NoDevice {
        /// The device asked for.
        device: TrainDevice,
        /// The driver's message.
        reason: String,
    },
}

impl TrainDevice {
    /// The tensor library's device.
    ///
    /// # Errors
    /// A graphics card that this build cannot use, or that is not there.
    pub(super) fn open(self) -> Result<Device, DeviceError> {
        match self {
            Self::Cpu => Ok(Device::Cpu),
            Self::Cuda(_) if !cuda_is_available() => Err(DeviceError::WithoutCuda { device: self }),
            Self::Cuda(number) => Device::new_cuda(number).map_err(|error| DeviceError::NoDevice {
                device: self,
                // A backtrace may follow.
                reason: error.to_string().lines().take(1).collect(),
            }),
        }
    }
}

impl fmt::Display for TrainDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.write_str("cpu"),
            Self::Cuda(number) => write!(f, "cuda:{number}"),
        }
    }
}

impl From<TrainDevice> for String {
    fn from(device: TrainDevice) -> Self {
        device.to_string()
    }
}

/// An unknown name.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("unknown device `{0}`: there are cpu, cuda and cuda:N")]
pub struct UnknownDevice(pub String);

impl FromStr for TrainDevice {
    type Err = UnknownDevice;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let number = match name {
            "cpu" => return Ok(Self::Cpu),
            "cuda" => Some(0),
            _ => name.strip_prefix("cuda:").and_then(|n| n.parse().ok()),
        };
        number
            .map(Self::Cuda)
            .ok_or_else(|| UnknownDevice(name.to_owned()))
    }
}

impl TryFrom<String> for TrainDevice {
    type Error = UnknownDevice;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        name.parse()
    }
}

#[cfg(test)]
#[path = "tests/device.rs"]
mod tests;
