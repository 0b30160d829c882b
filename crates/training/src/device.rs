//! Where the tensors of a run are computed.

use std::{fmt, str::FromStr};

use candle_core::{Device, utils::cuda_is_available};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::TrainError;

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

impl TrainDevice {
    /// The tensor library's device.
    ///
    /// # Errors
    /// A graphics card that this build cannot use, or that is not there.
    pub(super) fn open(self) -> Result<Device, TrainError> {
        match self {
            Self::Cpu => Ok(Device::Cpu),
            Self::Cuda(_) if !cuda_is_available() => Err(TrainError::WithoutCuda { device: self }),
            Self::Cuda(number) => Device::new_cuda(number).map_err(|error| TrainError::NoDevice {
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

/// A name that is none.
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
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_others_refused() {
        for device in [TrainDevice::Cpu, TrainDevice::Cuda(0), TrainDevice::Cuda(3)] {
            assert_eq!(device.to_string().parse(), Ok(device));
        }
        assert_eq!("cuda".parse(), Ok(TrainDevice::Cuda(0)));
        for name in ["gpu", "cuda:", "cuda:x", "cuda:-1", "CPU", ""] {
            let error = name.parse::<TrainDevice>().expect_err("no such device");
            assert_eq!(
                error.to_string(),
                format!("unknown device `{name}`: there are cpu, cuda and cuda:N")
            );
        }
    }

    #[test]
    fn a_build_without_the_feature_says_how_to_get_one() {
        assert!(TrainDevice::Cpu.open().expect("always there").is_cpu());
        if !cuda_is_available() {
            let error = TrainDevice::Cuda(1).open().expect_err("not built in");
            assert_eq!(
                error.to_string(),
                "cuda:1: this build has no CUDA; `cargo build --release --features cuda --target-dir target/cuda` makes one that does"
            );
        }
    }
}
