//! Arrays that the driver wrote.

use std::{collections::BTreeMap, path::Path};

use candle_core::{Device, Tensor};

use crate::error::Result;

/// The tensors of a safetensors file.
pub(crate) fn tensors(path: &Path) -> Result<BTreeMap<String, Tensor>> {
    let read = candle_core::safetensors::load(path, &Device::Cpu)
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(read.into_iter().collect())
}

/// One of them, by name.
pub(crate) fn named<'a>(tensors: &'a BTreeMap<String, Tensor>, name: &str) -> Result<&'a Tensor> {
    Ok(tensors
        .get(name)
        .ok_or_else(|| format!("no `{name}` among {:?}", tensors.keys()))?)
}

/// Rows of a matrix, as f64.
pub(crate) fn rows(tensor: &Tensor) -> Result<Vec<Vec<f64>>> {
    Ok(tensor.to_dtype(candle_core::DType::F64)?.to_vec2()?)
}
