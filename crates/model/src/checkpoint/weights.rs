//! `weights.safetensors`.

use std::{collections::BTreeMap, path::Path};

use candle_core::{Device, Tensor};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};

use super::{error::CheckpointError, files::WEIGHTS};

/// Values of a tensor, row by row; `path` and `name` say where it is.
pub(super) fn numbers(
    tensor: &Tensor,
    path: &Path,
    name: &str,
) -> Result<Vec<f32>, CheckpointError> {
    let values = tensor.flatten_all().and_then(|flat| flat.to_vec1::<f32>());
    values.map_err(|error| unreadable(path, name, &error))
}

fn unreadable(path: &Path, name: &str, error: &candle_core::Error) -> CheckpointError {
    CheckpointError::Tensor {
        path: path.to_owned(),
        name: hydro_files::short(name),
        reason: hydro_files::short(error),
    }
}

/// The bytes of a file that holds them.
pub(super) fn serialise(weights: &BTreeMap<String, Tensor>) -> Result<Vec<u8>, CheckpointError> {
    let mut bytes = Vec::new();
    for (name, tensor) in weights {
        let values: Vec<u8> = numbers(tensor, Path::new(WEIGHTS), name)?
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        bytes.push((name, tensor.dims().to_vec(), values));
    }
    let format = |reason: safetensors::SafeTensorError| CheckpointError::Format {
        path: WEIGHTS.into(),
        reason: reason.to_string(),
    };
    let views = bytes
        .iter()
        .map(|(name, shape, values)| {
            Ok((name, TensorView::new(Dtype::F32, shape.clone(), values)?))
        })
        .collect::<Result<Vec<_>, _>>()
        .map_err(format)?;
    safetensors::serialize(views, None).map_err(format)
}

/// Weights by name.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
) -> Result<BTreeMap<String, Tensor>, CheckpointError> {
    let tensors = SafeTensors::deserialize(bytes).map_err(|error| CheckpointError::Format {
        path: path.to_owned(),
        reason: hydro_files::short(error),
    })?;
    tensors
        .iter()
        .map(|(name, view)| {
            if view.dtype() != Dtype::F32 {
                return Err(CheckpointError::Shape {
                    path: path.to_owned(),
                    name: name.to_owned(),
                    found: format!("{:?} {:?}", view.dtype(), view.shape()),
                    expected: view.shape().to_vec(),
                });
            }
            let (words, _) = view.data().as_chunks::<4>();
            let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
            let tensor = Tensor::from_vec(values, view.shape(), &Device::Cpu)
                .map_err(|error| unreadable(path, name, &error))?;
            Ok((name.to_owned(), tensor))
        })
        .collect()
}
