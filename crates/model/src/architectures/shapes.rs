//! Shapes of a model's weights, found without memory for them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use candle_core::{DType, Device, Result, Shape, Tensor};
use candle_nn::{Init, VarBuilder, var_builder::SimpleBackend};

use super::{bounds::MOST_WEIGHTS, config::ModelConfig, network::Network};
use crate::error::ModelError;

/// Shapes of a model's weights by name.
pub(crate) type Shapes = BTreeMap<String, Vec<usize>>;

/// Name and shape of every weight of a model.
///
/// # Errors
/// Sizes that [`ModelConfig::check`] refuses; more than [`MOST_WEIGHTS`] numbers.
pub(crate) fn shapes(
    config: &ModelConfig,
    inputs: usize,
    outputs: usize,
) -> std::result::Result<Shapes, ModelError> {
    config.check()?;
    let found = Arc::new(Mutex::new(Shapes::new()));
    let backend = Box::new(Listing(Arc::clone(&found)));
    let vb = VarBuilder::from_backend(backend, DType::F32, Device::Cpu);
    Network::new(config, inputs, outputs, vb)?;
    let mut listed = found
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    let shapes = std::mem::take(&mut *listed);
    let count = (shapes.values()).fold(0usize, |sum, shape| {
        let product = shape.iter().fold(1usize, |a, b| a.saturating_mul(*b));
        sum.saturating_add(product)
    });
    if count > MOST_WEIGHTS {
        return Err(ModelError::Config {
            reason: format!(
                "{count} weights, expected {MOST_WEIGHTS} at most: choose smaller sizes"
            ),
        });
    }
    Ok(shapes)
}

/// Refuses a model of more weights than it may have, for `inputs` encoded numbers a sample and `outputs` force components.
///
/// # Errors
/// Also sizes that [`ModelConfig::check`] refuses.
pub fn check_count(
    config: &ModelConfig,
    inputs: usize,
    outputs: usize,
) -> std::result::Result<(), ModelError> {
    shapes(config, inputs, outputs).map(|_| ())
}

/// Writes down what a model asks for, and answers with one number seen as a whole tensor.
struct Listing(Arc<Mutex<Shapes>>);

impl SimpleBackend for Listing {
    fn get(&self, shape: Shape, name: &str, _: Init, dtype: DType, on: &Device) -> Result<Tensor> {
        self.0
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
            .insert(name.to_owned(), shape.dims().to_vec());
        Tensor::zeros((), dtype, on)?.broadcast_as(shape)
    }

    fn get_unchecked(&self, name: &str, _: DType, _: &Device) -> Result<Tensor> {
        candle_core::bail!("the shape of `{name}` must be given")
    }

    fn contains_tensor(&self, _: &str) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        AttentionOdeConfig, CnodeConfig, LstmConfig, MlpConfig, MlpOdeConfig, RelaxationOdeConfig,
        architectures::bounds::{MOST_LAYERS, MOST_WIDTH},
        parameters::Parameters,
    };

    fn kinds(size: usize, hidden: Vec<usize>) -> [ModelConfig; 6] {
        [
            ModelConfig::AttentionOde(AttentionOdeConfig {
                embedding: size,
                latent: size,
                heads: 1,
                hidden: hidden.clone(),
                ..AttentionOdeConfig::default()
            }),
            ModelConfig::MlpOde(MlpOdeConfig {
                latent: size,
                latent_hidden: vec![size],
                hidden: hidden.clone(),
                ..MlpOdeConfig::default()
            }),
            ModelConfig::RelaxationOde(RelaxationOdeConfig {
                hidden: hidden.clone(),
                ..RelaxationOdeConfig::default()
            }),
            ModelConfig::Cnode(CnodeConfig {
                hidden_state: size,
                hidden: hidden.clone(),
                ..CnodeConfig::default()
            }),
            ModelConfig::Lstm(LstmConfig {
                hidden: hidden.clone(),
                ..LstmConfig::default()
            }),
            ModelConfig::Mlp(MlpConfig {
                hidden,
                ..MlpConfig::default()
            }),
        ]
    }

    #[test]
    fn shapes_are_those_of_the_drawn_weights() {
        for config in kinds(6, vec![5, 4]) {
            let (_, drawn) =
                Parameters::draw(0, |vb| Network::new(&config, 9, 3, vb)).expect("drawn");
            let drawn: Shapes = drawn
                .iter()
                .map(|(name, var)| (name.to_owned(), var.dims().to_vec()))
                .collect();
            assert_eq!(shapes(&config, 9, 3).expect("listed"), drawn);
        }
    }

    #[test]
    fn sizes_out_of_bounds_are_refused_without_memory_for_them() {
        let most = usize::MAX;
        for config in kinds(6, vec![most])
            .into_iter()
            .chain(kinds(6, vec![1; MOST_LAYERS + 1]))
            .chain(kinds(6, vec![MOST_WIDTH; 3]))
        {
            let message = shapes(&config, 9, 3).expect_err("refused").to_string();
            assert!(message.contains("at most"), "{message}");
        }
        for size in [MOST_WIDTH + 1, 1 << 62, most] {
            let [attention, mlp, _, cnode, ..] = kinds(size, vec![4]);
            for config in [attention, mlp, cnode] {
                let message = shapes(&config, 9, 3).expect_err("refused").to_string();
                assert!(message.contains(&size.to_string()), "{message}");
            }
        }
        let config = RelaxationOdeConfig::default;
        let remembers = RelaxationOdeConfig {
            memory: most,
            ..config()
        };
        let long = RelaxationOdeConfig {
            window: most,
            ..config()
        };
        for (config, said) in [
            (remembers, "memory is 18446744073709551615"),
            (long, "window is 18446744073709551615 samples"),
        ] {
            let checked = ModelConfig::RelaxationOde(config).check();
            let message = checked.expect_err("refused").to_string();
            assert!(message.contains(said), "{message}");
        }
    }
}
