//! Errors of loading, looking up and setting a simulation.

use std::{
    ffi::CString,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::mujoco::ffi::{api::ApiError, last_refusal};

/// Why a model or a lookup failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimulatorError {
    /// No MuJoCo to call.
    #[error(transparent)]
    Api(#[from] ApiError),
    /// MuJoCo refused the model.
    #[error("{}: {reason}", .path.display())]
    Model {
        /// The MJCF; empty for one that was given as text.
        path: PathBuf,
        /// MuJoCo's reason, and the plugin's.
        reason: String,
    },
    /// No object of that name.
    #[error("the model has no {kind} `{name}`; it has: {}", .exists.join(", "))]
    NoSuch {
        /// `joint`, `body`, `sensor` or `actuator`.
        kind: &'static str,
        /// The name looked for.
        name: String,
        /// The names there are.
        exists: Vec<String>,
    },
    /// A state of another length.
    #[error("a state of {found} numbers for a model whose states have {expected}")]
    StateLength {
        /// Length of the model's states.
        expected: usize,
        /// Length given.
        found: usize,
    },
    /// A robot that does not float.
    #[error("the model's first joint is not free; joints: {}. A swimming robot has a <freejoint/> on its base, first of all joints", .joints.join(", "))]
    NotFloating {
        /// Joints of the model.
        joints: Vec<String>,
    },
    /// A density cannot be changed in proportion to none.
    #[error(
        "the scene's option density is {found} kg/m^3; expected more than zero, as in the truth and the baselines"
    )]
    NoDensity {
        /// The scene's.
        found: f64,
    },
}

pub(in crate::mujoco) fn c_path(path: &Path) -> Result<CString, SimulatorError> {
    CString::new(path.as_os_str().as_encoded_bytes()).map_err(|_| SimulatorError::Model {
        path: path.to_owned(),
        reason: "the path holds a zero byte".to_owned(),
    })
}

/// MuJoCo's reason and the plugin's.
pub(in crate::mujoco) fn refused(path: &Path, error: &[u8]) -> SimulatorError {
    let end = error
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(error.len());
    let text = String::from_utf8_lossy(&error[..end]).trim().to_owned();
    SimulatorError::Model {
        path: path.to_owned(),
        reason: [Some(text), last_refusal::take()]
            .into_iter()
            .flatten()
            .collect::<Vec<_>>()
            .join(": "),
    }
}

/// Room for MuJoCo's error text.
pub(in crate::mujoco) const ERROR_LEN: usize = 4096;
