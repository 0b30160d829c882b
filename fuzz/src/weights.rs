//! `weights.safetensors` of a checkpoint whose card is sound. The first byte says whose card.

use hydro_model::{checkpoint::Checkpoint, document::hexadecimal};
use sha2::{Digest as _, Sha256};

use super::{card, folder, refused};

/// A sound checkpoint.
pub(super) struct Part {
    card: &'static str,
    pub(super) weights: &'static [u8],
}

impl Part {
    /// SHA-256 of the weights, hexadecimal.
    pub(super) fn digest(&self) -> String {
        hexadecimal(&Sha256::digest(self.weights))
    }
}

macro_rules! part {
    ($name:literal) => {
        Part {
            card: include_str!(concat!("../parts/", $name, "/card.json")),
            weights: include_bytes!(concat!("../parts/", $name, "/weights.safetensors")),
        }
    };
}

/// A checkpoint of every kind of model.
pub(super) const PARTS: [Part; 6] = [
    part!("attention-ode"),
    part!("cnode"),
    part!("lstm"),
    part!("mlp"),
    part!("mlp-ode"),
    part!("relaxation-ode"),
];

/// Reads weights beside a card that names their digest.
pub fn read(bytes: &[u8]) -> bool {
    let Some((first, weights)) = bytes.split_first() else {
        return false;
    };
    let part = &PARTS[usize::from(*first) % PARTS.len()];
    let digest = hexadecimal(&Sha256::digest(weights));
    let card = part.card.replace(&part.digest(), &digest);
    folder::put("weights/card.json", card.as_bytes());
    folder::put("weights/weights.safetensors", weights);
    match Checkpoint::load(&folder::path().join("weights")) {
        Ok(checkpoint) => card::step(&checkpoint),
        Err(error) => refused(&error),
    }
}
