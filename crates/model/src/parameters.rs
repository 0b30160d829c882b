//! Named weights, drawn from a seed or read from a file.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Mutex,
};

use candle_core::{DType, Device, Result, Shape, Tensor, Var};
use candle_nn::{Init, VarBuilder, var_builder::SimpleBackend};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest as _, Sha256};

/// Weights in the order of their names. Cloning shares them.
#[derive(Clone, Debug, Default)]
pub struct Parameters(BTreeMap<String, Var>);

impl Parameters {
    /// Calls `build` with a [`VarBuilder`] that draws each weight when a layer asks for it; returns the model and its
    /// weights. The numbers depend on the seed and the names of the weights alone.
    pub fn draw<M>(seed: u64, build: impl FnOnce(VarBuilder) -> Result<M>) -> Result<(M, Self)> {
        Self::draw_on(&Device::Cpu, seed, build)
    }

    /// [`Parameters::draw`] with the weights on a device.
    pub fn draw_on<M>(
        device: &Device,
        seed: u64,
        build: impl FnOnce(VarBuilder) -> Result<M>,
    ) -> Result<(M, Self)> {
        let drawn = std::sync::Arc::new(Mutex::new(BTreeMap::new()));
        let backend = Box::new(Draw {
            seed,
            drawn: drawn.clone(),
        });
        let model = build(VarBuilder::from_backend(
            backend,
            DType::F32,
            device.clone(),
        ))?;
        let parameters = std::mem::take(
            &mut *drawn
                .lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner()),
        );
        Ok((model, Self(parameters)))
    }

    /// Names and weights, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Var)> {
        self.0.iter().map(|(name, var)| (name.as_str(), var))
    }

    /// Number of tensors.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// True if there is no weight.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Numbers in all tensors together.
    pub fn count(&self) -> usize {
        self.0.values().map(|var| var.elem_count()).sum()
    }

    /// A copy of the weights on the CPU.
    pub fn snapshot(&self) -> Result<BTreeMap<String, Tensor>> {
        self.0
            .iter()
            .map(|(name, var)| {
                let copy = var.as_detached_tensor().copy()?;
                Ok((name.clone(), copy.to_device(&Device::Cpu)?))
            })
            .collect()
    }

    /// Sets the weights to those of a snapshot; they stay on their device.
    pub fn restore(&self, snapshot: &BTreeMap<String, Tensor>) -> Result<()> {
        for (name, var) in &self.0 {
            let tensor = snapshot
                .get(name)
                .ok_or_else(|| candle_core::Error::CannotFindTensor { path: name.clone() })?;
            var.set(&tensor.to_device(var.device())?)?;
        }
        Ok(())
    }
}

/// A [`VarBuilder`] over given tensors; the error for a missing or misshapen one names it.
pub fn builder(tensors: &BTreeMap<String, Tensor>) -> VarBuilder<'static> {
    let tensors: HashMap<String, Tensor> = tensors
        .iter()
        .map(|(n, t)| (n.clone(), t.clone()))
        .collect();
    VarBuilder::from_tensors(tensors, DType::F32, &Device::Cpu)
}

struct Draw {
    seed: u64,
    drawn: std::sync::Arc<Mutex<BTreeMap<String, Var>>>,
}

impl Draw {
    fn values(&self, name: &str, init: Init, shape: &Shape) -> Vec<f32> {
        let digest = Sha256::new()
            .chain_update(self.seed.to_le_bytes())
            .chain_update(name)
            .finalize();
        let mut rng = ChaCha8Rng::from_seed(digest.into());
        let mut uniform = |bound: f64| {
            let draw = |_| ((2.0 * rng.random::<f64>() - 1.0) * bound) as f32;
            (0..shape.elem_count()).map(draw).collect()
        };
        match init {
            Init::Const(value) => vec![value as f32; shape.elem_count()],
            // Uniform with the same variance.
            Init::Randn { stdev, .. } => uniform(stdev * 3f64.sqrt()),
            Init::Uniform { up, .. } => uniform(up),
            // He's rule for the layers of candle-nn: uniform of variance gain^2 / fan-in.
            Init::Kaiming { .. } => {
                uniform((6.0 / shape.dims().last().copied().unwrap_or(1) as f64).sqrt())
            }
        }
    }
}

impl SimpleBackend for Draw {
    fn get(
        &self,
        shape: Shape,
        name: &str,
        init: Init,
        _: DType,
        device: &Device,
    ) -> Result<Tensor> {
        let values = self.values(name, init, &shape);
        let var = Var::from_tensor(&Tensor::from_vec(values, shape, device)?)?;
        let tensor = var.as_tensor().clone();
        self.drawn
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
            .insert(name.to_owned(), var);
        Ok(tensor)
    }

    fn get_unchecked(&self, name: &str, _: DType, _: &Device) -> Result<Tensor> {
        candle_core::bail!("the shape of `{name}` must be given to draw it")
    }

    fn contains_tensor(&self, _: &str) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_depend_on_seed_and_name_alone() {
        let draw = |seed, names: &[&str]| {
            Parameters::draw(seed, |vb| {
                names
                    .iter()
                    .map(|name| vb.get_with_hints(3, name, Init::Uniform { lo: -1.0, up: 1.0 }))
                    .collect::<Result<Vec<_>>>()
            })
            .expect("drawn")
            .1
        };
        let values = |parameters: &Parameters, name: &str| {
            let var = parameters
                .iter()
                .find(|(known, _)| *known == name)
                .expect("known")
                .1;
            var.to_vec1::<f32>().expect("a vector")
        };
        let (one, two) = (draw(1, &["a", "b"]), draw(1, &["b", "a"]));
        assert_eq!(values(&one, "a"), values(&two, "a"));
        assert_ne!(values(&one, "a"), values(&one, "b"));
        assert_ne!(values(&one, "a"), values(&draw(2, &["a"]), "a"));
        assert_eq!((one.len(), one.count()), (2, 6));
    }
}
